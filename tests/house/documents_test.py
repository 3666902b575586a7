"""Documents agree with the programs that they speak of."""
import csv
import os
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
MODAR = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")) / "modar"
PAGES = [ROOT / line for line in subprocess.run(
    ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"], cwd=ROOT, capture_output=True, text=True).stdout.split()] or [
    page for folder in ("", "bake", "formats", "runtime") for page in sorted((ROOT / folder).glob("*.md" if not folder else "**/*.md"))]


def without_code(page):
    """A page's text without its blocks of code and `code`."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL))


def anchors(page):
    """The names that a page's headings have in links."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


def commands_in(text):
    """The words of each of our commands that a page has in blocks or in `code`."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines += [code.replace("\n", " ") for code in re.findall(r"`([^`]+)`", prose)]
    for line in lines:
        for part in re.split(r"&&|\||;", re.sub(r"(^|\s)#.*", "", line)):
            words = part.split()
            if words and words[0] in ("modar", "modar-lab", "modar-play", "modar-fetch") and len(words) > 1:
                yield words


class Documents(unittest.TestCase):
    def test_the_second_reader_has_the_section_types_of_the_specification(self):
        sys.path.insert(0, str(ROOT / "scripts"))
        from bundle_bytes import OWNED, SINCE, SINGLES, TABLES
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in
                (ROOT / "formats/bundle.md").read_text().partition("## Section types")[2].partition("\n### ")[0].splitlines()
                if re.match(r"\| \d", line)]
        flags = {"0": 0, "required": 1, "required, GPU": 3}
        self.assertEqual(SINGLES, {int(row[0]): flags[row[3]] for row in rows if row[4] == "NONE"})
        self.assertEqual(OWNED, {int(row[0]): flags[row[3]] for row in rows if row[4] != "NONE"})
        self.assertEqual(SINCE, {int(row[0]): int(row[2][8]) for row in rows if row[2].startswith("since 1.")})
        self.assertEqual({kind: name for kind, (name, _) in TABLES.items()},
                         {int(row[0]): row[1].replace(" ", "_") for row in rows if "table of" in row[2]})

    def test_issues_md_is_fresh(self):
        printed = subprocess.run([str(MODAR), "check", "--list-issues"], capture_output=True, text=True, check=True)
        self.assertEqual((ROOT / "ISSUES.md").read_text(), printed.stdout,
                         "ISSUES.md is stale: modar check --list-issues > ISSUES.md")

    def test_page_and_packer_agree_on_what_a_page_loads_whole(self):
        packer = re.search(r"kMostWhole = std::size_t\{(\d+)\} << (\d+);", (ROOT / "bake/extensions/web/packed_bundle.hpp").read_text())
        page = re.search(r"MOST_BYTES = (\d+) << (\d+);", (ROOT / "runtime/extensions/web/modar-view.js").read_text())
        self.assertEqual(packer.groups(), page.groups())

    def test_each_item_of_the_paper_names_a_test_that_exists(self):
        text = (ROOT / "bake/extensions/lab/README.md").read_text()
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if re.match(r"\| \d+ \|", line)]
        self.assertEqual([int(row[0]) for row in rows], list(range(1, 87)))
        files = {path.name: path.read_text() for path in (ROOT / "tests").rglob("*_test.*") if path.suffix in (".py", ".cpp")}
        for number, item, state, shown in rows:
            with self.subTest(item=f"{number} {item}"):
                self.assertIn(state, ("yes", "partly", "phone"))
                self.assertRegex(shown, "`|]\\(")
                for file, name in re.findall(r"`(\w+_test\.\w+): (\w+)`", shown):
                    self.assertRegex(files.get(file, ""), rf"\bdef test_{name}\(" if file.endswith(".py") else rf"\bTEST(_[FP])?\(\w+,\s*{name}\)")

    def test_paths_that_documents_name_exist(self):
        missing = []
        for page in PAGES:
            for path in re.findall(r"`((?:formats|bake|runtime|shaders|assets|tests|scripts)/[\w./-]*)`", page.read_text()):
                if not (ROOT / path.rstrip("/")).exists():
                    missing.append(f"{page}: {path}")
        self.assertEqual(missing, [])

    def test_links_between_documents_lead_somewhere(self):
        wrong = []
        for page in PAGES:
            for target in re.findall(r"\]\(([^)]+)\)", without_code(page)):
                if "://" in target:
                    continue
                path, _, anchor = target.partition("#")
                file = (page.parent / path).resolve() if path else page
                if not file.exists():
                    wrong.append(f"{page}: {target}")
                elif anchor and anchor not in anchors(file):
                    wrong.append(f"{page}: {target}: no such heading")
        self.assertEqual(wrong, [])

    def test_every_guide_is_linked(self):
        linked = {(page.parent / target.partition("#")[0]).resolve()
                  for page in PAGES for target in re.findall(r"\]\(([^)#]+)", without_code(page))}
        self.assertEqual([page for page in PAGES if page.resolve() not in linked and page.name != "README.md"], [])
        guides = [page for page in PAGES if page.name == "README.md" and page.parent != ROOT]
        self.assertGreater(len(guides), 4)
        self.assertEqual([page for page in guides if page.resolve() not in linked], [])

    def test_readme_is_short(self):
        text = (ROOT / "README.md").read_text()
        self.assertLessEqual(len(text.splitlines()), 135)
        self.assertLessEqual(len(text.split()), 1000)
        picture = re.search(r"!\[[^]]+\]\(([^)]+)\)", text)[1]
        self.assertLess((ROOT / picture).stat().st_size, 600_000)

    def test_the_change_log_and_the_contributing_guide_are_short(self):
        self.assertLessEqual(len((ROOT / "CHANGELOG.md").read_text().split()), 1500)
        self.assertLessEqual(len((ROOT / "CONTRIBUTING.md").read_text().split()), 2000)

    def budget(self):
        """Counted instructions by measure."""
        with open(ROOT / "tests/bench/arm_budget.csv", newline="") as file:
            return {row["measure"]: int(row["instructions"]) for row in csv.DictReader(file)}

    def test_instructions_in_prose_are_the_counted_ones(self):
        """To the digits that are written; milliseconds follow at 800 MHz and half an instruction per cycle."""
        rows = re.findall(r"^\|[^|]*\(`(\w+)`\) \| ([\d.]+) million \| ([\d.]+) ms \|$", (ROOT / "bake/extensions/lab/README.md").read_text(), re.MULTILINE)
        counted = self.budget()
        self.assertEqual({name for name, _, _ in rows}, {name for name in counted if not name.endswith("_default_camera")})
        for name, millions, milliseconds in rows:
            for written, exact in ((millions, counted[name] / 1e6), (milliseconds, counted[name] / 0.5 / 800e6 * 1e3)):
                with self.subTest(name):
                    self.assertLessEqual(abs(float(written) - exact), 0.5 * 10 ** -len(written.partition(".")[2]))

    def test_milliseconds_of_a_frame_are_the_counted_ones(self):
        counted, pages = self.budget(), [ROOT / "README.md", ROOT / "bake/extensions/lab/README.md"]
        for page in pages:
            tracking, searching = re.search(r"(\d+) ms tracking, (\d+) ms searching", page.read_text()).groups()
            for written, name in ((tracking, "track_640x480"), (searching, "search_640x480")):
                with self.subTest(f"{page}: {name}"):
                    self.assertEqual(int(written), round(counted[name] / 0.5 / 800e6 * 1e3))

    def test_options_that_documents_name_exist(self):
        """Each `modar COMMAND ... --option` of a page, in code or prose, is an option of that command."""
        wrong, seen, help_of = [], 0, {}
        for page in PAGES:
            if page.name == "CHANGELOG.md":
                continue
            for words in commands_in(page.read_text()):
                options = [word.partition("=")[0] for word in words if re.fullmatch(r"--[a-z][\w-]*(=.*)?", word)]
                command = [words[0]]
                for word in words[1:]:
                    if command[0] not in ("modar", "modar-lab") or not re.fullmatch(r"[a-z]+", word) or len(command) == 3:
                        break
                    if len(command) == 2 and command[1] not in ("pattern", "ship", "cache"):
                        break
                    command.append(word)
                if words[:2] == ["modar", "help"] or command == ["modar", "COMMAND"]:
                    continue
                key = tuple(command)
                if key not in help_of:
                    ask = "--help" if command[0] == "modar-fetch" else "--help-all"
                    done = subprocess.run([str(MODAR.with_name(command[0])), *command[1:], ask], capture_output=True, text=True)
                    help_of[key] = done.stdout if done.returncode == 0 else None
                if help_of[key] is None:
                    wrong.append(f"{page}: {' '.join(command)}")
                    continue
                known = set(re.findall(r"--[a-z][\w-]*", help_of[key])) | {"--help", "--help-all", "--version"}
                wrong += [f"{page}: {' '.join(words)}: {option}" for option in options if option not in known]
                seen += len(options)
        self.assertEqual(wrong, [])
        self.assertGreater(seen, 60)

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
