"""`modar document`: manual pages and completions say what --help says, and the shells take them."""
import re
import shutil
import subprocess
import unittest

from programs import ProgramTest, needs


class Document(ProgramTest):
    def setUp(self):
        super().setUp()
        done = self.modar("document", "-o", "share")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.share = self.folder / "share"

    def complete(self, *words):
        """What bash offers for the last word."""
        script = ("source share/bash-completion/completions/modar; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); "
                  "_modar; printf '%s\\n' \"${COMPREPLY[@]}\"")
        done = subprocess.run(["bash", "-c", script, "bash", *words], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_types_name_every_option_of_a_command(self):
        text = (self.share / "modar/commands.d.ts").read_text()
        block = re.search(r"export interface PatternRectifyOptions \{\n(.*?)\n\}", text, re.DOTALL)[1]
        names = {re.sub("-(.)", lambda letter: letter[1].upper(), name) for name in
                 re.findall(r"--([a-z-]+)", self.modar("pattern", "rectify", "--help-all").stdout.partition("\nExample:")[0])}
        self.assertEqual(set(re.findall(r"^  (\w+)\?:", block, re.MULTILINE)), names - {"help"})
        self.assertIn("  tier?: 'thumb' | 'phone' | 'desktop' | ('thumb' | 'phone' | 'desktop')[];", text)

    def test_every_command_has_a_page_with_the_words_of_its_help(self):
        commands = re.findall(r"^  ([a-z]+) ", self.modar("help", "all").stdout, re.MULTILINE)
        self.assertGreater(len(commands), 10)
        for name in commands:
            page = (self.share / f"man/man1/modar-{name}.1").read_text().replace("\\-", "-")
            for option in re.findall(r"^  .*?(--[a-z-]+)", self.modar(name, "--help-all").stdout, re.MULTILINE):
                self.assertIn(option, page)
        self.assertIn("A to E", (self.share / "man/man1/modar-pattern-score.1").read_text())

    @needs("web")
    def test_help_is_short_and_help_all_is_whole(self):
        def listed(*words):
            """The commands or options of a help text."""
            done = self.modar(*words)
            self.assertEqual((done.returncode, done.stderr), (0, ""), words)
            text = done.stdout.partition("\nExample:")[0]
            return re.findall(r"^  ((?:-\w,)?--[\w-]+|[a-z]+)\b", text, re.MULTILINE)

        first = [name for name in listed("--help") if not name.startswith("-")]
        self.assertEqual(sorted(first), ["bake", "check", "init", "pattern", "report", "studio", "web"])
        every = [name for name in listed("help", "all") if not name.startswith("-")]
        self.assertEqual(every, [name for name in listed("--help-all") if not name.startswith("-")])
        self.assertTrue(set(first) < set(every))
        self.assertLessEqual(len(listed("bake", "--help")), 12)
        self.assertGreater(len(listed("bake", "--help-all")), 40)
        self.assertEqual(listed("help", "bake"), listed("bake", "--help"))
        self.assertEqual(listed("help", "bake", "all"), listed("bake", "--help-all"))
        self.assertEqual(listed("help", "pattern", "score"), listed("pattern", "score", "--help"))
        for name in every:
            shown = [option for option in listed(name, "--help") if option.startswith("-")]
            self.assertLessEqual(len(shown), 16, name)
            self.assertTrue(set(shown) <= set(listed(name, "--help-all")), name)
        wrong = self.modar("help", "bakes")
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("did you mean bake?", wrong.stderr)

    def test_help_wraps(self):
        for words in (["bake"], ["pattern", "simulate"]):
            for line in self.modar(*words, "--help-all").stdout.splitlines():
                if line.startswith(" " * 30):
                    self.assertLessEqual(len(line), 80, line)

    def test_pages_are_clean_roff(self):
        if shutil.which("groff") is None:
            self.skipTest("groff is not installed")
        for page in sorted((self.share / "man/man1").iterdir()):
            done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z", page], capture_output=True, text=True)
            self.assertEqual(done.stderr, "", page.name)

    def test_bash_completes(self):
        self.assertIn("pattern", self.complete("modar", "pat"))
        self.assertEqual(self.complete("modar", "pattern", "rec"), ["rectify"])
        self.assertIn("--width", self.complete("modar", "pattern", "rectify", "--wi"))
        self.assertEqual(self.complete("modar", "bake", "--effort", "b"), ["best"])
        (self.folder / "vase.obj").touch()
        (self.folder / "patio").touch()
        self.assertEqual(self.complete("modar", "pat"), ["pattern"], "a command, not a file")
        self.assertIn("bake", self.complete("modar", ""))
        self.assertNotIn("vase.obj", self.complete("modar", ""))
        self.assertEqual(self.complete("modar", "bake", "--model", "va"), ["vase.obj"])

    def test_zsh_and_fish_read_theirs(self):
        for shell, file in (("zsh", "zsh/site-functions/_modar"), ("fish", "fish/vendor_completions.d/modar.fish")):
            with self.subTest(shell):
                if shutil.which(shell) is None:
                    self.skipTest(f"{shell} is not installed")
                done = subprocess.run([shell, "-n", self.share / file], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
