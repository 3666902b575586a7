#!/usr/bin/env python3
"""Writes Java sources that replace the Android classes that an app names, out of the signatures in
Android's own api/current.txt: what android.jar is for a compiler.

  scripts/android_stubs.py current.txt APP_SOURCES STUBS

Members whose types are not among the classes written (or of java.* as of Java 7) are left out. Methods throw.
"""
import argparse
import pathlib
import re

# Innermost annotations first: one may hold others.
ANNOTATION = re.compile(r"@(?!interface)[\w.]+(?:\((?:[^()@\"]|\"[^\"]*\")*\)|(?![\w.(]))\s*")
TYPE_NAME = re.compile(r"[A-Za-z_][\w]*(?:\.[A-Za-z_]\w*)+")
JAVA_7 = re.compile(r"java\.(?!time\.|util\.(?:function|stream)\.)")
HEAD = re.compile(r"^(?P<words>(?:\w+ )*?)(?P<kind>class|interface|enum|@interface) (?P<name>[\w.]+)(?P<generics><.*?>)?"
                  r"(?: extends (?P<base>.*?))?(?: implements (?P<faces>.*?))? \{$")
BOXES = {"boolean": "Boolean", "byte": "Byte", "char": "Character", "short": "Short", "int": "Integer", "long": "Long",
         "float": "Float", "double": "Double"}
KEEP = {"public", "protected", "static", "final", "abstract"}


def read_signatures(path):
    """{"android.app.Activity": (head, [member lines])}; nested classes by their dotted names."""
    classes, package, members = {}, "", None
    for raw in path.read_text(encoding="utf-8").splitlines():
        line, found = re.sub(r"; // .*$", ";", raw.strip()), 1
        while found:
            line, found = ANNOTATION.subn("", line)
        if line.startswith("package "):
            package = line.split()[1]
        elif line.endswith("{") and HEAD.match(line):
            head = HEAD.match(line)
            members = []
            classes[f"{package}.{head['name']}"] = (head, members)
        elif line.endswith(";") and members is not None:
            members.append(line[:-1])
    return classes


def split_types(text):
    """"a.B<c.D,e.F>, int" -> ["a.B<c.D,e.F>", "int"]."""
    parts, depth, start = [], 0, 0
    for i, letter in enumerate(text):
        depth += (letter == "<") - (letter == ">")
        if letter == "," and depth == 0:
            parts.append(text[start:i].strip())
            start = i + 1
    return [part for part in [*parts, text[start:].strip()] if part]


class Stubs:
    def __init__(self, classes):
        self.classes = classes
        self.wanted = set()

    def want(self, name):
        """The class, those that it is nested in, and its bases."""
        if name in self.wanted or name not in self.classes:
            return
        self.wanted.add(name)
        head = self.classes[name][0]
        for base in TYPE_NAME.findall(f"{head['base'] or ''} {head['faces'] or ''}"):
            self.want(base)
        self.want(name.rpartition(".")[0])

    def known(self, text):
        return all(JAVA_7.match(name) or name in self.wanted for name in TYPE_NAME.findall(text))

    def call_of_base(self, name):
        base = self.classes[name][0]["base"]
        return "super((modar.Stub) null);" if base and base.partition("<")[0] in self.wanted else ""

    def method(self, name, words, text, in_interface):
        match = re.match(r"(?P<generics><.*?> )?(?P<result>\S.*?) (?P<name>\w+)\((?P<types>.*)\)(?: throws (?P<throws>.*))?$",
                         text)
        if not match or not self.known(text.replace("java.lang.", "")):
            return None
        types = split_types(match["types"])
        parameters = ", ".join(f"{each} p{i}" for i, each in enumerate(types))
        throws = f" throws {match['throws']}" if match["throws"] else ""
        if "protected" in words and "abstract" in words:
            words.remove("abstract")  # subclasses that implement it do not list it
        bare = in_interface or "abstract" in words
        if in_interface and ("static" in words or "default" in words):
            return None
        end = ";" if bare else ' { throw new RuntimeException("stub"); }'
        words = [w for w in words if w in KEEP and not (in_interface and w == "abstract")]
        return (f"{' '.join(words)} {match['generics'] or ''}{match['result']} {match['name']}({parameters}){throws}{end}")

    def member(self, name, line, in_interface):
        kind, _, text = line.partition(" ")
        words = []
        while text.split(" ", 1)[0] in KEEP | {"default", "deprecated", "synchronized", "native", "transient", "volatile", "strictfp"}:
            word, _, text = text.partition(" ")
            words.append(word)
        if kind == "method":
            return self.method(name, words, text, in_interface)
        if kind == "ctor":
            types = text[text.index("(") + 1:text.rindex(")")]
            if not self.known(types):
                return None
            parameters = ", ".join(f"{each} p{i}" for i, each in enumerate(split_types(types)))
            body = self.call_of_base(name)
            return f"{words[0]} {name.rpartition('.')[2]}({parameters}) {{ {body} }}"
        if kind == "field":
            match = re.match(r"(\S+(?: ?\[\])*) (\w+)(?: = (.*))?$", text)
            if not match or not self.known(match[1]):
                return None
            value = match[3]
            final = "final" in words
            if value is not None:
                value = {"(0.0f/0.0f)": "Float.NaN"}.get(value, value)
                if match[1] == "char":
                    value = "'?'"
            elif final or in_interface:
                # No constant: a compiler would copy it into the app, and Build.VERSION.SDK_INT would be 0 on every phone.
                value = f"modar.Stub.<{BOXES[match[1]]}>none()" if match[1] in BOXES else "null"
            words = [w for w in words if w in KEEP]
            return f"{' '.join(words)} {match[1]} {match[2]}{f' = {value}' if value is not None else ''};"
        return None

    def text(self, name):
        head, members = self.classes[name]
        kind, short = head["kind"], name.rpartition(".")[2]
        nested = [each for each in sorted(self.wanted) if each.rpartition(".")[0] == name]
        words = " ".join(w for w in head["words"].split() if w in KEEP and not (kind == "interface" and w == "abstract"))
        base = f" extends {head['base']}" if head["base"] and self.known(head["base"]) else ""
        faces = [f for f in re.findall(r"[\w.]+(?:<.*?>)?", head["faces"] or "") if self.known(f)]
        if kind == "enum":
            names = [m.split()[-1] for m in members if m.startswith("enum_constant")]
            return f"{words.replace(' final', '')} enum {short} {{ {', '.join(names)} }}\n"
        if kind == "interface" and faces:
            base, faces = f" extends {', '.join(faces)}", []
        lines = [f"{words} {kind} {short}{head['generics'] or ''}{base}"
                 f"{' implements ' + ', '.join(faces) if faces else ''} {{"]
        lines += [text for text in (self.member(name, m, kind == "interface") for m in members) if text]
        if kind == "class":
            lines.append(f"protected {short}(modar.Stub s) {{ {self.call_of_base(name)} }}")
        return "\n".join([*lines, *(self.text(each) for each in nested), "}\n"])

    def write(self, folder):
        (folder / "modar").mkdir(parents=True, exist_ok=True)
        (folder / "modar" / "Stub.java").write_text(
            "package modar;\npublic final class Stub { private Stub() { } public static <T> T none() { return null; } }\n")
        for name in sorted(self.wanted):
            package, _, short = name.rpartition(".")
            if package in self.wanted:
                continue  # inside its outer class
            file = folder / pathlib.Path(*package.split(".")) / f"{short}.java"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"package {package};\n{self.text(name)}")


def named_classes(sources):
    """What the app imports, and the nested classes that it names through an import."""
    for file in sorted(sources.rglob("*.java")):
        text = file.read_text(encoding="utf-8")
        for name in re.findall(r"^import (android\.[\w.]+|javax\.[\w.]+);", text, re.M):
            yield name
            short = name.rpartition(".")[2]
            for nested in re.findall(rf"\b{short}\.(\w+)", text):
                yield f"{name}.{nested}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("signatures", type=pathlib.Path)
    parser.add_argument("sources", type=pathlib.Path)
    parser.add_argument("stubs", type=pathlib.Path)
    arguments = parser.parse_args()
    stubs = Stubs(read_signatures(arguments.signatures))
    for name in named_classes(arguments.sources):
        stubs.want(name)
    stubs.write(arguments.stubs)


if __name__ == "__main__":
    main()
