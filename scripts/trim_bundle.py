#!/usr/bin/env python3
"""Copies a ModAR bundle as apps get it: without keypoints of the ModAR paper's method, unless its bake named parameters.

Usage: trim_bundle.py BUNDLE OUT
The bytes are those that `modar web` puts into a page: trim_to_publish() in bake/io/output.cpp.
"""
import json
import pathlib
import struct
import sys

from bundle_bytes import ENTRY, HEADER, xxh64

PAPER = (49, 256, 257)  # parameter sets, feature twins, feature texts
META, SUMMARY, PATTERNS, TRACKER_RECORD = 2, 4, 48, 258
GPU = 2  # flag of sections that begin at multiples of 4096


def stays(line):
    """A line of the content summary that is not about left-out parts."""
    key, value = next(iter(json.loads(line).items()))
    return key != "parameter_sets" and not (key == "section" and value in PAPER)


def trimmed(data):
    """The bundle's bytes; those of the file where nothing is to be left out."""
    head = HEADER.decode(data, 0)
    sections = [ENTRY.decode(data, 64 + ENTRY.size * i) for i in range(head["section_count"])]
    content = {(row["type"], row["owner"]): data[row["offset"]:row["offset"] + row["size"]] for row in sections}
    of = {kind: content[kind, owner] for kind, owner in content}
    found = sum(row["type"] == TRACKER_RECORD for row in sections)
    named = json.loads(of.get(META, b"{}")).get("options", {}).get("parameters")
    if PAPER[0] not in of or named or found != struct.unpack_from("<I", of[PATTERNS])[0]:
        return data
    sections = [row for row in sections if row["type"] not in PAPER]
    end, table, body = HEADER.size + ENTRY.size * len(sections), b"", []
    for row in sections:
        part = content[row["type"], row["owner"]]
        if row["type"] == SUMMARY:
            part = b"".join(filter(stays, part.splitlines(True)))
            row["hash"] = xxh64(part)
        unit = 4096 if row["flags"] & GPU else 64
        start = (end + unit - 1) // unit * unit
        table += struct.pack(ENTRY.code, *(row[name] for name in ("type", "version", "flags", "owner", "variant")), start,
                             len(part), row["hash"], 0)
        body += [bytes(start - end), part]
        end = start + len(part)
    header = struct.pack(HEADER.code[:-1], *data[:8], 1, head["minor"], len(sections), end, 64, ENTRY.size, 0, 0, 0)
    return b"".join([header, struct.pack("<Q", xxh64(header + table)), table, *body])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source = pathlib.Path(sys.argv[1]).read_bytes()
    pathlib.Path(sys.argv[2]).write_bytes(trimmed(source) if source.startswith(b"\x89MOD\r\n\x1a\n") else source)
