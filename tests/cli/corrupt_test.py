"""Every issue that only a workstation finds has a bundle that shows it: tests/corrupt/workstation/ID.modar, the words
of its `modar check` (ID.args), and the report that it has to give (ID.txt). `corrupt_test.py --write` writes the
reports: whoever runs it reads their difference before committing them."""
import json
import re
import shlex
import sys
import unittest

from programs import ROOT, ProgramTest

FOLDER = ROOT / "tests" / "corrupt" / "workstation"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Of the laboratory's program, which the core has not.
SECOND = re.compile(" SOURCE_READER |a second reader's")
# Lines with measurements, besides the issues: other tests hold these.
REPORT = re.compile(r"\S+\.modar: (good|BAD)$|(error|warning|info) ")


class Corrupt(ProgramTest):
    def report(self, case):
        """Verdict and issues of a case, and the exit code."""
        words = [str(self.folder) if word == "OUT" else word
                 for word in (FOLDER / f"{case}.args").read_text().split("\n")[:-1]]
        done = self.modar("check", f"{case}.modar", *words, cwd=FOLDER)
        lines = [line for line in done.stdout.split("\n")
                 if REPORT.match(line) and (case == "SOURCE_READER" or not SECOND.search(line))]
        return "".join(line + "\n" for line in lines), done

    def assert_like(self, report, expected, note):
        """Words are equal; numbers, which processors and drivers round in their own ways, nearly so."""
        report, expected = (re.sub("its colours: the .*?; look", "its colours; look", text) for text in (report, expected))
        self.assertEqual(NUMBER.sub("#", report), NUMBER.sub("#", expected), note)
        for ours, theirs in zip(NUMBER.findall(report), NUMBER.findall(expected)):
            self.assertAlmostEqual(float(ours), float(theirs), delta=0.02 + 0.02 * abs(float(theirs)), msg=note)

    def test_each_issue_has_a_bundle_that_shows_it(self):
        listed = self.modar("check", "--list-issues").stdout
        rows = [row.split(" | ") for row in listed.splitlines() if row.startswith("| ")][1:]
        severities = {row[0][2:]: row[1] for row in rows}
        in_formats = {path.stem for path in FOLDER.parent.glob("*.modar")}
        cases = sorted(path.stem for path in FOLDER.glob("*.modar"))
        self.assertEqual(sorted(set(severities) - in_formats), cases)
        for case in cases:
            with self.subTest(case):
                report, done = self.report(case)
                note = shlex.join(map(str, done.args)) + "\n" + done.stderr
                expected = (FOLDER / f"{case}.txt").read_text()
                self.assert_like(report, expected, note)
                severity = severities[case]
                self.assertIn(f"\n{severity} {case} ", report, note)
                self.assertEqual(done.returncode, 3 if severity == "error" else 0, note)

    def test_bundles_are_good_without_device_and_source(self):
        for path in sorted(FOLDER.glob("*.modar")):
            # Without words, it is bad by itself.
            if path.stem != "BUNDLE_PREVIEW" and not path.with_suffix(".args").read_text():
                continue
            with self.subTest(path.stem):
                done = self.modar("check", path, "--json")
                ids = {issue["id"] for issue in json.loads(done.stdout)["issues"]}
                # Some hold a texture and nothing else.
                self.assertLessEqual(ids, {"BUNDLE_EMPTY", "BUNDLE_PREVIEW"})
                self.assertEqual(done.returncode, 0, done.stderr)


def write():
    case = Corrupt()
    case.setUp()
    for path in sorted(FOLDER.glob("*.modar")):
        report, done = case.report(path.stem)
        path.with_suffix(".txt").write_text(report)
        print(report + done.stderr, end="")
    case.doCleanups()


if __name__ == "__main__":
    if "--write" in sys.argv:
        write()
    else:
        unittest.main()
