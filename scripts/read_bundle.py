#!/usr/bin/env python3
"""Reads and checks a ModAR bundle, written from formats/bundle.md alone: a second opinion on ours.

Usage: read_bundle.py FILE... [--json] [--full] [--scenes]
  --json  print the decoded content of one file; --full adds every position, normal, uv, colour, index
  --scenes  print a line for each file: a digest of the decoded scene, or the reason of its absence
Exit: 0 good, 1 usage, 2 a file cannot be read, 3 a bundle is invalid or unsupported.
"""
import base64
import json
import math
import re
import struct
import sys

from bundle_bytes import (COLOURS, DRAW_ORDER, FACE, FEATURES, KEYPOINT, NO_OFFSET, NONE, SHADOW, SHAPE, Bundle, Fault, at_least,
                          digest, flags_known, follow, need)
from bundle_clips import check_clips
from bundle_models import check_models, check_tight, decode_level, proxy_chunks
from bundle_nodes import check_nodes
from bundle_summary import check_summary

OF_ORB = ("max_features", "scale_factor", "level_count", "edge_threshold", "first_level", "wta_k", "harris",
          "patch_size", "fast_threshold")
OF_BRISK = ("agast_threshold", "octaves", "pattern_scale")


def check_textures(bundle):
    tables = bundle.tables
    follow(tables["textures"], "first_level", "level_count", len(tables["texture_levels"]),
           "BUNDLE_TEXTURE_RANGE")
    for number, row in enumerate(tables["textures"]):
        width, height, at = row["width"], row["height"], row["at"]
        flags_known(bundle, row, 127)
        need(row["flags"] & 5 != 4, "BUNDLE_TEXTURE_RANGE", at, "cut out without alpha")
        ways = row["flags"] >> 3 & 15
        need(not ways & ways >> 2 and (not ways or row["flags"] & 2), "BUNDLE_TEXTURE_RANGE", at, "beyond [0,1]")
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
             abs(row["half_height"] - row["height"] / side) <= 1e-6 and
             row["copies"] in (0, *range(2, 17)), "BUNDLE_PATTERN", row["at"])
        need(row["width_mm"] == 0 or 1e-3 <= row["width_mm"] <= 1e7, "BUNDLE_NUMBER", row["at"], "width_mm")
        need(-1 <= row["score"] <= 100, "BUNDLE_NUMBER", row["at"], "score")
    ids = [row["id"] for row in tables["parameter_sets"]]
    need(all(a < b for a, b in zip(ids, ids[1:])), "BUNDLE_PARAMETER_SET", 0, "ids do not rise")
    for row in tables["parameter_sets"]:
        check_parameter_set(row)
    for row in tables["scenes"]:
        need(row["pattern"] < len(tables["patterns"]) and row["model"] < len(tables["models"]) and
             abs(sum(part * part for part in row["rotation"]) - 1) <= 1e-4, "BUNDLE_SCENE",
             row["at"])
        need(1e-9 <= row["scale"] <= 1e9 and max(map(abs, row["offset"])) <= 1e9, "BUNDLE_NUMBER", row["at"], "scale")
    for row in tables["lights"]:
        sky, mean = row["sky"], row["sky"][:3]
        need(all(0 <= part <= 1e6 for part in [*mean, *row["key"]]) and
             all(abs(part) <= 2.002 * mean[i % 3] + 1e-3 for i, part in enumerate(sky) if i > 2),
             "LIGHT_VALUES", row["at"])
    lit = [row["scene"] for row in tables["lights"]]
    need(lit == sorted(set(lit)) and all(scene < len(tables["scenes"]) for scene in lit) and
         all(abs(sum(part * part for part in row["direction"]) - 1) <= 1e-4 for row in tables["lights"]),
         "BUNDLE_SCENE", 0, "lights")


def read_shadow(bundle, owner, variant, data):
    """The shadow of a scene: its rectangle, and as many bytes as it has texels."""
    need(owner < len(bundle.tables["scenes"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
    need(len(data) >= 32, "BUNDLE_SCENE", 0, "a shadow is too small")
    head = SHADOW.decode(data, 0)
    bundle.clean(head)
    sides = (head["width"], head["height"])
    need(1 <= min(sides) and max(sides) <= 256 and len(data) == 32 + sides[0] * sides[1] and
         all(low < high for low, high in zip(head["low"], head["high"])), "BUNDLE_SCENE", 0, "a shadow")
    need(max(map(abs, [*head["low"], *head["high"]])) <= 1e9, "BUNDLE_NUMBER", 0, "a shadow's place")


def read_draw_order(bundle, owner, variant, data):
    """The planes between a chunk's triangles: a tree in pre-order that holds each triangle once."""
    need(owner < len(bundle.tables["chunks"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
    need(len(data) % 24 == 0, "BUNDLE_CHUNK_RANGE", 0, "a draw order")
    nodes = list(DRAW_ORDER.iter_unpack(data))
    for node in nodes:
        need(all(map(math.isfinite, node[:4])), "BUNDLE_NUMBER", 0, "a plane")
    level = bundle.tables["chunks"][owner]["first_level"]
    levels = bundle.tables["levels"]
    triangles = levels[level]["index_count"] // 3 if level < len(levels) else 0
    waiting, at = [len(nodes)] if nodes else [], 0  # ends of subtrees
    while waiting:
        end = waiting.pop()
        behind = nodes[at][4]
        need(behind < end - at, "BUNDLE_CHUNK_RANGE", 0, "a draw order")
        waiting += [end] * (at + 1 + behind < end) + [at + 1 + behind] * (behind > 0)
        at += 1
    need(sorted(node[5] for node in nodes if node[5] != NONE) == list(range(triangles)), "BUNDLE_CHUNK_RANGE", 0,
         "a draw order")


def read_colours(bundle, owner, variant, data):
    """The colours of a pattern: three 16-bit numbers a cell."""
    need(owner < len(bundle.tables["patterns"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
    need(len(data) >= 16, "BUNDLE_PATTERN", 0, "colours are too few")
    head = COLOURS.decode(data, 0)
    bundle.clean(head)
    sides = (head["columns"], head["rows"])
    need(1 <= min(sides) and max(sides) <= 16 and len(data) == 16 + 6 * sides[0] * sides[1], "BUNDLE_PATTERN", 0,
         "colours")


def read_shape(bundle, owner, variant, data):
    """The shape of a pattern: an arc about an axis, or rectangles of the picture in space."""
    need(owner < len(bundle.tables["patterns"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
    pattern = bundle.tables["patterns"][owner]
    need(len(data) >= 32, "BUNDLE_PATTERN", 0, "a shape is too small")
    head = SHAPE.decode(data, 0)
    bundle.clean(head)
    need(len(data) == 32 + 48 * head["face_count"], "BUNDLE_PATTERN", 0, "faces of a shape")
    if head["kind"] == 1:
        arc, slope = head["half_arc"], head["slope"]
        need(head["face_count"] == 0 and 0 < arc <= math.pi and abs(slope) < 1 and
             abs(slope) * pattern["height"] < pattern["width"] / arc, "BUNDLE_PATTERN", 0, "a round shape")
        return
    need(head["kind"] == 2 and 1 <= head["face_count"] <= 16 and not head["half_arc"] and not head["slope"],
         "BUNDLE_PATTERN", 0, "a shape's kind")
    for i in range(head["face_count"]):
        face = FACE.decode(data, 32 + 48 * i)
        bundle.clean(face)
        left, top, width, height = face["place"]
        right, down = face["right"], face["down"]
        need(all(abs(part) <= 1000 for part in [*face["corner"], *right, *down]) and width and height and
             left + width <= pattern["width"] and top + height <= pattern["height"], "BUNDLE_PATTERN", 0, "a face")
        both = sum(a * b for a, b in zip(right, down))
        squares = sum(a * a for a in right) * sum(b * b for b in down)
        need(squares > 0 and both * both <= 1e-6 * squares, "BUNDLE_PATTERN", 0, "a face's edges")


def read_features(bundle):
    tables, out = bundle.tables, []
    sets = {row["id"]: row for row in tables["parameter_sets"]}
    for (kind, owner, variant), data in bundle.payload.items():
        if kind == 514:
            need(owner < len(tables["textures"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
        if kind == 259:
            read_colours(bundle, owner, variant, data)
        if kind == 260:
            read_shadow(bundle, owner, variant, data)
        if kind == 261:
            read_shape(bundle, owner, variant, data)
        if kind == 262:
            read_draw_order(bundle, owner, variant, data)
        if kind == 264:
            need(owner < len(tables["patterns"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
            need(data[:4] == b"RIFF" and data[8:12] == b"WEBP" and 12 < len(data) <= 32768 and
                 int.from_bytes(data[4:8], "little") == len(data) - 8, "BUNDLE_PATTERN", 0, "a picture")
        if kind in (256, 257):
            need(owner < len(tables["patterns"]) and variant in sets, "BUNDLE_SECTION_OWNER", 0)
        if kind == 258:
            need(owner < len(tables["patterns"]) and variant == 0, "BUNDLE_SECTION_OWNER", 0)
            read_loop_record(data, tables["patterns"][owner])
        if kind == 257:
            need((256, owner, variant) in bundle.payload and data.startswith(b"%YAML:1.0"),
                 "FEATURE_TEXT", 0)
            compare_text(data, bundle.payload[256, owner, variant])
        if kind == 256:
            text = bundle.payload.get((257, owner, variant))
            out.append(read_twin(bundle, tables["patterns"][owner], sets[variant], data))
            out[-1].update(pattern=owner, set_id=variant, yml=digest(text) if text else None)
    return out


def read_text(text):
    """Keypoints and descriptors of a feature text, as the bytes of a feature twin."""
    head, _, matrix = text.decode("ascii").partition("descriptors: !!opencv-matrix\n")
    rows = [row.split(",") for row in re.findall(r"^ *- *\[([^\]]*)\]", head, re.MULTILINE)]
    keypoints = b"".join(KEYPOINT.pack(*map(float, row[:5]), *map(int, row[5:])) for row in rows)
    sides = [int(re.search(rf"^ *{name}: *(\d+)$", matrix, re.MULTILINE)[1]) for name in ("rows", "cols")]
    data = matrix.partition("data: ")[2]
    if data.startswith("!!binary |\n"):
        raw = base64.b64decode("".join(data[10:].split()), validate=True)
        descriptors = raw[24:] if raw[:24] == b"1u".ljust(24) else None
    else:
        descriptors = bytes(int(value) for value in data.strip(" []\n").split(",") if value)
    return keypoints, descriptors if len(descriptors) == sides[0] * sides[1] and sides[0] == len(rows) else None


def compare_text(text, twin):
    head = FEATURES.decode(twin, 0)
    try:
        found = read_text(text)
    except (ValueError, TypeError, struct.error, OverflowError):
        found = None
    told = twin[32:32 + 28 * head["count"]], twin[head["descriptors_offset"]:]
    need(found == told, "PATTERN_YML_DIFFERS", 0, "text and twin")


def read_loop_record(data, pattern):
    """The tracker record: counts, offsets, places inside the image."""
    need(len(data) >= 128, "LOOP_RECORD", 0, "too small")
    (version, count, bright, patch_count, width, height, levels, zero, features, codes, patches,
     pixels) = struct.unpack_from("<8I4Q", data)
    need(version == 1 and zero == 0 and not any(data[64:128]) and count % 32 == bright % 32 == 0 and
         bright <= count <= 65536 and patch_count <= 4096 and 1 <= levels <= 8 and
         max(width, height) <= 1023 and
         (width, height) == (pattern["width"], pattern["height"]) and min(width, height) >> (levels - 1) >= 1 and
         codes % 64 == features % 2 == patches % 2 == 0, "LOOP_RECORD", 0, "header")
    for at, size in ((features, 12 * count), (codes, 32 * count), (patches, 8 * patch_count), (pixels, width * height)):
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
    check_clips(bundle)
    check_nodes(bundle)
    features = read_features(bundle)
    check_summary(bundle)
    for model in tables["models"]:
        layout = tables["layouts"][model["layout"]]
        for chunk in tables["chunks"][model["first_chunk"]:][:model["chunk_count"]]:
            for level in tables["levels"][chunk["first_level"]:][:chunk["level_count"]]:
                level.update(decode_level(bundle, layout, chunk, level, full))
            check_tight(chunk, tables["levels"][chunk["first_level"]:][:chunk["level_count"]])
    for row in tables["proxies"]:
        layout = tables["layouts"][tables["models"][row["model"]]["layout"]]
        for chunk in proxy_chunks(tables, row):
            level = tables["proxy_levels"][chunk["first_level"] - len(tables["levels"])]
            level.update(decode_level(bundle, layout, chunk, level, full))
            check_tight(chunk, [level])
    for row in (row for rows in [bundle.sections, *tables.values()] for row in rows):
        del row["at"], row["dirty"]
    for section in bundle.sections:
        section["hash"] = f"{section['hash']:016x}"
    meta = bundle.payload.get((2, NONE, 0), b"").decode("utf-8", "replace")
    return {"format": {"major": 1, "minor": bundle.header["minor"]}, "bytes": len(bundle.data),
            "meta": meta, "sections": bundle.sections, **tables, "features": features}


def scene_digest(bundle, decoded):
    """Of everything that is drawn or recognised: not of its place in the file or how it was made."""
    scene = {key: value for key, value in decoded.items() if key not in ("bytes", "meta", "sections")}
    looks = {f"{kind} {owner}": digest(data) for (kind, owner, _), data in bundle.payload.items() if 258 <= kind <= 265}
    scene.update(looks=looks, shades=bundle.shades)
    return digest(json.dumps(scene, sort_keys=True).encode())


def read(path, full):
    """The bundle, its decoded content, and an exit code with words where that fails."""
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
        for warning in bundle.warnings if code == 0 else []:
            print(f"{prefix}warning: {warning}", file=sys.stderr)
        if "--scenes" in options:
            print(scene_digest(bundle, decoded) if code == 0 else words.replace("\n", " "))
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
