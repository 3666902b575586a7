"""The models of a ModAR bundle, written from formats/bundle.md alone (for read_bundle.py)."""
import math
import struct

from bundle_bytes import ATTRIBUTE, COMPONENTS, NONE, at_least, digest, flags_known, follow, need
from bundle_clips import check_bones

SEMANTICS = {1: "positions", 2: "normals", 3: "uvs", 4: "colours", 5: "normals", 6: "joints", 7: "weights",
             8: "morph_x", 9: "morph_y", 10: "morph_z"}
WIDTHS = {1: (3, 4), 2: (3,), 3: (2,), 4: (4,), 5: (2,), 6: (4,), 7: (4,), **dict.fromkeys((8, 9, 10), (1, 2, 3, 4))}
LENGTH_STEP = {1: 0.02, 2: 2e-3, 4: 1e-4}  # by bytes of a component


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


def check_occlusion(bundle):
    """Bytes of vertices that belong to no attribute, a layout at most one, in the layouts' order."""
    tables, last = bundle.tables, -1
    for row in tables["occlusion"]:
        need(last < row["layout"] < len(tables["layouts"]), "BUNDLE_LAYOUT", row["at"], "occlusion")
        last = row["layout"]
        layout = tables["layouts"][last]
        used = {part["offset"] + byte for part in layout["attributes"]
                for byte in range(struct.calcsize(f"{part['components']}{COMPONENTS[part['type']]}"))}
        need(row["offset"] < layout["stride"] and row["offset"] not in used, "BUNDLE_LAYOUT", row["at"], "occlusion")


def check_models(bundle):
    tables = bundle.tables
    for row in tables["layouts"]:
        check_layout(bundle, row)
    check_occlusion(bundle)
    for row in tables["materials"]:
        flags_known(bundle, row, 0xFFFF03)
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
    check_proxies(bundle)
    used = sum(2 * level["index_count"] for level in tables["levels"] + tables["proxy_levels"])
    need(used <= len(bundle.indices), "BUNDLE_LEVEL_RANGE", 0, "indices are shared")


def check_proxies(bundle):
    """Whole models as one level each, from fine to coarse; their chunks and levels count on from those of models."""
    tables, before = bundle.tables, {}
    chunks, levels = tables["proxy_chunks"], tables["proxy_levels"]
    follow(tables["proxies"], "first_chunk", "chunk_count", len(chunks), "BUNDLE_PROXY", len(tables["chunks"]))
    follow(chunks, "first_level", "level_count", len(levels), "BUNDLE_PROXY", len(tables["levels"]))
    models = [row["model"] for row in tables["proxies"]]
    need(models == sorted(models) and all(m < len(tables["models"]) for m in models), "BUNDLE_PROXY", 0, "models")
    for row in tables["proxies"]:
        model = tables["models"][row["model"]]
        materials = range(model["first_material"], model["first_material"] + model["material_count"])
        mine = proxy_chunks(tables, row)
        mine_levels = [levels[chunk["first_level"] - len(tables["levels"])] for chunk in mine]
        need(mine and all(chunk["level_count"] == 1 for chunk in mine) and
             len({level["error"] for level in mine_levels}) == 1, "BUNDLE_PROXY", row["at"], "its levels")
        for chunk, level in zip(mine, mine_levels):
            check_chunk(chunk, materials)
            check_level(bundle, model, level)
        now = (-mine_levels[0]["error"], sum(level["index_count"] for level in mine_levels))
        last = before.get(row["model"], now)
        need(now[0] <= last[0] and now[1] <= last[1], "LEVEL_ORDER", row["at"], "proxies")
        before[row["model"]] = now
        check_grid(bundle, model, mine)


def proxy_chunks(tables, row):
    return tables["proxy_chunks"][row["first_chunk"] - len(tables["chunks"]):][:row["chunk_count"]]


def check_model(bundle, model):
    tables, at = bundle.tables, model["at"]
    errors = [name for name in model if "_error_" in name]
    at_least(model, 0, "diagonal", *errors)
    need(model["unit_metres"] == 0 or 1e-9 <= model["unit_metres"] <= 1e9, "BUNDLE_NUMBER", at, "unit_metres")
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
    check_grid(bundle, model, chunks)


def check_grid(bundle, model, chunks):
    """Warns where a vertex of two chunks would decode to two points."""
    kinds = [(part["type"], part["normalised"]) for part in bundle.tables["layouts"][model["layout"]]["attributes"]
             if part["semantic"] == 1]
    if not kinds or kinds[0][0] in (1, 6) or kinds[0][1]:
        return
    for chunk in chunks:
        step = chunk["position_step"]
        if (step != chunks[0]["position_step"] or math.frexp(step)[0] != 0.5 or
                any(math.fmod(offset, step) for offset in chunk["position_offset"])):
            bundle.warnings.append(f"CHUNK_GRID at byte {chunk['at']}: borders may crack")


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
    """A list of tuples, one a vertex; `raw` has the stored values."""
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
    at, out, bones = level["at"], {}, {}
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
        if part["semantic"] in (6, 7):
            bones[part["semantic"]] = [raw[i] for i in used]
        if part["semantic"] == 2:
            step = LENGTH_STEP[struct.calcsize(COMPONENTS[part["type"]])]
            need(all(abs(math.sqrt(sum(v * v for v in values[i])) - 1) <= step for i in used),
                 "VERTEX_NORMAL", at)
        flat = [value for row in values for value in row]
        out[SEMANTICS[part["semantic"]]] = digest(struct.pack(f"<{len(flat)}d", *flat))
        if full:
            out[SEMANTICS[part["semantic"]] + "_values"] = values
    if len(bones) == 2:
        check_bones(bundle, chunk, bones[6], bones[7])
    owned = {row["offset"] for row in bundle.tables["occlusion"]
             if bundle.tables["layouts"][row["layout"]] is layout}
    for byte in owned:
        shades = bytes(bundle.vertices[level["vertex_offset"] + i * layout["stride"] + byte] for i in used)
        need(max(shades, default=0) <= 127, "VERTEX_OCCLUSION", at)
        bundle.shades.append(digest(shades))
    owned |= {part["offset"] + byte for part in layout["attributes"]
             for byte in range(struct.calcsize(f"{part['components']}{COMPONENTS[part['type']]}"))}
    stride, first = layout["stride"], level["vertex_offset"]
    for byte in set(range(stride)) - owned:
        column = bundle.vertices[first + byte:first + level["vertex_count"] * stride:stride]
        need(not any(column[i] for i in used), "VERTEX_PADDING", at)
    out["indices"] = digest(struct.pack(f"<{len(indices)}H", *indices))
    return {**out, "indices_values": indices} if full else out
