"""`modar` under Node against the native program: the same bytes, messages and exit codes; and the npm package in an empty folder.

MODAR_MORE: a folder whose models and pictures are baked as well, each by itself.
"""
import filecmp
import hashlib
import http.client
import json
import os
import pathlib
import shutil
import ssl
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "cli"), str(TESTS / "web")]
from browser import CHROMIUM, Browser, Server  # noqa: E402
from programs import BIN, ROOT  # noqa: E402

MODELS = ("*.obj", "*.glb", "*.gltf", "*.ply", "*.stl")
PICTURES = ("*.png", "*.jpg", "*.tif", "*.tiff", "*.webp")
ASSETS = ROOT / "assets"


class Node(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-node-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        for folder in ("native", "node"):
            (cls.base / folder).mkdir()
        package = cls.base / "package" / "bin"
        package.mkdir(parents=True)
        for file in ("modar", "paths.js", "studio.js"):
            shutil.copy(ROOT / "bake/extensions/wasm" / file, package)
        for file in ("baker.js", "baker.wasm"):
            shutil.copy(ROOT / "build/wasm/bin" / file, package)
        cls.programs = {"native": [BIN / "modar"], "node": ["node", package / "modar"]}

    def both(self, *words, environment=None):
        """Runs both programs, each in its folder; their outcomes must be the same. Answers the folders."""
        folders = [self.base / kind for kind in self.programs]
        outcomes = [subprocess.run([*program, *map(str, words)], cwd=folder, capture_output=True, env=environment)
                    for program, folder in zip(self.programs.values(), folders)]
        self.assertEqual(outcomes[0].returncode, outcomes[1].returncode, outcomes[1].stderr[-600:])
        return folders, outcomes

    def same(self, name, *words):
        folders, outcomes = self.both(*words)
        native, node = (folder / name for folder in folders)
        self.assertEqual(native.exists(), node.exists(), words)
        if native.exists():
            self.assertTrue(filecmp.cmp(native, node, shallow=False), f"{words}: other bytes")
        return outcomes

    def bake(self, *words):
        return self.same("a.modar", "bake", *words, "--quiet", "-o", "a.modar")

    def test_assets_have_the_bytes_of_the_native_program(self):
        for model in sorted((ASSETS / "models").glob("*.obj")):
            with self.subTest(model.name):
                self.bake(model)
        for picture in sorted((ASSETS / "patterns").glob("*.png")):
            with self.subTest(picture.name):
                self.bake(picture)

    def test_further_files_have_them_too(self):
        more = os.environ.get("MODAR_MORE")
        if more is None:
            self.skipTest("MODAR_MORE names no folder")
        for kinds in (MODELS, PICTURES):
            for file in sorted(file for kind in kinds for file in pathlib.Path(more).rglob(kind)):
                with self.subTest(str(file)):
                    self.bake(file)

    def test_a_scene_with_options_and_what_reads_it(self):
        self.bake(ASSETS / "models/pottery.obj", f"{ASSETS / 'patterns/cover.png'}:210mm", "--scene", "cover=pottery,scale=0.5",
                  "--jobs", "4")
        for command in (["inspect", "a.modar", "--json"], ["check", "a.modar", "--json"], ["check", "nothing.modar"],
                        ["bake", "nothing.obj", "-o", "b.modar"], ["pattern", "score", ASSETS / "patterns/cover.png", "--json"],
                        ["--version"], ["bake", "--help"]):
            with self.subTest(command):
                _, (native, node) = self.both(*command)
                self.assertEqual(native.stdout, node.stdout)
                self.assertEqual(native.stderr, node.stderr)

    def test_golden_bundles_are_checked_alike(self):
        for bundle in sorted((ROOT / "tests/golden").glob("*.modar")):
            with self.subTest(bundle.name):
                _, (native, node) = self.both("check", bundle, "--json")
                self.assertEqual(native.stdout, node.stdout)

    def test_a_project(self):
        for folder in (self.base / kind for kind in self.programs):
            project = folder / "project"
            project.mkdir()
            for file in ("models/pottery.obj", "models/pottery.mtl", "models/pottery.png", "patterns/cover.png"):
                shutil.copy(ASSETS / file, project)
        self.both("init", "project")
        for _ in range(2):  # and from its cache
            self.same("project/out/project.modar", "bake", "--project", "project", "--quiet")

    def test_what_node_cannot_do_says_what_to_do(self):
        subprocess.run([*self.programs["node"], "ship", "keygen", "-o", "k"], cwd=self.base, check=True, capture_output=True)
        for words, cause in ((["ship", "verify", "https://a.example/ar", "--trust", "k.pub"], "folders alone"),
                             (["bake", ASSETS / "models/pottery.obj", "--memory", "1G", "-o", "b.modar"], "4 GB")):
            with self.subTest(words):
                run = subprocess.run([*self.programs["node"], *map(str, words)], cwd=self.base, capture_output=True, text=True)
                self.assertNotEqual(run.returncode, 0)
                self.assertIn(cause, run.stderr)
                self.assertIn("Debian", run.stderr)

    def test_the_package_bakes_in_an_empty_folder(self):
        npm = shutil.which("npm")
        if npm is None or not (ROOT / "build/web/web/engine-plain.wasm").exists():
            self.skipTest("needs npm and the preset web")
        laid, empty = self.base / "laid", self.base / "an empty folder"
        empty.mkdir()
        subprocess.run([ROOT / "scripts/wasm/package.sh", laid], check=True)
        tarball = json.loads(subprocess.run([npm, "pack", "--json", laid], cwd=self.base, capture_output=True, check=True).stdout)[0]
        self.assertLessEqual(tarball["size"], 6_000_000)
        self.assertNotIn("scripts", json.loads((laid / "package.json").read_text()))
        subprocess.run([npm, "install", "--offline", "--no-audit", "--no-fund", self.base / tarball["filename"]], cwd=empty, check=True,
                       capture_output=True)
        for file in ("models/statue.obj", "patterns/cover.png"):
            shutil.copy(ASSETS / file, empty)
        words = ["bake", "statue.obj", "cover.png", "--quiet", "-o"]
        subprocess.run([shutil.which("npx"), "modar", *words, "poster.modar"], cwd=empty, check=True)
        subprocess.run([BIN / "modar", *words, "native.modar"], cwd=empty, check=True)
        self.assertTrue(filecmp.cmp(empty / "poster.modar", empty / "native.modar", shallow=False))
        for program, words in ((["node_modules/.bin/modar"], ["-o", "site"]), ([BIN / "modar"], ["-o", "native-site", "--page", laid])):
            subprocess.run([*program, "web", "poster.modar", *words], cwd=empty, check=True, capture_output=True)
        differing = subprocess.run(["diff", "-rq", "site", "native-site"], cwd=empty, capture_output=True, text=True)
        self.assertEqual(differing.stdout, "")


class Library(unittest.TestCase):
    """`modar/bake`, from the package's folder."""

    @classmethod
    def setUpClass(cls):
        if not (ROOT / "build/web/web/engine-plain.wasm").exists():
            raise unittest.SkipTest("needs the preset web")
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-library-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        cls.laid = cls.base / "laid"
        subprocess.run([ROOT / "scripts/wasm/package.sh", cls.laid], check=True)

    def test_the_studio_answers_as_the_native_one(self):
        """All that its pages and its attackers ask, and a project made by mouse alone."""
        environment = {**os.environ, "MODAR_STUDIO_PROGRAM": f"node {self.laid / 'bin/modar'}"}
        for name, *cases in (("edit",), ("server",), ("attack",), ("studio", "-k", "twelve_clicks")):
            with self.subTest(name):
                run = subprocess.run([sys.executable, TESTS / f"studio/{name}_test.py", *cases], env=environment, capture_output=True, text=True)
                self.assertEqual(run.returncode, 0, run.stderr[-3000:])

    def test_it_serves_a_site_to_phones(self):
        bundle, site = self.base / "served.modar", self.base / "served"
        subprocess.run([BIN / "modar", "bake", "--quiet", ASSETS / "patterns/cover.png", "-o", bundle], check=True)
        process = subprocess.Popen(["node", self.laid / "bin/modar", "web", bundle, "-o", site, "--serve", "--bind", "127.0.0.1", "--port", "0"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        url = urllib.parse.urlsplit(process.stdout.readline().strip())
        signed = self.base / "signed.pem"
        signed.write_text(ssl.get_server_certificate((url.hostname, url.port)))
        trusting = ssl.create_default_context(cafile=signed)  # and its name is looked at
        with self.assertRaises(ssl.SSLError):
            http.client.HTTPSConnection("localhost", url.port).request("GET", "/")

        def get(path, **headers):
            connection = http.client.HTTPSConnection("localhost", url.port, context=trusting)
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            body = answer.read()
            connection.close()
            return answer, body
        for name in ("index.html", "app.js", "engine-simd.wasm", "bundles/served.modar"):
            self.assertEqual(get("/" + name)[1], (site / name).read_bytes(), name)
        answer, body = get("/app.js", Range="bytes=10-19")
        self.assertEqual((answer.status, body), (206, (site / "app.js").read_bytes()[10:20]))
        self.assertEqual(get("/app.js", Range="bytes=-7")[1], (site / "app.js").read_bytes()[-7:])
        self.assertEqual(get("/app.js", Range="bytes=99999999-")[0].status, 416)
        (site / "link.txt").symlink_to(bundle)
        for path in ("/.modar-output", "/../served.modar", "/%2e%2e/served.modar", "/link.txt", "/none", "/%ff", "//", "//x:y"):
            self.assertEqual(get(path)[0].status, 404, path)

    def test_node_has_what_the_native_program_has(self):
        subprocess.run(["node", "--test", TESTS / "wasm/library_test.mjs"], check=True,
                       env={**os.environ, "MODAR_PACKAGE": str(self.laid), "MODAR_BIN_DIR": str(BIN), "MODAR_SOURCE_DIR": str(ROOT)})

    def test_the_example_bakes_in_a_browser_and_shows_it(self):
        if CHROMIUM is None:
            self.skipTest("chromium is not installed")
        shutil.copy(ROOT / "bake/extensions/wasm/example.html", self.laid)
        server = Server(self.laid)
        self.addCleanup(server.close)
        browser = Browser(self.base / "profile", "/dev/null")
        self.addCleanup(browser.close)
        browser.open(f"{server.url}example.html")
        root = browser.call("DOM.getDocument")["root"]["nodeId"]
        for name, files in (("picture", ["patterns/cover.png"]), ("model", ["models/pottery.obj", "models/pottery.mtl", "models/pottery.png"])):
            node = browser.call("DOM.querySelector", nodeId=root, selector=f"input[name={name}]")["nodeId"]
            browser.call("DOM.setFileInputFiles", files=[str(ASSETS / file) for file in files], nodeId=node)
        browser.run("document.querySelector('button').click()")
        browser.wait("document.querySelector('output').value.includes('MB')", "the bake", 600)
        browser.run("document.querySelector('modar-viewer').look()")
        browser.wait("document.querySelector('modar-viewer').state === 'around'", "the turntable")
        if os.environ.get("MODAR_SCREENSHOT"):
            time.sleep(2)
            browser.screenshot(os.environ["MODAR_SCREENSHOT"])
        hexes = browser.run("crypto.subtle.digest('SHA-256', document.querySelector('modar-viewer').srcObject).then((hash) => "
                            "[...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, '0')).join(''))")
        subprocess.run([BIN / "modar", "bake", "--quiet", *(ASSETS / file for file in ("patterns/cover.png", "models/pottery.obj")), "-o",
                        self.base / "native.modar"], check=True)
        self.assertEqual(hexes, hashlib.sha256((self.base / "native.modar").read_bytes()).hexdigest())
        self.assertEqual(browser.errors, [])

    def test_a_page_bakes_a_model_of_the_visitor_onto_its_pictures(self):
        """modar web --baker: a model with its texture from this device, in the page's lists; the bytes of `modar bake --tier phone`."""
        if CHROMIUM is None:
            self.skipTest("chromium is not installed")
        home, site = self.base / "visit", self.base / "baker-site"
        home.mkdir()
        subprocess.run([BIN / "modar", "bake", "--quiet", ASSETS / "models/bust.obj", ASSETS / "patterns/cover.png", "-o", home / "old.modar"], check=True)
        web = [BIN / "modar", "web", home / "old.modar", "--quiet", "--languages", "en"]
        refused = subprocess.run([*web, "--page", ROOT / "build/web/web", "--baker", "-o", site], capture_output=True, text=True)
        self.assertEqual((refused.returncode, "it contains no baker" in refused.stderr), (5, True), refused.stderr)
        subprocess.run([*web, "--page", self.laid, "--baker", "-o", site], check=True)
        names = [f"models/pottery.{end}" for end in ("mtl", "obj", "png")]
        server = Server(site)
        self.addCleanup(server.close)
        browser = Browser(self.base / "visitor", "/dev/null")
        self.addCleanup(browser.close)
        browser.open(server.url)
        browser.wait("document.getElementById('start').textContent !== ''", "the page")
        self.assertFalse(any("baker" in url for url in browser.requests))
        browser.run("document.getElementById('lists-open').click()")
        browser.wait("Boolean(document.querySelector('#lists input'))", "the lists")
        root = browser.call("DOM.getDocument")["root"]["nodeId"]
        node = browser.call("DOM.querySelector", nodeId=root, selector="#lists input")["nodeId"]
        browser.call("DOM.setFileInputFiles", files=[str(ASSETS / names[0])], nodeId=node)
        browser.wait("document.querySelector('#lists output').value.includes(';')", "what to do without a model", 600)
        browser.call("DOM.setFileInputFiles", files=[str(ASSETS / name) for name in names], nodeId=node)
        browser.wait("document.getElementById('bundle').options.length === 2 && document.getElementById('bundle').value === '1'", "the bake", 600)
        if os.environ.get("MODAR_SCREENSHOT"):
            browser.run("document.getElementById('viewer').look()")
            browser.wait("document.getElementById('viewer').state === 'around'", "the turntable")
            time.sleep(2)
            browser.screenshot(os.environ["MODAR_SCREENSHOT"])
        hexes = browser.run("document.getElementById('viewer').srcObject().then((bytes) => crypto.subtle.digest('SHA-256', bytes)).then((hash) => "
                            "[...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, '0')).join(''))")
        (home / "pictures").mkdir()
        shutil.copy(next(site.glob("patterns/*.webp")), home / "pictures/cover.webp")
        for name in names:
            shutil.copy(ASSETS / name, home)
        subprocess.run([BIN / "modar", "bake", "--quiet", "--tier", "phone", "--model", "pottery.obj", "--pattern", "pictures/cover.webp", "-o", "native.modar"],
                       cwd=home, check=True)
        self.assertEqual(hexes, hashlib.sha256((home / "native.modar").read_bytes()).hexdigest())


if __name__ == "__main__":
    unittest.main()
