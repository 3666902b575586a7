"""The device's code for phones: clang 14 with libc++ 14 (older than the NDK r26 has them), for 32 and 64 bits."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
GENERATED = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")).parent
CLANG = shutil.which("clang++-14")
LIBCXX = pathlib.Path("/usr/lib/llvm-14/include/c++/v1")
# wasm: clang knows no system behind it; the C library's headers are those of Linux, EGL's of the browser.
TARGETS = {
    "armv7a-linux-gnueabihf": [],
    "aarch64-linux-gnu": [],
    "i686-linux-gnu": [],
    "wasm32-unknown-unknown": ["-D__linux__", "-D__EMSCRIPTEN__", "-D_GNU_SOURCE"],
}
FORMATS = ["formats/**/*.cpp"]
DEVICE = FORMATS + [f"runtime/{room}/*.cpp" for room in ("track", "render", "platform", "capi")]
# Where a bundle's structs may be laid out differently. The rest reads them as on the other 32 bits; a browser's is built
# by tests/web.
LAYOUT_ONLY = ("i686-linux-gnu", "wasm32-unknown-unknown")
# On 64 bits the rest of the runtime is the host's; of the processor itself it has the vectors of the loops over pixels.
LOOPS = FORMATS + ["runtime/track/kernels.cpp"]
ONLY_64_BITS = "\nnamespace { unsigned long long planted; __UINTPTR_TYPE__ narrowed[] = {planted}; }\n"


@unittest.skipUnless(CLANG and LIBCXX.exists(), "clang-14 or libc++-14-dev is not installed")
class Phone(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        # The host's C library replaces the phone's: what depends on the processor is laid over it.
        for name, text in {"gnu/stubs.h": "",
                           "xlocale.h": "#include <stdlib.h>\n#include <wchar.h>\n",
                           "bits/wordsize.h": "#define __WORDSIZE (__SIZEOF_POINTER__ * 8)\n"
                                              "#define __WORDSIZE_TIME64_COMPAT32 0\n"}.items():
            (self.folder / name).parent.mkdir(exist_ok=True)
            (self.folder / name).write_text(text)

    def compile(self, target, patterns, more=""):
        """All files as one: the headers are read once."""
        files = [file for pattern in patterns for file in sorted(ROOT.glob(pattern))]
        self.assertGreaterEqual(len(files), len(patterns))
        unit = self.folder / "unit.cpp"
        unit.write_text("".join(f'#include "{file}"\n' for file in files) + more)
        includes = [ROOT, ROOT / "runtime" / "include", GENERATED / "shaders" / "generated",
                    GENERATED / "assets" / "generated"]
        return subprocess.run(
            [CLANG, f"--target={target}", *TARGETS[target], "-std=c++20", "-fsyntax-only", "-w", "-fno-exceptions",
             "-fno-rtti", "-nostdinc++", "-nostdlibinc", "-DEIGEN_DONT_VECTORIZE", "-DMODAR_BUILT_VERSION=MODAR_VERSION_NUMBER", "-DEGL_NO_X11", "-D__regparm__(x)=",
             *(f"-I{path}" for path in includes), "-isystem", LIBCXX, "-isystem", self.folder, "-idirafter",
             "/usr/include", "-idirafter", "/usr/include/x86_64-linux-gnu", "-idirafter", "/usr/include/eigen3", unit],
            capture_output=True, text=True)

    def test_formats_and_runtime_compile_for_every_phone(self):
        for target in TARGETS:
            with self.subTest(target=target):
                done = self.compile(target, FORMATS if target in LAYOUT_ONLY else LOOPS if target == "aarch64-linux-gnu" else DEVICE)
                self.assertEqual(done.returncode, 0, done.stderr[:4000])

    def test_a_line_that_needs_64_bits_is_seen(self):
        for target in TARGETS:
            done = self.compile(target, ["runtime/platform/device_profile.cpp"], ONLY_64_BITS)
            self.assertEqual("narrowed" in done.stderr, target != "aarch64-linux-gnu", f"{target}: {done.stderr[:500]}")


if __name__ == "__main__":
    unittest.main()
