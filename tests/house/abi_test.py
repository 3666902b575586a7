"""Structures of modar.h can grow: programs and libraries of different versions agree on what the other does not know."""
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
INCLUDE = ROOT / "runtime" / "include"
HEADER = INCLUDE / "modar" / "modar.h"
STRUCT = re.compile(r"typedef struct (modar_\w+) \{\n(.*?)\} \1;", re.S)

# The library's side: what it reads of a caller's structure, and what it writes into it.
LIBRARY = """
#include <cstring>
#include "runtime/capi/handles.hpp"
template <class Struct> static void read(const void* theirs, void* ours, size_t* size) {
  const Struct grown = modar::grown(*static_cast<const Struct*>(theirs));
  std::memcpy(ours, &grown, *size = sizeof grown);
}
template <class Struct> static void write(void* to) {
  Struct ours;
  std::memset(static_cast<void*>(&ours), 0x55, sizeof ours);
  modar::give(ours, static_cast<Struct*>(to));
}
"""
READ = """extern "C" void read_{0}(const void* theirs, void* ours, size_t* size) {{ read<{0}>(theirs, ours, size); }}
extern "C" void write_{0}(void* to) {{ write<{0}>(to); }}
"""

# The program's side, in C. Its memory held 0xAA before.
PROGRAM = """
#include <modar/modar.h>
#include <stdio.h>
#include <string.h>
static int failures = 0;
static void expect(const unsigned char* bytes, size_t from, size_t to, int value, const char* what) {
  for (size_t i = from; i < to; ++i)
    if (bytes[i] != value) { printf("%s: byte %zu is %02x\\n", what, i, bytes[i]); ++failures; return; }
}
"""
CHECK = """
void read_{0}(const void* theirs, void* ours, size_t* size);
void write_{0}(void* to);
static void check_{0}(void) {{
  union {{ {0} it; unsigned char bytes[1024]; }} caller;
  unsigned char library[1024];
  size_t size = 0;
  memset(&caller, 0xAA, sizeof caller);
  caller.it.size = sizeof caller.it;
  read_{0}(&caller, library, &size);
  if (size == sizeof caller.it) printf("{0}: the size does not tell the versions apart\\n"), ++failures;
  size_t both = size < sizeof caller.it ? size : sizeof caller.it;
  expect(library, sizeof(size_t), both, 0xAA, "{0}: read");
  expect(library, both, size, 0, "{0}: read of a newer member");
  write_{0}(&caller);
  expect(caller.bytes, sizeof(size_t), both, 0x55, "{0}: written");
  expect(caller.bytes, both, sizeof caller, 0xAA, "{0}: written beyond what both know");
}}
"""


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def grown(header):
    """Each structure has an int more, the smallest member that a later version may append."""
    return STRUCT.sub(lambda found: f"typedef struct {found[1]} {{\n{found[2]}  int later;\n}} {found[1]};", header)


class Abi(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        header = HEADER.read_text()
        self.structs = [name for name, members in STRUCT.findall(header)]
        self.assertEqual(self.structs, re.findall(r"typedef struct (modar_\w+) \{", header))
        for version, text in (("now", header), ("later", grown(header))):
            (self.folder / version / "modar").mkdir(parents=True)
            (self.folder / version / "modar" / "modar.h").write_text(text)

    def outcome(self, library, program):
        """What a program of one version prints with the library of another."""
        (self.folder / "library.cpp").write_text(LIBRARY + "".join(READ.format(name) for name in self.structs))
        calls = "".join(f"  check_{name}();\n" for name in self.structs)
        (self.folder / "program.c").write_text(PROGRAM + "".join(CHECK.format(name) for name in self.structs)
                                               + f"int main(void) {{\n{calls}  return failures;\n}}\n")
        run("c++", "-std=c++20", "-w", "-c", "-I", self.folder / library, "-I", ROOT, "-I", INCLUDE,
            self.folder / "library.cpp", "-o", self.folder / "library.o")
        run("cc", "-std=c99", "-Wall", "-Werror", "-c", "-I", self.folder / program, self.folder / "program.c",
            "-o", self.folder / "program.o")
        run("c++", self.folder / "program.o", self.folder / "library.o", "-o", self.folder / "program")
        return run(self.folder / "program")

    def test_an_old_program_with_a_newer_library(self):
        self.assertEqual(self.outcome("later", "now"), "")

    def test_a_newer_program_with_an_old_library(self):
        self.assertEqual(self.outcome("now", "later"), "")


if __name__ == "__main__":
    unittest.main()
