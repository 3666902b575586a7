#!/usr/bin/env python3
"""Holds the tree against the laws of the house (CONTRIBUTING.md): who may include whom, what the
player may link, what lies at the top level.

  scripts/check_laws.py [--root DIR] [--player FILE]

--player: a linked modar-play of the preset `device`, whose symbols and libraries are looked at.
Prints one line a violation, exits 3 if there is one.
"""
import argparse
import pathlib
import re
import subprocess
import sys

ROOMS = ("formats", "bake", "runtime", "tests")
SOURCES = (".cpp", ".hpp", ".h")
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

# Header prefixes of third parties and the files that may include them (Law 4).
OPENCV_FILES = (
    r"bake/(pattern|lab)/.*\.cpp", r"bake/pattern/gray_mat\.hpp",
    r"runtime/paper/.*\.(cpp|hpp)", r"runtime/play/desk_.*\.cpp", r"tests/.*",
)
THIRD_PARTIES = {
    "opencv2/": OPENCV_FILES,
    "OpenMesh/": (r"bake/mesh/topology/mesh_topology\.cpp", r"tests/.*"),
    "draco/": (r"(bake|runtime)/[a-z_/]*draco[a-z_]*\.cpp", r"tests/.*"),
    "tiny_gltf": (r"bake/(import/gltf|export)/(glb|gltf)_[a-z_]*\.cpp", r"bake/import/gltf/tinygltf_library\.[ch]pp",
                  r"tests/.*"),
    "bake/import/gltf/tinygltf_library": (r"bake/(import/gltf|export)/[a-z_]*gl(b|tf)[a-z_]*\.cpp",),
    "toml++/": (r"bake/project/project_file\.cpp",),
    "CLI/": (r"bake/commands/command_line\.cpp",),
    "nlohmann/": (r"bake/json\.cpp", r"bake/check/(bake_options|device_file)_json\.cpp", r"tests/.*"),
    "rapidjson/": (r"runtime/play/(frame_report|recording)\.cpp",
                   r"runtime/fetch/(main|release|store)\.cpp", r"tests/.*"),
    "sodium.h": (r"runtime/fetch/release\.cpp", r"bake/ship/keys\.cpp"),
    "zstd.h": (r"runtime/fetch/piece\.cpp",
               r"bake/ship/(mesh_encoder|recipe_maker)\.cpp", r"bake/lab/ship_bench\.cpp", r"tests/.*"),
    "meshoptimizer": (r"runtime/fetch/piece\.cpp",
                      r"bake/import/gltf/gltf_meshopt\.cpp", r"bake/mesh/lod/reduce\.cpp", r"bake/ship/mesh_encoder\.cpp",
                      r"bake/lab/(lod_bench|meshopt_peer|ship_bench)\.cpp", r"tests/.*"),
    "assimp/": (r"bake/lab/assimp_peer\.cpp", r"tests/mesh/assimp_oracle\.cpp"),
    "tiny_obj_loader": (r"bake/lab/tinyobj_library\.hpp",),
    "bake/lab/tinyobj_library": (r"bake/lab/tinyobj_peer\.cpp", r"tests/import/tiny_obj\.cpp"),
    "curl/": (r"runtime/fetch/curl_downloader\.cpp",),
    "httplib.h": (r"bake/web/(http_reader|serve)\.cpp",),
    "openssl/": (r"bake/web/serve\.cpp",),
    "qrencode.h": (r"bake/web/serve\.cpp",),
    "SDL": (r"runtime/play/desk_.*\.cpp", r"tests/.*"),
    "png.h": (r"bake/image/png\.cpp",),
    "zlib.h": (r"bake/export/usdz_writer\.cpp",),
    "jpeglib.h": (r"bake/image/jpeg\.cpp",),
    "jerror.h": (r"bake/image/jpeg\.cpp",),
    "webp/": (r"bake/image/webp\.cpp",),
    "tiffio.h": (r"bake/image/tiff\.cpp",),
    "stb/": (r"bake/image/stb\.cpp",),
    "Eigen/": (r"(runtime|bake)/.*\.cpp", r"tests/.*"),
}
# Headers that code of the device never includes (Law 9): each one grows the player by hundreds of KB.
BANNED_ON_DEVICE = {"iostream", "fstream", "sstream", "ostream", "istream", "iomanip", "filesystem",
                    "locale", "regex", "codecvt"}
# Of the lab, what looks into the renderer.
INSIDE = (r"bake/lab/(render_bench|plain_shading)\.cpp",)
# Files of the runtime that a phone never builds.
DESK = (r"runtime/paper/.*", r"runtime/play/desk_.*")
TOP_LEVEL = {"bake", "runtime", "formats", "shaders", "assets", "tests", "scripts", "CMakeLists.txt",
             "CMakePresets.json", "README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md",
             "ISSUES.md"}
UNTRACKED_TOP_LEVEL = {"build", "out"}
# Functions whose last bit depends on the platform's libm, and what of Eigen calls them: the pose loop does without.
LIBM = re.compile(r"\b(?:(?:std|glm)::(?:a?sin|a?cos|a?tan2?|exp2?|log(?:2|10)?|pow|hypot|cbrt)f?\(|AngleAxis[df]?\b)")
BANNED_SYMBOLS = ("OpenMesh", "tinygltf", "draco", "2cv", "CLI11", "nlohmann")
BANNED_LIBRARIES = ("opencv", "OpenMesh", "draco", "tinygltf", "SDL", "assimp", "stdc++")


def matches(path, patterns):
    return any(re.fullmatch(p, path) for p in patterns)


def standard_header(name):
    return re.fullmatch(r"[a-z_0-9]+", name) is not None


# Rooms of the workstation from the bottom up: each includes those before it, and of its own rank itself only.
BAKE_ROOMS = (("bake", "bake/memory"), ("bake/image",), ("bake/import", "bake/video"), ("bake/mesh",),
              ("bake/texture", "bake/pattern"), ("bake/bundle", "bake/export", "bake/ship"), ("bake/web",), ("bake/check",), ("bake/page", "bake/project"), ("bake/commands",), ("bake/lab",))
RANK = {room: rank for rank, rooms in enumerate(BAKE_ROOMS) for room in rooms}
# Rooms with one header for all others.
DOORS = {"bake/pattern": "bake/pattern/pattern.hpp"}


def bake_room(path):
    """"bake/mesh/weld/a.cpp" -> "bake/mesh"; a file right under bake/ is of "bake"."""
    parts = path.split("/")
    return "/".join(parts[:2]) if len(parts) > 2 else parts[0]


def room_violations(path, name):
    here, there = bake_room(path), bake_room(name)
    if here == there or not path.startswith("bake/") or not name.startswith("bake/"):
        return
    if there not in RANK or here not in RANK:
        yield f"{there if there not in RANK else here} is no room of BAKE_ROOMS"
    elif RANK[there] >= RANK[here]:
        yield f"{here} lies below {there}, but includes '{name}'"
    elif there in DOORS and name != DOORS[there]:
        yield f"{there} is included through {DOORS[there]}, not '{name}'"


def include_violations(path, name):
    """Yields what is wrong with file `path` including `name`."""
    room = path.split("/")[0]
    yield from room_violations(path, name)
    for prefix, allowed in THIRD_PARTIES.items():
        if name.startswith(prefix) and not matches(path, allowed):
            yield f"'{name}' may be included by {', '.join(allowed)} only"
    target = name.split("/")[0]
    if room == "formats":
        fine = standard_header(name) or target == "formats" or name in ("tl/expected.hpp", "xxhash.h")
        posix = name in (
            "fcntl.h", "unistd.h", "sys/file.h", "sys/mman.h", "sys/stat.h", "sys/types.h")
        if not fine and not posix:
            yield f"formats/ includes the standard library, tl/expected.hpp and xxhash.h only, not '{name}'"
    if room == "runtime" and target == "bake":
        yield f"the runtime knows nothing of the bake, but includes '{name}'"
    if room == "bake" and target == "runtime" and not matches(path, INSIDE):
        yield f"the bake uses the runtime through its public headers <modar/...>, not '{name}'"
    if room in ("formats", "runtime") and not matches(path, DESK) and name in BANNED_ON_DEVICE:
        yield f"code of the device does not include <{name}>"


def check_includes(root):
    for room in ROOMS:
        for file in sorted((root / room).rglob("*")):
            if file.suffix not in SOURCES:
                continue
            path = file.relative_to(root).as_posix()
            text = file.read_text(encoding="utf-8", errors="replace")
            for name in INCLUDE.findall(text):
                for violation in include_violations(path, name):
                    yield f"{path}: {violation}"
            if path.startswith("runtime/track/"):
                for call in LIBM.findall(text):
                    yield f"{path}: {call} rounds differently from phone to phone; poses are the same everywhere"


def check_top_level(root):
    for entry in sorted(root.iterdir()):
        known = entry.name in TOP_LEVEL | UNTRACKED_TOP_LEVEL or entry.name.startswith(".")
        if not known:
            yield f"{entry.name}: does not belong at the top level"


def check_player(player):
    dynamic = subprocess.run(["readelf", "-d", player], capture_output=True, text=True, check=True).stdout
    for library in re.findall(r"NEEDED.*\[(.+)\]", dynamic):
        if any(banned in library for banned in BANNED_LIBRARIES):
            yield f"{player}: links {library}"
    symbols = subprocess.run(["nm", "-a", player], capture_output=True, text=True, check=True).stdout
    for banned in BANNED_SYMBOLS:
        hit = next((line for line in symbols.splitlines() if banned in line), None)
        if hit:
            yield f"{player}: holds {banned}: {hit.split()[-1]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--player")
    arguments = parser.parse_args()
    violations = list(check_includes(arguments.root)) + list(check_top_level(arguments.root))
    if arguments.player:
        violations += list(check_player(arguments.player))
    for violation in violations:
        print(violation)
    return 3 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
