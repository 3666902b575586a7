"""The prose of the tree: comments and strings of code, and the text of guides, with the line where each begins."""
import io
import re
import tokenize

C_LIKE = re.compile(r'R"(\w*)\((?P<raw>.*?)\)\1"|(?P<string>"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n]){2,}\'|`(?:\\.|[^`\\])*`)|\'(?:\\.|[^\'\\\n])\''
                    r'|(?P<block>/\*.*?\*/)|(?P<line>//[^\n]*(?:\n[ \t]*//[^\n]*)*)', re.S)
HASH_LIKE = re.compile(r'\$\{#|\\#|(?P<string>"(?:\\.|[^"\\])*"|\'[^\']*\')|(?P<line>(?<![^\s;(])#[^\n]*(?:\n[ \t]*#[^\n]*)*)', re.S)
C_SUFFIXES = (".cpp", ".hpp", ".h", ".c", ".js", ".mjs", ".cjs", ".ts", ".java", ".vert", ".frag", ".css")
HASH_SUFFIXES = (".sh", ".cmake", ".txt", ".toml")
SUFFIXES = (*C_SUFFIXES, *HASH_SUFFIXES, ".py", ".md")


def of_code(pattern, text):
    for match in pattern.finditer(text):
        kind = match.lastgroup
        if kind:
            yield text.count("\n", 0, match.start()) + 1, kind, match[kind]


def of_python(text):
    comment, begin, last = [], 0, -1
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            if comment and token.start[0] > last + 1:
                yield begin, "line", "\n".join(comment)
                comment = []
            begin, last = (begin if comment else token.start[0]), token.start[0]
            comment.append(token.string)
        elif token.type == tokenize.STRING:
            yield token.start[0], "string", token.string
    if comment:
        yield begin, "line", "\n".join(comment)


def without_code(text):
    """A guide without its code; lines keep their numbers."""
    blank = lambda match: re.sub(r"[^\n]", " ", match[0])  # noqa: E731
    return re.sub(r"`[^`\n]*(?:\n[^`\n]+)?`", blank, re.sub(r"^ *```.*?^ *```", blank, text, flags=re.M | re.S))


def prose(name, text):
    """Yields (line, kind, words): kind is string, raw, block, line or guide."""
    if name.endswith(".md"):
        yield 1, "guide", without_code(text)
    elif name.endswith(".py"):
        yield from of_python(text)
    elif name.endswith(HASH_SUFFIXES):
        yield from of_code(HASH_LIKE, text)
    elif name.endswith(C_SUFFIXES):
        yield from of_code(C_LIKE, text)


def words(kind, text):
    """The prose without comment signs, quotations, `code`, and strings that are one word; newlines stay countable."""
    blank = lambda match: re.sub(r"[^\n]", " ", match[0])  # noqa: E731
    if kind in ("line", "block", "guide"):
        text = re.sub(r"(?m)^[ \t]*(?://[/!]?<?|\*(?!/)|#+)", blank, text)
        return re.sub(r'"[^"\n]*(?:\n[^"\n]*)?"|`[^`]*`', blank, text)
    text = re.sub(r"(?<!^)`[^`\n]*`(?!$)", blank, text)
    return re.sub(r'"\S*"', blank, text) if kind == "raw" else blank(re.match(r"[^\n]*", text)) if not re.search(r"\s", text) else text
