"""How models of a ModAR bundle move, written from formats/bundle.md alone (for read_bundle.py)."""
import math
import struct

from bundle_bytes import NONE, TRACK, TRACKS, need

RULE = "BUNDLE_CLIP"


def unit(rotation):
    return abs(sum(part * part for part in rotation) - 1) <= 1e-4


def rotation_of(words):
    """The quaternion of three u16: bits 0 and 1 name its largest component, the others have 15 bits each."""
    bits = words[0] | words[1] << 16 | words[2] << 32
    largest, parts = bits & 3, [((bits >> (2 + 15 * i) & 0x7FFF) * 2 / 32766 - 1) * math.sqrt(0.5) for i in range(3)]
    rest = 1 - sum(part * part for part in parts)
    need(bits >> 47 == 0 and rest > 0, RULE, 0, "a rotation")
    return [*parts[:largest], math.sqrt(rest), *parts[largest:]]


def read_tracks(data, joints):
    """Of a clip: its samples, and (joint, path, sample numbers, values) of each track."""
    need(len(data) >= 16, RULE, 0, "tracks are too small")
    head = TRACKS.decode(data, 0)
    count, samples = head["track_count"], head["sample_count"]
    need(not head["dirty"] and 2 <= samples <= 65536 and count <= 12288 and 16 + 40 * count <= len(data), RULE, 0, "tracks")
    end, before, out = 16 + 40 * count, (0, 0), []
    for i in range(count):
        row = TRACK.decode(data, 16 + 40 * i)
        keys, order = row["key_count"], (row["joint"], row["path"])
        need(not row["dirty"] and row["joint"] < joints and 1 <= row["path"] <= 3 and order > before and
             keys and row["keys"] == end and end + 8 * keys <= len(data), RULE, 0, "a track")
        turns = row["path"] == 2
        need(not turns or not any(row["low"] + row["step"]), RULE, 0, "a rotation's range")
        at = struct.unpack_from(f"<{keys}H", data, end)
        need(at[0] == 0 and all(a < b for a, b in zip(at, at[1:])) and at[-1] < samples, RULE, 0, "keys do not rise")
        words = list(struct.iter_unpack("<3H", data[end + 2 * keys:end + 8 * keys]))
        values = [rotation_of(word) if turns else [low + step * w for low, step, w in zip(row["low"], row["step"], word)]
                  for word in words]
        out.append((row["joint"], row["path"], at, values))
        end, before = end + 8 * keys, order
    need(end == len(data), RULE, 0, "bytes behind the last track")
    return samples, out


def check_clips(bundle):
    tables = bundle.tables
    models, joints, bones, clips = (tables[name] for name in ("models", "joints", "bones", "clips"))
    need(len(joints) <= 4096 and len(clips) <= 256, RULE, 0, "too many")
    for rows in (joints, clips):
        of = [row["model"] for row in rows]
        need(of == sorted(of) and all(m < len(models) for m in of), RULE, 0, "models")
    for number, row in enumerate(joints):
        parent = row["parent"]
        need(unit(row["rotation"]) and (parent == NONE or parent < number and joints[parent]["model"] == row["model"]),
             RULE, row["at"], "a joint")
    names = [(row["model"], row["name"]) for row in clips]
    need(len(set(names)) == len(names) and all(name for _, name in names), RULE, 0, "names")
    for number, row in enumerate(clips):
        owner = row["tracks"]
        need(1 / 1024 <= row["seconds"] <= 546 and row["error"] >= 0, "BUNDLE_NUMBER", row["at"], "a clip")
        need(owner <= number and clips[owner]["tracks"] == owner and
             ((265, number, 0) in bundle.payload) == (owner == number), RULE, row["at"], "tracks")
        read_tracks(bundle.payload[265, owner, 0], sum(joint["model"] == row["model"] for joint in joints))
    need(all(owner < len(clips) and not variant for kind, owner, variant in bundle.payload if kind == 265),
         "BUNDLE_SECTION_OWNER", 0)
    check_parts(tables)
    last = -1
    for row in tables["scene_clips"]:
        need(not bundle.strict or row["flags"] < 2, "BUNDLE_RESERVED", row["at"])
        need(last < row["scene"] < len(tables["scenes"]) and row["clip"] < len(clips) and
             tables["scenes"][row["scene"]]["model"] == clips[row["clip"]]["model"], RULE, row["at"], "a scene's clip")
        last = row["scene"]


def check_parts(tables):
    bones, joints, last = tables["bones"], tables["joints"], -1
    for row in tables["parts"]:
        first, count, targets = row["first_bone"], row["bone_count"], row["target_count"]
        end = first + count + targets
        need(last < row["material"] < len(tables["materials"]) and 1 <= count <= 32 and targets <= 4 and end <= len(bones) and
             all(low <= high for low, high in zip(row["bounds_min"], row["bounds_max"])), RULE, row["at"], "a part")
        last = row["material"]
        owner = next((i for i, model in enumerate(tables["models"])
                      if 0 <= last - model["first_material"] < model["material_count"]), None)
        need(owner is not None and all(bone["joint"] < len(joints) and joints[bone["joint"]]["model"] == owner
                                       for bone in bones[first:end]), RULE, row["at"], "bones of another model")
        kinds = {part["semantic"]: (part["type"], part["normalised"], part["components"])
                 for part in tables["layouts"][tables["models"][owner]["layout"]]["attributes"]}
        need(count + targets == 1 or (kinds.get(6), kinds.get(7)) == ((5, 0, 4), (5, 1, 4)), RULE, row["at"],
             "no bones in vertices")
        morphs = [kinds[semantic] for semantic in (8, 9, 10) if semantic in kinds]
        need(count + targets == 1 or all(kind[:2] == (2, 0) for kind in morphs) and not (morphs and 4 in kinds), RULE,
             row["at"], "morph targets")
        need(not targets or len(morphs) == 3 and min(kind[2] for kind in morphs) >= targets, RULE, row["at"], "no targets")


def check_bones(bundle, chunk, joints, weights):
    """Vertices that are used name bones of their part, and their weights have the sum 255."""
    count = next((row["bone_count"] for row in bundle.tables["parts"] if row["material"] == chunk["material"]), 1)
    need(all(max(row) < count for row in joints) and all(sum(row) == 255 for row in weights), "VERTEX_BONES", chunk["at"])
