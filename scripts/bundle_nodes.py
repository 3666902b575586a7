"""The nodes and actions of a ModAR bundle, written from formats/bundle.md alone (for read_bundle.py)."""
import json
import re

from bundle_bytes import NONE, flags_known, need

MODEL, PICTURE, LABEL = 1, 2, 3
FOUND, LOST, TAP, AFTER = 1, 2, 3, 4
SHOW, HIDE, TOGGLE, TEXT, LINK, NEXT, TURN = 3, 4, 5, 6, 7, 8, 10


def unit(parts):
    return abs(sum(part * part for part in parts) - 1) <= 1e-4


def check_node(bundle, row, taken):
    at, kind = row["at"], row["kind"]
    flags_known(bundle, row, 1)
    need(max(map(abs, row["place"])) <= 1e9 and 0 <= min(row["half_size"]) and max(row["half_size"]) <= 1e9,
         "BUNDLE_NUMBER", at, "place or size")
    known = kind in (MODEL, PICTURE, LABEL)
    need(known or not bundle.strict, "BUNDLE_ENUM", at, f"kind {kind}")
    scenes, subject = bundle.tables["scenes"], row["subject"]
    still = row["rotation"][3] == 1
    marked = 0 < len(row["mark"].encode()) <= 32
    sized = min(row["half_size"]) > 0
    fits = {MODEL: subject < len(scenes) and scenes[subject]["pattern"] == row["pattern"] and not any(row["place"]) and still,
            PICTURE: subject < len(bundle.tables["textures"]) and sized,
            LABEL: subject == NONE and still and marked}
    need(row["pattern"] < len(bundle.tables["patterns"]) and
         (not known or (fits[kind] and (kind == LABEL or not row["mark"]) and (kind == PICTURE or not any(row["half_size"])))),
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
    if event not in (FOUND, LOST, TAP, AFTER) or command not in (SHOW, HIDE, TOGGLE, TEXT, LINK, NEXT, TURN):
        need(not bundle.strict and (source is not None or event > AFTER), "BUNDLE_ENUM", at)
        return
    need(source is not None, "BUNDLE_ACTION", at, "source")
    if command == LINK:
        need(row["target"] == NONE, "BUNDLE_ACTION", at, "target")
    else:
        need(row["target"] < len(nodes), "BUNDLE_ACTION", at, "target")
        target = nodes[row["target"]]
        need(target["pattern"] == source and (command != TEXT or target["kind"] == LABEL) and
             (command != NEXT or target["group"] > 0) and (command != TURN or target["kind"] != LABEL), "BUNDLE_ACTION", at)
    model = event == TAP and nodes[row["source"]]["kind"] == MODEL
    need((model or not row["part"]) and (command == LINK or not row["address"]) and (event == AFTER or not row["seconds"]) and
         (unit(row["axis"]) if command == TURN else not any([*row["axis"], row["duration"], row["degrees"]])),
         "BUNDLE_ACTION", at, "a field of another kind")
    need(command != LINK or re.fullmatch(r'https://[^/ "<>\\^`{|}][^ "<>\\^`{|}]*', row["address"]), "ACTION_LINK", at)


def check_titles(bundle):
    """Each label has a title in every language in which one has."""
    titles = {}
    for told in json.loads(bundle.payload.get((2, NONE, 0), b"{}")).get("nodes", []):
        titles.setdefault((told["pattern"], told["node"]), set()).update(told.get("title", {}))
    labels = [titles.get((bundle.tables["patterns"][row["pattern"]]["name"], row["name"]), set())
              for row in bundle.tables["nodes"] if row["kind"] == LABEL]
    if any(has != set().union(*labels) for has in labels):
        bundle.warnings.append("NODE_TEXT")


def check_nodes(bundle):
    nodes, actions = bundle.tables["nodes"], bundle.tables["actions"]
    need(len(nodes) <= 1024 and len(actions) <= 256, "BUNDLE_NODE", 0, "too many")
    taken = set()
    for row in nodes:
        check_node(bundle, row, taken)
    for row in actions:
        check_action(bundle, row)
    check_titles(bundle)
