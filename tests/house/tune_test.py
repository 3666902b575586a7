"""scripts/tune.py finds a constant and makes it a variable, in every scope that constants stand in."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import tune  # noqa: E402

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


if __name__ == "__main__":
    unittest.main()
