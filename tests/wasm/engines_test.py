"""The static studio and the library's example in each browser that is installed: load, bake, stage. The page drives itself, with files of
its server, and posts what it found; the bundles are the native program's."""
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "cli"), str(TESTS / "web")]
from browser import engines, report_of  # noqa: E402
from programs import BIN, ROOT  # noqa: E402

FILES = ("patterns/cover.png", "models/pottery.obj", "models/pottery.mtl", "models/pottery.png")
NAMES = [file.split("/")[1] for file in FILES]
COMMON = """
const until = async (what, seconds, holds) => {
  for (const end = Date.now() + 1000 * seconds; !await holds();) {
    if (Date.now() > end) throw new Error(`${what} did not happen: ${document.body.innerText.slice(0, 300)}`);
    await new Promise((done) => { setTimeout(done, 200); });
  }
};
const get = async (names) => Promise.all(names.map(async (name) => new File([await (await fetch(`/test/${name}`)).blob()], name)));
const put = (input, files) => {
  const list = new DataTransfer();
  for (const file of files) list.items.add(file);
  input.files = list.files;
  input.dispatchEvent(new Event('change', {bubbles: true}));
};
const sha = async (bytes) => [...new Uint8Array(await crypto.subtle.digest('SHA-256', bytes))].map((byte) => byte.toString(16).padStart(2, '0')).join('');
const report = (told) => fetch('/told', {method: 'POST', body: JSON.stringify(told)});
const drive = (steps) => steps().catch((error) => report({error: `${error} ${error?.stack}`}));
addEventListener('error', ({message}) => report({error: message}));
"""
STUDIO = COMMON + """
drive(async () => {
  const begun = performance.now();
  await until('the studio', 200, () => document.querySelector('header.bar') && document.querySelector('input[type=file]'));
  const opened = performance.now();
  put(document.querySelector('input[type=file]'), await get(%s));
  const project = async () => (await fetch('api/project')).json();
  await until('the bake', 300, async () => { const {bundle, baking} = await project(); return bundle && bundle.baked && !bundle.stale && !baking; });
  const baked = performance.now();
  const bundle = await sha(await (await fetch('api/bundle')).arrayBuffer());
  location.hash = '#/scene/cover';
  await until('the stage', 100, () => document.querySelector('canvas'));
  await new Promise((done) => { setTimeout(done, 3000); });
  const notice = document.querySelector('.unkept, .notice.bad')?.innerText ?? '';
  const read = async () => {
    const projects = await (await navigator.storage.getDirectory()).getDirectoryHandle('modar-projects');
    return (await (await (await projects.getDirectoryHandle('project')).getFileHandle('modar.toml')).getFile()).text();
  };
  const text = modarStatic.kept && await read();
  await report({bundle, text, kept: modarStatic.kept, notice, opened: opened - begun, baked: baked - opened});
});
""" % json.dumps(NAMES)
EXAMPLE = COMMON + """
drive(async () => {
  const form = document.querySelector('form');
  put(form.picture, await get([%s]));
  put(form.model, await get(%s));
  document.querySelector('button').click();
  const output = document.querySelector('output');
  await until('the bake', 300, () => / MB$|;/.test(output.value));
  const viewer = document.querySelector('modar-viewer');
  if (!viewer.srcObject) throw new Error(output.value);
  viewer.look();
  await until('the turntable', 100, () => viewer.state === 'around');
  await report({bundle: await sha(viewer.srcObject)});
});
""" % (json.dumps(NAMES[0]), json.dumps(NAMES[1:]))


@unittest.skipUnless((ROOT / "build/web/web/engine-plain.wasm").exists(), "needs the preset web")
class Engines(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-engines-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def lay_files(self, site):
        (site / "test").mkdir()
        for file in FILES:
            shutil.copy(ROOT / "assets" / file, site / "test")
        return site

    def native(self, *words):
        subprocess.run([BIN / "modar", *map(str, words)], cwd=self.folder, check=True, capture_output=True)

    def in_each(self, site, page, judge):
        names = []
        for name, start in engines(self):
            with self.subTest(name):
                told = report_of(site, start, page, 420)
                self.assertNotIn("error", told)
                names.append(name)
                judge(told)
                print(name, {key: round(value) for key, value in told.items() if isinstance(value, float)}, flush=True)
        self.assertTrue(names, "no browser is installed")

    def test_the_studio(self):
        subprocess.run([ROOT / "scripts/wasm/studio.sh", self.folder / "site", self.folder / "studio.zip"], check=True)
        site = self.lay_files(self.folder / "site")
        index = site / "index.html"
        index.write_text(index.read_text().replace("</head>", '<script src="drive.js" type="module"></script></head>'))
        (site / "drive.js").write_text(STUDIO)
        project = self.folder / "project"
        shutil.copytree(site / "test", project)
        bundles = {}

        def judge(told):
            if told["kept"]:
                (project / "modar.toml").write_text(told["text"])
                subprocess.run([BIN / "modar", "bake", "--quiet"], cwd=project, check=True)
                bundles[hashlib.sha256((project / "out/project.modar").read_bytes()).hexdigest()] = True
                self.assertEqual(told["notice"], "")
            else:  # WebKitGTK gives pages no files: the page says so
                self.assertEqual(told["notice"], "not kept")
            bundles[told["bundle"]] = True
            self.assertEqual(len(bundles), 1)
        self.in_each(site, "", judge)

    def test_the_example(self):
        site = self.folder / "package"
        subprocess.run([ROOT / "scripts/wasm/package.sh", site], check=True)
        self.lay_files(site)
        (site / "drive.js").write_text(EXAMPLE)
        page = (ROOT / "bake/extensions/wasm/example.html").read_text()
        (site / "example.html").write_text(page.replace("</html>", '<script src="drive.js" type="module"></script></html>'))
        self.native("bake", "--quiet", *(ROOT / "assets" / file for file in FILES[:2]), "-o", "native.modar")
        expected = hashlib.sha256((self.folder / "native.modar").read_bytes()).hexdigest()
        self.in_each(site, "example.html", lambda told: self.assertEqual(told["bundle"], expected))


if __name__ == "__main__":
    unittest.main()
