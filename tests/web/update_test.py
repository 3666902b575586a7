"""Updates of a page in three engines, from a server that never ends, stalls, drips or lags: each is given up, and the good one after
them is installed. The page tells the test itself, so no engine needs a driver."""
import hashlib
import json
import os
import pathlib
import sys
import threading
import time
import unittest
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import Quiet, engines  # noqa: E402
from programs import ROOT, ProgramTest, picture  # noqa: E402
import http.server  # noqa: E402

PAGE = ROOT / "build" / "web" / "web"

# Each visit: what the server does, what the update says of it, the release that is installed afterwards (0: none).
VISITS = [
    ("lags behind the site", "failed fetch.roll-back", 0),
    ("latest has no end", "failed fetch.too-long", 0),
    ("latest stalls", "failed fetch.network", 0),
    ("pieces have no end", "failed fetch.network", 0),
    ("pieces drip", "failed fetch.network", 0),
    ("good", "updated", 3),
    ("lags behind the store", "failed fetch.roll-back", 3),
    ("good", "current", 3),
]
# What the server may send of endless files in all before the connections end: limits, and buffers of both sides.
MOST_ENDLESS = 8 << 20

REPORT = """
const root = document.documentElement;
let told = false;
async function tell() {
  if (told || root.dataset.update === undefined) return;
  told = true;
  const scope = new URL('./', location).href;
  const { installedBundles, installedFile } = await import('./installed-release.js');
  const { release } = await (await fetch('site.json')).json();
  const bundles = await installedBundles(scope, release);
  const later = await installedBundles(scope, { ...release, version: 3 });
  let sha = '';
  if (bundles) {
    const bytes = await (await installedFile(scope, bundles[0].file)).arrayBuffer();
    sha = Array.from(new Uint8Array(await crypto.subtle.digest('SHA-256', bytes)), (b) => b.toString(16).padStart(2, '0')).join('');
  }
  const query = new URLSearchParams({ update: root.dataset.update, sha, later: later ? 'shown' : '' });
  if (await (await fetch(`told?${query}`, { cache: 'no-store' })).text() === 'again') location.reload();
}
new MutationObserver(tell).observe(root, { attributes: true });
tell();
"""


class Rude(Quiet):
    """The site; its release folder as the visit has it."""

    def do_GET(self):
        path, _, query = self.path.partition("?")
        visit = self.server.visit()
        if path == "/told":
            return self.answer(b"again" if self.server.told(urllib.parse.parse_qs(query, keep_blank_values=True)) else b"done")
        if path == "/report.js":
            return self.answer(REPORT.encode(), "text/javascript")
        if path in ("/", "/index.html"):
            page = (pathlib.Path(self.directory) / "index.html").read_bytes()
            return self.answer(page.replace(b"</head>", b'<script type="module" src="report.js"></script></head>'), "text/html")
        of_latest, of_piece = path == "/release/latest", path.startswith("/release/objects/")
        if of_latest and visit.startswith("lags"):
            return self.answer(b"1\n" if visit.endswith("site") else b"2\n")
        if (of_latest and visit == "latest has no end") or (of_piece and visit == "pieces have no end"):
            return self.drip(b"1" * 65536, 0.005, endless=True)  # a fast line: WebKit reads ahead at the loop's speed
        if of_latest and visit == "latest stalls":
            return self.drip(b"", 0.1)
        if of_piece and visit == "pieces drip":
            return self.drip(b"1", 0.1)
        return super().do_GET()

    def answer(self, body, kind="text/plain"):
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def drip(self, part, wait, endless=False):
        self.send_response(200)
        self.end_headers()
        begun = self.server.at
        try:
            while self.server.at == begun and not self.server.over:
                self.wfile.write(part)
                self.wfile.flush()
                self.server.endless += len(part) if endless else 0
                if endless and self.server.endless > 4 * MOST_ENDLESS:
                    return
                time.sleep(wait)
        except OSError:
            pass


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, folder):
        super().__init__(("127.0.0.1", 0), lambda *words: Rude(*words, directory=str(folder)))
        self.at, self.endless, self.over, self.results = 0, 0, False, []
        self.done = threading.Event()
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def handle_error(self, *_):
        pass

    def visit(self):
        return VISITS[min(self.at, len(VISITS) - 1)][0]

    def told(self, query):
        self.results.append({key: values[0] for key, values in query.items()})
        self.at += 1
        if self.at >= len(VISITS):
            self.done.set()
        return not self.done.is_set()


@unittest.skipUnless((PAGE / "engine-update.wasm").exists(), "the engine was built without updates")
class RudeUpdates(ProgramTest):
    def check(self, done):
        self.assertEqual(done.returncode, 0, done.stderr)

    def publish(self, bundle, site):
        self.check(self.modar("ship", "publish", bundle, "--to", site / "release", "--key", self.folder / "museum.key"))

    def make_site(self):
        """Made when release 2 was the newest; release 3 has come since."""
        site = self.folder / "site"
        self.check(self.modar("ship", "keygen", "--out", self.folder / "museum.key"))
        bundle, cover = self.bake_demo(), self.folder / "cover.png"
        picture(cover)
        shas = {}
        for number in (1, 2, 3):
            other = self.folder / str(number) / "demo.modar"
            other.parent.mkdir()
            self.check(self.modar("bake", "--model", ROOT / "assets/models/pottery.obj", "--pattern", cover,
                                  "--scene", f"cover=pottery,scale=0.{number}", "--loop-views", 8, "--no-score", "--lods", 1,
                                  "--parameters", "none", "-o", other, "--quiet"))
            shas[number] = hashlib.sha256(other.read_bytes()).hexdigest()
            self.publish(other, site)
            if number == 2:
                self.check(self.modar("web", bundle, "-o", site, "--release", "release", "--trust", self.folder / "museum.key.pub",
                                      "--quiet", "--force"))
        told = json.loads((site / "site.json").read_text())
        self.assertEqual((told["release"]["epoch"], told["release"]["version"], told["release"]["stall"]), (0, 2, 30))
        told["release"]["stall"] = 1  # seconds: half a minute is long for a test
        (site / "site.json").write_text(json.dumps(told))
        return site, shas

    def test_an_update_that_never_ends_stalls_or_lags_is_given_up(self):
        site, shas = self.make_site()
        names = []
        for name, start in engines(self):
            with self.subTest(name):
                names.append(name)
                server = Server(site)
                begun = time.monotonic()
                process = start(f"http://localhost:{server.server_port}/")
                try:
                    self.assertTrue(server.done.wait(240), f"{name}: only {server.results}")
                finally:
                    server.over = True
                    os.killpg(process.pid, 9)
                    process.wait()
                    server.shutdown()
                    server.server_close()
                for (what, update, release), told in zip(VISITS, server.results):
                    self.assertEqual((what, told["update"], told["sha"]), (what, update, shas.get(release, "")))
                    # A site that has come to release 3 itself shows its own.
                    self.assertEqual(told["later"], "")
                self.assertLess(server.endless, MOST_ENDLESS)
                print(f"{name}: {len(VISITS)} visits in {time.monotonic() - begun:.1f} s, {server.endless >> 10} KiB of endless files")
        self.assertTrue(names, "no browser is installed")


if __name__ == "__main__":
    unittest.main()
