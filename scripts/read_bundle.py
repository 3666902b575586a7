#!/usr/bin/env python3
"""Reads and checks a ModAR bundle, written from formats/bundle.md alone: a second opinion on ours.

Usage: read_bundle.py FILE... [--json] [--full] [--scenes]
  --json  print what was decoded of one file; --full adds every position, normal, uv, colour, index
  --scenes  print a line for each file: a digest of the scene that was decoded, or why there is none
Exit: 0 good, 1 usage, 2 a file cannot be read, 3 a bundle is invalid or unsupported.
"""
import json
import math
import struct
import sys

from bundle_statement import check_statement
from bundle_bytes import (ATTRIBUTE, COMPONENTS, FEATURES, KEYPOINT, NO_OFFSET, NONE, Bundle, Fault,
                          digest, need)

SEMANTICS = {1: "positions", 2: "normals", 3: "uvs", 4: "colours", 5: "normals"}
WIDTHS = {1: (3, 4), 2: (3,), 3: (2,), 4: (4,), 5: (2,)}
OF_ORB = ("max_features", "scale_factor", "level_count", "edge_threshold", "first_level", "wta_k", "harris",
          "patch_size", "fast_threshold")
OF_BRISK = ("agast_threshold", "octaves", "pattern_scale")
LENGTH_STEP = {1: 0.02, 2: 2e-3, 4: 1e-4}  # by bytes of a component


def follow(rows, first, count, size, rule):
    """Ranges follow each other and cover the table."""
    end = 0
    for row in rows:
        need(row[first] == end and end + row[count] <= size, rule, row["at"], first)
        end += row[count]
    need(end == size, rule, 0, f"{size - end} records without an owner")


def flags_known(bundle, row, known):
    need(not bundle.strict or row["flags"] & ~known == 0, "BUNDLE_RESERVED", row["at"], "flags")


def at_least(row, low, *names):
    for name in names:
        values = row[name] if isinstance(row[name], list) else [row[name]]
        need(all(value >= low for value in values), "BUNDLE_NUMBER", row["at"], name)


def check_layout(bundle, row):
    count, raw = row["attribute_count"], bytes(row["attributes"])
    need(0 < row["stride"] <= 252 and row["stride"] % 4 == 0 and 1 <= count <= 8, "BUNDLE_LAYOUT",
         row["at"])
    need(not bundle.strict or not any(raw[count * 8:]), "BUNDLE_RESERVED", row["at"])
    row["attributes"], used, seen = [], set(), []
    for i in range(count):
        part = ATTRIBUTE.decode(raw, i * 8)
        bundle.clean({**part, "at": row["at"] + 8 + i * 8})
        semantic, kind, normalised = part["semantic"], part["type"], part["normalised"]
        need(semantic in SEMANTICS and kind in COMPONENTS and normalised < 2, "BUNDLE_ENUM",
             row["at"], str(part))
        size = struct.calcsize(COMPONENTS[kind])
        touched = set(range(part["offset"], part["offset"] + size * part["components"]))
        need(part["components"] in WIDTHS[semantic] and part["offset"] % max(2, size) == 0 and
             max(touched) < row["stride"] and not touched & used and
             SEMANTICS[semantic] not in seen and not (normalised and kind in (1, 6)),
             "BUNDLE_LAYOUT", row["at"], str(part))
        used |= touched
        seen.append(SEMANTICS[semantic])
        del part["at"], part["dirty"]
        row["attributes"].append(part)
    need("positions" in seen, "BUNDLE_LAYOUT", row["at"], "no position")


def check_models(bundle):
    tables = bundle.tables
    for row in tables["layouts"]:
        check_layout(bundle, row)
    for row in tables["materials"]:
        flags_known(bundle, row, 1)
        need(row["texture"] == NONE or row["texture"] < len(tables["textures"]),
             "BUNDLE_MATERIAL_RANGE", row["at"], "texture")
        values = [row["shininess"], row["opacity"]]
        for name in ("ambient", "diffuse", "specular", "emission"):
            values += row[name]
        need(min(values) >= 0 and row["opacity"] <= 1, "MATERIAL_VALUES", row["at"])
    follow(tables["models"], "first_chunk", "chunk_count", len(tables["chunks"]),
           "BUNDLE_MODEL_RANGE")
    follow(tables["chunks"], "first_level", "level_count", len(tables["levels"]),
           "BUNDLE_CHUNK_RANGE")
    for row in tables["models"]:
        check_model(bundle, row)
    used = sum(2 * level["index_count"] for level in tables["levels"])
    need(used <= len(bundle.indices), "BUNDLE_LEVEL_RANGE", 0, "indices are shared")


def check_model(bundle, model):
    tables, at = bundle.tables, model["at"]
    errors = [name for name in model if "_error_" in name]
    at_least(model, 0, "diagonal", "unit_metres", *errors)
    need(model["scale"] > 0, "BUNDLE_NUMBER", at, "scale")
    need(max(model[name] for name in errors if name.endswith("_deg")) <= 180, "BUNDLE_NUMBER", at)
    for name in errors:
        if "_rms" in name:
            need(model[name] <= model[name.replace("_rms", "_max")] * (1 + 1e-6), "MODEL_ERRORS", at)
    need(model["layout"] < len(tables["layouts"]), "BUNDLE_MODEL_RANGE", at, "layout")
    materials = range(model["first_material"], model["first_material"] + model["material_count"])
    need(materials.stop <= len(tables["materials"]), "BUNDLE_MODEL_RANGE", at, "materials")
    first = model["first_chunk"]
    chunks = tables["chunks"][first:first + model["chunk_count"]]
    for chunk in chunks:
        check_chunk(chunk, materials)
        levels = tables["levels"][chunk["first_level"]:][:chunk["level_count"]]
        for level in levels:
            check_level(bundle, model, level)
        need(levels[0]["error"] == 0, "LEVEL_ORDER", levels[0]["at"])
        for fine, coarse in zip(levels, levels[1:]):
            need(fine["error"] <= coarse["error"] and fine["index_count"] >= coarse["index_count"],
                 "LEVEL_ORDER", coarse["at"])
    finest = [tables["levels"][chunk["first_level"]] for chunk in chunks]
    need(model["triangle_count"] == sum(level["index_count"] // 3 for level in finest) and
         model["vertex_count"] <= sum(level["vertex_count"] for level in finest) and
         model["level_count"] == max((chunk["level_count"] for chunk in chunks), default=0),
         "MODEL_COUNTS", at)
    check_placement(model, chunks, tables["levels"])


def check_placement(model, chunks, levels):
    side, diagonal, at = 2 * model["scale"], model["diagonal"], model["at"]
    point = diagonal == 0 and model["scale"] == 1
    need(point or side * (1 - 1e-6) <= diagonal <= side * math.sqrt(3) * (1 + 1e-6), "MODEL_PLACEMENT", at)
    if not chunks:
        return
    sides = [max(chunk["bounds_max"][axis] for chunk in chunks) - min(chunk["bounds_min"][axis] for chunk in chunks)
             for axis in range(3)]
    coarsest = max(levels[chunk["first_level"] + chunk["level_count"] - 1]["error"] for chunk in chunks)
    slack = 2 * math.sqrt(3) * (model["position_error_max"] + model["scale"] * coarsest)
    need(model["scale"] * math.hypot(*sides) <= diagonal * (1 + 1e-6) + slack, "MODEL_PLACEMENT", at)


def check_tight(chunk, levels):
    """Box and cone are those of the decoded triangles."""
    at, places = chunk["at"], [place for level in levels for place in level.pop("used")]
    triangles = [triangle for level in levels for triangle in level.pop("triangles")]
    for axis, (low, high) in enumerate(zip(chunk["bounds_min"], chunk["bounds_max"])):
        if places:
            need(low >= min(p[axis] for p in places) - 1e-6 and high <= max(p[axis] for p in places) + 1e-6,
                 "CHUNK_LOOSE", at)
    if chunk["cone_cutoff"] > 1:
        return
    cone, sine = chunk["cone_axis"], chunk["cone_cutoff"] + 1e-3
    least = max(0.0, 1 - sine * sine) * sum(c * c for c in cone)
    for a, b, c in triangles:
        a, b, c = ([struct.unpack("<f", struct.pack("<f", v))[0] for v in p] for p in (a, b, c))
        u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
        n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        along = sum(p * q for p, q in zip(n, cone))
        need(along >= 0 and along * along >= least * sum(p * p for p in n), "CHUNK_CONE", at)


def check_chunk(chunk, materials):
    at = chunk["at"]
    pairs = list(zip(chunk["bounds_min"], chunk["bounds_max"]))
    need(all(low <= high for low, high in pairs), "BUNDLE_CHUNK_RANGE", at, "box")
    need(all(abs(side) <= 1 + 2**-10 for pair in pairs for side in pair), "CHUNK_OUTSIDE", at)
    need(chunk["position_step"] > 0, "BUNDLE_NUMBER", at, "position_step")
    length = math.sqrt(sum(side * side for side in chunk["cone_axis"]))
    need(chunk["cone_cutoff"] >= 0 and (abs(length - 1) <= 1e-3 or
                                        (length == 0 and chunk["cone_cutoff"] > 1)),
         "CHUNK_CONE", at)
    need(chunk["level_count"] >= 1, "BUNDLE_CHUNK_RANGE", at, "no level")
    need(chunk["material"] in materials, "BUNDLE_MATERIAL_RANGE", at)


def check_level(bundle, model, level):
    stride = bundle.tables["layouts"][model["layout"]]["stride"]
    end = level["vertex_offset"] + level["vertex_count"] * stride
    need(level["vertex_count"] <= 65535 and level["vertex_offset"] % 4 == 0 and
         end <= len(bundle.vertices), "BUNDLE_LEVEL_RANGE", level["at"], "vertices")
    end = level["index_offset"] + level["index_count"] * 2
    need(level["index_count"] % 3 == 0 and level["index_offset"] % 2 == 0 and
         end <= len(bundle.indices), "BUNDLE_LEVEL_RANGE", level["at"], "indices")
    at_least(level, 0, "error")


def decode_attribute(part, raw, chunk):
    """A list of tuples, one a vertex; `raw` has the values as they are stored."""
    if part["normalised"]:
        bits = 8 * struct.calcsize(COMPONENTS[part["type"]])
        signed = COMPONENTS[part["type"]] in "bh"
        raw = [[((2 * c + 1) if signed else c) / (2**bits - 1) for c in row] for row in raw]
    if part["semantic"] == 1:
        zero, step = chunk["position_offset"], chunk["position_step"]
        return [tuple(o + step * a for o, a in zip(zero, row)) for row in raw]
    if part["semantic"] == 3:
        zero, scale = chunk["uv_offset"], chunk["uv_scale"]
        return [tuple(o + s * a for o, s, a in zip(zero, scale, row)) for row in raw]
    if part["semantic"] == 5:
        return [octahedral(x, y) for x, y in raw]
    return [tuple(float(value) for value in row) for row in raw]


def octahedral(x, y):
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = (1 - abs(y)) * (1 if x >= 0 else -1), (1 - abs(x)) * (1 if y >= 0 else -1)
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


def decode_level(bundle, layout, chunk, level, full):
    at, out = level["at"], {}
    indices = struct.unpack_from(f"<{level['index_count']}H", bundle.indices, level["index_offset"])
    need(max(indices, default=-1) < level["vertex_count"], "LEVEL_INDEX", at)
    used = sorted(set(indices))
    for part in layout["attributes"]:
        code = struct.Struct(f"<{part['components']}{COMPONENTS[part['type']]}")
        first = level["vertex_offset"] + part["offset"]
        raw = [code.unpack_from(bundle.vertices, first + i * layout["stride"])
               for i in range(level["vertex_count"])]
        need(all(map(math.isfinite, (v for i in used for v in raw[i]))), "VERTEX_NOT_FINITE", at)
        values = decode_attribute(part, raw, chunk)
        if part["semantic"] == 1:
            box = list(zip(chunk["bounds_min"], chunk["bounds_max"]))
            need(all(low - 1e-6 <= v <= high + 1e-6 for i in used
                     for v, (low, high) in zip(values[i], box)), "CHUNK_BOUNDS", at)
            out["used"] = [values[i] for i in used]
            out["triangles"] = [tuple(values[i] for i in indices[t:t + 3]) for t in range(0, len(indices), 3)]
        if part["semantic"] == 2:
            step = LENGTH_STEP[struct.calcsize(COMPONENTS[part["type"]])]
            need(all(abs(math.sqrt(sum(v * v for v in values[i])) - 1) <= step for i in used),
                 "VERTEX_NORMAL", at)
        flat = [value for row in values for value in row]
        out[SEMANTICS[part["semantic"]]] = digest(struct.pack(f"<{len(flat)}d", *flat))
        if full:
            out[SEMANTICS[part["semantic"]] + "_values"] = values
    owned = {part["offset"] + byte for part in layout["attributes"]
             for byte in range(struct.calcsize(f"{part['components']}{COMPONENTS[part['type']]}"))}
    stride, first = layout["stride"], level["vertex_offset"]
    for byte in set(range(stride)) - owned:
        column = bundle.vertices[first + byte:first + level["vertex_count"] * stride:stride]
        need(not any(column[i] for i in used), "VERTEX_PADDING", at)
    out["indices"] = digest(struct.pack(f"<{len(indices)}H", *indices))
    return {**out, "indices_values": indices} if full else out


def check_textures(bundle):
    tables = bundle.tables
    follow(tables["textures"], "first_level", "level_count", len(tables["texture_levels"]),
           "BUNDLE_TEXTURE_RANGE")
    for number, row in enumerate(tables["textures"]):
        width, height, at = row["width"], row["height"], row["at"]
        flags_known(bundle, row, 3)
        need(row["format"] == 1, "BUNDLE_ENUM", at, "format")
        need(-1 <= row["ssim"] <= 1 and 0 <= row["psnr_db"] <= 140, "BUNDLE_NUMBER", at, "quality")
        need(1 <= min(width, height) and max(width, height) <= 8192 and
             row["level_count"] in (1, max(width, height).bit_length()) and
             min(row["source_width"], row["source_height"]) >= 1, "BUNDLE_TEXTURE_RANGE", at)
        pot = width & (width - 1) == 0 and height & (height - 1) == 0
        need(pot or (row["level_count"] == 1 and not row["flags"] & 2), "TEXTURE_SIDES", at)
        data = bundle.payload.get((514, number, 0), b"")
        first, ranges = row["first_level"], []
        for i, level in enumerate(tables["texture_levels"][first:first + row["level_count"]]):
            w, h = max(1, width >> i), max(1, height >> i)
            places = [level["offset"]] + [level["alpha_offset"]] * (row["flags"] & 1)
            need(level["width"] == w and level["height"] == h and
                 level["size"] == 8 * ((w + 3) // 4) * ((h + 3) // 4) and
                 (row["flags"] & 1 or level["alpha_offset"] == NO_OFFSET) and
                 all(p % 8 == 0 and p + level["size"] <= len(data) for p in places),
                 "BUNDLE_TEXTURE_LEVEL", level["at"])
            need(-1 <= level["ssim"] <= 1 and 0 <= level["psnr_db"] <= 140, "BUNDLE_NUMBER", level["at"], "quality")
            ranges += [(place, place + level["size"]) for place in places]
            blocks = [digest(data[place:place + level["size"]]) for place in places]
            level["blocks"], level["alpha_blocks"] = (blocks + [None])[:2]
        ranges.sort()
        need(all(a[1] <= b[0] for a, b in zip(ranges, ranges[1:])), "TEXTURE_OVERLAP", at)


def check_parameter_set(row):
    orb, at = row["detector"] == 1, row["at"]
    need(row["detector"] in (1, 2) and row["harris"] < 2, "BUNDLE_ENUM", at)
    at_least(row, 0, "scale_factor", "pattern_scale", "ransac_threshold")
    bits = row["descriptor_bits"]
    need(0 < bits <= 4096 and bits % 8 == 0, "BUNDLE_PARAMETER_SET", at)
    need(bits == (256 if orb else 512), "DESCRIPTOR_LENGTH", at)
    good = row["min_matches"] >= 4 and row["min_inliers"] >= 4 and row["ransac_threshold"] > 0
    good = good and 0 < row["max_distance"] <= bits
    if orb:
        good = (good and 1 <= row["max_features"] <= 100000 and 1 < row["scale_factor"] <= 4 and
                1 <= row["level_count"] <= 16 and row["first_level"] < row["level_count"] and
                2 <= row["wta_k"] <= 4 and 2 <= row["patch_size"] <= 255 and
                1 <= row["fast_threshold"] <= 255 and row["edge_threshold"] <= 1024)
    else:
        good = (good and 1 <= row["agast_threshold"] <= 255 and row["octaves"] <= 8 and
                0.1 <= struct.unpack("<f", struct.pack("<f", row["pattern_scale"]))[0] + 1e-8 and
                row["pattern_scale"] <= 10)
    others = OF_BRISK if orb else OF_ORB
    good = good and not any(row[name] for name in others)
    need(good, "PARAMETER_VALUES", at)


def check_patterns(bundle):
    tables = bundle.tables
    for row in tables["patterns"]:
        side = max(row["width"], row["height"])
        need(min(row["width"], row["height"]) >= 1 and side <= 65535 and
             abs(row["half_width"] - row["width"] / side) <= 1e-6 and
             abs(row["half_height"] - row["height"] / side) <= 1e-6, "BUNDLE_PATTERN", row["at"])
        at_least(row, 0, "width_mm")
        need(-1 <= row["score"] <= 100, "BUNDLE_NUMBER", row["at"], "score")
    ids = [row["id"] for row in tables["parameter_sets"]]
    need(all(a < b for a, b in zip(ids, ids[1:])), "BUNDLE_PARAMETER_SET", 0, "ids do not rise")
    for row in tables["parameter_sets"]:
        check_parameter_set(row)
    for row in tables["scenes"]:
        need(row["pattern"] < len(tables["patterns"]) and row["model"] < len(tables["models"]) and
             abs(sum(part * part for part in row["rotation"]) - 1) <= 1e-4, "BUNDLE_SCENE",
             row["at"])
        need(row["scale"] > 0, "BUNDLE_NUMBER", row["at"], "scale")


def read_features(bundle):
    tables, out = bundle.tables, []
    sets = {row["id"]: row for row in tables["parameter_sets"]}
    for (kind, owner, variant), data in bundle.payload.items():
        if kind == 514:
            need(owner < len(tables["textures"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
        if kind in (256, 257):
            need(owner < len(tables["patterns"]) and variant in sets, "BUNDLE_SECTION_OWNER", 0)
        if kind == 258:
            need(owner < len(tables["patterns"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
            read_loop_record(data)
        if kind == 257:
            need((256, owner, variant) in bundle.payload and data.startswith(b"%YAML:1.0"),
                 "FEATURE_TEXT", 0)
        if kind == 256:
            text = bundle.payload.get((257, owner, variant))
            out.append(read_twin(bundle, tables["patterns"][owner], sets[variant], data))
            out[-1].update(pattern=owner, set_id=variant, yml=digest(text) if text else None)
    return out


def read_loop_record(data):
    """The record of the pose loop: counts, offsets, places inside of the image."""
    need(len(data) >= 128, "LOOP_RECORD", 0, "too small")
    (version, count, bright, patch_count, width, height, levels, zero, features, codes, patches,
     pixels) = struct.unpack_from("<8I4Q", data)
    need(version == 1 and zero == 0 and not any(data[64:128]) and count % 32 == bright % 32 == 0 and
         bright <= count <= 65536 and patch_count <= 4096 and 1 <= levels <= 8 and
         max(width, height) <= 1023 and min(width, height) >> (levels - 1) >= 1 and
         codes % 64 == features % 2 == patches % 2 == 0, "LOOP_RECORD", 0, "header")
    image = sum((width >> level) * (height >> level) for level in range(levels))
    for at, size in ((features, 12 * count), (codes, 32 * count), (patches, 8 * patch_count), (pixels, image)):
        need(128 <= at and at + size <= len(data), "LOOP_RECORD", 0, "an array leaves the section")
    places = [*struct.iter_unpack("<2H8x", data[features:features + 12 * count]),
              *struct.iter_unpack("<2H4x", data[patches:patches + 8 * patch_count])]
    need(all(x <= 64 * width and y <= 64 * height for x, y in places), "LOOP_RECORD", 0, "a place")
    of = [level for level, in struct.iter_unpack("<4xH2x", data[patches:patches + 8 * patch_count])]
    need(of == sorted(of) and all(level < levels for level in of), "LOOP_RECORD", 0, "levels")


def read_twin(bundle, pattern, chosen, data):
    need(len(data) >= 32, "BUNDLE_FEATURES", 0, "too small")
    head = FEATURES.decode(data, 0)
    bundle.clean(head)
    count, end = head["count"], 32 + 28 * head["count"]
    first = (end + 15) // 16 * 16
    need(head["keypoints_offset"] == 32 and head["descriptors_offset"] == first and
         head["descriptor_bytes"] * 8 == chosen["descriptor_bits"] and
         len(data) == first + count * head["descriptor_bytes"], "BUNDLE_FEATURES", 0)
    need(not any(data[end:first]), "SECTION_PADDING", 0, "before descriptors")
    octaves = chosen["level_count"] if chosen["detector"] == 1 else 2**31
    for x, y, size, angle, response, octave, _ in KEYPOINT.iter_unpack(data[32:end]):
        need(all(map(math.isfinite, (x, y, size, angle, response))) and size > 0 and
             -360 <= angle <= 360 and 0 <= octave < octaves, "KEYPOINT_VALUES", 0)
        need(0 <= x <= pattern["width"] and 0 <= y <= pattern["height"], "KEYPOINT_OUTSIDE", 0)
    return {"count": count, "descriptor_bytes": head["descriptor_bytes"],
            "keypoints": digest(data[32:end]), "descriptors": digest(data[first:])}


def check(bundle, full):
    """Every rule of the specification; answers the decoded content."""
    tables = bundle.tables
    check_models(bundle)
    check_textures(bundle)
    check_patterns(bundle)
    features = read_features(bundle)
    check_statement(bundle)
    for model in tables["models"]:
        layout = tables["layouts"][model["layout"]]
        for chunk in tables["chunks"][model["first_chunk"]:][:model["chunk_count"]]:
            for level in tables["levels"][chunk["first_level"]:][:chunk["level_count"]]:
                level.update(decode_level(bundle, layout, chunk, level, full))
            check_tight(chunk, tables["levels"][chunk["first_level"]:][:chunk["level_count"]])
    for row in (row for rows in [bundle.sections, *tables.values()] for row in rows):
        del row["at"], row["dirty"]
    for section in bundle.sections:
        section["hash"] = f"{section['hash']:016x}"
    meta = bundle.payload.get((2, NONE, 0), b"").decode("utf-8", "replace")
    return {"format": {"major": 1, "minor": bundle.header["minor"]}, "bytes": len(bundle.data),
            "meta": meta, "sections": bundle.sections, **tables, "features": features}


def scene_digest(decoded):
    """Of everything that is drawn or recognised: not of where it lies in the file or how it was made."""
    scene = {key: value for key, value in decoded.items() if key not in ("bytes", "meta", "sections")}
    return digest(json.dumps(scene, sort_keys=True).encode())


def read(path, full):
    """The bundle, what was decoded of it, and an exit code with words where that fails."""
    try:
        with open(path, "rb") as file:
            bundle = Bundle(file.read())
        return bundle, check(bundle, full), 0, ""
    except OSError as error:
        return None, None, 2, f"error: {error}"
    except Fault as fault:
        return None, None, 3, str(fault)


def main(arguments):
    files = [a for a in arguments if not a.startswith("-")]
    options = set(arguments) - set(files)
    if options & {"--help", "-h"}:
        print(__doc__)
        return 0
    if not files or options - {"--json", "--full", "--scenes"} or ("--json" in options and len(files) > 1):
        print(__doc__, file=sys.stderr)
        return 1
    worst = 0
    for path in files:
        prefix = f"{path}: " if len(files) > 1 else ""
        bundle, decoded, code, words = read(path, "--full" in options)
        worst = max(worst, code)
        if "--scenes" in options:
            print(scene_digest(decoded) if code == 0 else words.replace("\n", " "))
        elif code != 0:
            print(prefix + words, file=sys.stderr)
        elif "--json" in options:
            print(json.dumps(decoded, indent=1, ensure_ascii=False, allow_nan=False))
        else:
            counts = [f"{len(rows)} {name}" for name, rows in bundle.tables.items() if rows]
            print(f"{prefix}good: {len(bundle.data)} bytes, " +
                  ", ".join([f"{len(bundle.sections)} sections"] + counts))
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
