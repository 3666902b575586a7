"""Presets that no other test builds: each configures, and clang, which builds `fuzz`, accepts the code of its targets."""
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
# `dev` is this build; test.sh builds device, newcomer.sh release and package, tests/web the engine;
# wasm takes libraries that are built first.
BUILT = {"dev", "device", "release", "package", "web", "wasm"}
# The libraries that fuzz targets link, without formats and runtime/track, which house_phone compiles with clang.
LIBRARIES = ("modar_transport", "modar_fetch", "modar_common", "modar_image", "modar_import", "modar_mesh", "modar_texture", "modar_pattern", "modar_options",
             "modar_bundle", "modar_check", "modar_ship", "modar_project")
# GCC and clang from 16 on take it; Debian 12's clang 14 does not.
PLANTED = "\nnamespace { struct Planted { int a, b; }; int planted(Planted p) { auto [a, b] = p; return [a] { return a; }() + b; } }\n"


def unit_command(entry, unit):
    """The compiler's words for this file in the place of the entry's, to check it and write nothing."""
    words = [word for word in shlex.split(entry["command"]) if word != "-c" and not word.startswith("-fsanitize")]
    at = words.index("-o")
    del words[at:at + 2]
    return [str(unit) if word == entry["file"] else word for word in words] + ["-fsyntax-only", "-w"]


class Presets(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def configure(self, name):
        if name == "fuzz" and not shutil.which("clang++"):
            self.skipTest("clang is not installed")
        done = subprocess.run(["cmake", "--preset", name, "-B", self.folder / name], cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{name}: {done.stderr[-2000:]}")

    def test_each_configures(self):
        names = {preset["name"] for preset in json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"] if not preset.get("hidden")}
        for name in sorted(names - BUILT - {"fuzz"}):
            with self.subTest(name):
                self.configure(name)

    def test_clang_accepts_what_fuzz_builds(self):
        self.configure("fuzz")
        entries = json.loads((self.folder / "fuzz" / "compile_commands.json").read_text())
        for library in LIBRARIES:
            units = [entry for entry in entries if f"/{library}.dir/Unity/" in entry["file"]]
            self.assertTrue(units, library)
            for entry in units:
                with self.subTest(entry["file"]):
                    done = subprocess.run(unit_command(entry, entry["file"]), cwd=entry["directory"], capture_output=True, text=True)
                    self.assertEqual(done.returncode, 0, done.stderr[:4000])
        planted = self.folder / "planted.cpp"
        planted.write_text(PLANTED)
        done = subprocess.run(unit_command(entries[0], planted), cwd=entries[0]["directory"], capture_output=True, text=True)
        self.assertIn("planted.cpp", done.stderr, "what GCC alone accepts")
        self.assertNotEqual(done.returncode, 0)


if __name__ == "__main__":
    unittest.main()
