"""The content summary of a ModAR bundle, written from formats/bundle.md alone (for read_bundle.py)."""
import json
import struct

from bundle_bytes import NONE, TABLES, Fault, need

NO_ATTRIBUTE = [0, 0, 0, 0, 0]


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
        if not name.startswith("reserved") and (name != "copies" or row[name] > 0):
            yield name, attributes(row) if name == "attributes" else row[name], code


def section_lines(bundle):
    for section in bundle.sections:
        if section["type"] != 4:
            yield [("section", section["type"], "I"), ("owner", section["owner"], "I"),
                   ("variant", section["variant"], "I"), ("bytes", section["size"], "Q"),
                   ("xxh64", f"{section['hash']:016x}", "s")]


def lines_of(bundle):
    yield [("summary", 1, "I"), ("minor", bundle.header["minor"], "H")]
    for kind, (table, record) in TABLES.items():
        if kind in (*range(21, 26), 67, 71, 72):  # clips and proxies: their sections' lines alone
            continue
        for index, row in enumerate(bundle.tables[table]):
            yield list(record_pairs(table, record, index, row))
    yield from section_lines(bundle)


def check_summary(bundle):
    text = bundle.payload.get((4, NONE, 0))
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
    need(count == len(told), "STATEMENT_DIFFERS", count, "lines after the last")
