"""What a phone gets stays small: scripts/size.py on the preset `device`, and on a planted growth."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
SCRIPT = ROOT / "scripts" / "size.py"
BUILD = ROOT / "build" / "device"

SMALL = "int first(int x) { return x * 3; }\nint main() { return first(0); }\n"
LARGE = "extern const char picture[5000] = {1};\n" + SMALL


def run(*arguments):
    done = subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


class Device(unittest.TestCase):
    def test_every_target_stays_under_its_ceiling(self):
        if not (BUILD / "bin" / "modar-play").exists():
            self.skipTest("the preset device is not built here (scripts/test.sh builds it)")
        code, out = run("--build", BUILD)
        self.assertEqual(code, 0, out)

    def test_the_player_s_ceiling_is_the_promise(self):
        targets = json.loads((ROOT / "scripts" / "size_ceilings.json").read_text())
        self.assertLessEqual(targets["armhf/bin/modar-play"]["ceiling"], 385_000)
        self.assertLessEqual(targets["bin/modar-play"]["ceiling"], 542_500)


class Planted(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.ceilings = self.folder / "ceilings.json"
        self.build(SMALL)
        size = self.folder / "program.stripped"
        subprocess.run(["strip", "-o", size, self.folder / "program"], check=True)
        self.small = size.stat().st_size
        self.ceilings.write_text(json.dumps({"program": {"ceiling": self.small + 999}}))

    def build(self, text):
        (self.folder / "a.cpp").write_text(text)
        compiler = os.environ.get("CXX", "c++")
        subprocess.run([compiler, "-o", self.folder / "program", self.folder / "a.cpp"], check=True)

    def size(self, *more):
        return run("--build", self.folder, "--ceilings", self.ceilings, *more)

    def test_growth_is_refused_and_its_symbol_named(self):
        self.assertEqual(self.size(), (0, f"program: {self.small} of {self.small + 999} bytes\n"))
        self.assertEqual(self.size("--update")[0], 0)
        self.assertEqual(self.size(), (0, f"program: {self.small} of {self.small + 999} bytes, +0\n"))
        self.build(LARGE)
        code, out = self.size()
        self.assertEqual(code, 3)
        self.assertIn("+5000  picture", out)
        code, out = self.size("--json")
        self.assertEqual(code, 3)
        self.assertEqual(json.loads(out)[0]["grown"][0], [5000, "picture"])

    def test_the_largest_symbol_is_named_where_no_size_was_recorded(self):
        self.build(LARGE)
        code, out = self.size()
        self.assertEqual(code, 3)
        self.assertEqual(out.splitlines()[1].split(), ["+5000", "picture"])

    def test_a_missing_program_is_reported(self):
        code, out = run("--build", self.folder / "nowhere", "--ceilings", self.ceilings)
        self.assertEqual(code, 2)
        self.assertIn("is not built", out)


if __name__ == "__main__":
    unittest.main()
