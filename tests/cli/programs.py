"""Where the programs and assets under test are, and how the tests of this folder call them."""
import atexit
import functools
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from random import Random

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
BIN = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin"))
POTTERY = ROOT / "assets" / "models" / "pottery.obj"
STATUE = ROOT / "assets" / "models" / "statue.obj"
COVER = ROOT / "assets" / "patterns" / "cover.png"
EXTENSIONS = os.environ.get("MODAR_EXTENSIONS", "web,adopt,report,studio,lab,python,paper,android").split(",")


def needs(extension):
    """Skips a test where CMake built without the extension."""
    return unittest.skipUnless(extension in EXTENSIONS, f"built without the extension {extension}")



# The clip of demo_files(); in one frame the cover is gone.
CLIP_WIDTH, CLIP_HEIGHT, CLIP_FRAMES, CLIP_GONE = 480, 360, 12, 6
# Few views of a pattern: enough for tests.
QUICK = ["--loop-views", "8", "--no-score"]
# Frames of covered_clip(), and how the camera might have turned before each: radians, exact in few decimals.
SEEN, COVERED = 18, 8
TURNS = [[Random(3 * i + axis).randrange(-8, 9) / 4096 for axis in range(3)] for i in range(SEEN + COVERED)]

# A gyroscope's readings, [milliseconds, degrees a second]: rising by one a millisecond; half a second later two more. By how many
# degrees it turned in some spans, by geometry: the area under straight lines, the last reading for at most 100 ms more.
READINGS = [[10 * i, 10 * i] for i in range(1, 11)] + [[600, 50], [610, 50]]
TURNED = {(15, 95): 4.4, (25, 35): 0.3, (105, 150): 4.5, (605, 655): 2.5, (5, 50): None, (50, 400): None, (300, 609): None,
          (605, 711): None}


def write_png(path, width, rows, kind=0):
    """rows: bytes of samples of 8 bits; kind: PNG's colour type."""
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), 8, kind, 0, 0, 0)),
              (b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks))


def picture(path, width=200, height=150, mirrored=False):
    """A PNG of gray rectangles, small enough to be a pattern in no time; or its mirror image."""
    random = Random(7)
    rows = [bytearray([128] * width) for _ in range(height)]
    for _ in range(150):
        x, y, shade = random.randrange(width), random.randrange(height), random.randrange(256)
        for row in rows[y:y + random.randrange(4, 20)]:
            row[x:x + 16] = bytes([shade] * len(row[x:x + 16]))
    if mirrored:
        rows = [row[::-1] for row in rows]
    write_png(path, width, rows)


def covered_clip(path, width=640, height=480):
    """Gray frames of our cover on a wall that the camera goes along; in the last COVERED of them something is over the cover."""
    wall = path.with_suffix(".wall")
    columns, rows = width * 3 // 16, height * 5 // 32
    wall.write_bytes(Random(7).randbytes(columns * rows))
    graph = (f"[0]scale={8 * columns}:{8 * rows}:flags=bilinear,format=gray,loop=-1:1[wall];[1]scale={width * 2 // 5}:-2:flags=area,"
             "format=gray[cover];[wall][cover]overlay=(W-w)/2:(H-h)/2:format=auto,format=gray,drawbox=x=iw*0.3:y=ih*0.2:w=iw*0.4:"
             f"h=ih*0.6:color=gray:t=fill:enable='gte(n,{SEEN})',crop={width}:{height}:x='n*8':y='(in_h-out_h)/2+n'")
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{columns}x{rows}", "-i", wall, "-i", COVER,
                    "-filter_complex", graph, "-frames:v", str(SEEN + COVERED), "-pix_fmt", "gray", "-f", "rawvideo", path], check=True)


def write_turns(path, turns):
    """For `modar-play --gyro`."""
    path.write_text("".join("{:.12f} {:.12f} {:.12f}\n".format(*turn) for turn in turns))


def make_demo_files(folder):
    """demo.modar, pottery on the cover (levels of detail have tests of their own), and clip/, a hand that holds the cover."""
    done = subprocess.run([BIN / "modar", "bake", "--model", POTTERY, "--pattern", COVER, "-o", folder / "demo.modar", "--quiet",
                           "--no-lods", *QUICK], capture_output=True, text=True)
    if (done.returncode, done.stderr) != (0, ""):
        raise AssertionError(done.stderr)
    subprocess.run([sys.executable, ROOT / "assets" / "make_clip.py", "--pattern", COVER, "--frames", str(CLIP_FRAMES), "--size",
                    f"{CLIP_WIDTH}x{CLIP_HEIGHT}", folder / "clip"], check=True)


@functools.cache
def demo_files():
    """The folder that CTest's demo_files filled for all tests; for a test that is run manually, one of its own."""
    if "MODAR_DEMO_FILES" in os.environ:
        return pathlib.Path(os.environ["MODAR_DEMO_FILES"])
    folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-demo-"))
    atexit.register(shutil.rmtree, folder)
    make_demo_files(folder)
    return folder


def demo_clip(folder, frames=CLIP_FRAMES):
    """frame_*.png and truth.csv as make_clip.py writes them: a number of frames around the one without the cover."""
    first, clip = CLIP_GONE - frames // 2, demo_files() / "clip"
    truth = (clip / "truth.csv").read_text().splitlines(keepends=True)
    folder.mkdir()
    for i in range(frames):
        shutil.copy(clip / f"frame_{first + i:05d}.png", folder / f"frame_{i:05d}.png")
        truth[1 + i] = f"{i},{truth[1 + first + i].partition(',')[2]}"
    (folder / "truth.csv").write_text("".join(truth[:1 + frames]))
    return folder


PROJECT = """
[project]
name = "demo"
[bake]
loop-views = 8
score = false
lods = 1
parameters = "none"
[[model]]
file = "pottery.obj"
[[pattern]]
file = "cover.png"
[[scene]]
pattern = "cover"
model = "pottery"
"""


def mount_fat(test):
    """The folder of a FAT file system, which has no links and no permissions, or skips the test."""
    image, mount = test.folder.with_name(test.folder.name + ".img"), test.folder.with_name(test.folder.name + "-fat")
    made = shutil.which("mkfs.vfat", path="/sbin:/usr/sbin:/bin:/usr/bin")
    if not made:
        test.skipTest("mkfs.vfat is not installed")
    mount.mkdir()
    test.addCleanup(mount.rmdir)
    test.addCleanup(image.unlink)
    with open(image, "wb") as file:
        file.truncate(64 << 20)
    subprocess.run([made, image], check=True, capture_output=True)
    ways = [["mount", "-o", "loop", image, mount], ["fusefat", "-o", "rw+", image, mount]]
    if not any(shutil.which(way[0]) and subprocess.run(way, capture_output=True).returncode == 0 for way in ways):
        test.skipTest("no right to mount a FAT image, and fusefat is not installed or fails")
    test.addCleanup(subprocess.run, ["umount", mount])
    return mount


class ProgramTest(unittest.TestCase):
    """A test with a folder of its own, removed afterwards."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-test-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def run_program(self, name, *arguments, env=None, cwd=None):
        return subprocess.run([str(BIN / name), *map(str, arguments)], capture_output=True, text=True,
                              env={**os.environ, **(env or {})}, cwd=cwd or self.folder)

    def modar(self, *arguments, **options):
        return self.run_program("modar", *arguments, **options)

    def lab(self, *arguments, **options):
        return self.run_program("modar-lab", *arguments, **options)

    def lab_json(self, *arguments, **options):
        done = self.lab(*arguments, "--json", **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def modar_json(self, *arguments, **options):
        done = self.modar(*arguments, "--json", **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def assert_fails(self, done, code, *words):
        """The exit code, words on stderr, nothing on stdout."""
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        for word in words:
            self.assertIn(word, done.stderr)

    def bake_demo(self, name="demo.modar"):
        """Pottery on the cover."""
        return pathlib.Path(shutil.copyfile(demo_files() / "demo.modar", self.folder / name))

    def bake_project(self, texts, cover=COVER):
        """The same by modar.toml, with lines of the scene's texts; or on another file that is named cover.png."""
        folder = self.folder / "project"
        folder.mkdir(exist_ok=True)
        for file in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png"), cover):
            shutil.copy(file, folder)
        (folder / "modar.toml").write_text(PROJECT + texts)
        done = self.modar("bake", "--quiet", cwd=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        return folder / "out" / "demo.modar"
