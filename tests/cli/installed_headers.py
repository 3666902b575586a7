"""What the installed headers declare, as clang parses them, and a program that links all of it."""
import json
import shutil
import subprocess

FUNCTIONS = {"FunctionDecl", "CXXMethodDecl", "CXXConstructorDecl", "CXXDestructorDecl", "CXXConversionDecl"}
SCOPES = {"NamespaceDecl", "LinkageSpecDecl", "CXXRecordDecl"}


def clang():
    return next((found for name in ("clang++", "clang++-14") if (found := shutil.which(name))), None)


def headers(include):
    """Paths as a program includes them, of every header below the folder."""
    return sorted(p.relative_to(include).as_posix() for suffix in ("hpp", "h") for p in include.rglob(f"*.{suffix}"))


def syntax_trees(text):
    """clang prints one JSON document after another."""
    decoder, at = json.JSONDecoder(), 0
    while at < len(text.rstrip()):
        tree, at = decoder.raw_decode(text, at)
        yield tree
        while at < len(text) and text[at].isspace():
            at += 1


def functions_below(node):
    """Functions that are declared and not defined: a library has to hold them. Templates have no symbol."""
    if node.get("kind") in FUNCTIONS:
        defined = any(child.get("kind") == "CompoundStmt" for child in node.get("inner", []))
        given = node.get("isImplicit") or node.get("pure") or "explicitlyDefaulted" in node or "explicitlyDeleted" in node
        if not defined and not given:
            yield node
    elif node.get("kind") in SCOPES:
        for child in node.get("inner", []):
            yield from functions_below(child)


def declared_symbols(include, folder):
    """Mangled names of all functions that the headers below `include` declare and leave to a library."""
    source = folder / "headers.cpp"
    source.write_text("".join(f"#include <{header}>\n" for header in headers(include)))
    done = subprocess.run([clang(), "-std=c++20", f"-I{include}", "-fsyntax-only", "-Xclang", "-ast-dump=json", "-Xclang",
                           "-ast-dump-filter=modar", source], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return sorted({function["mangledName"] for tree in syntax_trees(done.stdout) for function in functions_below(tree)})


def program(symbols):
    """A program that takes the address of each symbol, by the linker's name for it: private members, too."""
    lines = [f'extern const char s{i} __asm__("{name}");' for i, name in enumerate(symbols)]
    lines.append("const void* const addresses[] = {" + ", ".join(f"&s{i}" for i in range(len(symbols))) + "};")
    lines.append("int main() { int missing = 0; for (const void* const& a : addresses)"
                 " missing += *const_cast<const void* const volatile*>(&a) == nullptr; return missing; }")
    return "\n".join(lines) + "\n"
