"""Installed files: programs that run from there; the libraries, found by CMake and pkg-config; their headers."""
import csv
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from installed_headers import clang, declared_symbols, headers, program
from programs import BIN, CLIP_HEIGHT, CLIP_WIDTH, COVER, POTTERY, QUICK, ROOT, ProgramTest, demo_clip

sys.path.insert(0, str(ROOT / "assets"))
from kit import png  # noqa: E402

BUILD = BIN.parent
SANITIZE = os.environ.get("MODAR_SANITIZE", "")
FLAGS = [f"-fsanitize={SANITIZE}"] if SANITIZE else []
WIDTH, HEIGHT, FRAMES = CLIP_WIDTH, CLIP_HEIGHT, 6
# What bake_flags() models. The middle of the red one is that of the whole, (0, 0).
FLAGS_SHOWN = {"red": ((-1, -0.75), (0.6, -0.4), (0.2, 0.7)), "green": ((0.7, -0.5), (1, 0.75), (0.4, 0.75))}

# A project outside of the tree that links every function of the installed headers.
EVERYTHING = """
cmake_minimum_required(VERSION 3.22)
project(everything LANGUAGES CXX)
find_package(modar 0.1 REQUIRED COMPONENTS runtime fetch)
add_executable(everything everything.cpp)
target_link_libraries(everything PRIVATE modar::fetch modar::runtime)
"""

# Draws and never tracks, as its arguments say.
DRAW_ALONE = r"""
#include <modar/modar.h>
#include <stdio.h>
#include <string.h>
int main(int argc, char** argv) {
  modar_error e = {.size = sizeof e};
  modar_camera camera = {.size = sizeof camera};
  modar_camera_default(64, 48, &camera);
  static uint8_t rgba[64 * 48 * 4];
  char name[4] = "";
  if (argc < 3) return 9;
  if (modar_bundle_open("none.modar", &e) || e.status != MODAR_IO || strcmp(e.code, "io.open")) return 10;
  if (modar_bundle_verify(NULL, NULL) != 1 || modar_bundle_open(NULL, NULL) || modar_bundle_open_bytes(NULL, 1, NULL)) return 11;
  if (modar_renderer_create(NULL, NULL, 0, &e) || strcmp(e.code, "capi.null")) return 12;
  modar_context* context = modar_context_create(&e);
  modar_bundle* bundle = modar_bundle_open(argv[1], &e);
  if (!context || !bundle || modar_bundle_verify(bundle, &e)) return 13;
  if (modar_model_name(bundle, 0, name, sizeof name) != 7 || strcmp(name, "pot")) return 14;
  if (modar_model_name(bundle, 1, name, sizeof name) || modar_scene_at(bundle, 7, NULL)) return 15;
  if (modar_renderer_create(bundle, "nokia", 0, &e) || e.status != MODAR_USAGE) return 16;
  modar_renderer* renderer = modar_renderer_create(bundle, argv[2], 0, &e);
  if (!renderer || modar_renderer_resize(renderer, 64, 48, &e)) return 17;
  modar_item items[2] = {{.size = sizeof(modar_item), .to_eye = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -4, 1}}, {.size = sizeof(modar_item), .model = 99}};
  modar_drawing drawing = {.size = sizeof drawing, .camera = &camera, .items = items, .item_count = 2};
  modar_renderer_render(renderer, NULL, &drawing);
  modar_renderer_read_rgba(renderer, rgba);
  modar_render_stats stats = {.size = sizeof stats};
  modar_renderer_stats(renderer, &stats);
  int lit = 0;
  for (size_t i = 0; i < sizeof rgba; i += 4) lit += rgba[i] > 0;
  printf("%d %d\n", stats.draw_calls, lit);
  if (modar_renderer_restore(renderer, &e)) return 18;
  modar_renderer_destroy(renderer);
  modar_bundle_close(bundle);
  modar_context_destroy(context);
  return 0;
}
"""

# Draws all scenes of a bundle at once, as its arguments say: calls, triangles and pixels that are not black.
DRAW_SCENES = r"""
#include <modar/modar.h>
#include <stdio.h>
int main(int argc, char** argv) {
  static uint8_t rgba[64 * 48 * 4];
  modar_error e = {.size = sizeof e};
  modar_camera camera = {.size = sizeof camera};
  modar_camera_default(64, 48, &camera);
  modar_context* context = modar_context_create(&e);
  modar_bundle* bundle = modar_bundle_open(argv[1], &e);
  modar_renderer* renderer = bundle ? modar_renderer_create(bundle, argc > 2 ? argv[2] : NULL, 0, &e) : NULL;
  if (!renderer || modar_renderer_resize(renderer, 64, 48, &e)) return 10;
  /* Seen from above: the camera's y points down. */
  modar_pose pose = {.size = sizeof pose, .rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1}, .translation = {0, 0, 3}};
  modar_item items[16];
  size_t count = 0;
  modar_scene scene = {.size = sizeof scene};
  for (; count < 16 && modar_scene_at(bundle, (uint32_t)count, &scene); ++count) {
    items[count] = (modar_item){.size = sizeof items[0]};
    modar_item_place(&items[count], &scene, &pose);
  }
  modar_drawing drawing = {.size = sizeof drawing, .camera = &camera, .items = items, .item_count = count};
  modar_renderer_render(renderer, NULL, &drawing);
  modar_renderer_read_rgba(renderer, rgba);
  modar_render_stats stats = {.size = sizeof stats};
  modar_renderer_stats(renderer, &stats);
  int lit = 0;
  for (size_t i = 0; i < sizeof rgba; i += 4) lit += rgba[i] + rgba[i + 1] + rgba[i + 2] > 0;
  printf("%d %d %d\n", stats.draw_calls, (int)stats.triangles, lit);
  modar_renderer_destroy(renderer);
  modar_bundle_close(bundle);
  modar_context_destroy(context);
  return 0;
}
"""


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, **options)


class App(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.prefix = pathlib.Path(tempfile.mkdtemp(prefix="modar-prefix-"))
        cls.addClassCleanup(shutil.rmtree, cls.prefix, ignore_errors=True)
        for component in ("development", "library"):
            done = run("cmake", "--install", BUILD, "--prefix", cls.prefix, "--component", component, text=True)
            assert done.returncode == 0, done.stdout + done.stderr

    def build_example(self):
        """A copy of runtime/example, far from our tree."""
        project = self.folder / "project"
        shutil.copytree(ROOT / "runtime" / "example", project)
        flags = " ".join(["-std=c99 -Wall -Wextra -Wpedantic -Werror", *FLAGS])
        done = run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
                   f"-DCMAKE_C_FLAGS={flags}", f"-DCMAKE_EXE_LINKER_FLAGS={' '.join(FLAGS)}", text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = run("cmake", "--build", project / "build", text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return project / "build" / "overlay"

    def clip(self):
        """Frames of our cover in NV21, where its corners truly are, and the frames in RGB."""
        folder = demo_clip(self.folder / "clip", FRAMES)
        with (folder / "truth.csv").open() as file:
            truth = list(csv.DictReader(file))
        frames = {}
        for form in ("nv21", "rgb24"):
            done = run("ffmpeg", "-v", "error", "-pattern_type", "glob", "-i", folder / "*.png", "-vf",
                       "scale=out_range=full", "-pix_fmt", form, "-f", "rawvideo", "-", check=True)
            frames[form] = done.stdout
        return truth, frames["nv21"], frames["rgb24"]

    def assert_overlay(self, frame, rgba, rgb, centre):
        """A model in the middle of the pattern, the camera's picture in the frame's corners."""
        def far(x, y):
            i = y * WIDTH + x
            return max(abs(rgba[4 * i + c] - rgb[3 * i + c]) for c in range(3))

        size = 20
        ring = [far(x, y) for x in (*range(size), *range(WIDTH - size, WIDTH)) for y in range(size)]
        self.assertLess(sum(ring) / len(ring), 6, f"the picture of frame {frame}")
        if centre is None:
            return
        x, y = (round(v) for v in centre)
        middle = [far(u, v) for u in range(x - 4, x + 5) for v in range(y - 4, y + 5)]
        self.assertGreater(sum(middle) / len(middle), 20, f"the model of frame {frame}")

    def test_the_example_of_forty_lines(self):
        example = (ROOT / "runtime" / "example" / "overlay.c").read_text()
        self.assertLessEqual(len(example.splitlines()), 40)
        self.assertIn(f"```c\n{example}```", (ROOT / "runtime" / "README.md").read_text(), "the guide shows the program")
        overlay, bundle = self.build_example(), self.bake_demo()
        self.assertEqual(run(overlay).returncode, 1)
        # A program that gives up leaves its memory to the system.
        done = run(overlay, COVER, WIDTH, HEIGHT, env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}, text=True)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("bundle.magic", done.stderr)
        truth, nv21, rgb = self.clip()
        done = run(overlay, bundle, WIDTH, HEIGHT, input=nv21)
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = done.stderr.decode().splitlines()
        self.assertEqual(len(lines), FRAMES)
        self.assertEqual(len(done.stdout), FRAMES * WIDTH * HEIGHT * 4)
        found = 0
        for k, (line, row) in enumerate(zip(lines, truth)):
            seen, x, y, z = (float(word) for word in line.split())
            centre = None
            if seen:
                # The three floats put the pattern's middle where the diagonals of its corners meet.
                found += 1
                centre = WIDTH * x / z + (WIDTH - 1) / 2, WIDTH * y / z + (HEIGHT - 1) / 2
                self.assertLess(abs(centre[0] - diagonals(row)[0]) + abs(centre[1] - diagonals(row)[1]), 3)
            self.assert_overlay(k, done.stdout[k * WIDTH * HEIGHT * 4:], rgb[k * WIDTH * HEIGHT * 3:], centre)
        self.assertGreaterEqual(found, FRAMES - 2)

    def pkg_config(self, package):
        return run("pkg-config", "--cflags", "--libs", package, check=True, text=True,
                   env={**os.environ, "PKG_CONFIG_PATH": str(next(self.prefix.rglob("pkgconfig")))}).stdout.split()

    def link_by_pkg_config(self, symbols):
        source = self.folder / "everything.cpp"
        source.write_text(program(symbols))
        return run("c++", *FLAGS, "-o", self.folder / "everything", source, *self.pkg_config("modar-fetch"), text=True)

    @unittest.skipUnless(clang(), "clang, which parses the headers, is not installed")
    def test_every_function_of_every_installed_header_links(self):
        include = self.prefix / "include" / "modar"
        self.assertGreaterEqual(set(headers(include)), {"modar/modar.h", "modar/fetch.hpp", "formats/bundle_view.hpp"})
        symbols = declared_symbols(include, self.folder)
        names = run("c++filt", input="\n".join(symbols).encode()).stdout.decode()
        self.assertGreater(len(symbols), 100)
        for known in ("modar_tracker_step", "modar::BundleView::open(", "modar::fetch_release(", "modar::PoseLoop::~"):
            self.assertIn(known, names)
        done = self.link_by_pkg_config(symbols)
        self.assertEqual(done.returncode, 0, done.stderr)
        project = self.folder / "project"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(EVERYTHING)
        (project / "everything.cpp").write_text(program(symbols))
        for command in (["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
                         f"-DCMAKE_EXE_LINKER_FLAGS={' '.join(FLAGS)}"], ["cmake", "--build", project / "build"]):
            done = run(*command, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        # A function that no library has is found.
        planted = self.folder / "include"
        shutil.copytree(include, planted)
        (planted / "modar" / "planted.hpp").write_text("namespace modar { struct Planted { private: void nowhere(); }; }\n")
        more = declared_symbols(planted, self.folder)
        self.assertEqual(len(more), len(symbols) + 1)
        self.assertIn("Planted::nowhere", self.link_by_pkg_config(more).stderr)

    def test_installed_programs_run(self):
        place = self.folder / "usr"
        done = run("cmake", "--install", BUILD, "--prefix", place, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        bundle = self.folder / "installed.modar"
        for command in (["modar", "bake", "--model", POTTERY, "-o", bundle], ["modar", "check", bundle],
                        ["modar-play", "--help"], ["modar-fetch", "--help"]):
            done = run(place / "bin" / command[0], *command[1:], text=True)
            self.assertEqual(done.returncode, 0, f"{command}: {done.stderr}")

    def test_drawing_alone_carries_no_tracker(self):
        bundle = self.bake_demo()
        (self.folder / "draw.c").write_text(DRAW_ALONE)
        flags = self.pkg_config("modar")
        done = run("cc", "-Wall", "-Wextra", "-Werror", *FLAGS, "-o", self.folder / "draw", self.folder / "draw.c",
                   *flags, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        for device in ("desktop", "noext"):
            done = run(self.folder / "draw", bundle, device, cwd=self.folder, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            calls, lit = (int(word) for word in done.stdout.split())
            self.assertEqual(calls, 1)
            self.assertGreater(lit, 64 * 48 // 20)
        symbols = run("nm", "-C", self.folder / "draw", text=True, check=True).stdout
        carried = [part for part in ("modar::Renderer::render", "PoseLoop", "refine_pose") if part in symbols]
        self.assertEqual(carried, ["modar::Renderer::render"])


    def build_apps(self):
        project = self.folder / "apps"
        shutil.copytree(ROOT / "tests" / "cli" / "apps", project)
        flags = " ".join(["-Wall -Wextra -Wpedantic -Werror", *FLAGS])
        done = run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}",
                   f"-DCMAKE_C_FLAGS={flags}", f"-DCMAKE_CXX_FLAGS={flags}", text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = run("cmake", "--build", project / "build", text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return project / "build"

    def bake_flags(self):
        """Two triangles in red and green, flat, on our cover: its largest side is from -1 to 1 as it stands."""
        (self.folder / "flags.mtl").write_text("newmtl red\nKa 1 0 0\nKd 1 0 0\nnewmtl green\nKa 0 1 0\nKd 0 1 0\n")
        lines = ["# Z up", "mtllib flags.mtl", *(f"v {x} {y} 0" for triangle in FLAGS_SHOWN.values() for x, y in triangle),
                 "usemtl red", "f 1 2 3", "usemtl green", "f 4 5 6"]
        (self.folder / "flags.obj").write_text("\n".join(lines) + "\n")
        bundle = self.folder / "flags.modar"
        done = self.modar("bake", "--model", self.folder / "flags.obj", "--pattern", f"{COVER}:210mm", "-o", bundle,
                          "--quiet", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        return bundle

    def assert_over_the_hosts_picture(self, bundle, host):
        """A frame of 160x120, turned clockwise and scaled by 1.5 over a viewport of 150x240 at (9, 4) of 170x250."""
        angle = 0.5
        to_eye = [[math.cos(angle), 0, math.sin(angle), 0.1], [0, 1, 0, -0.15],
                  [-math.sin(angle), 0, math.cos(angle), -2.2], [0, 0, 0, 1]]
        done = run(host, bundle, *(to_eye[i % 4][i // 4] for i in range(16)))
        self.assertEqual(done.returncode, 0, done.stderr)

        def place(x, y):
            """Run manually: pinhole, a quarter turn, the scale, the crop; GL's rows go up."""
            eye = [row[0] * x + row[1] * y + row[3] for row in to_eye]
            u, v = 75.5 + 150 * eye[0] / -eye[2], 66.5 - 140 * eye[1] / -eye[2]
            return 9 + 1.5 * (120 - v) - 15, 4 + 240 - 1.5 * u

        shapes = {colour: [place(*corner) for corner in corners] for colour, corners in FLAGS_SHOWN.items()}
        seen = {"red": 0, "green": 0, "host": 0}
        for i in range(170 * 250):
            x, y = i % 170, i // 170
            depths = {colour: inside(x + 0.5, y + 0.5, shape) for colour, shape in shapes.items()}
            red, green, blue, alpha = done.stdout[4 * i:4 * i + 4]
            shown = next((colour for colour, depth in depths.items() if depth > 1), None)
            if shown is None and max(depths.values()) > -1:
                continue  # an edge
            if shown is None or not (9 <= x < 159 and 4 <= y < 244):
                shown = "host"
                self.assertEqual((red, green), (x, y))
                self.assertIn(blue, (127, 128))
            else:
                self.assertEqual((red > 100, green > 100, blue), (shown == "red", shown == "green", 0), (x, y))
            self.assertEqual(alpha, 255)
            seen[shown] += 1
        self.assertGreater(min(seen.values()), 1500, seen)

    def assert_is_the_cover(self, wide, high, grays):
        """The means of eight by eight pixels of the pattern's picture are those of the file's same places."""
        cover = png.read(COVER)
        self.assertAlmostEqual(wide / high, cover.width / cover.height, delta=0.01)
        for i, gray in enumerate(grays):
            x, y = ((2 * at + 1) * side // 8 for at, side in ((i % 4, wide), (i // 4, high)))
            columns = range(round((x - 4) * cover.width / wide), round((x + 4) * cover.width / wide))
            rows = range(round((y - 4) * cover.height / high), round((y + 4) * cover.height / high))
            places = [3 * (cover.width * row + column) for row in rows for column in columns]
            mean = sum(0.299 * cover.pixels[at] + 0.587 * cover.pixels[at + 1] + 0.114 * cover.pixels[at + 2] for at in places)
            self.assertAlmostEqual(gray, mean / len(places), delta=6, msg=f"cell {i}")

    def assert_asks_of_c(self, bundle, phone):
        truth, nv21, _ = self.clip()
        asset = self.folder / "app.apk"  # an asset is at a multiple of 4
        asset.write_bytes(b"x" * 12 + bundle.read_bytes() + b"tail")
        done = run(phone, asset, 12, bundle.stat().st_size, WIDTH, HEIGHT, input=nv21)
        self.assertEqual(done.returncode, 0, done.stderr)
        width, picture, *poses, pick = (line.split() for line in done.stdout.decode().splitlines())
        self.assertEqual(width, ["width_mm", "210"])
        self.assert_is_the_cover(*map(float, picture[1:3]), list(map(float, picture[3:])))
        self.assertEqual(len(poses), FRAMES)
        _, visible, fit, *place = (float(word) if word != "pose" else word for word in poses[-1])
        self.assertEqual(visible, 1)
        self.assertTrue(0.3 < fit <= 1, fit)
        x, y = (WIDTH * place[i] / place[2] + (side - 1) / 2 for i, side in enumerate((WIDTH, HEIGHT)))
        self.assertLess(abs(x - diagonals(truth[-1])[0]) + abs(y - diagonals(truth[-1])[1]), 3)
        # The tap went to the pattern's middle, on which the model is.
        distance, *point = (float(word) for word in pick[1:])
        self.assertAlmostEqual(distance, math.hypot(*place), delta=0.01)
        self.assertLess(math.hypot(*point), 0.01)

    def test_ten_scenes_of_a_model_are_two_calls(self):
        """The models in one call and their shadows in another, with instances and, masked as a Mali-400, without."""
        (self.folder / "roof.obj").write_text("v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 1 1 1\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n")
        (self.folder / "draw.c").write_text(DRAW_SCENES)
        done = run("cc", "-std=c99", "-Wall", "-Wextra", "-Werror", self.folder / "draw.c", "-o", self.folder / "draw",
                   *self.pkg_config("modar"), *FLAGS, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        drawn = {}
        for scenes in (1, 10):
            words = [word for k in range(scenes) for word in
                     ("--scene", f"cover=roof,scale=0.1,offset={k % 5 * 30 - 60}mm:{k // 5 * 60 - 30}mm:0mm")]
            done = self.modar("bake", "--model", "roof.obj", "--pattern", f"{COVER}:210mm", *QUICK, *words, "-o", f"{scenes}.modar")
            self.assertEqual(done.returncode, 0, done.stderr)
            for device in ((), ("mali400",)):
                done = run(self.folder / "draw", self.folder / f"{scenes}.modar", *device, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                drawn[scenes, device] = [int(word) for word in done.stdout.split()]
        for device in ((), ("mali400",)):
            one, ten = drawn[1, device], drawn[10, device]
            self.assertEqual((one[:2], ten[:2]), ([2, 4], [2, 40]), device)
            self.assertGreater(ten[2], 6 * one[2], device)

    def test_two_apps_outside_of_the_tree(self):
        apps, bundle = self.build_apps(), self.bake_flags()
        self.assert_over_the_hosts_picture(bundle, apps / "host")
        self.assert_asks_of_c(bundle, apps / "phone")

    def test_the_headers_name_their_standard(self):
        for header in ("renderer", "pose_loop"):
            (self.folder / "old.cpp").write_text(f"#include <modar/{header}.hpp>\n")
            done = run("c++", "-std=c++17", "-fsyntax-only", self.folder / "old.cpp", *self.pkg_config("modar"), text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("need C++20", done.stderr)


def inside(x, y, triangle):
    """Distance to the nearest side's line, negative outside; in pixels."""
    sides = []
    for (ax, ay), (bx, by) in zip(triangle, (*triangle[1:], triangle[0])):
        sides.append(((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / math.hypot(bx - ax, by - ay))
    (ax, ay), (bx, by), (cx, cy) = triangle
    clockwise = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0
    return min(-side if clockwise else side for side in sides)


def diagonals(row):
    """Where the diagonals of a row of truth.csv meet."""
    x0, y0, x1, y1, x2, y2, x3, y3 = (float(row[key]) for key in list(row)[1:9])
    ax, ay, bx, by = x2 - x0, y2 - y0, x3 - x1, y3 - y1
    s = ((x1 - x0) * by - (y1 - y0) * bx) / (ax * by - ay * bx)
    return x0 + s * ax, y0 + s * ay


if __name__ == "__main__":
    unittest.main()
