#!/usr/bin/env python3
"""Prints how a bench's figures change with one constant of the code: the curve that chooses its value.

  scripts/tune.py NAME [--file FILE] [--values A,B,...] [--jobs N] [--json] -- BENCH [OPTIONS]
  scripts/tune.py kRatio -- pose --patterns patterns --backgrounds photos --frames 20 --parameters none

NAME: a constant, such as kRatio, that is defined as `constexpr TYPE NAME = NUMBER;`. --file: where it is defined, if it is in several
files. --values: default 0.5 to 2 times the present value. --jobs: benches at a time (default: a processor each); one alone measures
times well. BENCH: of `modar-lab bench`, with its options; its inputs are read by each run, so that all values see the same frames.
A figure of several rows ("right_pct near", "right_pct far") is their mean. The present value is marked by a star.
Builds a copy of the tree, in which the constant is a variable, in build/tune (minutes the first time, then the files that use it)."""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TREE, BUILD = ROOT / "build/tune/tree", ROOT / "build/tune/build"
DEFINITION = r"^(?P<indent> *)(?P<scope>(?:static |inline )*)constexpr (?P<type>[\w:]+) (?P<name>{}) ?= ?(?P<value>[^;\n]+);"
# In the place of the constant; block and class scope need storage of their own, so that it is read once.
READ = '#include <cstdlib>\ninline double modar_tuned(double value) { const char* text = std::getenv("MODAR_TUNED"); ' \
       'return text == nullptr ? value : std::strtod(text, nullptr); }\n'
FACTORS = (0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0)


def tracked():
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [name for name in names.split("\0") if name and (ROOT / name).is_file()]


def definition(name, file):
    """The file that defines the constant, and the match of its definition."""
    pattern = re.compile(DEFINITION.format(re.escape(name)), re.M)
    found = []
    for path in tracked():
        if not path.endswith((".cpp", ".hpp")) or path.startswith("tests/") or file not in (None, path):
            continue
        found += [(path, match) for match in pattern.finditer((ROOT / path).read_text())]
    if not found:
        sys.exit(f"tune.py: {name}: no file defines it as `constexpr TYPE {name} = NUMBER;`")
    if len(found) > 1:
        sys.exit(f"tune.py: {name}: it is defined in {', '.join(path for path, _ in found)}; name one with --file")
    return found[0]


def as_variable(text, match):
    """The file's text with the constant as a variable that MODAR_TUNED sets."""
    scope = match["scope"]
    if match["indent"] and not scope:
        scope = "static "  # in a function
    elif "static" in scope:
        scope = "static inline "  # in a class
    line = f'{match["indent"]}{scope}const {match["type"]} {match["name"]} = static_cast<{match["type"]}>(modar_tuned({match["value"]}));'
    rest = re.sub(rf"^ *static_assert\([^;]*\b{match['name']}\b[^;]*;", "", text[match.end():], flags=re.M)
    return READ + text[:match.start()] + line + rest


def write_if_new(path, data):
    """Files keep their times where nothing changed, so that little is compiled again."""
    if not path.is_file() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def build(changed, text):
    names = set(tracked())
    for old in TREE.rglob("*") if TREE.is_dir() else ():
        if old.is_file() and old.relative_to(TREE).as_posix() not in names:
            old.unlink()
    for name in names:
        write_if_new(TREE / name, text.encode() if name == changed else (ROOT / name).read_bytes())
        if os.access(ROOT / name, os.X_OK):
            (TREE / name).chmod(0o755)
    quiet = {"check": True, "stdout": sys.stderr}
    if not (BUILD / "build.ninja").is_file():
        subprocess.run(["cmake", "-S", TREE, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DMODAR_TESTS=OFF",
                        "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=20"], **quiet)
    subprocess.run(["ninja", "-C", BUILD, "modar-lab", "modar-model-probe"], **quiet)


def figures(value, bench):
    """The bench's figures with that value: the mean of the rows of each."""
    done = subprocess.run([BUILD / "bin/modar-lab", "bench", *bench, "--json", "--quiet"], capture_output=True, text=True,
                          env={**os.environ, "MODAR_TUNED": repr(value)})
    if done.returncode != 0:
        sys.exit(f"tune.py: with {value}: {done.stderr.strip()}")
    rows = {}
    for row in json.loads(done.stdout):
        if row["ours"] is not None:
            rows.setdefault(row["measure"].split()[0], []).append(row["ours"])
    return {measure: sum(all_rows) / len(all_rows) for measure, all_rows in rows.items()}


def present(match):
    text = match["value"].rstrip("fFuU")
    try:
        return float(text)
    except ValueError:
        sys.exit(f"tune.py: {match['name']} is {match['value']}, which is no number")


def values_of(match, asked):
    """Those that were asked for, or around the present one; it is always among them."""
    now = present(match)
    values = [float(word) for word in asked.split(",")] if asked else [now * factor for factor in FACTORS]
    if match["type"] not in ("double", "float"):
        values = [round(value) for value in values]
        now = round(now)
    return sorted({*(float(f"{value:.6g}") if isinstance(value, float) else value for value in values), now}), now


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name")
    parser.add_argument("--file")
    parser.add_argument("--values", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    parser.add_argument("bench", nargs="+")
    options = parser.parse_args()
    path, match = definition(options.name, options.file)
    values, now = values_of(match, options.values)
    build(path, as_variable((ROOT / path).read_text(), match))
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        curve = dict(zip(values, pool.map(lambda value: figures(value, options.bench), values)))
    if options.json:
        print(json.dumps({"name": options.name, "file": path, "value": now, "bench": options.bench,
                          "curve": [{"value": value, **row} for value, row in curve.items()]}))
        return
    measures = list(curve[now])
    print(f"{path}: {options.name} = {match['value']}; modar-lab bench {' '.join(options.bench)}")
    print("  ".join([f"{'value':>10} ", *(f"{measure:>12}" for measure in measures)]))
    for value, row in curve.items():
        print("  ".join([f"{value:>10.6g}{'*' if value == now else ' '}", *(f"{row.get(measure, float('nan')):>12.5g}" for measure in measures)]))


if __name__ == "__main__":
    main()
