#!/usr/bin/env python3
"""Declarations of runtime/include/modar/modar.h for languages that call C, printed: scripts/bindings.py python|csharp

python: a module for ctypes (runtime/extensions/python). csharp: a file for P/Invoke (runtime/extensions/csharp).
"""
import pathlib
import re
import sys

HEADER = pathlib.Path(__file__).resolve().parents[1] / "runtime" / "include" / "modar" / "modar.h"
PYTHON = {"int": "c_int", "float": "c_float", "double": "c_double", "size_t": "c_size_t", "char": "c_char", "uint8_t": "c_uint8",
          "uint32_t": "c_uint32", "int64_t": "c_int64", "uint64_t": "c_uint64", "ptrdiff_t": "c_ssize_t"}
CSHARP = {"int": "int", "float": "float", "double": "double", "size_t": "UIntPtr", "char": "byte", "uint8_t": "byte", "uint32_t": "uint",
          "int64_t": "long", "uint64_t": "ulong", "ptrdiff_t": "IntPtr", "void": "void"}
RESERVED = {"event", "out"}


def read():
    """Constants {name: number}, structures {name: [(type, stars, name, count)]}, functions [(type, stars, name, parameters)], each
    parameter as a field, and the names of opaque handles."""
    text = HEADER.read_text()
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r"^\s*#.*?(?<!\\)$", "", text, flags=re.MULTILINE | re.DOTALL).partition("namespace modar")[0]
    text = text.replace("MODAR_EXPERIMENTAL", "").replace("const ", "")
    constants = {name: int(value) for body in re.findall(r"\benum\s*\{(.*?)\}", text, re.DOTALL)
                 for name, value in re.findall(r"(MODAR_\w+)\s*=\s*(-?\d+)", body)}
    structures = {}
    for body, name in re.findall(r"typedef struct \w+\s*\{(.*?)\}\s*(\w+);", text, re.DOTALL):
        structures[name] = [field for line in body.split(";") if line.strip() for field in fields(line)]
    handles = [b for a, b in re.findall(r"typedef struct (\w+) (\w+);", text) if a == b]
    functions = []
    rest = re.sub(r"(typedef\s+struct\s+\w+\s*\{.*?\}\s*\w+;|\benum\s*\{.*?\};|extern \"C\" \{)", "", text, flags=re.DOTALL)
    for kind, stars, name, parameters in re.findall(r"(\w+)\s*(\**)\s*(modar_\w+)\(([^)]*)\);", rest):
        listed = [] if parameters.strip() in ("", "void") else [fields(part)[0] for part in parameters.split(",")]
        functions.append((kind, len(stars), name, listed))
    return constants, structures, functions, handles


def fields(declaration):
    """"double fx, fy" or "float corners[8]"."""
    kind, rest = re.match(r"\s*(\w+)\s*(.*)", declaration, re.DOTALL).groups()
    found = [re.match(r"\s*(\**)\s*(\w+)\s*(?:\[(\w*)\])?", part).groups() for part in rest.split(",")]
    return [(kind, len(stars), name, None if count is None else int(count or 0)) for stars, name, count in found]


def python():
    constants, structures, functions, _ = read()

    def kind_of(kind, stars, count=None):
        if (kind, stars) == ("char", 1):
            return "c_char_p"
        known = PYTHON.get(kind) or (kind if kind in structures else "c_void_p")
        if stars:
            known = "c_void_p" if kind not in structures else f"POINTER({known})"
        return known if count is None else f"{known} * {count}"

    yield "# Made by scripts/bindings.py of modar.h."
    yield "from ctypes import *  # noqa: F403"
    for name, value in constants.items():
        yield f"{name} = {value}"
    for name, members in structures.items():
        listed = ", ".join(f'("{member}", {kind_of(kind, stars, count)})' for kind, stars, member, count in members)
        yield f"\n\nclass {name}(Structure):\n    _fields_ = [{listed}]"
    yield "\n\ndef declare(library):"
    for kind, stars, name, parameters in functions:
        takes = ", ".join("c_void_p" if count is not None else kind_of(k, s) for k, s, _, count in parameters)
        gives = "None" if (kind, stars) == ("void", 0) else kind_of(kind, stars)
        yield f"    library.{name}.restype, library.{name}.argtypes = {gives}, [{takes}]"


def csharp():
    constants, structures, functions, _ = read()
    yield "// Made by scripts/bindings.py of modar.h."
    yield "using System;\nusing System.Runtime.InteropServices;\n\nnamespace Modar {\npublic static class Constants {"
    for name, value in constants.items():
        yield f"  public const int {name} = {value};"
    yield "}"
    for name, members in structures.items():
        yield f"\n[StructLayout(LayoutKind.Sequential)]\npublic unsafe struct {name} {{"
        for kind, stars, member, count in members:
            member = f"@{member}" if member in RESERVED else member
            if count is not None and (stars or CSHARP[kind].endswith("Ptr")):
                yield "  public IntPtr " + ", ".join(f"{member}{i}" for i in range(count)) + ";"
            elif count is not None:
                yield f"  public fixed {CSHARP[kind]} {member}[{count}];"
            else:
                yield f"  public {'IntPtr' if stars else CSHARP.get(kind, kind)} {member};"
        yield f"  public static {name} Sized() {{ return new {name} {{ size = (UIntPtr)sizeof({name}) }}; }}\n}}"
    yield "\npublic static unsafe class Native {"
    for kind, stars, name, parameters in functions:
        takes = []
        for k, s, parameter, count in parameters:
            parameter = f"@{parameter}" if parameter in RESERVED else parameter
            pointer = s or count is not None
            known = CSHARP.get(k) or (k if k in structures else None)
            if (k, s) == ("char", 1) and parameter in ("path", "device", "language"):
                takes.append(f"[MarshalAs(UnmanagedType.LPStr)] string {parameter}")
            else:
                takes.append(f"{known or 'void'}{'*' if pointer else ''} {parameter}" if known or pointer else f"{k} {parameter}")
        gives = "IntPtr" if stars else CSHARP.get(kind, kind)
        yield f'  [DllImport("modar")] public static extern {gives} {name}({", ".join(takes)});'
    yield "}\n}"


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in ("python", "csharp"):
        sys.exit(__doc__)
    print("\n".join(globals()[sys.argv[1]]()))
