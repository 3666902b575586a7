#!/usr/bin/env python3
"""Plants small faults in a room's code, one at a time, and prints how many of them the room's tests find.

  scripts/plant.py [ROOM...] [--count N] [--seed S] [--jobs N]
  scripts/plant.py bake/mesh --count 30 --seed 7

ROOM: a folder of C++, JavaScript or Java (default: all rooms, in proportion to their lines, at least 4 each). A fault is an off-by-one
or inverted comparison, a constant doubled or halved, a sign, a dropped statement, two arguments swapped, or an early return. Each is
built by the preset `edit` and is found where a test of the room fails or hangs; the room's programs run first. One that does not
compile, or that the compiler turns into the same code, is replaced by another. --seed: chooses the places (default 1).
Prints each fault, the survivors as diffs, and the share that was found. Works in a copy of the tree, in build/plant: the first build
takes minutes."""
import argparse
import difflib
import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
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
    "bake/memory": ["mesh_test"],
    "bake/process": ["cli_(web|report)"],
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


def room_of(path):
    """The longest room that a file is in."""
    rooms = [room for room in TESTS if path == room or path.startswith(room + "/")]
    return max(rooms, key=len) if rooms else None


def sources(room):
    """Files of the room in which faults are planted, without those of rooms within it."""
    for path in sorted((ROOT / room).rglob("*")):
        name = path.relative_to(ROOT).as_posix()
        if path.suffix in (".cpp", ".js", ".mjs", ".java") and "tests" not in path.relative_to(ROOT).parts and (room not in TESTS or room_of(name) == room):
            yield name


def shares(rooms, count):
    """How many of `count` faults each room gets: by its lines, at least 4."""
    lines = {room: sum((ROOT / name).read_text().count("\n") for name in sources(room)) for room in rooms}
    share = {room: max(4, round(count * lines[room] / sum(lines.values()))) for room in rooms}
    while sum(share.values()) > count and max(share.values()) > 4:
        share[max(share, key=share.get)] -= 1
    return share


def chosen(room, seed):
    """Faults of the room without end, in turn of each kind; a place at most once."""
    chance = random.Random(f"{room} {seed}")
    kinds = {}
    for name in sources(room):
        for kind, *fault in faults((ROOT / name).read_text(), pathlib.PurePath(name).suffix):
            kinds.setdefault(kind, []).append((name, *fault))
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
    within = room_of(room)
    if not within:
        sys.exit(f"plant.py: {room}: no tests are known for it; rooms: {', '.join(TESTS)}")
    return TESTS[within]


def planted(text, fault):
    begin, end, instead = fault
    return text[:begin] + instead + text[end:]


def difference(path, before, after):
    return "".join(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(path), str(path), n=2))


def listed_tests():
    """CTest's tests by name: command, folder, environment and fixtures."""
    shown = subprocess.run(["ctest", "--test-dir", BUILD, "--show-only=json-v1"], check=True, capture_output=True, text=True).stdout
    return {test["name"]: {"command": test.get("command"), **{each["name"]: each["value"] for each in test["properties"]}}
            for test in json.loads(shown)["tests"]}


class Tests:
    """A build of the copy and the tests of rooms in it, fast ones first."""

    def __init__(self, rooms, jobs):
        self.jobs, self.listed, self.sound, self.seconds = jobs, listed_tests(), set(), {}
        self.names = {}
        for room in rooms:
            found = [name for group in tests_of(room) for name in self.listed if re.fullmatch(group, name)]
            self.names[room] = list(dict.fromkeys(sorted(found, key=lambda name: not self.is_program(name))))
        everything = list(dict.fromkeys(name for room in rooms for name in self.names[room]))
        for name in everything:
            if not self.build(name):
                sys.exit(f"plant.py: {name}: its build fails without a fault; see {BUILD}")
        self.listed = listed_tests()
        for fixture in sorted({each for name in everything for each in self.listed[name].get("FIXTURES_REQUIRED", [])}):
            if self.run(fixture) is not True:
                sys.exit(f"plant.py: {fixture} fails without a fault")
        self.clean = {name: self.digest(name) for name in everything}

    def is_program(self, name):
        return (self.listed[name]["command"] or [f"{name}_test"])[0].endswith("_test")

    def build(self, name):
        program = (self.listed[name]["command"] or [name])[0].rpartition("/")[2]
        targets = [program] if self.is_program(name) else ["bake/all", "runtime/all"] + (["tests/android/all"] if name == "android_bridge" else [])
        return self.ninja(*targets)

    def ninja(self, *targets):
        return subprocess.run(["ninja", "-C", BUILD, "-j", str(self.jobs), *targets], stdout=subprocess.DEVNULL).returncode == 0

    def digest(self, name):
        """Of the programs that a test runs."""
        program = pathlib.Path(self.listed[name]["command"][0])
        files = [program] if self.is_program(name) else [*(BUILD / "bin").iterdir(), *BUILD.rglob("*.so")]
        return [hashlib.blake2b(path.read_bytes()).digest() for path in sorted(files) if path.is_file()]

    def run(self, name):
        """Whether it passes. What takes ten times as long as before hangs."""
        test = self.listed[name]
        environment = {**os.environ, **dict(each.split("=", 1) for each in test.get("ENVIRONMENT", [])), "GTEST_FAIL_FAST": "1"}
        fast = ["-f"] if test["command"][-1] == "-v" else []
        start = time.monotonic()
        with subprocess.Popen([*test["command"], *fast], cwd=test["WORKING_DIRECTORY"], env=environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, start_new_session=True) as process:
            try:
                code = process.wait(30 + 10 * self.seconds.get(name, 60))
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                return False
        if code == 0:
            self.seconds[name] = time.monotonic() - start
        return code in (0, test.get("SKIP_RETURN_CODE", 0))

    def object_of(self, path):
        """What the compiler makes of a file; None for a file that is not compiled. False: it does not compile."""
        if not path.endswith(".cpp"):
            return None
        source = str(TREE / path)
        named = subprocess.run(["ninja", "-C", BUILD, "-t", "query", source], capture_output=True, text=True).stdout
        outputs = re.findall(r"^    (\S+\.o)$", named, re.M)
        return self.ninja(*outputs) and [(BUILD / output).read_bytes() for output in outputs]

    def failing(self, path, room):
        """The first test that fails; None where all pass. False: no build."""
        for name in self.names[room]:
            if not self.build(name):
                return False
            same = path.endswith(".cpp") and self.digest(name) == self.clean[name]
            engine = not path.endswith(".cpp") and "web_engine" in self.listed[name].get("FIXTURES_REQUIRED", [])
            if not same and ((engine and not self.run("web_engine")) or not self.run(name)):
                return name
        return None

    def verify(self, name):
        """A test that finds a fault passes without it."""
        if name not in self.sound and not (self.build(name) and self.run(name)):
            sys.exit(f"plant.py: {name} fails without a fault; see {BUILD}")
        self.sound.add(name)


def plant(room, count, seed, tests):
    """Plants faults in a room: how many were planted, the survivors as diffs, how many gave the same program."""
    tried, survivors, same = 0, [], 0
    for kind, (path, *fault) in chosen(room, seed):
        if tried == count:
            break
        before, start = (TREE / path).read_text(), time.monotonic()
        clean = tests.object_of(path)
        after = planted(before, fault)
        (TREE / path).write_text(after)
        try:
            made = tests.object_of(path)
            if made is False or (made is not None and made == clean):
                same += made is not False
                continue
            by = tests.failing(path, room_of(path))
        finally:
            (TREE / path).write_text(before)
        if by is False:
            continue
        if by:
            tests.verify(by)
        tried += 1
        line = before.count("\n", 0, fault[0]) + 1
        print(f"{path}:{line}: {kind}: {by or 'SURVIVED'} ({time.monotonic() - start:.0f} s)", flush=True)
        if by is None:
            survivors.append(difference(path, before, after))
    return tried, survivors, same


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", metavar="ROOM", nargs="*")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    rooms = [room.rstrip("/") for room in options.rooms] or list(TESTS)
    copy_tree()
    # As the commit's, which the copy has not.
    os.environ["SOURCE_DATE_EPOCH"] = subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
    subprocess.run(["cmake", "--preset", "edit", *launcher], cwd=TREE, check=True, stdout=subprocess.DEVNULL)
    total = [0, 0]
    for room, count in shares(rooms, options.count).items():
        within = list(dict.fromkeys(room_of(name) for name in sources(room)))
        tried, survivors, same = plant(room, count, options.seed, Tests(within, options.jobs))
        print("\n".join([*survivors, f"{room}: {tried - len(survivors)} of {tried} faults found, seed {options.seed}; {same} gave the same program"]),
              flush=True)
        total = [total[0] + tried - len(survivors), total[1] + tried]
    print(f"all: {total[0]} of {total[1]}")


if __name__ == "__main__":
    main()
