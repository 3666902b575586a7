"""Every language is parsed, on a machine without browsers, emscripten and Android: JavaScript, Java, the page's engine, the app's bridge."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
GENERATED = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")).parent
NODE = shutil.which("node")
JAVAC = shutil.which("javac")
ENGINE = [ROOT / "runtime/extensions/web" / name for name in ("engine.cpp", "record.cpp", "update.cpp")]
# Of emscripten's header what the engine uses.
EMSCRIPTEN = "#define EMSCRIPTEN_KEEPALIVE\n#define EM_JS(type, name, parameters, ...) type name parameters\n"


def sources(*suffixes):
    return [file for folder in ("bake", "runtime", "tests") for file in sorted((ROOT / folder).rglob("*")) if file.suffix in suffixes]


class Parse(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-parse-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "emscripten.h").write_text(EMSCRIPTEN)

    def fault_in(self, language, files):
        """What the parser says of them, or nothing."""
        if language == "JavaScript":
            for file in files:
                kind = "commonjs" if file.suffix == ".cjs" else "module"
                done = subprocess.run([NODE, f"--input-type={kind}", "--check", "-"], input=file.read_text(), capture_output=True, text=True)
                if done.returncode:
                    return f"{file}: {done.stderr}"
            return ""
        if language == "Java":
            command = [JAVAC, "--should-stop=ifNoError=PARSE", "-proc:none", "-d", self.folder, *files]
        else:
            java = pathlib.Path(JAVAC).resolve().parents[1] / "include" if JAVAC else self.folder
            folders = [ROOT, ROOT / "runtime/include", ROOT / "runtime/fetch/include", self.folder, *GENERATED.glob("*/generated")]
            command = [os.environ.get("CXX", "c++"), "-std=c++20", "-fsyntax-only", "-w", "-fno-exceptions", "-fno-rtti",
                       *(f"-I{folder}" for folder in folders), "-isystem", "/usr/include/eigen3", "-isystem", java, "-isystem",
                       java / "linux", *files]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.stderr if done.returncode else ""

    def check(self, language, files, planted):
        self.assertGreater(len(files), 2)
        self.assertEqual(self.fault_in(language, files), "")
        wrong = self.folder / f"Wrong{files[0].suffix}"
        wrong.write_text(planted)
        self.assertIn("Wrong", self.fault_in(language, [wrong]))

    @unittest.skipUnless(NODE, "nodejs is not installed")
    def test_javascript(self):
        self.check("JavaScript", sources(".js", ".mjs", ".cjs"), "export const a = (1;\n")

    @unittest.skipUnless(JAVAC, "default-jdk-headless is not installed")
    def test_java(self):
        self.check("Java", sources(".java"), "class Wrong { int a = ; }\n")

    def test_the_pages_engine(self):
        self.check("C++", ENGINE, '#include <emscripten.h>\nEMSCRIPTEN_KEEPALIVE int a() { return b; }\n')

    @unittest.skipUnless(JAVAC, "default-jdk-headless is not installed")
    def test_the_apps_bridge(self):
        self.check("C++", sorted((ROOT / "runtime/extensions/android").glob("*.cpp")), "#include <jni.h>\njint a(JNIEnv* e) { return e; }\n")


if __name__ == "__main__":
    unittest.main()
