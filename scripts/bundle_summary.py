"""The content summary of a ModAR bundle, written from formats/bundle.md alone (for read_bundle.py)."""
import json
import struct

from bundle_bytes import NONE, TABLES, Fault, need

NO_ATTRIBUTE = [0, 0, 0, 0, 0]


def word_sums(data, stride):
    """Sums of 16-bit words by their place in rows of `stride` bytes."""
    words = struct.unpack(f"<{len(data) // 2}H", data)
    return [sum(words[i::stride // 2]) for i in range(stride // 2)]


def same(told, value, code):
    """A number of the text against a decoded one, in the precision of its field."""
    if isinstance(value, list):
        return (isinstance(told, list) and len(told) == len(value) and
                all(same(a, b, code) for a, b in zip(told, value)))
    if isinstance(told, bool) or not isinstance(told, (int, float)):
        return told == value and isinstance(told, str) == isinstance(value, str)
    if code[-1] in "fd":
        try:
            return struct.pack("<" + code[-1], told) == struct.pack("<" + code[-1], value)
        except OverflowError:
            return False
    return isinstance(told, int) and told == value


def attributes(row):
    parts = [[part[key] for key in ("semantic", "type", "components", "normalised", "offset")]
             for part in row["attributes"]]
    return parts + [NO_ATTRIBUTE] * (8 - len(parts))


def record_pairs(table, record, index, row):
    """(key, value, struct code) of a record's line."""
    yield table, index, "I"
    for name, code in record.fields:
        if not name.startswith("reserved"):
            yield name, attributes(row) if name == "attributes" else row[name], code


def feature_lines(bundle):
    for (kind, owner, variant), data in bundle.payload.items():
        if kind == 256:
            text = bundle.payload.get((257, owner, variant), b"")
            yield [("features", owner, "I"), ("set", variant, "I"),
                   ("count", struct.unpack_from("<I", data)[0], "I"), ("text_bytes", len(text), "Q")]


def tracker_lines(bundle):
    for (kind, owner, _), data in bundle.payload.items():
        if kind == 258:
            words = struct.unpack(f"<{len(data) // 2}H", data[:len(data) // 2 * 2])
            yield [("loop_record", owner, "I"), ("bytes", len(data), "Q"),
                   ("sums", [sum(words[i::4]) for i in range(4)], "Q"), ("last", data[-1], "B")]


def level_lines(bundle):
    tables = bundle.tables
    for model in tables["models"]:
        stride = tables["layouts"][model["layout"]]["stride"]
        for chunk in tables["chunks"][model["first_chunk"]:][:model["chunk_count"]]:
            first = chunk["first_level"]
            for index in range(first, first + chunk["level_count"]):
                level = tables["levels"][index]
                line = [("level_sums", index, "I")]
                if level["vertex_count"] <= level["index_count"]:
                    vertices = bundle.vertices[level["vertex_offset"]:]
                    line.append(("vertices", word_sums(vertices[:level["vertex_count"] * stride],
                                                       stride), "Q"))
                indices = bundle.indices[level["index_offset"]:][:2 * level["index_count"]]
                yield line + [("indices", word_sums(indices, 2)[0], "Q")]


def texture_lines(bundle):
    tables = bundle.tables
    for number, texture in enumerate(tables["textures"]):
        data, first = bundle.payload.get((514, number, 0), b""), texture["first_level"]
        for index in range(first, first + texture["level_count"]):
            level = tables["texture_levels"][index]
            line = [("texture_level_sums", index, "I")]
            for key, at in [("blocks", "offset"), ("alpha_blocks", "alpha_offset")]:
                if at == "offset" or texture["flags"] & 1:
                    line.append((key, word_sums(data[level[at]:][:level["size"]], 8), "Q"))
            yield line


def lines_of(bundle):
    yield [("statement", 1, "I"), ("minor", bundle.header["minor"], "H")]
    for table, record in TABLES.values():
        for index, row in enumerate(bundle.tables[table]):
            yield list(record_pairs(table, record, index, row))
    yield from feature_lines(bundle)
    yield from tracker_lines(bundle)
    yield from level_lines(bundle)
    yield from texture_lines(bundle)


def check_summary(bundle):
    text = bundle.payload.get((3, NONE, 0))
    if text is None:
        return
    *told, rest = text.split(b"\n")
    need(rest == b"", "STATEMENT_DIFFERS", 0, "the last line has no end")
    count = 0
    for number, line in enumerate(lines_of(bundle)):
        need(number < len(told), "STATEMENT_DIFFERS", number, "a line is missing")
        try:
            pairs = json.loads(told[number].decode("utf-8"), object_pairs_hook=list)
        except (UnicodeDecodeError, ValueError):
            raise Fault("STATEMENT_DIFFERS", number, "no JSON") from None
        need(isinstance(pairs, list) and [p[0] for p in pairs] == [k for k, _, _ in line] and
             all(same(p[1], value, code) for p, (_, value, code) in zip(pairs, line)),
             "STATEMENT_DIFFERS", number, f"line {number + 1}, {line[0]}")
        count += 1
    need(count == len(told), "STATEMENT_DIFFERS", count, "lines that tell of nothing")
