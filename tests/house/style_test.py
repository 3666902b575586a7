"""Style that a tool can see: clang-format, lines that name unfinished work."""
import os
import pathlib
import re
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
ROOMS = ("formats", "bake", "runtime", "tests")
PAGES = ("runtime/extensions/web", "runtime/extensions/web/adapters", "bake/extensions/studio/page")


def files(*suffixes):
    found = [f for room in ROOMS for f in (ROOT / room).rglob("*") if f.suffix in suffixes]
    return sorted(found)


class Style(unittest.TestCase):
    def test_clang_format(self):
        if shutil.which("clang-format") is None:
            self.skipTest("no clang-format here")
        scripts = [file for folder in PAGES for file in sorted((ROOT / folder).glob("*.js"))]
        done = subprocess.run(["clang-format", "--dry-run", "-Werror", *map(str, [*files(".cpp", ".hpp", ".java"), *scripts])],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr[:2000])

    def test_nothing_is_left_unfinished(self):
        word = re.compile(r"\b(" + "|".join(("TO" + "DO", "FIX" + "ME", "XX" + "X")) + r")\b")
        hits = [f"{f.relative_to(ROOT)}:{i}" for f in files(".cpp", ".hpp", ".h")
                for i, line in enumerate(f.read_text().splitlines(), 1) if word.search(line)]
        self.assertEqual(hits, [])


if __name__ == "__main__":
    unittest.main()
