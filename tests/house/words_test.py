"""Comments, strings and guides use no word that the glossary rejects; the comments of constants are one line."""
import os
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import prose  # noqa: E402

# These quote the words or are not prose of this project.
APART = ("formats/glossary.md", "tests/house/words_test.py", "tests/fuzz/corpus/", "assets/subjects/", "LICENSE")


def rejected():
    """The phrases of the glossary's list, also at the beginning of a sentence, as one expression; a/b are alternatives of a word."""
    section = (ROOT / "formats/glossary.md").read_text().partition("\n## Words that are not used\n")[2].partition("\n## ")[0]
    phrases = [row.split("|")[1].strip() for row in section.splitlines() if row.startswith("| ") and not row.startswith("| not ")]
    either = [r"\s+".join("(?:" + "|".join(re.escape(form) if i else f"[{form[0]}{form[0].upper()}]{form[1:]}" for form in word.split("/")) + ")"
                          for i, word in enumerate(phrase.split())) for phrase in phrases]
    return re.compile(r"(?<![\w-])(?:" + "|".join(either) + r")(?![\w(-])")


REJECTED = rejected()


def found(name, text):
    """(line, phrase, sentence) of each rejected phrase; a question may ask "what is"."""
    for line, kind, part in prose.prose(name, text):
        words = prose.words(kind, part)
        for match in REJECTED.finditer(words):
            begin = max((m.end() for m in re.finditer(r"[.:;!?](?=\s)|\n\s*\n|\|", words[:match.start()])), default=0)
            end = re.compile(r"[.:;!?](?=\s|[\"'`]?$)|\n\s*\n|\||\Z").search(words, match.end())
            if match[0][1:].startswith("hat") and end[0] == "?":
                continue
            yield line + words.count("\n", 0, match.start()), " ".join(match[0].split()), " ".join(words[begin:end.end()].split())


def pages():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True).stdout.split()
    names = listed or [f.relative_to(ROOT).as_posix() for room in ("bake", "formats", "runtime", "scripts", "tests") for f in (ROOT / room).rglob("*")]
    return [name for name in sorted(names) if name.endswith(prose.SUFFIXES) and not name.startswith(APART) and (ROOT / name).is_file()]


class Words(unittest.TestCase):
    def test_no_rejected_word_in_prose(self):
        hits = [f"{name}:{line}: {phrase}: {sentence[:120]}" for name in pages()
                for line, phrase, sentence in found(name, (ROOT / name).read_text())]
        self.assertEqual(hits, [], "formats/glossary.md lists the words that are not used")

    def test_prose_of_each_language_is_seen(self):
        bad = "it lies here"
        for name, text in (("a.cpp", f"// {bad}\n"), ("a.hpp", f"int a;  ///< {bad}\n"), ("a.js", f"/* {bad} */\n"), ("a.js", f"say(`{bad}`);\n"),
                           ("a.java", f'say("{bad}");\n'), ("a.py", f'"""{bad}"""\n'), ("a.py", f"x = 1  # {bad}\n"), ("a.sh", f"# {bad}\n"),
                           ("a.sh", f'echo "{bad}"\n'), ("CMakeLists.txt", f"# {bad}\n"), ("a.md", f"So {bad}.\n"), ("a.cpp", f'R"({bad})"\n')):
            with self.subTest(name + ": " + text):
                self.assertEqual([phrase for _, phrase, _ in found(name, text)], ["lies"])

    def test_phrases_across_lines_are_seen_quotations_and_questions_are_not(self):
        self.assertEqual([line for line, _, _ in found("a.cpp", "int a;\n// The value is taken as\n// it is.\n")], [2])
        for text in ('// "lies" is not used\n', "// `lies` is not used\n", "int lies = 'l';\n", "// What is this?\n"):
            self.assertEqual(list(found("a.cpp", text)), [], text)
        self.assertEqual(list(found("a.md", "```sh\necho lies\n```\nand `lies`\n")), [])


if __name__ == "__main__":
    unittest.main()
