#!/usr/bin/env python3
"""Lints C++ with clang-tidy and .clang-tidy.

  scripts/tidy.py FILE...          whole files
  scripts/tidy.py [--seconds N]    the lines that changed: uncommitted ones, and those of commits that main lacks; on main,
                                   those of the last commit. Ends after N CPU-seconds (60) and lists the files left.
  --build FOLDER                   a build folder of GCC or clang, with or without unity files (build/dev, else build/edit)

Exits with 1 if clang-tidy finds something, with 2 if a file does not compile by clang.
"""
import argparse
import json
import pathlib
import re
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROOMS = ("bake/", "formats/", "runtime/")
COMMITS_ON_MAIN = 1
# Options of GCC that clang refuses.
FOREIGN = re.compile(r"-fira-region=.*|--param=.*|-fmax-errors=.*|-fno-var-tracking.*")


def git(*words):
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    return done.stdout if done.returncode == 0 else ""


def base():
    """The commit from which on lines count as changed."""
    head = git("rev-parse", "HEAD").strip()
    for main in ("origin/main", "main"):
        common = git("merge-base", "HEAD", main).strip()
        if common and common != head:
            return common
    commits = git("rev-list", f"--max-count={COMMITS_ON_MAIN + 1}", "--first-parent", "HEAD").split()
    return commits[-1] if commits else ""


def changed():
    """{file: [[first line, last line], ...]}, newest commits first in the order of files."""
    since = base()
    if not since:
        return {}
    files, name = {}, None
    for line in git("diff", "--unified=0", "--find-renames", "--diff-filter=AMR", since, "--", *ROOMS).splitlines():
        if line.startswith("+++ "):
            name = line[6:] if line.endswith(".cpp") else None
        elif name and line.startswith("@@"):
            first, count = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))?", line).groups()
            if count != "0":
                files.setdefault(name, []).append([int(first), int(first) + int(count or 1) - 1])
    return files


def arguments(entry):
    """A compile command as clang reads it, without its file."""
    words, kept = shlex.split(entry["command"]), []
    if pathlib.Path(words[0]).name == "ccache":
        words = words[1:]
    skip = False
    for word, following in zip(words, [*words[1:], ""]):
        if skip or FOREIGN.fullmatch(word) or word in ("-c", entry["file"], "-Winvalid-pch"):
            skip = False
        elif word == "-o" or (word == "-include" and "cmake_pch" in following):
            skip = True
        else:
            kept.append(word)
    return kept


def commands(build):
    """{file: entry of a compilation database}, also of files that unity files include."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        path = pathlib.Path(entry["file"])
        sources = [str(path)]
        if path.name.startswith("unity_") and path.exists():
            sources = re.findall(r'^#include "(.*)"$', path.read_text(), re.M)
        for source in sources:
            name = str(pathlib.Path(source).resolve())
            found.setdefault(name, {"directory": entry["directory"], "file": name,
                                    "arguments": [*arguments(entry), "-Wno-unknown-warning-option", "-c", name]})
    return found


def lint(files, build, seconds):
    """Status and the files that were left out."""
    known = commands(build)
    worst, left = 0, []
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "compile_commands.json").write_text(json.dumps(list(known.values())))
        for name, lines in files.items():
            spent = resource.getrusage(resource.RUSAGE_CHILDREN)
            path = str((ROOT / name).resolve())
            if path not in known or (seconds and spent.ru_utime + spent.ru_stime > seconds):
                left.append(name)
                continue
            only = [f"--line-filter={json.dumps([{'name': path, 'lines': lines}])}"] if lines else []
            done = subprocess.run(["clang-tidy", "-p", folder, "--quiet", f"--config-file={ROOT}/.clang-tidy", *only, path],
                                  capture_output=True, text=True)
            if done.returncode:
                sys.stdout.write(done.stdout)
                worst = max(worst, 2 if "[clang-diagnostic-error]" in done.stdout or not done.stdout else 1)
    return worst, left


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--build", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    if not shutil.which("clang-tidy"):
        sys.exit("tidy.py: clang-tidy is not installed")
    builds = [options.build] if options.build else [ROOT / "build/dev", ROOT / "build/edit"]
    build = next((one for one in builds if (one / "compile_commands.json").exists()), None)
    if not build:
        sys.exit("tidy.py: no build folder has a compile_commands.json; configure one")
    files = {str(pathlib.Path(file).resolve()): [] for file in options.files} or changed()
    status, left = lint(files, build, 0 if options.files else options.seconds)
    print(f"tidy.py: {len(files) - len(left)} of {len(files)} files checked" + "".join(f"\n  not checked: {name}" for name in left))
    sys.exit(status)


if __name__ == "__main__":
    main()
