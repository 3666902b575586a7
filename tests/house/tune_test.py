"""scripts/tune.py finds a constant and makes it a variable, in every scope of constants; constants have one-line
comments, and figures in bake/extensions/lab/tuned/ if they are tagged."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
sys.path.insert(0, str(ROOT / "tests/house"))
import constants  # noqa: E402
import tune  # noqa: E402

MOST_WORDS, MOST_FIGURES = 30, 2

PROGRAM = """#include <cstdio>
{before}
int main() {{
{inside}
  std::printf("%.3f", static_cast<double>({use}));
}}
"""


class Tune(unittest.TestCase):
    def ran(self, before, inside, use, **environment):
        text = PROGRAM.format(before=before, inside=inside, use=use)
        match = re.compile(tune.DEFINITION.format("kShare"), re.M).search(text)
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "a.cpp"
            source.write_text(tune.as_variable(text, match))
            subprocess.run([os.environ.get("CXX", "c++"), "-std=c++20", source, "-o", source.with_suffix("")], check=True)
            return float(subprocess.check_output([source.with_suffix("")], env={**os.environ, **environment}))

    def test_constants_of_all_scopes_become_variables(self):
        for before, inside, use in (("constexpr double kShare = 0.25;  // of all", "", "kShare"),
                                    ("inline constexpr float kShare = 0.25f;", "", "kShare"),
                                    ("struct A { \n  static constexpr double kShare = 0.25;\n};", "", "A::kShare"),
                                    ("", "  constexpr double kShare = 0.25;", "kShare")):
            with self.subTest(before + inside):
                self.assertEqual(self.ran(before, inside, use), 0.25)
                self.assertEqual(self.ran(before, inside, use, MODAR_TUNED_kShare="0.75"), 0.75)

    def test_several_constants_are_swept_apart(self):
        path, lens = tune.definition("kLensVariance")
        found = [(path, lens), tune.definition(f"{path}:kSampleVariance"), tune.definition("kMaxRotation")]
        texts = tune.variables(found)
        for each, match in found:
            self.assertIn(f'modar_tuned("MODAR_TUNED_{match["name"]}"', texts[each])

    def test_values_lie_around_the_present_one(self):
        match = re.compile(tune.DEFINITION.format("kSteps"), re.M).search("constexpr int kSteps = 10;\n")
        self.assertEqual(tune.values_of(match, ""), ([5, 7, 8, 10, 12, 14, 20], 10))
        self.assertEqual(tune.values_of(match, "3,30"), ([3, 10, 30], 10))

    def test_a_constant_of_the_code_is_found_and_an_unknown_one_is_not(self):
        path, match = tune.definition("kMaxRotation")
        self.assertTrue(path.startswith("runtime/track/"))
        self.assertGreater(tune.present(match), 0)
        self.assertEqual(tune.definition(f"{path}:kMaxRotation")[0], path)
        with self.assertRaises(SystemExit) as refused:
            tune.definition("kNowhere")
        self.assertIn("kNowhere", str(refused.exception))

    def test_written_rows_are_verified(self):
        path, match = tune.definition("kMaxRotation")
        bench = ["pose", "--only", "70 % covered"]
        curve = {0.5: {"right_pct": 80.0, "error_px": 0.25}, 1.0: {"right_pct": 90.0, "error_px": 0.2}}
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(tune, "build"):
            folder = pathlib.Path(folder)
            tune.write(path, match, {0.5: {"right_pct": 1.0}}, bench, folder)
            tune.write(path, match, curve, bench, folder)  # in place of the first
            rows = tune.stored(folder / "pose.csv")
            self.assertEqual([row["figures"] for row in rows], ["right_pct=80 error_px=0.25", "right_pct=90 error_px=0.2"])
            self.assertEqual({(row["constant"], row["file"], row["command"]) for row in rows}, {("kMaxRotation", path, "pose --only '70 % covered'")})
            for factor, differing in ((1.0, 0), (1.009, 0), (1.011, 2)):  # two rows, SAME is 1 %
                again = lambda name, value, words, data: {measure: figure * factor for measure, figure in curve.get(value, curve[1.0]).items()}  # noqa: E731
                with mock.patch.object(tune, "figures", again), mock.patch("builtins.print"):
                    self.assertEqual(tune.verify([folder / "pose.csv"], 1, None), differing)

    def test_flat_is_compared_with_the_present_value(self):
        row = {"figures": "right_pct=flat"}
        self.assertEqual(tune.differences(row, {"right_pct": 90.0}, {"right_pct": 90.8}), [])
        self.assertEqual(len(tune.differences(row, {"right_pct": 90.0}, {"right_pct": 91.0})), 1)


class Constants(unittest.TestCase):
    def faults(self, files, rows):
        """The faults of the constants of {path: text}, and the stored rows {bench: [row]}."""
        found, defined = [], set()
        for path, text in files.items():
            for line, name, comment in constants.constants(text):
                words, figures, tag = constants.words_of(comment), constants.figures_of(comment), constants.TAG.search(comment)
                if words > MOST_WORDS or figures > MOST_FIGURES:
                    found.append(f"{path}:{line}: {name}: {words} words and {figures} figures in its comment")
                if tag and not any((row["file"], row["constant"]) == (path, name) for row in rows.get(tag[1], ())):
                    found.append(f"{path}:{line}: {name}: bake/extensions/lab/tuned/{tag[1]}.csv has no row")
                if tag:
                    defined.add((tag[1], path, name))
        return found + [f"bake/extensions/lab/tuned/{bench}.csv: {row['constant']}: no constant of {row['file']} has that tag"
                        for bench, those in rows.items() for row in those if (bench, row["file"], row["constant"]) not in defined]

    def test_comments_are_one_line_and_tags_have_rows(self):
        files = {path: (ROOT / path).read_text() for path in tune.tracked() if path.endswith((".cpp", ".hpp", ".h"))}
        rows = {file.stem: tune.stored(file) for file in tune.TUNED.glob("*.csv")}
        self.assertTrue(rows)
        self.assertEqual(self.faults(files, rows), [])

    def test_each_fault_is_found(self):
        row = {"constant": "kA", "file": "a.cpp"}
        good = {"a.cpp": f"// {'word ' * 28}[1, 2] tuned: lod\nconstexpr int kA = 1;\n"}
        self.assertEqual(self.faults(good, {"lod": [row]}), [])
        for text, rows in ((f"// {'word ' * 31}\nconstexpr int kA = 1;\n", {}), ("// 1 of 2 or 3\nconstexpr int kA = 1;\n", {}),
                           ("constexpr int kA = 1;  // 1 of 2 or 3\n", {}), (good["a.cpp"], {}), (good["a.cpp"], {"lod": [row, {**row, "constant": "kB"}]}),
                           ("constexpr int kA = 1;\n", {"lod": [row]})):
            with self.subTest(text):
                self.assertEqual(len(self.faults({"a.cpp": text}, rows)), 1)


if __name__ == "__main__":
    unittest.main()
