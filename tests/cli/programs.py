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
