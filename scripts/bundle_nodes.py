"""The nodes and actions of a ModAR bundle, written from formats/bundle.md alone (for read_bundle.py)."""
import json
import re

from bundle_bytes import NONE, flags_known, need

MODEL, PICTURE, LABEL, VIDEO, SOUND = 1, 2, 3, 4, 5
FOUND, LOST, TAP, AFTER = 1, 2, 3, 4
PLAY, PAUSE, SHOW, HIDE, TOGGLE, TEXT, LINK, NEXT, TURN, CLIP, CLIP_ONCE, STOP = 1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13


UNSEEN = ("\x00- \x7f-\xa0\xad\u034f\u061c\u115f\u1160\u1680\u17b4\u17b5\u180b-\u180f\u2000-\u200f\u2028-\u202f\u205f-\u206f\u2800\u3000\u3164"
          "\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufffb\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff")


def is_link(address):
    return re.fullmatch(r'https://[^@/?#]+([/?#].*)?', address) and not re.search(rf'["<>\\^`{{|}}{UNSEEN}]', address)


def unit(parts):
    return abs(sum(part * part for part in parts) - 1) <= 1e-4


def check_node(bundle, row, taken):
    at, kind = row["at"], row["kind"]
    flags_known(bundle, row, 7)
    need(max(map(abs, row["place"])) <= 1e9 and 0 <= min(row["half_size"]) and max(row["half_size"]) <= 1e9,
         "BUNDLE_NUMBER", at, "place or size")
    need(0 <= min(row["key"]) and max(row["key"]) <= 1 and 0 <= row["reach"] <= 1, "BUNDLE_NUMBER", at, "key")
    known = kind in (MODEL, PICTURE, LABEL, VIDEO, SOUND) and row["alpha"] <= 2
    need(known or not bundle.strict, "BUNDLE_ENUM", at, f"kind {kind}")
    scenes, subject = bundle.tables["scenes"], row["subject"]
    media = bundle.tables["media"][subject]["kind"] if subject < len(bundle.tables["media"]) else 0
    still = row["rotation"][3] == 1
    marked = 0 < len(row["mark"].encode()) <= 32
    sized = min(row["half_size"]) > 0
    fits = {MODEL: subject < len(scenes) and scenes[subject]["pattern"] == row["pattern"] and not any(row["place"]) and still,
            PICTURE: subject < len(bundle.tables["textures"]) and sized,
            LABEL: subject == NONE and still and marked,
            VIDEO: media == 1 and sized,
            SOUND: media == 2 and still and not any(row["place"]) and not row["group"] and not row["flags"] & 1}
    keyed = row["alpha"] == 2 or not any([*row["key"], row["reach"]])
    of_media = (kind == VIDEO or row["alpha"] == 0) and (kind in (VIDEO, SOUND) or row["flags"] < 2)
    need(row["pattern"] < len(bundle.tables["patterns"]) and
         (not known or (fits[kind] and (kind == LABEL or not row["mark"]) and (kind in (PICTURE, VIDEO) or not any(row["half_size"])) and keyed and of_media)),
         "BUNDLE_NODE", at)
    keys = {(row["pattern"], row["name"])} | ({(subject,)} if kind == MODEL else set())
    need(unit(row["rotation"]) and row["name"] and not keys & taken, "BUNDLE_NODE", at)
    taken |= keys


def check_action(bundle, row):
    at, nodes, event, command = row["at"], bundle.tables["nodes"], row["event"], row["command"]
    need(0 <= min(row["seconds"], row["duration"]) and max(row["seconds"], row["duration"]) <= 86400 and
         max(map(abs, row["axis"])) <= 2 and abs(row["degrees"]) <= 36000, "BUNDLE_NUMBER", at)
    source = None
    if row["source"] < len(nodes if event == TAP else bundle.tables["patterns"]):
        source = nodes[row["source"]]["pattern"] if event == TAP else row["source"]
    if event not in (FOUND, LOST, TAP, AFTER) or command not in (PLAY, PAUSE, SHOW, HIDE, TOGGLE, TEXT, LINK, NEXT, TURN, CLIP, CLIP_ONCE, STOP):
        need(not bundle.strict and (source is not None or event > AFTER), "BUNDLE_ENUM", at)
        return
    need(source is not None, "BUNDLE_ACTION", at, "source")
    if command == LINK:
        need(row["target"] == NONE, "BUNDLE_ACTION", at, "target")
    else:
        need(row["target"] < len(nodes), "BUNDLE_ACTION", at, "target")
        target = nodes[row["target"]]
        need(target["pattern"] == source and (command > PAUSE or target["kind"] in (VIDEO, SOUND)) and
             (command <= PAUSE or target["kind"] != SOUND) and (command != TEXT or target["kind"] == LABEL) and
             (command != NEXT or target["group"] > 0) and (command != TURN or target["kind"] != LABEL), "BUNDLE_ACTION", at)
        if command >= CLIP:
            need(target["kind"] == MODEL, "BUNDLE_ACTION", at, "target")
            model = bundle.tables["scenes"][target["subject"]]["model"]
            names = [clip["name"] for clip in bundle.tables["clips"] if clip["model"] == model]
            need(command == STOP or row["address"] in names, "BUNDLE_ACTION", at, "clip")
    model = event == TAP and nodes[row["source"]]["kind"] == MODEL
    need((model or not row["part"]) and (command in (LINK, CLIP, CLIP_ONCE) or not row["address"]) and (event == AFTER or not row["seconds"]) and
         (unit(row["axis"]) if command == TURN else not any([*row["axis"], row["duration"], row["degrees"]])),
         "BUNDLE_ACTION", at, "a field of another kind")
    need(command != LINK or is_link(row["address"]), "ACTION_LINK", at)


def boxes(data, at, end):
    """(type, begin, end) of the boxes between two bytes."""
    while at < end:
        need(at + 8 <= end, "MEDIA_FILE", at, "a header")
        size, head = int.from_bytes(data[at:at + 4], "big"), 8
        if size == 1:
            size, head = int.from_bytes(data[at + 8:at + 16], "big"), 16
        size = size or end - at
        need(head <= size <= end - at, "MEDIA_FILE", at, "a box")
        yield data[at + 4:at + 8], at + head, at + size
        at += size


def read_track(data, at, end, track):
    for kind, begin, stop in boxes(data, at, end):
        if kind in (b"mdia", b"minf", b"stbl"):
            read_track(data, begin, stop, track)
        elif kind == b"mdhd":
            wide = data[begin] == 1
            need(stop - begin >= (32 if wide else 20), "MEDIA_FILE", begin, "mdhd")
            scale = int.from_bytes(data[begin + (20 if wide else 12):][:4], "big")
            need(scale > 0, "MEDIA_FILE", begin, "mdhd")
            track["seconds"] = int.from_bytes(data[begin + (24 if wide else 16):][:8 if wide else 4], "big") / scale
        elif kind == b"hdlr":
            track["handler"] = data[begin + 8:begin + 12]
        elif kind == b"stsd":
            need(stop - begin >= 16, "MEDIA_FILE", begin, "stsd")
            track["codec"] = data[begin + 12:begin + 16]
            if track["codec"] == b"avc1":
                size = int.from_bytes(data[begin + 8:begin + 12], "big")
                need(86 <= size <= stop - begin - 8, "MEDIA_FILE", begin, "avc1")
                track["size"] = [int.from_bytes(data[begin + 40 + i:][:2], "big") for i in (0, 2)]
                for inner, first, _ in boxes(data, begin + 8 + 86, begin + 8 + size):
                    track.update(profile=data[first + 1] if inner == b"avcC" else track.get("profile"))


def check_file(data, row):
    order, tracks = [], []
    for kind, begin, end in boxes(data, 0, len(data)):
        order.append(kind)
        if kind == b"moov":
            for inner, first, last in boxes(data, begin, end):
                if inner == b"trak":
                    tracks.append({})
                    read_track(data, first, last, tracks[-1])
    video = [track for track in tracks if track.get("handler") == b"vide"]
    sound = [track for track in tracks if track.get("handler") == b"soun"]
    need(order[:1] == [b"ftyp"] and b"moov" in order and b"mdat" in order and order.index(b"moov") < order.index(b"mdat"),
         "MEDIA_FILE", 0, "order")
    seen = len(video) == 1 and video[0].get("codec") == b"avc1" and video[0].get("profile") == 66 and \
        video[0]["size"] == [row["width"], row["height"]]
    need((seen if row["kind"] == 1 else not video) and len(sound) == (row["flags"] & 1) and
         all(track.get("codec") == b"mp4a" for track in sound) and
         abs(max(track["seconds"] for track in video + sound) - row["seconds"]) <= 0.1, "MEDIA_FILE", 0, "what it is")


def check_media(bundle):
    media = bundle.tables["media"]
    for (kind, owner, variant), _ in bundle.payload.items():
        need(kind != 263 or (owner < len(media) and variant == 0), "BUNDLE_SECTION_OWNER", 0)
    need(len(media) <= 1024, "BUNDLE_NODE", 0, "too many")
    for index, row in enumerate(media):
        flags_known(bundle, row, 3)
        need(0 <= row["seconds"] <= 86400, "BUNDLE_NUMBER", row["at"])
        need(row["kind"] in (1, 2) or not bundle.strict, "BUNDLE_ENUM", row["at"])
        if row["kind"] not in (1, 2):
            continue
        data = bundle.payload.get((263, index, 0))
        seen = 1 <= row["width"] <= 1280 and 1 <= row["height"] <= 720 and row["poster"] < len(bundle.tables["textures"])
        heard = (row["width"], row["height"], row["poster"], row["flags"]) == (0, 0, NONE, 1)
        need((seen if row["kind"] == 1 else heard) and row["seconds"] > 0 and data is not None, "BUNDLE_NODE", row["at"])
        check_file(data, row)
        if row["flags"] & 2:
            bundle.warnings.append("MEDIA_FLASHES")


TIME = r"(?:(\d\d):)?([0-5]\d):([0-5]\d)\.(\d{3})"


def check_captions(text):
    need(len(text.encode()) <= 1 << 18 and "\r" not in text, "CAPTIONS", 0)
    head, *cues = re.split(r"\n\n", text[:-1] if text.endswith("\n") else text)
    need(head == "WEBVTT" and cues, "CAPTIONS", 0, "its first line")
    last = 0
    for cue in cues:
        times, *words = cue.split("\n")
        found = re.fullmatch(TIME + " --> " + TIME + "( .*)?", times)
        need(found and words and all(words) and "-->" not in "".join(words), "CAPTIONS", 0, cue)
        begin, end = (((int(h or 0) * 60 + int(m)) * 60 + int(s)) * 1000 + int(ms) for h, m, s, ms in (found.groups()[:4], found.groups()[4:8]))
        need(last <= begin < end, "CAPTIONS", 0, times)
        last = begin


def check_texts(bundle):
    """Each label has a title, and each sound has captions, in every language in which one has."""
    told = json.loads(bundle.payload.get((2, NONE, 0), b"{}")).get("nodes", [])

    def languages(key, row):
        name = bundle.tables["patterns"][row["pattern"]]["name"]
        return set().union(*(each.get(key, {}) for each in told if (each["pattern"], each["node"]) == (name, row["name"])))
    media = bundle.tables["media"]
    labels = [languages("title", row) for row in bundle.tables["nodes"] if row["kind"] == LABEL]
    heard = [languages("captions", row) for row in bundle.tables["nodes"] if row["kind"] in (VIDEO, SOUND) and media[row["subject"]]["flags"] & 1]
    if any(has != set().union(*labels) for has in labels):
        bundle.warnings.append("NODE_TEXT")
    if any(has != set().union(*heard) or not has for has in heard):
        bundle.warnings.append("CAPTIONS_MISSING")
    for each in told:
        for text in each.get("captions", {}).values():
            check_captions(text)


def check_nodes(bundle):
    nodes, actions = bundle.tables["nodes"], bundle.tables["actions"]
    check_media(bundle)
    need(len(nodes) <= 1024 and len(actions) <= 256, "BUNDLE_NODE", 0, "too many")
    taken = set()
    for row in nodes:
        check_node(bundle, row, taken)
    for row in actions:
        check_action(bundle, row)
    check_texts(bundle)
