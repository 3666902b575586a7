"""Where the programs and assets under test are, and how the tests of this folder call them."""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib
from random import Random

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
BIN = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin"))
POTTERY = ROOT / "assets" / "models" / "pottery.obj"
STATUE = ROOT / "assets" / "models" / "statue.obj"
COVER = ROOT / "assets" / "patterns" / "cover.png"


# Few views of a pattern: enough for tests.
QUICK = ["--loop-views", "8", "--no-score"]
# Frames of covered_clip(), and how the camera might have turned before each: radians, exact in few decimals.
SEEN, COVERED = 18, 8
TURNS = [[Random(3 * i + axis).randrange(-8, 9) / 4096 for axis in range(3)] for i in range(SEEN + COVERED)]

# A gyroscope's readings, [milliseconds, degrees a second]: rising by one a millisecond; half a second later two more. By how many
# degrees it turned in some spans, by hand: the area under straight lines, the last reading for at most 100 ms more.
READINGS = [[10 * i, 10 * i] for i in range(1, 11)] + [[600, 50], [610, 50]]
TURNED = {(15, 95): 4.4, (25, 35): 0.3, (105, 150): 4.5, (605, 655): 2.5, (5, 50): None, (50, 400): None, (300, 609): None,
          (605, 711): None}


def picture(path, width=200, height=150):
    """A PNG of gray rectangles, small enough to be a pattern in no time."""
    random = Random(7)
    rows = [bytearray([128] * width) for _ in range(height)]
    for _ in range(150):
        x, y, shade = random.randrange(width), random.randrange(height), random.randrange(256)
        for row in rows[y:y + random.randrange(4, 20)]:
            row[x:x + 16] = bytes([shade] * len(row[x:x + 16]))
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)),
              (b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks))


def covered_clip(path, width=640, height=480):
    """Gray frames of our cover on a wall that the camera goes along; in the last COVERED of them something lies over the cover."""
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


class ProgramTest(unittest.TestCase):
    """A test with a folder of its own, removed afterwards."""

    demo = []  # the bytes of bake_demo()

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-test-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def run_program(self, name, *arguments, env=None, cwd=None):
        return subprocess.run([str(BIN / name), *map(str, arguments)], capture_output=True, text=True,
                              env={**os.environ, **(env or {})}, cwd=cwd or self.folder)

    def modar(self, *arguments, **options):
        return self.run_program("modar", *arguments, **options)

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
        """Pottery on the cover, baked once a program; levels of detail have tests of their own."""
        bundle = self.folder / name
        if not ProgramTest.demo:
            done = self.modar("bake", "--model", POTTERY, "--pattern", COVER, "-o", bundle, "--quiet", "--no-lods",
                              *QUICK)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stderr, "")
            ProgramTest.demo.append(bundle.read_bytes())
        bundle.write_bytes(ProgramTest.demo[0])
        return bundle
