"""Documents agree with the programs that they speak of."""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
MODAR = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")) / "modar"


class Documents(unittest.TestCase):
    def test_issues_md_is_fresh(self):
        printed = subprocess.run([str(MODAR), "check", "--list-issues"], capture_output=True, text=True, check=True)
        self.assertEqual((ROOT / "ISSUES.md").read_text(), printed.stdout,
                         "ISSUES.md is stale: modar check --list-issues > ISSUES.md")

    def test_paths_that_documents_name_exist(self):
        missing = []
        for name in ("README.md", "CONTRIBUTING.md", "formats/bundle.md"):
            text = (ROOT / name).read_text()
            for path in re.findall(r"`((?:formats|bake|runtime|shaders|assets|tests|scripts)/[\w./-]*)`", text):
                if not (ROOT / path.rstrip("/")).exists():
                    missing.append(f"{name}: {path}")
        self.assertEqual(missing, [])

    def test_links_between_documents_lead_somewhere(self):
        missing = []
        for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"):
            for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", (ROOT / name).read_text()):
                if "://" not in target and not (ROOT / target).exists():
                    missing.append(f"{name}: {target}")
        self.assertEqual(missing, [])

    def test_each_attack_of_the_specification_has_a_test(self):
        table = (ROOT / "formats/shipping.md").read_text().partition("## Attacks and accidents\n")[2].partition("\n## ")[0]
        rows = [line.split("|")[1:4] for line in table.splitlines() if line.startswith("| ")][1:]
        self.assertGreater(len(rows), 14)
        tests = "".join(file.read_text() for file in (ROOT / "tests/cli").glob("ship*_test.py"))
        for happens, _, names in rows:
            named = re.findall(r"`(\w+)`", names)
            self.assertTrue(named, happens)
            for name in named:
                self.assertIn(f"def test_{name}(self)", tests)

    def test_each_promise_of_the_threat_model_has_a_test(self):
        text = (ROOT / "formats/threats.md").read_text()
        rows = [line.split("|")[1:4] for line in text.splitlines() if line.startswith("| **")]
        self.assertGreater(len(rows), 10)
        tests = "".join(file.read_text() for folder in ("cli", "web", "check") for file in (ROOT / "tests" / folder).glob("*_test.py"))
        for who, _, names in rows:
            named = re.findall(r"`(\w+)`", names)
            self.assertTrue(named, who)
            for name in named:
                if name.endswith("_fuzz"):
                    self.assertTrue((ROOT / "tests/fuzz" / f"{name}.cpp").exists(), name)
                else:
                    self.assertIn(f"def test_{name}(self)", tests)


if __name__ == "__main__":
    unittest.main()
