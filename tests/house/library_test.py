"""The runtime as an app's library: configured where nothing is found, as under a phone's sysroot, built and installed."""
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
MODES = [f"-DCMAKE_FIND_ROOT_PATH_MODE_{kind}=ONLY" for kind in ("PROGRAM", "LIBRARY", "INCLUDE", "PACKAGE")]


class Library(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-library-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "sysroot").mkdir()

    def run_cmake(self, *words):
        return subprocess.run(["cmake", *map(str, words)], capture_output=True, text=True, cwd=self.folder,
                              env={**os.environ, "PKG_CONFIG_LIBDIR": "", "PKG_CONFIG_PATH": ""})

    def launcher(self, *more):
        """Checks each file as a compiler does, and leaves an empty object: the same code is optimised and linked for the page by
        tests/web, and run everywhere else."""
        script = self.folder / "launcher.sh"
        script.write_text(f'"$@" -fsyntax-only {shlex.join(map(str, more))} || exit' + '''
while [ "$1" != -o ]; do compiler=${compiler:-$1}; shift; done
exec "$compiler" -x c++ -c /dev/null -o "$2"
''')
        return f"-DCMAKE_CXX_COMPILER_LAUNCHER=sh;{script}"

    def configure(self, *more):
        # Without warnings, in few files: other builds have the rest.
        tools = [f"-DCMAKE_{name}={shutil.which(tool)}" for name, tool in
                 {"MAKE_PROGRAM": "ninja", "CXX_COMPILER": os.environ.get("CXX", "c++"), "AR": "ar",
                  "RANLIB": "ranlib"}.items()]
        return self.run_cmake("-S", ROOT, "-B", "build", "-G", "Ninja", *tools,
                              "-DCMAKE_CXX_FLAGS=-O0 -w", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=0",
                              f"-DCMAKE_FIND_ROOT_PATH={self.folder / 'sysroot'}", *MODES,
                              f"-DCMAKE_INSTALL_PREFIX={self.folder / 'prefix'}", *more)

    def test_it_builds_where_nothing_is_found(self):
        done = self.configure(self.launcher(), "-DMODAR_LIBRARY_ONLY=ON", "-DMODAR_INCLUDE_PATHS=/usr/include;/usr/include/eigen3")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_cmake("--build", "build", "-j2")
        self.assertEqual(done.returncode, 0, (done.stdout + done.stderr)[-3000:])
        done = self.run_cmake("--install", "build", "--component", "development")
        self.assertEqual(done.returncode, 0, done.stderr)
        installed = {path.name for path in (self.folder / "prefix").rglob("*")}
        self.assertLessEqual({"libmodar.so", "libmodar_runtime.a", "libmodar_formats.a", "modar.h", "modar.pc",
                              "modar-config.cmake"}, installed)
        self.assertEqual(list((self.folder / "build" / "bin").glob("*")), [], "no player")

    def test_a_type_error_is_seen(self):
        (self.folder / "planted.hpp").write_text('inline int planted = "text";\n')
        done = self.configure(self.launcher("-include", self.folder / "planted.hpp"), "-DMODAR_LIBRARY_ONLY=ON",
                              "-DMODAR_INCLUDE_PATHS=/usr/include;/usr/include/eigen3")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_cmake("--build", "build", "-j2", "--target", "modar_formats")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("planted.hpp:1", done.stdout)

    def test_a_player_is_not_configured_there(self):
        # The same without the option: shows that nothing is found indeed.
        done = self.configure("-DMODAR_DEVICE_ONLY=ON")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("PkgConfig", done.stderr)


if __name__ == "__main__":
    unittest.main()
