"""The studio as a static page in Chromium: by file chooser and buttons alone, kept, offline, in one tab; what it makes is what the native
program makes of the same files."""
import filecmp
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "cli"), str(TESTS / "web")]
from browser import CHROMIUM, Browser, Server  # noqa: E402
from programs import BIN, ROOT  # noqa: E402

ASSETS = ROOT / "assets"
FILES = ("patterns/cover.png", "models/pottery.obj", "models/pottery.mtl", "models/pottery.png")
STARTED = "Boolean(globalThis.modarStatic && document.querySelector('header.bar'))"


@unittest.skipUnless(CHROMIUM and (ROOT / "build/web/web/engine-plain.wasm").exists(), "needs chromium and the preset web")
class StaticStudio(unittest.TestCase):
    def setUp(self):
        self.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-static-"))
        self.addCleanup(shutil.rmtree, self.base, ignore_errors=True)
        archive = self.base / "studio.zip"
        subprocess.run([ROOT / "scripts/wasm/studio.sh", self.base / "laid", archive], check=True)
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(self.base)
        self.server = Server(self.base / "modar-studio")
        self.addCleanup(self.server.close)
        self.browser = self.start("profile")

    def start(self, profile):
        browser = Browser(self.base / profile, "/dev/null", size=(1280, 900))
        self.addCleanup(browser.close)
        session, browser.session = browser.session, None
        (self.base / "got").mkdir(exist_ok=True)
        browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.base / "got"))
        browser.session = session
        browser.open(self.server.url)
        browser.wait(STARTED, "the studio", 120)
        return browser

    def project(self):
        return json.loads(self.browser.run("fetch('api/project').then((answer) => answer.text())"))

    def drop(self, *files):
        self.choose("input[type=file]", *(ASSETS / file for file in files))

    def choose(self, selector, *files):
        for last in (False, False, True):
            root = self.browser.call("DOM.getDocument")["root"]["nodeId"]
            node = self.browser.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
            try:
                return self.browser.call("DOM.setFileInputFiles", files=list(map(str, files)), nodeId=node)
            except RuntimeError:  # it has been drawn anew meanwhile
                if last:
                    raise

    def baked(self):
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({bundle, baking}) => "
                          "Boolean(bundle && bundle.baked && !bundle.stale && !baking))", "the bake", 300)

    def download(self, index):
        """What the button of an export makes."""
        self.browser.run(f"document.querySelectorAll('li.way-out button')[{index}].click()")
        link = f"document.querySelectorAll('li.way-out')[{index}].querySelector('a.small')"
        self.browser.wait(f"Boolean({link})", "the export", 300)
        name = self.browser.run(f"{link}.href.split('/').pop()")
        self.browser.run(f"{link}.click()")
        for _ in range(300):
            if (self.base / "got" / name).exists():
                break
            self.browser.run("new Promise((done) => setTimeout(done, 100))")
        with zipfile.ZipFile(self.base / "got" / name) as packed:
            packed.extractall(self.base / name)
        return self.base / name

    def test_from_two_files_to_a_site(self):
        self.drop(*FILES)
        self.baked()
        self.browser.run("location.hash = '#/scene/cover'")
        self.browser.wait("Boolean(document.querySelector('canvas'))", "the stage")
        self.browser.run("location.hash = '#/ship'")
        self.browser.wait("document.querySelectorAll('li.way-out').length === 2", "the ways out")
        site, project = self.download(0), self.download(1)
        self.assertEqual(sorted(file.name for file in project.rglob("*")), sorted(["modar.toml", *(file.split("/")[1] for file in FILES)]))
        # The project goes to a workstation, which makes the same bundle and site of it.
        work = self.base / "project"
        shutil.move(project, work)
        subprocess.run([BIN / "modar", "bake", "--quiet"], cwd=work, check=True)
        bundle = self.browser.run("fetch('api/bundle').then((answer) => answer.arrayBuffer()).then((bytes) => crypto.subtle.digest('SHA-256', bytes))"
                                  ".then((hash) => [...new Uint8Array(hash)].join())")
        self.assertEqual(bundle, ",".join(map(str, hashlib.sha256((work / "out/project.modar").read_bytes()).digest())))
        subprocess.run([BIN / "modar", "web", "out/project.modar", "--quiet", "-o", self.base / "native", "--page", self.base / "modar-studio/engine",
                        "--title", "project"], cwd=work, check=True)
        compared = filecmp.dircmp(site, self.base / "native")
        self.assertEqual((compared.left_only, compared.right_only, compared.diff_files), ([], [], []))
        # Nothing has been asked of any other server, and nothing sent to this one.
        self.assertEqual({url for url in self.browser.requests if not str(url).startswith((self.server.url, "blob:", "data:"))}, set())

    def test_it_is_kept_and_opens_without_a_server(self):
        self.drop("patterns/cover.png")
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({patterns}) => patterns.length === 1)", "the picture")
        before = self.project()
        self.browser.wait("fetch('files.json').then((answer) => answer.json()).then((names) => Promise.all(names.map((name) => caches.match(name))))"
                          ".then((found) => found.every(Boolean))", "the copies of all files")
        self.server.close()
        self.browser.open("about:blank")
        self.browser.open(self.server.url)
        self.browser.wait(STARTED, "the studio without a server", 120)
        after = self.project()
        self.assertEqual([after[key] for key in ("revision", "patterns", "files")], [before[key] for key in ("revision", "patterns", "files")])

    def restart(self):
        """The browser ends without a word, and comes back."""
        self.browser.process.kill()
        self.browser.process.wait()
        self.browser = self.start("profile")

    def wait_for_page(self, condition, what):
        """While the page is loaded anew, it answers nothing."""
        for _ in range(1200):
            try:
                if self.browser.run(f"!globalThis.before && {STARTED} && {condition}"):
                    return
            except RuntimeError:
                pass
            time.sleep(0.1)
        raise AssertionError(f"{what} did not happen; console: {self.browser.errors}")

    def press(self, label):
        self.browser.run("document.querySelector('.projects') || document.querySelector('button.project').click()")
        find = f"[...document.querySelectorAll('.projects button')].find((button) => button.textContent === {label!r})"
        self.browser.wait(f"Boolean({find})", label)
        self.browser.run("globalThis.before = true")
        self.browser.run(f"{find}.click()")
        self.wait_for_page("true", f"the page after {label}")

    def test_projects_have_names_and_folders_and_come_back_from_archives(self):
        self.drop("patterns/cover.png")
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({patterns}) => patterns.length === 1)", "the picture")
        self.browser.run("document.querySelector('button.project').click()")
        self.browser.wait("Boolean(document.querySelector('.projects input'))", "the menu")
        self.browser.run("(() => { const name = document.querySelector('.projects input'); name.value = 'Haus am Fluß'; "
                         "name.dispatchEvent(new Event('change')); })()")
        self.browser.wait("document.querySelector('button.project').innerText === 'Haus am Fluß'", "the name")
        before = self.project()
        archive = self.base / "Fluß.zip"
        with zipfile.ZipFile(archive, "w") as packed:
            packed.write(ASSETS / "patterns/cover.png", "cover.png")
            packed.writestr("modar.toml", '[project]\nname = "from afar"\n[[pattern]]\nfile = "cover.png"\nwidth = "210mm"\n')
        self.choose(".projects input[type=file]", archive)
        self.wait_for_page("document.querySelector('button.project').innerText === 'from afar'", "the archive's project")
        self.assertEqual([pattern["width_mm"] for pattern in self.project()["patterns"]], [210])
        # The person grants a folder, here one of the browser's own.
        self.browser.run("globalThis.showDirectoryPicker = async () => (await navigator.storage.getDirectory()).getDirectoryHandle('granted', {create: true})")
        self.press("Open a folder of this computer")
        self.assertEqual((self.project()["name"], self.project()["patterns"]), ("granted", []))
        self.drop("patterns/game.png")
        granted = ("navigator.storage.getDirectory().then((root) => root.getDirectoryHandle('granted')).then((folder) => folder.getFileHandle('{}'))"
                   ".then((file) => file.getFile()).then((file) => file.size, () => 0)")
        self.browser.wait(granted.format("game.png") + f".then((size) => size === {(ASSETS / 'patterns/game.png').stat().st_size})", "the picture in the folder")
        self.browser.wait(granted.format("modar.toml"), "modar.toml in the folder")
        self.press("project")
        self.assertEqual([self.project()[key] for key in ("name", "revision", "patterns")], [before[key] for key in ("name", "revision", "patterns")])

    def quota(self, **size):
        self.browser.call("Storage.overrideQuotaForOrigin", origin=self.server.url.rstrip("/"), **size)

    def test_a_full_disk_is_told_and_nothing_is_lost(self):
        self.drop("patterns/cover.png")
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({patterns}) => patterns.length === 1)", "the picture")
        self.quota(quotaSize=1000)
        self.drop("patterns/game.png")
        self.browser.wait("document.querySelector('.notice.bad')?.innerText.includes('no more room')", "the message")
        self.quota()
        self.drop("patterns/poems.png")
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({patterns}) => patterns.length === 3)", "the third picture")
        before = self.project()
        self.restart()
        after = self.project()
        self.assertEqual([after[key] for key in ("revision", "patterns", "files")], [before[key] for key in ("revision", "patterns", "files")])

    def test_closing_in_a_bake_loses_nothing(self):
        self.drop(*FILES)
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({baking}) => baking)", "the job")
        before = self.project()
        self.restart()
        after = self.project()
        self.assertEqual([after[key] for key in ("revision", "patterns", "models", "files")], [before[key] for key in ("revision", "patterns", "models", "files")])
        self.browser.run("fetch('api/bake', {method: 'POST', body: '{}'})")
        self.baked()

    def test_a_second_tab_says_so(self):
        self.browser.run("navigator.locks.query().then(({held}) => held.length)")
        session, self.browser.session = self.browser.session, None
        target = self.browser.call("Target.createTarget", url=self.server.url)["targetId"]
        self.browser.session = self.browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.browser.wait("document.body?.innerText.includes('open in another tab')", "the message")
        self.browser.session = session
        self.assertEqual(self.project()["patterns"], [])

    def test_a_job_is_cancelled_and_a_wrong_file_is_told(self):
        self.drop(*FILES)
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({baking}) => baking)", "the job")
        self.browser.run("fetch('api/job', {method: 'DELETE'})")
        self.browser.wait("fetch('api/project').then((answer) => answer.json()).then(({baking}) => !baking)", "its end")
        self.assertFalse(self.project()["bundle"]["baked"])
        told = json.loads(self.browser.run("fetch('api/files/modar.toml', {method: 'PUT', body: new Blob(['x'])}).then((answer) => answer.text())"))
        self.assertEqual(told["code"], "studio.name")
        self.assertNotEqual(told["cure"], "")

    def test_work_that_breaks_off_is_told_and_ends(self):
        # The job's worker alone gets a message with a job: there the program cannot start.
        worker = self.base / "modar-studio/studio-worker.js"
        worker.write_text(worker.read_text().replace("isJob = true;", "isJob = true;\n  throw new RangeError('out of memory');", 1))
        page = self.base / "modar-studio/engine/files.json"
        page.rename(page.with_suffix(".away"))
        self.browser = self.start("other")
        self.browser.run("(globalThis.told = new Promise((resolve) => new EventSource('').addEventListener('failed', ({data}) => resolve(data))), true)")
        self.drop(*FILES)
        failure = json.loads(self.browser.run("told"))
        self.assertEqual((failure["code"], "out of memory" in failure["error"]), ("studio.memory", True), failure)
        self.assertFalse(self.project()["baking"])
        # A site is made of the page's files, one of which the server does not have.
        refused = json.loads(self.browser.run("fetch('api/export', {method: 'POST', body: '{\"kind\": \"zip\"}'}).then((answer) => answer.text())"))
        self.assertEqual((refused["code"], refused["error"], refused["cure"]),
                         ("studio.page", "engine/files.json: the server answered 404", "try again"))


if __name__ == "__main__":
    unittest.main()
