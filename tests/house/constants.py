"""The constants of the C++ code, each with its comment."""
import re

DEFINITION = re.compile(r"^[ \t]*(?:static |inline )*constexpr [\w:<>, ]+?[ *&](k[A-Z]\w*)(?:\[\w*\])?(?: ?=|\{)")
TAG = re.compile(r"tuned: ?(\w+)")


def constants(text):
    """Yields (line, names, comment): a comment belongs to the constants directly below it, or at its left."""
    lines, block, start = text.splitlines(), [], 0
    for number, line in enumerate(lines, 1):
        if re.match(r"\s*//", line):
            start, block = (start if block else number), [*block, re.sub(r"^\s*//[/!]*<?\s?", "", line)]
            continue
        match = DEFINITION.match(line)
        if match:
            trailing = re.search(r"//[/!]*<?\s*(.*)$", re.sub(r'"(?:\\.|[^"\\])*"', '""', line))
            more = []
            for follower in lines[number:] if trailing else ():  # a trailing comment over several lines
                if not re.match(r"\s{20,}//", follower):
                    break
                more.append(re.sub(r"^\s*//[/!]*<?\s?", "", follower))
            if block:
                yield start, match[1], " ".join(block)
            if trailing:
                yield number, match[1], " ".join([trailing[1], *more])
        block = []


def words_of(comment):
    return len(TAG.sub("", comment).split())


def figures_of(comment):
    return len(re.findall(r"(?<![\w.])[-+]?\d[\d.,]*", TAG.sub("", comment)))
