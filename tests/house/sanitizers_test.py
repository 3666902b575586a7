"""What the presets' sanitizers see: faults planted into files that are compiled as a preset compiles ours."""
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
SCOPE = """int main(int count, char**) {
  int* last = nullptr;
  for (int i = 0; i < count; ++i) { int own = i; last = &own; }
  return *static_cast<volatile int*>(last) * 0;
}
"""
OVERFLOW = """int main(int count, char**) { int large = 2147483646; volatile int sum = large + 2 * count; return sum * 0; }
"""
# One file of each kind that the preset `dev` exempts from a check, and the fault that this check is for.
PLANTED = {
    "bake/commands/bake_command.cpp": ("signed integer overflow", OVERFLOW),
    "bake/mesh/rays/occlusion.cpp": ("signed integer overflow", OVERFLOW),
    "runtime/track/kernels.cpp": ("stack-use-after-scope", SCOPE),
    "tests/formats/quantise_test.cpp": ("stack-use-after-scope", SCOPE),
}


class Sanitizers(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-sanitizers-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def flags_of(self, *options):
        """The words that compile each file, of a configured folder in which every file is compiled by itself."""
        done = subprocess.run(["cmake", "--preset", "full", "-S", ROOT, "-B", self.folder / "build", "-DCMAKE_UNITY_BUILD=OFF",
                               "-DCMAKE_CXX_COMPILER_LAUNCHER=", *options], capture_output=True, text=True, cwd=ROOT)
        self.assertEqual(done.returncode, 0, done.stderr)
        commands = json.loads((self.folder / "build/compile_commands.json").read_text())
        return {os.path.relpath(entry["file"], ROOT): shlex.split(entry["command"]) for entry in commands}

    def report(self, words, text):
        """What the program says that `text` is, compiled with the flags for code and sanitizers among `words`."""
        source, program = self.folder / "planted.cpp", self.folder / "planted"
        source.write_text(text)
        flags = [word for word in words if re.match(r"-f|-O|--param|-std=", word)]
        done = subprocess.run([words[0], *flags, source, "-o", program], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return subprocess.run([program], capture_output=True, text=True).stderr

    def test_the_preset_full_sees_what_dev_leaves_out(self):
        flags = self.flags_of()
        for file, (expected, text) in PLANTED.items():
            with self.subTest(file=file):
                self.assertIn(expected, self.report(flags[file], text))

    def test_it_is_its_option_that_sees_them(self):
        flags = self.flags_of("-DMODAR_SANITIZE_FULL=OFF")
        for file, (expected, text) in PLANTED.items():
            with self.subTest(file=file):
                self.assertNotIn(expected, self.report(flags[file], text))


if __name__ == "__main__":
    unittest.main()
