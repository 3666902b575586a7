#!/usr/bin/env python3
"""Prints how a bench's figures change with constants of the code, one at a time: the curves that choose their values.

  scripts/tune.py [FILE:]NAME... [--values A,B,...] [--jobs N] [--json] -- BENCH [OPTIONS]
  scripts/tune.py kRatio kTukey -- pose --patterns patterns --backgrounds photos --frames 20 --parameters none

NAME: a constant, such as kRatio, that is defined as `constexpr TYPE NAME = NUMBER;`; with its FILE, if it is in several. --values: of
each; default 0.5 to 2 times the present one. --jobs: benches at a time (default: a processor each); one alone measures
times well. BENCH: of `modar-lab bench`, with its options; its inputs are read by each run, so that all values see the same frames.
A figure of several rows ("right_pct near", "right_pct far") is their mean, one beside another program's ("rms_percent/meshopt_simplify")
the geometric mean of the ratios. The present value is marked by a star.
Builds a copy of the tree, in which the constants are variables, in build/tune (minutes the first time, then the files that use it)."""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TREE, BUILD = ROOT / "build/tune/tree", ROOT / "build/tune/build"
DEFINITION = r"^(?P<indent> *)(?P<scope>(?:static |inline )*)constexpr (?P<type>[\w:]+) (?P<name>{}) ?= ?(?P<value>[^;\n]+);"
# In the place of a constant; block and class scope need storage of their own, so that it is read once.
READ = '#include <cstdlib>\n#ifndef MODAR_TUNED\n#define MODAR_TUNED\n' \
       'inline double modar_tuned(const char* name, double value) { const char* text = std::getenv(name); ' \
       'return text == nullptr ? value : std::strtod(text, nullptr); }\n#endif\n'
FACTORS = (0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0)


def tracked():
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [name for name in names.split("\0") if name and (ROOT / name).is_file()]


def definition(asked):
    """The file that defines the constant [FILE:]NAME, and the match of its definition."""
    file, _, name = asked.rpartition(":")
    pattern = re.compile(DEFINITION.format(re.escape(name)), re.M)
    found = []
    for path in tracked():
        if not path.endswith((".cpp", ".hpp")) or path.startswith("tests/") or file not in ("", path):
            continue
        found += [(path, match) for match in pattern.finditer((ROOT / path).read_text())]
    if not found:
        sys.exit(f"tune.py: {name}: no file defines it as `constexpr TYPE {name} = NUMBER;`")
    if len(found) > 1:
        sys.exit(f"tune.py: {name}: it is defined in {', '.join(path for path, _ in found)}; name one as FILE:{name}")
    return found[0]


def as_variable(text, match):
    """The file's text with the constant as a variable that MODAR_TUNED_<name> sets."""
    scope = match["scope"]
    if match["indent"] and not scope:
        scope = "static "  # in a function
    elif "static" in scope:
        scope = "static inline "  # in a class
    line = f'{match["indent"]}{scope}const {match["type"]} {match["name"]} = static_cast<{match["type"]}>(modar_tuned("MODAR_TUNED_{match["name"]}", {match["value"]}));'
    rest = re.sub(rf"^ *static_assert\([^;]*\b{match['name']}\b[^;]*;", "", text[match.end():], flags=re.M)
    return READ + text[:match.start()] + line + rest


def write_if_new(path, data):
    """Files keep their times where nothing changed, so that little is compiled again."""
    if not path.is_file() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def variables(constants):
    """The texts of the files that define them, with variables in their places."""
    texts = {}
    for path, match in constants:
        text = texts.get(path, (ROOT / path).read_text())
        texts[path] = as_variable(text, re.compile(DEFINITION.format(re.escape(match["name"])), re.M).search(text))
    return texts


def build(texts):
    names = set(tracked())
    for old in TREE.rglob("*") if TREE.is_dir() else ():
        if old.is_file() and old.relative_to(TREE).as_posix() not in names:
            old.unlink()
    for name in names:
        write_if_new(TREE / name, texts[name].encode() if name in texts else (ROOT / name).read_bytes())
        if os.access(ROOT / name, os.X_OK):
            (TREE / name).chmod(0o755)
    quiet = {"check": True, "stdout": sys.stderr}
    if not (BUILD / "build.ninja").is_file():
        subprocess.run(["cmake", "-S", TREE, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DMODAR_TESTS=OFF",
                        "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=20"], **quiet)
    subprocess.run(["ninja", "-C", BUILD, "modar", "modar-lab", "modar-model-probe", "modar_video_library"], **quiet)


def figures(name, value, bench):
    """The bench's figures with that value of one constant: the mean of the rows of each, or of their ratios."""
    done = subprocess.run([BUILD / "bin/modar-lab", "bench", *bench, "--json", "--quiet"], capture_output=True, text=True,
                          env={**os.environ, f"MODAR_TUNED_{name}": repr(value)})
    if done.returncode != 0:
        sys.exit(f"tune.py: with {name} = {value}: {done.stderr.strip()}")
    rows = {}
    for row in json.loads(done.stdout):
        measure = next(word for word in row["measure"].split() if not word[0].isdigit())  # "1/2 rms_percent/meshopt_simplify scan"
        figure = row["ratio" if "/" in measure else "ours"]
        if figure is not None:
            rows.setdefault(measure, []).append(figure)
    return {measure: (statistics.geometric_mean if "/" in measure and min(found) > 0 else statistics.mean)(found) for measure, found in rows.items()}


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


def curve_of(pool, name, values, bench):
    return {value: pool.submit(figures, name, value, bench) for value in values}


def show(path, match, now, curve, bench):
    measures = list(curve[now])
    print(f"{path}: {match['name']} = {match['value']}; modar-lab bench {' '.join(bench)}")
    print("  ".join([f"{'value':>10} ", *(f"{measure:>12}" for measure in measures)]))
    for value, row in curve.items():
        print("  ".join([f"{value:>10.6g}{'*' if value == now else ' '}", *(f"{row.get(measure, float('nan')):>12.5g}" for measure in measures)]),
              flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+", metavar="[FILE:]NAME")
    parser.add_argument("--values", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    words = sys.argv[1:]
    if "--" not in words:
        parser.error("no -- BENCH")
    options, bench = parser.parse_args(words[:words.index("--")]), words[words.index("--") + 1:]
    constants = [definition(name) for name in options.names]
    if len({match["name"] for _, match in constants}) < len(constants):
        sys.exit("tune.py: two constants of one name cannot be told apart; one at a time")
    sweeps = [values_of(match, options.values) for _, match in constants]
    build(variables(constants))
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        present_figures = pool.submit(figures, "", 0, bench)
        curves = [curve_of(pool, match["name"], [value for value in values if value != now], bench)
                  for (_, match), (values, now) in zip(constants, sweeps)]
        for (path, match), (values, now), curve in zip(constants, sweeps, curves):
            rows = {value: (present_figures if value == now else curve[value]).result() for value in values}
            if options.json:
                print(json.dumps({"name": match["name"], "file": path, "value": now, "bench": bench,
                                  "curve": [{"value": value, **row} for value, row in rows.items()]}), flush=True)
            else:
                show(path, match, now, rows, bench)


if __name__ == "__main__":
    main()
