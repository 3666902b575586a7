#!/usr/bin/env python3
"""Compares the built programs and libraries of the device with their committed ceilings.

  scripts/size.py [--build build/device] [--ceilings scripts/size_ceilings.json] [--most 20] [--json]
  scripts/size.py --update      records the sizes of today in the build folder (sizes.json)

Names the symbols that grew since the last --update; without one, the largest symbols. A program is
measured after `strip` (libc, EGL and GLES belong to the phone), a library by the code and data that
its objects hold before linking. A target with a `triple` is another processor's, in a sibling build
folder; it is left out with a note where that is not built or binutils for it are missing
(scripts/foreign.sh armhf builds it). Data goes to stdout. Exits 2 where something is not built, 3
where something is above its ceiling.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
LEAST = 512  # bytes: smaller symbols are not recorded


def output_of(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def weight(path, tools):
    """Bytes of a stripped program, or of the sections that an archive's objects would load."""
    if path.suffix == ".a":
        return int(output_of(tools + "size", "-t", path).splitlines()[-1].split()[3])
    with tempfile.TemporaryDirectory() as folder:
        stripped = pathlib.Path(folder) / path.name
        output_of(tools + "strip", "-o", stripped, path)
        return stripped.stat().st_size


def symbols(path, tools):
    """Bytes of each symbol; those of one name are added up."""
    sizes = {}
    for line in output_of(tools + "nm", "-C", "-S", "--radix=d", path).splitlines():
        words = line.split(maxsplit=3)
        if len(words) == 4 and words[1].isdigit() and words[2] not in "bB":
            sizes[words[3]] = sizes.get(words[3], 0) + int(words[1])
    return {name: size for name, size in sorted(sizes.items()) if size >= LEAST}


def grown(before, now, most):
    """[(bytes more, symbol)], largest growth first; a new symbol grew from 0."""
    more = [(size - before.get(name, 0), name) for name, size in now.items()]
    return sorted((row for row in more if row[0] > 0), key=lambda row: (-row[0], row[1]))[:most]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build" / "device")
    parser.add_argument("--ceilings", type=pathlib.Path, default=ROOT / "scripts" / "size_ceilings.json")
    parser.add_argument("--most", type=int, default=20, help="symbols to name for each target")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    recorded = options.build / "sizes.json"
    before = json.loads(recorded.read_text()) if recorded.exists() else {}
    sizes = {}
    rows = []
    for name, target in json.loads(options.ceilings.read_text()).items():
        tools = target["triple"] + "-" if "triple" in target else ""
        path = (options.build.parent if tools else options.build) / name
        if tools and not (path.exists() and shutil.which(tools + "strip")):
            print(f"size.py: {path} is left out", file=sys.stderr)
            continue
        if not path.exists():
            print(f"size.py: {path} is not built; cmake --build --preset device builds it", file=sys.stderr)
            return 2
        then = before.get(name, {"bytes": None, "symbols": {}})
        sizes[name] = {"bytes": weight(path, tools), "symbols": symbols(path, tools)}
        rows.append({"target": name, "bytes": sizes[name]["bytes"], "ceiling": target["ceiling"], "before": then["bytes"],
                     "grown": grown(then["symbols"], sizes[name]["symbols"], options.most)})
    if options.update:
        recorded.write_text(json.dumps(sizes, indent=1) + "\n")
    elif options.json:
        print(json.dumps(rows, indent=1))
    else:
        for row in rows:
            above = row["bytes"] > row["ceiling"]
            change = "" if row["before"] is None else f", {row['bytes'] - row['before']:+d}"
            print(f"{row['target']}: {row['bytes']} of {row['ceiling']} bytes{change}")
            if above or row["bytes"] > (row["before"] or row["bytes"]):
                for more, symbol in row["grown"]:
                    print(f"  {more:+7d}  {symbol[:140]}")
    return 3 if any(row["bytes"] > row["ceiling"] for row in rows) and not options.update else 0


if __name__ == "__main__":
    sys.exit(main())
