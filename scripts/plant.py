#!/usr/bin/env python3
"""Plants small faults in a room's code, one at a time, and prints how many of them the room's tests find.

  scripts/plant.py ROOM [--count N] [--seed S] [--jobs N]
  scripts/plant.py bake/mesh --count 30 --seed 7

ROOM: a folder of C++, JavaScript or Java. A fault is an off-by-one or inverted comparison, a constant doubled or halved, a sign, a
dropped statement, two arguments swapped, or an early return. Each is built by the preset `edit` and is found where a test of the room
fails or hangs. One that does not compile is replaced by another. --seed: chooses the places (default 1).
Prints each fault, the survivors as diffs, and the share that was found. Works in a copy of the tree, in build/plant: the first build
takes minutes."""
import argparse
import difflib
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
TREE = ROOT / "build/plant/tree"
BUILD = TREE / "build/edit"
# Tests of each room by name, fast ones first. The longest prefix counts.
TESTS = {
    "formats": ["(check|bundle|golden|quantise|vertex_scan|action|atomic_file|spec_table)_test", "cli_(corrupt|inspect)"],
    "formats/transport": ["(ship|arriving|byte_source)_test", "cli_ship.*"],
    "bake/io": ["import_test|commands_test", "cli_(bake|files)"],
    "bake/image": ["import_test|texture_pipeline_test", "cli_(bake|files|pattern)"],
    "bake/video": ["cli_(media|acting|play)"],
    "bake/import": ["import_test", "cli_(bake|files)"],
    "bake/mesh": ["mesh_test|budget_test", "mesh_oracle_test", "cli_(bake|check)"],
    "bake/texture": ["(texture_pipeline|atlas|etc1|mesa_etc1)_test", "cli_bake"],
    "bake/pattern": ["pattern_test", "cli_(pattern|rectify)"],
    "bake/options": ["commands_test", "cli_(bake|project|document|scenes)"],
    "bake/bundle": ["commands_test|source_check_test", "cli_(bake|scenes|acting|media|mapping|check)"],
    "bake/project": ["commands_test", "cli_(project|changed|entry)"],
    "bake/check": ["(device_rules|source_check|mutate|content_check|light)_test", "cli_(check|corrupt)"],
    "bake/export": ["import_test", "cli_inspect"],
    "bake/ship": ["ship_test", "cli_ship.*"],
    "bake/commands": ["commands_test|bench_display_test", "cli_(bake|document|entry|inspect|changed)"],
    "bake/extensions/report": ["cli_report"],
    "bake/extensions/studio": ["studio_(edit|attack|server)", "studio_page"],
    "bake/extensions/web": ["cli_web"],
    "bake/extensions/lab": ["lab_test|bench_display_test|light_test|mutate_test"],
    "runtime/track": ["track_test|pose_loop_test|pose_loop_memory_test"],
    "runtime/record": ["pattern_test|pose_loop_test"],
    "runtime/render": ["render_test.*|capi_test", "cli_(play|gl_calls)"],
    "runtime/arrive": ["arriving_test|render_test"],
    "runtime/capi": ["capi_test", "cli_app"],
    "runtime/platform": ["mapped_file_test|render_test|play_test", "cli_play"],
    "runtime/fetch": ["ship_test|byte_source_test", "cli_ship.*"],
    "runtime/play": ["play_test|play_threads_test", "cli_play"],
    "runtime/opencv": ["track_test", "cli_play"],
    "runtime/extensions/paper": ["track_test"],
    "runtime/extensions/web": ["web_(download|layout)", "web_(page|acting|viewer|update|arrival|wanted)", "web_faults"],
    "runtime/extensions/android": ["android_bridge", "android_apk"],
}
SWAPPED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "===": "!==", "!==": "==="}
PLAIN = r"""//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|^[ \t]*#[^\n]*|\bstatic_assert\([^;]*;"""
NUMBER = re.compile(r"(?<![\w.\[])(?=\d*\.?\d*[1-9])(\d+\.\d*(?:e[+-]?\d+)?|\d+(?:e-\d+)?|0x[0-9a-f]+)(?=[fuUlL]*(?![\w.]))")
STATEMENT = re.compile(r"^[ \t]+(?!return\b|case\b|break\b|continue\b|goto\b|using\b|throw\b|delete\b|const\b|let\b|var\b|import\b|export\b)"
                       r"[\w.>\[\]*+-]+(?:::\w+)*(?:\([^;{}]*\)| [-+*/|&^]?= [^;{}]*);$", re.M)
FUNCTION = re.compile(r"^[^\n;=]*\b(?:void|bool|boolean) [\w:~]+\([^;{}]*\)[^;{}=]*\{$", re.M)
SCRIPT = re.compile(r"^(?:export )?(?:async )?function \w+\([^;{}]*\) \{$|^  (?!if|for|while|switch|catch)[\w#]+\([^;{}]*\) \{$", re.M)


def blanked(text):
    """The text with comments, strings, directives and static assertions as spaces, so that places stay."""
    return re.sub(PLAIN, lambda match: re.sub(r"[^\n]", " ", match[0]), text, flags=re.M | re.S)


def scaled(number, factor):
    """Doubled or halved, in the notation of the number."""
    if number.startswith("0x"):
        return hex(int(int(number, 16) * factor))
    if re.fullmatch(r"\d+", number):
        return str(int(int(number) * factor)) if int(number) > 1 else "2"
    return repr(float(number) * factor)


def faults(text, suffix):
    """All faults of a file: kind, begin, end and what takes that place."""
    code = blanked(text)
    found = [("comparison", *match.span(1), SWAPPED[match[1]]) for match in re.finditer(r"(?<= )(<=?|>=?|[!=]==?)(?= )", code)]
    for match in NUMBER.finditer(code):
        factor = 2 if (match.start() + len(match[0])) % 2 else 0.5
        found.append(("constant", *match.span(1), scaled(match[1], factor)))
    found += [("sign", *match.span(1), "-" if match[1] == "+" else "+") for match in re.finditer(r"(?<=[\w)\]] )([+-])(?= [\w(])", code)]
    found += [("dropped", *match.span(), "") for match in STATEMENT.finditer(code)]
    for match in re.finditer(r"(?<=\w\()([\w.]+), ([\w.]+)(?=[,)])", code):
        if match[1] != match[2]:
            found.append(("swapped", *match.span(), f"{match[2]}, {match[1]}"))
    for match in (SCRIPT if suffix in (".js", ".mjs") else FUNCTION).finditer(code):
        value = " false" if re.search(r"\bbool(?:ean)? ", match[0]) else ""
        # The condition keeps a compiler from warnings about what follows.
        found.append(("early return", match.end(), match.end(), f" if (true) return{value};"))
    return found


def chosen(room, seed):
    """Faults of the room without end, in turn of each kind; a place at most once."""
    chance = random.Random(f"{room} {seed}")
    kinds = {}
    for path in sorted((ROOT / room).rglob("*")):
        if path.suffix in (".cpp", ".js", ".mjs", ".java") and "tests" not in path.parts:
            for kind, *fault in faults(path.read_text(), path.suffix):
                kinds.setdefault(kind, []).append((path.relative_to(ROOT), *fault))
    for of_kind in kinds.values():
        chance.shuffle(of_kind)
    while any(kinds.values()):
        for kind in sorted(kinds):
            if kinds[kind]:
                yield kind, kinds[kind].pop()


def copy_tree():
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout.decode().split("\0")
    for name in filter(None, names):
        source, target = ROOT / name, TREE / name
        if source.is_file() and not (target.is_file() and target.read_bytes() == source.read_bytes()):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)


def tests_of(room):
    prefixes = [prefix for prefix in TESTS if room == prefix or room.startswith(prefix + "/")]
    if not prefixes:
        sys.exit(f"plant.py: {room}: no tests are known for it; rooms: {', '.join(TESTS)}")
    return TESTS[max(prefixes, key=len)]


def targets_of(groups):
    """What the tests run: their own programs, or all that people run."""
    listed = subprocess.run(["ctest", "--test-dir", BUILD, "-N", "-R", f"^({'|'.join(groups)})$"], capture_output=True, text=True).stdout
    names = re.findall(r"Test +#\d+: (\S+)", listed)
    programs = [name for name in names if name.endswith("_test")]
    return programs + (["bake/all", "runtime/all"] if len(programs) < len(names) else []) + (["tests/android/all"] if "android_bridge" in names else [])


def build(targets, jobs):
    return subprocess.run(["ninja", "-C", BUILD, "-j", str(jobs), *targets], capture_output=True, text=True)


def failing_test(groups, jobs):
    """The first test that fails; None where all pass."""
    for group in groups:
        done = subprocess.run(["ctest", "--test-dir", BUILD, "-R", f"^({group})$", "-j", str(jobs), "--timeout", "300", "--stop-on-failure",
                               "--no-tests=error"], capture_output=True, text=True)
        if done.returncode != 0:
            failed = re.findall(r"\d+ - (\S+) \(", done.stdout)
            return failed[0] if failed else group
    return None


def planted(text, fault):
    begin, end, instead = fault
    return text[:begin] + instead + text[end:]


def difference(path, before, after):
    return "".join(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(path), str(path), n=2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("room", metavar="ROOM")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    room = options.room.rstrip("/")
    rooms = [room, *(prefix for prefix in TESTS if prefix.startswith(room + "/"))]
    groups = list(dict.fromkeys(group for each in rooms for group in tests_of(each)))
    copy_tree()
    # As the commit's, which the copy has not.
    os.environ["SOURCE_DATE_EPOCH"] = subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
    subprocess.run(["cmake", "--preset", "edit", *launcher], cwd=TREE, check=True, stdout=subprocess.DEVNULL)
    targets = targets_of(groups)
    if build(targets, options.jobs).returncode != 0 or failing_test(groups, options.jobs):
        sys.exit(f"plant.py: {room}: the build or its tests fail without a fault; see {BUILD}")
    tried, survivors, skipped = 0, [], 0
    for kind, (path, *fault) in chosen(room, options.seed):
        if tried == options.count:
            break
        before, start = (ROOT / path).read_text(), time.monotonic()
        after = planted(before, fault)
        (TREE / path).write_text(after)
        try:
            if build(targets, options.jobs).returncode != 0:
                skipped += 1
                continue
            by = failing_test(tests_of(str(path)), options.jobs)
        finally:
            (TREE / path).write_text(before)
        tried += 1
        line = before.count("\n", 0, fault[0]) + 1
        print(f"{path}:{line}: {kind}: {by or 'SURVIVED'} ({time.monotonic() - start:.0f} s)", flush=True)
        if by is None:
            survivors.append(difference(path, before, after))
    build(targets, options.jobs)
    print("\n".join(["", *survivors]))
    print(f"{room}: {tried - len(survivors)} of {tried} faults found, seed {options.seed}; {skipped} did not compile")


if __name__ == "__main__":
    main()
