"""The C API in Python, C# and Godot: what libmodar.so says there is what modar-play says."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

from programs import BIN, COVER, POTTERY, QUICK, ROOT, ProgramTest, demo_files

# scripts/test.sh builds it: without sanitizers, so that other programs can load it.
LIBRARY = ROOT / "build" / "device" / "runtime" / "capi"
HEADER = ROOT / "runtime" / "include" / "modar" / "modar.h"
PYTHON = ROOT / "runtime" / "extensions" / "python"
GODOT = ROOT / "runtime" / "extensions" / "godot"
GODOT_HEADERS = os.environ.get("MODAR_GODOT_HEADERS")
CSHARP = ROOT / "runtime" / "extensions" / "csharp"
WIDTH, HEIGHT = 480, 360


def interpreter():
    """A Python that has numpy."""
    for python in (sys.executable, "/usr/bin/python3"):
        if subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0:
            return python
    return None


@unittest.skipUnless((LIBRARY / "libmodar.so.0").exists(), "no libmodar.so: cmake --preset device, cmake --build --preset device")
class Languages(ProgramTest):
    def setUp(self):
        super().setUp()
        self.bundle = self.bake_demo()
        self.frames = self.folder / "frames.gray"
        subprocess.run(["ffmpeg", "-loglevel", "error", "-i", demo_files() / "clip" / "frame_%05d.png", "-pix_fmt", "gray", "-f", "rawvideo",
                        self.frames], check=True)
        played = self.run_program("modar-play", self.bundle, "--input", f"grey:{WIDTH}x{HEIGHT}:{self.frames}", "--json").stdout
        self.played = [(line["visible"] or [None])[0] for line in map(json.loads, played.splitlines()) if "frame" in line]
        # Programs of the tests have sanitizers, and the library has none.
        self.environment = {**{key: value for key, value in os.environ.items() if key != "LD_PRELOAD"}, "LD_LIBRARY_PATH": str(LIBRARY),
                            "PATH": f"{BIN}:{os.environ['PATH']}", "PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}

    def assert_runs(self, *words):
        done = subprocess.run([*map(str, words)], cwd=self.folder, env=self.environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def declare(self, language, path):
        path.write_text(self.assert_runs(sys.executable, ROOT / "scripts" / "bindings.py", language))

    def assert_poses(self, poses):
        """[visible, 9 numbers of the rotation, 3 of the translation] a frame, as floats."""
        self.assertEqual(len(poses), len(self.played))
        self.assertGreater(sum(1 for each in self.played if each), 6)
        for pose, played in zip(poses, self.played):
            self.assertEqual(bool(pose[0]), played is not None)
            if played:
                for got, wanted in zip(pose[1:], [*played["rotation"], *played["translation"]], strict=True):
                    self.assertAlmostEqual(got, wanted, delta=1e-6)

    def structure_sizes(self):
        """By the compiler."""
        names = re.findall(r"^\} (modar_\w+);", HEADER.read_text(), re.M)
        source = self.folder / "sizes.c"
        lines = "".join(f'printf("{name} %zu\\n", sizeof({name}));' for name in names)
        source.write_text(f"#include <stdio.h>\n#include <modar/modar.h>\nint main(void) {{ {lines} return 0; }}\n")
        self.assert_runs("cc", "-I", HEADER.parents[1], source, "-o", "sizes")
        return dict(line.split() for line in self.assert_runs("./sizes").splitlines())

    def test_python(self):
        python = interpreter()
        if not python:
            self.skipTest("python3-numpy is not installed")
        package = self.folder / "modar"
        shutil.copytree(PYTHON / "modar", package)
        shutil.copy(ROOT / "scripts" / "bundle_bytes.py", package)
        self.declare("python", package / "_capi.py")
        symbols = subprocess.run(["nm", "-D", "--defined-only", LIBRARY / "libmodar.so.0"], capture_output=True, text=True).stdout
        self.assertEqual(set(re.findall(r"library\.(\w+)\.restype", (package / "_capi.py").read_text())), set(re.findall(r" T (modar_\w+)", symbols)))
        (self.folder / "all.py").write_text(CHECKS)
        told = json.loads(self.assert_runs(python, "all.py", self.bundle, self.frames, POTTERY, json.dumps(QUICK), COVER))
        self.assertEqual({name: str(size) for name, size in told["sizes"].items()}, self.structure_sizes())
        self.assert_poses(told["poses"])
        self.assertEqual(told["wrong"], ["bundle.magic", 3, "cli.pattern", 1])
        with self.subTest("what the guide shows"):
            shutil.copy(POTTERY, self.folder / "vase.obj")
            shutil.copy(COVER, self.folder)
            text = re.search(r"```python\n(.*?)```", (PYTHON / "README.md").read_text(), re.DOTALL)[1]
            (self.folder / "guide.py").write_text(text.replace("scene=", "no_lods=True, loop_views=8, no_score=True, scene="))
            self.assertIn("['vase'] ['cover']", self.assert_runs(python, "guide.py"))
        with self.subTest("the trajectory"):
            if subprocess.run([python, "-c", "import matplotlib"], capture_output=True).returncode != 0:
                self.skipTest("python3-matplotlib is not installed")
            self.assertEqual(self.assert_runs(python, PYTHON / "example" / "trajectory.py", self.bundle, demo_files() / "clip" / "frame_%05d.png", "plot.png"),
                             f"{len(told['poses']) - 1} places\n")
            self.assertTrue((self.folder / "plot.png").read_bytes().startswith(b"\x89PNG"))

    @unittest.skipUnless(shutil.which("mcs") and shutil.which("mono"), "mono-mcs and mono-runtime are not installed")
    def test_csharp(self):
        self.declare("csharp", self.folder / "Modar.cs")
        sizes = self.structure_sizes()
        lines = "".join(f'System.Console.WriteLine("{name} {{0}}", sizeof(Modar.{name}));' for name in sizes)
        (self.folder / "Sizes.cs").write_text(f"unsafe static class Sizes {{ static void Main() {{ {lines} }} }}\n")
        for program, source in (("Poses", CSHARP / "example" / "Poses.cs"), ("Sizes", "Sizes.cs")):
            self.assert_runs("mcs", "-unsafe", f"-out:{program}.exe", source, "Modar.cs")
        self.assertEqual(dict(line.split() for line in self.assert_runs("mono", "Sizes.exe").splitlines()), sizes)
        told = self.assert_runs("mono", "Poses.exe", self.bundle, self.frames, WIDTH, HEIGHT).splitlines()
        self.assert_poses([list(map(float, line.split())) for line in told])
        failed = subprocess.run(["mono", "Poses.exe", self.frames, self.frames, str(WIDTH), str(HEIGHT)], cwd=self.folder, env=self.environment,
                                capture_output=True, text=True)
        self.assertEqual(failed.returncode, 3)
        self.assertIn("[bundle.magic]", failed.stderr)


    @unittest.skipUnless(GODOT_HEADERS and shutil.which("godot3-server"), "no godot3-server, or MODAR_GODOT_HEADERS does not name its headers")
    def test_godot(self):
        project = self.folder / "project"
        shutil.copytree(GODOT / "example", project)
        shutil.copy(self.bundle, project)
        shutil.copy(self.frames, project)
        self.assert_runs("cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-I", GODOT_HEADERS, "-I", HEADER.parents[1],
                         GODOT / "modar_godot.c", "-L", LIBRARY, "-lmodar", "-o", project / "libmodar_godot.so")
        self.environment["HOME"] = str(self.folder)
        told = self.assert_runs("godot3-server", "--path", project).splitlines()
        self.assertEqual([line for line in told if line.startswith(("found", "lost", "error"))], ["found cover"])
        places = [line.removeprefix("place ").partition(" ") for line in told if line.startswith("place ")]
        self.assertEqual(len(places), len(self.played))
        compared = 0
        for (shown, _, numbers), played in zip(places, self.played):
            if shown == "True" and played:
                x, y, z, origin = ([float(n) for n in part.split(",")] for part in re.findall(r"Vector3\(([^)]*)\)", numbers))
                stretch = played.get("stretch") or [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
                columns = [[sum(played["rotation"][3 * row + k] * stretch[4 * k + column] for k in range(3)) for row in range(3)] for column in range(4)]
                columns[3] = [a + b for a, b in zip(columns[3], played["translation"])]
                for column, wanted in zip((x, y, z, origin), columns, strict=True):
                    for got, number, sign in zip(column, wanted, (1, -1, -1), strict=True):
                        self.assertAlmostEqual(got, sign * number, delta=1e-4)
                compared += 1
        self.assertGreater(compared, 5)


CHECKS = """
import ctypes, json, sys
import modar
import numpy as np
from modar import _capi

path, frames, source, quick, cover = sys.argv[1:]
bundle = modar.Bundle(path)
bundle.verify()
gray = bundle.picture("cover")
assert gray.base is not None and not gray.flags.owndata and np.shares_memory(gray, bundle.bytes)
assert abs(gray.shape[1] / gray.shape[0] - 348 / 717) < 0.01
for chunk, vertices, indices in bundle.chunks("pottery"):
    assert np.shares_memory(vertices, bundle.bytes) and np.shares_memory(indices, bundle.bytes)
    assert indices.max() < len(vertices)
# The model's own file is the oracle of its box.
own = np.array([line.split()[1:4] for line in open(source) if line.startswith("v ")], float)
points, triangles = bundle.positions("pottery")
for got, wanted in ((points.min(0), own.min(0)), (points.max(0), own.max(0))):
    assert np.abs(got - wanted).max() < 1e-3 * np.ptp(own), (got, wanted)
assert triangles.max() < len(points)
blocks = bundle.texture_blocks(bundle.textures[0])
assert blocks.shape[2] == 8 and np.shares_memory(blocks, bundle.bytes)

tracker, poses = modar.Tracker(bundle, 480, 360), []
for frame in np.fromfile(frames, np.uint8).reshape(-1, 360, 480):
    tracker.step(frame)
    pose = modar.Pose(tracker._handle, 0)
    poses.append([pose.visible, *map(float, pose.rotation.ravel()), *map(float, pose.translation)])
seen = tracker.step(frame)
assert np.allclose(seen["cover"].view()[:3, 3] * (1, -1, -1), seen["cover"].translation, atol=0.05)
rgb = np.repeat(frame[..., None], 3, 2)
drawn = modar.Renderer(bundle, 480, 360).render(rgb, seen, tracker.camera)
plain = modar.Renderer(bundle, 480, 360).render(rgb, {}, tracker.camera)
assert np.abs(plain[..., :3].astype(int) - rgb).max() < 12
x, y = seen["cover"].corners.mean(0).astype(int)
assert np.abs(drawn[y - 9:y + 9, x - 9:x + 9, :3].astype(int) - plain[y - 9:y + 9, x - 9:x + 9, :3]).mean() > 8

def fault(work):
    try:
        work()
    except modar.ModarError as error:
        assert error.cause and error.cure
        return error
wrong = fault(lambda: modar.Bundle(frames))
no_width = fault(lambda: modar.bake("out.modar", pattern=cover + ":wide"))
sizes = {name: ctypes.sizeof(kind) for name, kind in vars(_capi).items() if name.startswith("modar_") and isinstance(kind, type)}
print(json.dumps({"poses": poses, "sizes": sizes, "wrong": [wrong.code, wrong.status, no_width.code, no_width.status]}))
"""


if __name__ == "__main__":
    unittest.main()
