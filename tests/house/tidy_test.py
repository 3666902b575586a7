"""clang-tidy finds nothing in the lines that changed, and finds planted faults, in build folders of GCC too."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
BUILD = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")).parent
PLANTED = "#include <string>\n\nbool first(const std::string& text) {\n  return text.size() == 0;\n}\n\nint half(int of) {\n  return of / 2;\n}\n"


def tidy(*words, cwd=ROOT):
    return subprocess.run([sys.executable, cwd / "scripts/tidy.py", *map(str, words)], cwd=cwd, capture_output=True, text=True)


@unittest.skipUnless(shutil.which("clang-tidy"), "clang-tidy is not installed")
class Tidy(unittest.TestCase):
    def test_changed_lines(self):
        done = tidy("--build", BUILD)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("files checked", done.stdout)

    def copy(self):
        """A repository with a build folder, whose one file is compiled by way of a unity file."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        root = pathlib.Path(folder.name).resolve()
        for name in ("scripts/tidy.py", ".clang-tidy"):
            (root / name).parent.mkdir(exist_ok=True)
            shutil.copy(ROOT / name, root / name)
        (root / "formats").mkdir()
        (root / "build").mkdir()
        unity = root / "build/unity_0_cxx.cxx"
        unity.write_text(f'#include "{root}/formats/planted.cpp"\n')
        command = f"/usr/bin/c++ -std=c++20 -fira-region=one --param=ggc-min-heapsize=1000 -o x.o -c {unity}"
        (root / "build/compile_commands.json").write_text(json.dumps(
            [{"directory": str(root), "file": str(unity), "command": command}]))
        return root

    def test_a_file_of_a_unity_build(self):
        root = self.copy()
        (root / "formats/planted.cpp").write_text(PLANTED)
        done = tidy("--build", root / "build", "formats/planted.cpp", cwd=root)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("planted.cpp:4:", done.stdout)
        self.assertIn("readability-container-size-empty", done.stdout)
        (root / "formats/planted.cpp").write_text("int\n")
        self.assertEqual(tidy("--build", root / "build", "formats/planted.cpp", cwd=root).returncode, 2)

    @unittest.skipUnless(shutil.which("git"), "git is not installed")
    def test_only_lines_that_changed_count(self):
        root = self.copy()
        def git(*words):
            subprocess.run(["git", "-c", "user.name=x", "-c", "user.email=x@x", *words], cwd=root, check=True, capture_output=True)
        git("init", "-b", "main")
        (root / "formats/planted.cpp").write_text(PLANTED)
        for change in ("", "// more\n"):  # the oldest commit is what the others are compared with
            (root / "formats/planted.cpp").write_text(PLANTED + change)
            git("add", "formats")
            git("commit", "-m", "x")
        self.assertEqual(tidy("--build", root / "build", cwd=root).returncode, 0)
        (root / "formats/planted.cpp").write_text(PLANTED.replace("size() == 0", "size() == 0 ") + "// more\n")
        done = tidy("--build", root / "build", cwd=root)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("1 of 1 files checked", done.stdout)
        done = tidy("--build", root / "build", "--seconds", "0.000001", cwd=root)
        self.assertEqual(done.returncode, 0, done.stdout)  # git's own time is more
        self.assertIn("not checked: formats/planted.cpp", done.stdout)


if __name__ == "__main__":
    unittest.main()
