#!/usr/bin/env python3
"""Holds the tree against the laws of the house (CONTRIBUTING.md): who may include whom, what the player may link, the top level's contents.

  scripts/check_laws.py [--root DIR] [--player FILE]
  scripts/check_laws.py --rooms

--player: a linked modar-play of the preset `device`, whose symbols and libraries are looked at.
--rooms: prints the rooms from the top down, with their doors and who comes through them.
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
    r"bake/pattern/.*\.cpp", r"bake/extensions/lab/.*\.cpp", r"bake/pattern/gray_mat\.hpp",
    r"runtime/opencv/.*\.(cpp|hpp)", r"runtime/extensions/paper/.*\.cpp", r"runtime/play/desk_.*\.cpp", r"tests/.*",
)
THIRD_PARTIES = {
    "opencv2/": OPENCV_FILES,
    "OpenMesh/": (r"bake/mesh/repair/half_edges\.cpp", r"tests/.*"),
    "draco/": (r"bake/[a-z_/]*draco[a-z_]*\.cpp", r"tests/.*"),
    "tiny_gltf": (r"bake/(import/gltf|export)/(glb|gltf)_[a-z_]*\.cpp", r"bake/import/gltf/tinygltf_library\.[ch]pp",
                  r"tests/.*"),
    "bake/import/gltf/tinygltf_library": (r"bake/(import/gltf|export)/[a-z_]*gl(b|tf)[a-z_]*\.cpp",),
    "toml++/": (r"bake/project/project_file\.cpp",),
    "CLI/": (r"bake/commands/command_line\.cpp",),
    "nlohmann/": (r"bake/json\.cpp", r"tests/.*"),
    "rapidjson/": (r"runtime/play/desk_golden\.cpp",
                   r"runtime/fetch/(release|store)\.cpp", r"tests/.*"),
    "sodium.h": (r"runtime/fetch/release\.cpp", r"bake/ship/keys/keys\.cpp"),
    "zstd.h": (r"runtime/fetch/piece\.cpp",
               r"bake/ship/recipe_maker\.cpp", r"bake/extensions/lab/ship_bench\.cpp", r"tests/.*"),
    "meshoptimizer": (r"bake/import/gltf/gltf_meshopt\.cpp", r"bake/mesh/lod/reduce\.cpp",
                      r"bake/extensions/lab/(lod_bench|meshopt_peer|ship_bench)\.cpp", r"tests/.*"),
    "assimp/": (r"bake/extensions/lab/assimp_peer\.cpp", r"tests/mesh/assimp_oracle\.cpp"),
    "tiny_obj_loader": (r"bake/extensions/lab/tinyobj_library\.hpp",),
    "bake/extensions/lab/tinyobj_library": (r"bake/extensions/lab/tinyobj_peer\.cpp", r"tests/import/tiny_obj\.cpp"),
    "curl/": (r"runtime/fetch/curl_downloader\.cpp",),
    "httplib.h": (r"bake/ship/http/http_reader\.cpp", r"bake/extensions/web/serve\.cpp", r"bake/extensions/studio/server\.cpp"),
    "openssl/": (r"bake/extensions/web/serve\.cpp",),
    "qrencode.h": (r"bake/extensions/web/serve\.cpp",),
    "SDL": (r"runtime/play/desk_.*\.cpp", r"tests/.*"),
    "png.h": (r"bake/image/png\.cpp",),
    "zlib.h": (r"bake/export/usdz_writer\.cpp",),
    "minizip/": (r"bake/extensions/studio/archive\.cpp",),
    "jpeglib.h": (r"bake/image/jpeg\.cpp", r"tests/image/.*"),
    "jerror.h": (r"bake/image/jpeg\.cpp",),
    "webp/": (r"bake/image/webp\.cpp",),
    "lcms2.h": (r"bake/image/colour_profile\.cpp",),
    "tiffio.h": (r"bake/image/tiff\.cpp",),
    "stb/": (r"bake/image/stb\.cpp",),
    "Eigen/": (r"(runtime|bake)/.*\.cpp", r"tests/.*"),
}
# Headers that code of the device never includes (Law 9): each one grows the player by hundreds of KB.
BANNED_ON_DEVICE = {"iostream", "fstream", "sstream", "ostream", "istream", "iomanip", "filesystem",
                    "locale", "regex", "codecvt"}
# Takes the place of files in many rooms, and includes their headers.
WASM = "bake/extensions/wasm/"
# Of the lab, what looks into the renderer.
INSIDE = (r"bake/extensions/lab/(render_bench|plain_shading)\.cpp",)
# Files of the runtime that a phone never builds.
DESK = (r"runtime/opencv/.*", r"runtime/extensions/paper/.*", r"runtime/play/desk_.*")
TOP_LEVEL = {"bake", "runtime", "formats", "shaders", "assets", "tests", "scripts", "CMakeLists.txt",
             "CMakePresets.json", "README.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md",
             "ISSUES.md"}
UNTRACKED_TOP_LEVEL = {"build", "out"}
# Functions whose last bit depends on the platform's libm, and what of Eigen calls them: the pose loop does without.
LIBM = re.compile(r"\b(?:(?:std|glm)::(?:a?sin|a?cos|a?tan2?|exp2?|log(?:2|10)?|pow|hypot|cbrt)f?\(|AngleAxis[df]?\b)")
# Of C++20, what the C++ library of Debian's emscripten lacks; use formats/base/ranges.hpp. Desks alone build the rest.
LACKED = re.compile(r"\bstd::(?:ranges::\w+|views::\w+|bit_cast|atomic_ref|make_unique_for_overwrite)")
DESKS_ALONE = r"formats/base/ranges\.hpp|runtime/(?:play|fetch/curl_).*|(?:bake|runtime)/extensions/(?:lab|python|paper|android)/.*"
BANNED_SYMBOLS = ("OpenMesh", "tinygltf", "draco", "2cv", "CLI11", "nlohmann")
BANNED_LIBRARIES = ("opencv", "OpenMesh", "draco", "tinygltf", "SDL", "assimp", "stdc++")


def matches(path, patterns):
    return any(re.fullmatch(p, path) for p in patterns)


def standard_header(name):
    return re.fullmatch(r"[a-z_0-9]+", name) is not None


# Rooms of the workstation from the bottom up: each includes those before it, and of its own rank itself only.
BAKE_ROOMS = (("bake/process",), ("bake", "bake/memory"), ("bake/io",), ("bake/image",), ("bake/import", "bake/video"), ("bake/mesh",),
              ("bake/texture", "bake/pattern"), ("bake/options",), ("bake/bundle", "bake/export", "bake/ship"),
              ("bake/check",), ("bake/project",), ("bake/commands",), ("bake/extensions/web", "bake/extensions/adopt", "bake/extensions/report"), ("bake/extensions/studio",), ("bake/extensions/wasm",), ("bake/extensions/lab",))
RANK = {room: rank for rank, rooms in enumerate(BAKE_ROOMS) for room in rooms}
# The doors of the rooms: the headers that other rooms may include. Those of bake/memory and below
# are for all. The lab measures the inside, and may include everything below it; what it alone
# includes is no door.
DOORS = {
    "bake": ("json.hpp", "report.hpp", "up_axis.hpp"),
    "bake/io": ("input.hpp", "output.hpp", "terminal.hpp"),
    "bake/process": ("process.hpp",),
    "bake/memory": ("array.hpp", "memory_limit.hpp"),
    "bake/image": ("image.hpp", "resample.hpp", "difference.hpp"),
    "bake/import": ("read_model.hpp", "source_model.hpp", "gltf/tinygltf_library.hpp"),
    "bake/video": ("video.hpp", "encode_video.hpp"),
    "bake/mesh": ("tri_mesh.hpp", "upright.hpp", "draw_order.hpp"),
    "bake/mesh/clip": ("movement.hpp",),
    "bake/mesh/weld": ("weld.hpp", "triangulate.hpp"),
    "bake/mesh/repair": ("repair.hpp",),
    "bake/mesh/rays": ("triangle_tree.hpp", "occlusion.hpp"),
    "bake/mesh/pack": ("pack.hpp", "chunk.hpp", "vertex_codec.hpp"),
    "bake/mesh/lod": ("mesh_levels.hpp", "reduce.hpp"),
    "bake/texture": ("texture.hpp", "texture_codec.hpp", "texture_stage.hpp"),
    "bake/texture/atlas": ("atlas.hpp",),
    "bake/texture/relief": ("relief.hpp",),
    "bake/pattern": ("pattern.hpp", "alike_patterns.hpp", "score.hpp"),
    "bake/options": ("request.hpp", "request_text.hpp", "options.hpp"),
    "bake/bundle": ("bundle_builder.hpp", "bundle_json.hpp", "link_bundles.hpp"),
    "bake/bundle/files": ("sorted_files.hpp",),
    "bake/bundle/scene": ("scene_placement.hpp", "scene_nodes.hpp", "scene_shadow.hpp"),
    "bake/export": ("extract.hpp", "model_file.hpp", "room_models.hpp"),
    "bake/ship": ("publish.hpp", "release_folder.hpp", "verify_release.hpp"),
    "bake/ship/http": ("http_reader.hpp",),
    "bake/ship/mesh": ("mesh_pieces.hpp",),
    "bake/ship/keys": ("keys.hpp", "root_draft.hpp"),
    "bake/extensions/web": ("site.hpp", "serve.hpp"),
    "bake/extensions/adopt": (),
    "bake/check": ("verdict.hpp", "text_check.hpp"),
    "bake/check/content": ("content_check.hpp",),
    "bake/check/device": ("device_rules.hpp", "device_file.hpp"),
    "bake/check/source": ("source_check.hpp", "reproduce.hpp", "second_check.hpp"),
    "bake/check/picture": ("visual_check.hpp", "pose_check.hpp", "reference_renderer.hpp"),
    "bake/extensions/report": ("model_pictures.hpp",),
    "bake/project": ("project.hpp", "project_edit.hpp"),
    "bake/extensions/studio": (),
    "bake/extensions/wasm": (),
    "bake/commands": ("command_line.hpp", "commands.hpp"),
    "bake/extensions/lab": (),
    # Of the runtime, apps and rooms come through runtime/include and runtime/fetch/include.
    "runtime/platform": ("command_line.hpp", "lap_clock.hpp", "semaphore.hpp"),
    "runtime/platform/gl": ("extension_list.hpp",),
    "runtime/track": (),
    "runtime/record": (),
    "runtime/arrive": (),
    "runtime/render": (),
    "runtime/opencv": ("features.hpp", "opencv_bridge.hpp"),
    "runtime/extensions/paper": (),
    "runtime/play": (),
    "runtime/capi": (),
    "runtime/fetch": (),
    "runtime/extensions/android": (),
    "runtime/extensions/web": (),
}
# Extensions, each with an option of CMake: only extensions and tests include them.
EXTENSIONS = ("bake/extensions/web", "bake/extensions/adopt", "bake/extensions/report", "bake/extensions/studio", "bake/extensions/wasm", "bake/extensions/lab", "runtime/extensions/paper", "runtime/extensions/web", "runtime/extensions/android")
# Larger rooms are divided rather than given more doors.
MOST_DOORS = 3


def bake_room(path):
    """"bake/pattern/a.cpp" -> "bake/pattern", "bake/mesh/weld/a.cpp" -> "bake/mesh/weld", which is a room within bake/mesh;
    a file right under bake/ is of "bake"."""
    parts = path.split("/")
    if "/".join(parts[:3]) in DOORS or parts[1:2] == ["extensions"]:
        return "/".join(parts[:3])
    return "/".join(parts[:2]) if len(parts) > 2 else parts[0]


def door_violations(path, name):
    """Of a room's header that is no door of it, included by another room; tests and the lab look inside."""
    here, there = bake_room(path), bake_room(name)
    if here == there or name.split("/")[0] not in ("bake", "runtime") or path.startswith(("tests/", "bake/extensions/lab/", WASM)):
        return
    if here.count("/") == 2 and here.rsplit("/", 1)[0] == there:  # a room within a room knows it
        return
    if there in ("runtime/include", "runtime/fetch/include"):
        return
    if there not in DOORS:
        yield f"{there} is no room of DOORS"
    elif name.removeprefix(there + "/") not in DOORS[there]:
        doors = ", ".join(DOORS[there]) or "none"
        yield f"'{name}' is no door of {there}, which has: {doors}"


def door_table_violations(root):
    """Of the table itself: doors that nobody has, and too many of them."""
    for room, doors in DOORS.items():
        if len(doors) > MOST_DOORS:
            yield f"{room}: has {len(doors)} doors, at most {MOST_DOORS} are allowed"
        for door in doors:
            if (root / "CMakeLists.txt").exists() and not (root / room / door).exists():
                yield f"{room}: its door {door} does not exist"


def print_rooms(root):
    """The rooms from the top down, each with its doors and the rooms that come through them."""
    guests = {}
    for top in ("bake", "runtime"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in SOURCES:
                continue
            path = file.relative_to(root).as_posix()
            for name in INCLUDE.findall(file.read_text(encoding="utf-8", errors="replace")):
                if name.startswith(("bake/", "runtime/")) and bake_room(name) != bake_room(path):
                    guests.setdefault(name, set()).add(bake_room(path))
    tops = [room for rooms in reversed(BAKE_ROOMS) for room in rooms] + [room for room in DOORS if room.startswith("runtime/")]
    order = [inner for top in tops for inner in DOORS if inner == top or house_of(inner) == top]
    for room in order:
        print(room)
        for door in DOORS.get(room, ()):
            through = sorted(guests.get(f"{room}/{door}", ()))
            print(f"  {door:32} {', '.join(through)}")


def house_of(room):
    """"bake/mesh/weld" -> "bake/mesh"; rooms in no other are their own, and so is bake/io."""
    return room if "/extensions/" in room else "/".join(room.split("/")[:2])


def room_violations(path, name):
    here, there = house_of(bake_room(path)), house_of(bake_room(name))
    if here == there or not path.startswith("bake/") or not name.startswith("bake/"):
        return
    if there not in RANK or here not in RANK:
        yield f"{there if there not in RANK else here} is no room of BAKE_ROOMS"
    elif RANK[there] >= RANK[here]:
        yield f"{here} is below {there}, but includes '{name}'"


def extension_violations(path, name):
    there = next((room for room in EXTENSIONS if name.startswith(room + "/")), None)
    if there and not path.startswith(("tests/", *(room + "/" for room in EXTENSIONS))):
        yield f"the core includes '{name}' of the extension {there}"


def include_violations(path, name):
    """Yields the faults of file `path` including `name`."""
    room = path.split("/")[0]
    yield from room_violations(path, name)
    yield from door_violations(path, name)
    yield from extension_violations(path, name)
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
            if room != "tests" and not re.fullmatch(DESKS_ALONE, path):
                for lacked in LACKED.findall(re.sub(r"//.*", "", text)):
                    yield f"{path}: emscripten has no {lacked}; see formats/base/ranges.hpp"
            if path.startswith(("runtime/track/", "runtime/record/")):
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
    parser.add_argument("--rooms", action="store_true")
    arguments = parser.parse_args()
    if arguments.rooms:
        print_rooms(arguments.root)
        return 0
    violations = [*check_includes(arguments.root), *check_top_level(arguments.root), *door_table_violations(arguments.root)]
    if arguments.player:
        violations += list(check_player(arguments.player))
    for violation in violations:
        print(violation)
    return 3 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
