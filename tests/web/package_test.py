"""The npm package in the projects of others: Vite, webpack, strict TypeScript, no bundler, on a server."""
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import Browser, Server  # noqa: E402
from npm_project import PAGE, install  # noqa: E402
from programs import ROOT  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent / "package"
# The newest two generations of Vite that this Node runs (Debian 12 has Node 18). Before 8, its server copies packages without the
# files next to them.
NODE = tuple(int(part) for part in subprocess.run(["node", "-p", "process.versions.node"], capture_output=True, text=True).stdout.split(".")) \
    if shutil.which("node") else ()
VITES = ("vite7", "vite8") if NODE >= (20, 19) else ("vite5", "vite6")
TOOLS = {**{vite: f"npm:vite@{vite[-1]}" for vite in VITES}, "typescript": "*", "webpack": "^5.100", "webpack-cli": "*", "@types/react": "^19"}
HTML = '<!doctype html><link rel="icon" href="data:,"><canvas id="picture"></canvas><canvas id="models"></canvas>%s'
STRICT = {"compilerOptions": {"strict": True, "noUncheckedIndexedAccess": True, "target": "es2022", "module": "esnext", "types": [],
                              "moduleResolution": "bundler", "lib": ["es2022", "dom"], "noEmit": True}, "files": ["main.ts"]}
WEBPACK = ["--mode", "production", "--entry", "./main.js", "--output-path", "packed", "--no-devtool"]


JSX = """import { useRef } from 'react';
import { type ModarViewer } from 'modar/viewer';

export function Vase() {
  const viewer = useRef<ModarViewer>(null);
  return <modar-viewer ref={viewer} src="vase.modar" alt="A vase" max-bytes={1e6} className="wide" onClick={() => { void viewer.current?.look(); }} />;
}
"""


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.base, cls.tarball = install(cls, TOOLS)
        public = cls.base / "public"
        public.mkdir()
        files = pathlib.Path(os.environ["MODAR_DEMO_FILES"])
        shutil.copy(files / "demo.modar", public)
        shutil.copy(files / "clip" / "frame_00001.png", public / "frame.png")
        shutil.copy(HERE / "main.ts", cls.base)
        (cls.base / "index.html").write_text(HTML % '<script type="module" src="/main.ts"></script>')
        (cls.base / "tsconfig.json").write_text(json.dumps(STRICT))
        cls.browser = Browser(cls.base / "profile", cls.base / "none.y4m")
        cls.addClassCleanup(cls.browser.close)

    def tool(self, package, program, *words):
        path = self.base / "node_modules" / package / program
        done = subprocess.run(["node", path, *words], cwd=self.base, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def assert_plays(self, url):
        self.browser.errors.clear()
        self.browser.open(url)
        self.browser.wait("window.result !== undefined", "the end")
        self.assertEqual(self.browser.run("window.result"), "cover,1,2,16,around,Start the camera,pottery,1")
        self.assertEqual(self.browser.errors, [])
        self.browser.open("about:blank")  # Vite's pages ask for their server when it is gone

    def assert_folder_plays(self, folder):
        server = Server(folder)
        self.addCleanup(server.close)
        self.assert_plays(server.url)

    def test_it_holds_what_people_look_for(self):
        names = {file.name for file in (self.base / "node_modules" / "modar").iterdir()}
        engines = {f"engine-{kind}.{end}" for kind in ("simd", "plain", "record-simd", "record-plain") for end in ("js", "wasm")}
        self.assertEqual({name for name in names if not name.endswith(".map")}, engines | {
            "package.json", "README.md", *(["adapters"] if (PAGE / "adapters").exists() else []), "LICENSE", "modar.js", "modar.d.ts", "modar-view.js", "modar-view.d.ts", "modar-worker.js",
            "modar-viewer.js", "modar-viewer.d.ts", "modar-worker-simd.js", "modar-worker-plain.js", "gyroscope.js", "engine.js",
            "arrival.js", "bundle.js", "camera.js", "download.js", "storage.js", "turntable.js", "media.js", "viewer-parts.js", "viewer-words.js", "lod-stream.js", "words",
            "qr.js",
            "record-worker.js", "record-worker-simd.js", "record-worker-plain.js"})
        maps = {name.removesuffix(".map") for name in names if name.endswith(".map")}
        self.assertEqual(maps, {name for name in names if name.endswith(".js") and not name.startswith("engine-")})
        licence = (self.base / "node_modules" / "modar" / "LICENSE").read_text()
        for words in ("MIT License", "Mozilla Public License", "musl"):
            self.assertIn(words, licence)

    def test_strict_types_hold(self):
        self.tool("typescript", "bin/tsc", "-p", ".")
        self.addCleanup(shutil.copy, HERE / "main.ts", self.base)
        text = (HERE / "main.ts").read_text()
        wrong = {"detail.view.length": "vew", "detail.inliers": "outliers", "viewer.look()": "lok"}
        for good, bad in wrong.items():
            self.assertIn(good, text)
            text = text.replace(good, good.replace(re.search(r"\.(\w+)", good)[1], bad, 1))
        (self.base / "main.ts").write_text(text)
        with self.assertRaises(AssertionError) as told:
            self.tool("typescript", "bin/tsc", "-p", ".")
        for bad in wrong.values():
            self.assertIn(f"Property '{bad}' does not exist", str(told.exception))

    def test_react_knows_the_element(self):
        """And TypeScript without React takes the same types: test_strict_types_hold() with its types out of the way."""
        options = {**STRICT["compilerOptions"], "jsx": "react-jsx"}
        told = {}
        for name, text in {"good": JSX, "attribute": JSX.replace("src=", "scr="), "method": JSX.replace("look()", "lok()")}.items():
            (self.base / f"{name}.tsx").write_text(text)
            (self.base / f"{name}.json").write_text(json.dumps({"compilerOptions": options, "files": [f"{name}.tsx"]}))
            told[name] = subprocess.run(["node", self.base / "node_modules/typescript/bin/tsc", "-p", f"{name}.json"], cwd=self.base, capture_output=True, text=True).stdout
        self.assertEqual(told["good"], "")
        self.assertIn("Property 'scr' does not exist", told["attribute"])
        self.assertIn("Property 'lok' does not exist", told["method"])
        types = self.base / "node_modules" / "@types"
        types.rename(self.base / "types")
        self.addCleanup((self.base / "types").rename, types)
        self.tool("typescript", "bin/tsc", "-p", ".")

    def test_vite_builds_it(self):
        for vite in VITES:
            out = self.base / f"built-{vite}"
            self.tool(vite, "bin/vite.js", "build", "--outDir", out, "--logLevel", "error")
            self.assert_folder_plays(out)

    def test_webpack_builds_it(self):
        self.tool("typescript", "bin/tsc", "main.ts", "--ignoreConfig", "--target", "es2022", "--module", "esnext",
                  "--moduleResolution", "bundler", "--types", "", "--skipLibCheck")
        self.tool("webpack-cli", "bin/cli.js", *WEBPACK)
        packed = self.base / "packed"
        (packed / "index.html").write_text(HTML % '<script src="main.js" defer></script>')
        for file in ("demo.modar", "frame.png"):
            shutil.copy(self.base / "public" / file, packed)
        self.assert_folder_plays(packed)

    def test_vites_server_shows_it(self):
        for vite in VITES:
            with socket.socket() as free:
                free.bind(("127.0.0.1", 0))
                port = free.getsockname()[1]
            words = ["node", self.base / "node_modules" / vite / "bin" / "vite.js", "--host", "127.0.0.1", "--port", str(port), "--strictPort"]
            server = subprocess.Popen(words, cwd=self.base, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            try:
                self.assertTrue(any("Local" in line for line in server.stdout), vite)
                self.assert_plays(f"http://127.0.0.1:{port}/")
            finally:
                server.terminate()
                server.wait()
                server.stdout.close()

    def test_a_server_may_import_it(self):
        self.assertEqual(subprocess.run(
            ["node", "--input-type=module", "-e", "const m = await import('modar'); const v = await import('modar/view'); const e = await import('modar/viewer'); "
             "console.log(typeof m.load, typeof v.View, typeof e.ModarViewer)"],
            cwd=self.base, capture_output=True, text=True).stdout, "function function function\n")


if __name__ == "__main__":
    unittest.main()
