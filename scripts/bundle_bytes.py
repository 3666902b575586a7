"""The bytes of a ModAR bundle as tables, written from formats/bundle.md alone (for read_bundle.py)."""
import json
import math
import struct

NONE, NO_OFFSET, MASK = 0xFFFFFFFF, 0xFFFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF


class Fault(Exception):
    def __init__(self, rule, offset, detail):
        super().__init__(f"error {rule}: byte {offset}: {detail}")


def need(condition, rule, offset, detail=""):
    if not condition:
        raise Fault(rule, offset, detail)


# XXH64, from the public specification of xxHash (doc/xxhash_spec.md), seed 0.
P1, P2, P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
P4, P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5


def rotate(value, bits):
    return ((value << bits) | (value >> (64 - bits))) & MASK


def mixed(lane):
    return rotate(lane * P2 & MASK, 31) * P1 & MASK


def xxh64(data):
    size, at = len(data), 0
    if size >= 32:
        lanes = [(P1 + P2) & MASK, P2, 0, -P1 & MASK]
        while size - at >= 32:
            words = struct.unpack_from("<4Q", data, at)
            lanes = [rotate((a + w * P2) & MASK, 31) * P1 & MASK for a, w in zip(lanes, words)]
            at += 32
        result = sum(rotate(a, r) for a, r in zip(lanes, (1, 7, 12, 18))) & MASK
        for a in lanes:
            result = ((result ^ mixed(a)) * P1 + P4) & MASK
    else:
        result = P5
    result = (result + size) & MASK
    while size - at >= 8:
        lane = struct.unpack_from("<Q", data, at)[0]
        result = (rotate(result ^ mixed(lane), 27) * P1 + P4) & MASK
        at += 8
    if size - at >= 4:
        lane = struct.unpack_from("<I", data, at)[0]
        result = (rotate(result ^ (lane * P1 & MASK), 23) * P2 + P3) & MASK
        at += 4
    for byte in data[at:]:
        result = rotate(result ^ (byte * P5 & MASK), 11) * P1 & MASK
    result = ((result ^ (result >> 33)) * P2) & MASK
    result = ((result ^ (result >> 29)) * P3) & MASK
    return result ^ (result >> 32)


def digest(data):
    return f"{xxh64(data):016x}"


class Record:
    """Fields as "name:code" with struct's codes; N marks a NameRef."""

    def __init__(self, spec):
        self.fields = [field.split(":") for field in spec.split()]
        self.code = "<" + "".join(code.replace("N", "2I") for _, code in self.fields)
        self.size = struct.calcsize(self.code)

    def decode(self, data, at):
        values, out, reserved = iter(struct.unpack_from(self.code, data, at)), {"at": at}, 0
        for name, code in self.fields:
            count = 2 if code == "N" else int(code[:-1] or 1)
            part = [next(values) for _ in range(count)]
            if name.startswith("reserved"):
                reserved |= any(part)
                continue
            if code[-1] in "fd":
                need(all(map(math.isfinite, part)), "BUNDLE_NUMBER", at, name)
            out[name] = part if count > 1 else part[0]
        out["dirty"] = bool(reserved)
        return out


HEADER = Record("magic:8B major:H minor:H section_count:I file_size:Q table_offset:Q entry_size:I "
                "reserved0:I reserved1:2Q hash:Q")
ENTRY = Record("type:I version:H flags:H owner:I variant:I offset:Q size:Q hash:Q reserved:Q")
TABLE = Record("count:I stride:I reserved:Q")
FEATURES = Record("count:I descriptor_bytes:I keypoints_offset:Q descriptors_offset:Q reserved:Q")
ATTRIBUTE = Record("semantic:B type:B components:B normalised:B offset:H reserved:H")
CHUNK = Record("bounds_min:3f bounds_max:3f cone_axis:3f cone_cutoff:f position_offset:3f position_step:f "
               "uv_offset:2f uv_scale:2f material:I first_level:I level_count:I reserved:I")
LEVEL = Record("vertex_offset:Q index_offset:Q vertex_count:I index_count:I error:f reserved:I")
TABLES = {
    16: ("models", Record(
        "name:N center:3d scale:d diagonal:d unit_metres:d position_error_max:d "
        "position_error_rms:d normal_error_max_deg:f normal_error_rms_deg:f uv_error_max_texels:f "
        "uv_error_rms_texels:f vertex_count:Q triangle_count:Q source_vertex_count:Q "
        "source_face_count:Q layout:I first_chunk:I chunk_count:I first_material:I "
        "material_count:I level_count:I reserved:4I")),
    17: ("chunks", CHUNK),
    18: ("levels", LEVEL),
    19: ("materials", Record("name:N ambient:3f diffuse:3f specular:3f emission:3f shininess:f "
                             "opacity:f texture:I flags:I reserved:2I")),
    20: ("layouts", Record("stride:H attribute_count:H reserved:I attributes:64B")),
    21: ("clips", Record("name:N model:I tracks:I seconds:f error:f reserved:2I")),
    22: ("joints", Record("model:I parent:I before:12f translation:3f rotation:4f scale:3f")),
    23: ("bones", Record("joint:I reserved:3I inverse:12f")),
    24: ("parts", Record("material:I first_bone:I bone_count:I target_count:I bounds_min:3f bounds_max:3f")),
    25: ("scene_clips", Record("scene:I clip:I flags:I reserved:I")),
    32: ("textures", Record("name:N width:I height:I source_width:I source_height:I format:I "
                            "flags:I first_level:I level_count:I psnr_db:f ssim:f reserved:4I")),
    33: ("texture_levels", Record("offset:Q alpha_offset:Q size:I width:I height:I psnr_db:f ssim:f "
                                  "reserved:I")),
    48: ("patterns", Record("name:N width:I height:I width_mm:d half_width:f half_height:f score:f "
                            "score_version:I copies:I reserved:5I")),
    49: ("parameter_sets", Record(
        "name:N id:I detector:I max_features:I scale_factor:f level_count:I edge_threshold:I "
        "first_level:I wta_k:I harris:I patch_size:I fast_threshold:I agast_threshold:I octaves:I "
        "pattern_scale:f descriptor_bits:I max_distance:I min_matches:I min_inliers:I "
        "ransac_threshold:f reserved:3I")),
    64: ("scenes", Record("pattern:I model:I scale:f offset:3f rotation:4f reserved:2I")),
    65: ("lights", Record("scene:I reserved0:I sky:27f direction:3f key:3f reserved1:I")),
    66: ("occlusion", Record("layout:I offset:I")),
    68: ("nodes", Record("name:N pattern:I kind:I subject:I flags:I group:I place:3f rotation:4f half_size:2f mark:N "
                         "alpha:I key:3f reach:f reserved:I")),
    69: ("actions", Record("event:I command:I source:I target:I part:N address:N seconds:f duration:f axis:3f degrees:f "
                           "reserved:2I")),
    70: ("media", Record("name:N kind:I flags:I width:I height:I seconds:f poster:I reserved:4I")),
    67: ("proxies", Record("model:I first_chunk:I chunk_count:I reserved:I")),
    71: ("proxy_chunks", CHUNK),
    72: ("proxy_levels", LEVEL),
}
COLOURS = Record("columns:I rows:I reserved:2I")
SHAPE = Record("kind:I face_count:I half_arc:d slope:d reserved:2I")
FACE = Record("place:4H corner:3f right:3f down:3f reserved:I")
SHADOW = Record("width:I height:I low:2f high:2f reserved:2I")
TRACKS = Record("track_count:I sample_count:I reserved:2I")
TRACK = Record("joint:I path:B reserved0:B key_count:H keys:I low:3f step:3f reserved1:I")
DRAW_ORDER = struct.Struct("<4f2I")
KEYPOINT = struct.Struct("<5f2i")
SINGLES = {1: 1, 2: 0, 3: 0, 4: 0, 512: 3, 513: 3, **{kind: 1 for kind in TABLES}, **{kind: 0 for kind in (*range(21, 26), *range(65, 73))}}  # type: flags
OWNED = {256: 1, 257: 0, 258: 0, 259: 0, 260: 0, 261: 0, 262: 0, 263: 0, 264: 0, 265: 0, 514: 3}
SINCE = {4: 1, 65: 2, 66: 2, 67: 3, 68: 3, 69: 3, 70: 3, 71: 3, 72: 3, 263: 3, 264: 3, 259: 2, 260: 2, 261: 2, 262: 2,
         **{kind: 4 for kind in (*range(21, 26), 265)}}  # type: minor version
COMPONENTS = {1: "e", 2: "h", 3: "H", 4: "b", 5: "B", 6: "f"}


class Bundle:
    def __init__(self, data):
        self.data, self.sections, self.payload, self.tables = data, [], {}, {}
        self.warnings, self.shades = [], []  # shades: digests of the levels' occlusion
        self.read_header()
        self.read_sections()
        self.names = self.payload.get((1, NONE, 0), b"")
        self.check_text(self.names, "BUNDLE_NAME")
        for kind, (name, record) in TABLES.items():
            self.tables[name] = self.read_table(kind, record)
        self.check_minor()
        self.check_meta(self.payload.get((2, NONE, 0)))
        self.vertices = self.payload.get((512, NONE, 0), b"")
        self.indices = self.payload.get((513, NONE, 0), b"")

    def read_header(self):
        data = self.data
        need(len(data) >= 64, "BUNDLE_TRUNCATED", len(data), "no room for a header")
        self.header = head = HEADER.decode(data, 0)
        need(bytes(head["magic"]) == b"\x89MOD\r\n\x1a\n", "BUNDLE_MAGIC", 0)
        need(head["major"] == 1, "BUNDLE_VERSION", 8, f"major version {head['major']}")
        need(len(data) >= head["file_size"], "BUNDLE_TRUNCATED", len(data), "shorter than stated")
        need(len(data) == head["file_size"], "BUNDLE_FILE_SIZE", 16, "longer than stated")
        need(head["table_offset"] == 64 and head["entry_size"] == 48, "BUNDLE_HEADER", 24)
        end = 64 + 48 * head["section_count"]
        need(head["section_count"] <= 65536 and end <= len(data), "BUNDLE_SECTION_COUNT", 12)
        need(xxh64(data[:56] + data[64:end]) == head["hash"], "BUNDLE_HEADER_HASH", 56)
        self.strict = head["minor"] <= 4
        self.clean(head)

    def clean(self, record):
        need(not (self.strict and record["dirty"]), "BUNDLE_RESERVED", record["at"])

    def read_sections(self):
        end, last = 64 + 48 * self.header["section_count"], None
        for i in range(self.header["section_count"]):
            entry = ENTRY.decode(self.data, 64 + 48 * i)
            at, kind, flags = entry["at"], entry["type"], entry["flags"]
            key = (kind, entry["owner"], entry["variant"])
            need(last is None or last < key, "BUNDLE_SECTION_ORDER", at, str(key))
            last = key
            self.clean(entry)
            need(flags < 4 or not self.strict, "BUNDLE_RESERVED", at + 6, f"flags {flags}")
            known = {**SINGLES, **OWNED}.get(kind)
            if known is None:
                need(not flags & 1, "BUNDLE_SECTION_REQUIRED", at, f"type {kind}")
            else:
                need(entry["version"] == 1, "BUNDLE_SECTION_VERSION", at + 4)
                need(flags & 3 == known, "BUNDLE_SECTION_FLAGS", at + 6)
                need(kind in OWNED or key[1:] == (NONE, 0), "BUNDLE_SECTION_OWNER", at + 8)
            begin, size = entry["offset"], entry["size"]
            need(begin % (4096 if flags & 2 else 64) == 0, "BUNDLE_SECTION_ALIGNMENT", at + 16)
            need(end <= begin and begin + size <= len(self.data), "BUNDLE_SECTION_RANGE", at + 16)
            need(not any(self.data[end:begin]), "SECTION_PADDING", end)
            end, self.payload[key] = begin + size, self.data[begin:begin + size]
            need(xxh64(self.payload[key]) == entry["hash"], "SECTION_HASH", begin)
            self.sections.append(entry)
        need(end == len(self.data), "BUNDLE_FILE_SIZE", end, "bytes behind the last section")

    def check_text(self, text, rule):
        try:
            letters = text.decode("utf-8")
        except UnicodeDecodeError as error:
            raise Fault(rule, error.start, "no UTF-8") from None
        bad = [c for c in letters if ord(c) < 32 or 127 <= ord(c) < 160]
        need(not bad, rule, 0, "a control character")

    def check_minor(self):
        needed = max((SINCE.get(entry["type"], 0) for entry in self.sections), default=0)
        if any(row["flags"] & 2 for row in self.tables["materials"]) or any(row["flags"] & 4 for row in self.tables["textures"]):
            needed = max(needed, 2)
        if any(row["copies"] for row in self.tables["patterns"]):
            needed = max(needed, 4)
        need(self.header["minor"] >= needed, "BUNDLE_MINOR", 10, f"1.{needed} is needed")

    def check_meta(self, text):
        """*Meta text*: an object whose known members have their types."""
        if text is None:
            return

        def no_number(word):
            raise ValueError(word)

        def deep(value):
            inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
            return 0 if inner is None else 1 + max(map(deep, inner), default=0)

        def number(kind):
            def read(word):
                exponent = int(word.lower().partition("e")[2] or 0)
                return kind(word) if len(word) <= 40 and exponent <= 250 else no_number(word)
            return read

        try:
            meta = json.loads(text.decode("utf-8"), parse_constant=no_number, parse_int=number(int), parse_float=number(float))
            json.dumps(meta, ensure_ascii=False).encode("utf-8")  # no half of a surrogate pair
            good = isinstance(meta, dict) and not text.startswith(b"\xef\xbb\xbf") and deep(meta) <= 32
        except (ValueError, RecursionError):
            good = False
        need(good, "META_TEXT", 0, "no JSON object")
        lists = [meta.get(name, []) for name in ("models", "patterns", "scenes", "nodes", "texts")]
        need(all(isinstance(part, list) and all(isinstance(item, dict) for item in part) for part in lists) and
             isinstance(meta.get("tool", ""), str) and isinstance(meta.get("options", {}), dict), "META_TEXT", 0, "a member")
        for item in meta.get("nodes", []):
            told = [item[name] for name in ("title", "text", "alt", "captions") if name in item]
            need(isinstance(item.get("pattern"), str) and isinstance(item.get("node"), str) and told and
                 all(isinstance(words, dict) and all(isinstance(word, str) for word in words.values()) for words in told),
                 "META_TEXT", 0, "nodes")
        for item in meta.get("texts", []):
            words = item.get("text")
            need(isinstance(item.get("pattern"), str) and isinstance(item.get("model", ""), str) and
                 isinstance(words, dict) and all(isinstance(word, str) for word in words.values()), "META_TEXT", 0, "texts")

    def read_table(self, kind, record):
        entry = next((e for e in self.sections if e["type"] == kind), None)
        if entry is None:
            return []
        at, size = entry["offset"], entry["size"]
        need(size >= 16, "BUNDLE_TABLE_SHAPE", at, "too small")
        head = TABLE.decode(self.data, at)
        count, stride = head["count"], head["stride"]
        need(stride >= record.size and stride % 8 == 0 and
             (stride == record.size or not self.strict) and count * stride == size - 16,
             "BUNDLE_TABLE_SHAPE", at, f"{count} records of {stride} bytes")
        self.clean(head)
        rows = [record.decode(self.data, at + 16 + i * stride) for i in range(count)]
        for row in rows:
            self.clean(row)
            for field in ("name", "mark", "part", "address"):
                if field in row:
                    row[field] = self.name(row, field)
        return rows

    def name(self, row, field):
        begin, length = row[field]
        need(length <= 1024 and begin + length <= len(self.names), "BUNDLE_NAME", row["at"])
        try:
            return self.names[begin:begin + length].decode("utf-8")
        except UnicodeDecodeError:
            raise Fault("BUNDLE_NAME", row["at"], "cut inside a character") from None


def follow(rows, first, count, size, rule, before=0):
    """Ranges follow each other and cover the table, whose first record has the number `before`."""
    end = before
    for row in rows:
        need(row[first] == end and end + row[count] <= before + size, rule, row["at"], first)
        end += row[count]
    need(end == before + size, rule, 0, f"{before + size - end} records without an owner")


def flags_known(bundle, row, known):
    need(not bundle.strict or row["flags"] & ~known == 0, "BUNDLE_RESERVED", row["at"], "flags")


def at_least(row, low, *names):
    for name in names:
        values = row[name] if isinstance(row[name], list) else [row[name]]
        need(all(value >= low for value in values), "BUNDLE_NUMBER", row["at"], name)
