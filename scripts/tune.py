#!/usr/bin/env python3
"""Prints how a bench's figures change with constants of the code, one at a time: the curves that choose their values.

  scripts/tune.py [FILE:]NAME... [--values A,B,...] [--jobs N] [--json] [--write] [--data FOLDER] -- BENCH [OPTIONS]
  scripts/tune.py kRatio kTukey -- pose --patterns patterns --backgrounds photos --frames 20 --parameters none
  scripts/tune.py --verify bake/extensions/lab/tuned/lod.csv... [--jobs N] [--data FOLDER]

NAME: a constant, such as kRatio, that is defined as `constexpr TYPE NAME = NUMBER;`; with its FILE, if it is in several. --values: of
each; default 0.5 to 2 times the present one. --jobs: benches at a time (default: a processor each); one alone measures
times well. BENCH: of `modar-lab bench`, with its options; its inputs are read by each run, so that all values see the same frames.
A figure of several rows ("right_pct near", "right_pct far") is their mean, one compared with another program's ("rms_percent/meshopt_simplify")
the geometric mean of the ratios. The present value is marked by a star.
--write: stores the figures in bake/extensions/lab/tuned/BENCH.csv, in place of older ones of that constant and command. --verify: repeats the rows of
such files; exit 1 where a figure differs by more than 1 %, or a "flat" one from that of the present value. --data: where BENCH runs.
Builds a copy of the tree, in which the constants are variables, in build/tune (minutes the first time, then the files that use it)."""
import argparse
import concurrent.futures
import csv
import json
import os
import pathlib
import re
import shlex
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
TUNED, COLUMNS = ROOT / "bake/extensions/lab/tuned", ["constant", "file", "command", "value", "figures", "commit"]
SAME = 0.01  # share by which a figure may differ from the stored one
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


def figures(name, value, bench, data=None):
    """The bench's figures with that value of one constant: the mean of the rows of each, or of their ratios."""
    done = subprocess.run([BUILD / "bin/modar-lab", "bench", *bench, "--json", "--quiet"], capture_output=True, text=True, cwd=data,
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
    """The requested ones, or around the present one; it is always among them."""
    now = present(match)
    values = [float(word) for word in asked.split(",")] if asked else [now * factor for factor in FACTORS]
    if match["type"] not in ("double", "float"):
        values = [round(value) for value in values]
        now = round(now)
    return sorted({*(float(f"{value:.6g}") if isinstance(value, float) else value for value in values), now}), now


def curve_of(pool, name, values, bench, data):
    return {value: pool.submit(figures, name, value, bench, data) for value in values}


def stored(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write(path, match, curve, bench, folder=None):
    """Stores a curve, in place of that constant's rows of the same command."""
    target, command = (folder or TUNED) / f"{bench[0]}.csv", shlex.join(bench)
    commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    rows = [row for row in (stored(target) if target.is_file() else []) if (row["constant"], row["file"], row["command"]) != (match["name"], path, command)]
    rows += [dict(zip(COLUMNS, (match["name"], path, command, f"{value:g}", " ".join(f"{measure}={figure:.5g}" for measure, figure in row.items()), commit)))
             for value, row in curve.items()]
    rows.sort(key=lambda row: (row["file"], row["constant"], row["command"], float(row["value"])))
    target.parent.mkdir(parents=True, exist_ok=True)
    with open(target, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def differences(row, now, found):
    """Measures of a stored row that differ from the found figures; now: those of the present value."""
    wrong = []
    for measure, text in (pair.rsplit("=", 1) for pair in row["figures"].split()):
        expected, figure = now.get(measure) if text == "flat" else float(text), found.get(measure)
        if figure is None or expected is None or abs(figure - expected) > SAME * max(abs(expected), abs(figure)):
            wrong.append(f"{measure} is {figure}, not {text}")
    return wrong


def verify(files, jobs, data):
    """Repeats the rows of files; the number of those that differ."""
    rows = [row for file in files for row in stored(file)]
    wrong = 0
    for of_one in sorted({(row["file"], row["constant"]) for row in rows}):  # one build each, since names repeat in other files
        mine = [row for row in rows if (row["file"], row["constant"]) == of_one]
        build(variables([definition(":".join(of_one))]))
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            present_of = {row["command"]: pool.submit(figures, "", 0, shlex.split(row["command"]), data) for row in mine}
            runs = [(row, pool.submit(figures, row["constant"], float(row["value"]), shlex.split(row["command"]), data)) for row in mine]
            for row, run in runs:
                found = differences(row, present_of[row["command"]].result(), run.result())
                wrong += bool(found)
                print(f"{row['file']}: {row['constant']} = {row['value']}: {'; '.join(found) or 'same'}", flush=True)
    return wrong


def show(path, match, now, curve, bench):
    measures = list(curve[now])
    print(f"{path}: {match['name']} = {match['value']}; modar-lab bench {' '.join(bench)}")
    print("  ".join([f"{'value':>10} ", *(f"{measure:>12}" for measure in measures)]))
    for value, row in curve.items():
        print("  ".join([f"{value:>10.6g}{'*' if value == now else ' '}", *(f"{row.get(measure, float('nan')):>12.5g}" for measure in measures)]),
              flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="[FILE:]NAME")
    parser.add_argument("--values", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--verify", nargs="+", default=[], metavar="CSV")
    parser.add_argument("--data", type=pathlib.Path)
    words = sys.argv[1:]
    if "--" not in words:
        options = parser.parse_args(words)
        if not options.verify:
            parser.error("no -- BENCH")
        sys.exit(1 if verify(options.verify, options.jobs, options.data) else 0)
    options, bench = parser.parse_args(words[:words.index("--")]), words[words.index("--") + 1:]
    constants = [definition(name) for name in options.names]
    if len({match["name"] for _, match in constants}) < len(constants):
        sys.exit("tune.py: two constants of one name cannot be told apart; one at a time")
    sweeps = [values_of(match, options.values) for _, match in constants]
    build(variables(constants))
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        present_figures = pool.submit(figures, "", 0, bench, options.data)
        curves = [curve_of(pool, match["name"], [value for value in values if value != now], bench, options.data)
                  for (_, match), (values, now) in zip(constants, sweeps)]
        for (path, match), (values, now), curve in zip(constants, sweeps, curves):
            rows = {value: (present_figures if value == now else curve[value]).result() for value in values}
            if options.write:
                write(path, match, rows, bench)
            if options.json:
                print(json.dumps({"name": match["name"], "file": path, "value": now, "bench": bench,
                                  "curve": [{"value": value, **row} for value, row in rows.items()]}), flush=True)
            else:
                show(path, match, now, rows, bench)


if __name__ == "__main__":
    main()
