"""Packed bundles in a browser: drawn as the raw ones are, refined on the way, and put together from damaged downloads."""
import functools
import hashlib
import http.server
import json
import pathlib
import shutil
import sys
import tempfile
import threading
import time
import unittest
import urllib.parse

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / folder) for folder in ("cli", "bench")]
from browser import CANVAS, KEPT, Browser, Quiet  # noqa: E402
from page_memory import resident_by_process  # noqa: E402
from programs import COVER, POTTERY, QUICK, ProgramTest  # noqa: E402

HEADER, PIECE = 64, 64


def range_from(at):
    """Requests after the first stages: MOST_ASKED of runtime/extensions/web/download.js."""
    return f"bytes={at}-{at + (4 << 20) - 1}"


# {before, coarse, whole: hashes of the drawing; events; error}. When a context is lost: true, at once; 'after' all has come; 2,
# when the bytes of stage 2 have come, in the task that draws them.
DRAW = """(async () => {
  const [{ load }, { View }] = await Promise.all([import('/modar.js'), import('/modar-view.js')]);
  """ + CANVAS + """
  const sha = async (blob) => [...new Uint8Array(await crypto.subtle.digest('SHA-1', await blob.arrayBuffer()))].join();
  const hash = async (view) => {
    view.drawFrom(0, Float32Array.of(1, 0, 0, 0, 0, 0.8, -0.6, 0, 0, 0.6, 0.8, 0, 0, 0, -1.6, 1), 300);
    return sha(await view.photograph('image/png'));
  };
  // What fades away over the models, as hash() has it: on black.
  let fading = null;
  HTMLCanvasElement.prototype.animate = function (...words) {
    const on = Object.assign(document.createElement('canvas'), { width: this.width, height: this.height });
    const context = on.getContext('2d', { alpha: false });
    context.drawImage(document.querySelector('canvas'), 0, 0);
    context.drawImage(this, 0, 0);
    const animation = Element.prototype.animate.apply(this, words), { effect } = animation;
    fading = new Promise((resolve) => { on.toBlob(resolve, 'image/png'); }).then(sha)
      .then((seen) => ({ seen, to: effect.getKeyframes().at(-1).opacity, ms: effect.getTiming().duration }));
    return animation;
  };
  const got = [], drawn = {};
  let modar;
  try {
    modar = await load(%s, { simd: %s, onProgress: (...progress) => got.push(progress) });
    const when = %s, [picture, models] = [canvas(640, 480), canvas(640, 480)];
    const lose = () => new Promise((resolve) => {
      const context = models.getContext('webgl2').getExtension('WEBGL_lose_context');
      models.addEventListener('webglcontextrestored', () => resolve(true));
      models.addEventListener('webglcontextlost', () => setTimeout(() => context.restoreContext(), 50));
      context.loseContext();
    });
    let restored = false;
    const { arrival } = modar, { download } = arrival;
    arrival.download = async (stage, take) => {
      await download.call(arrival, stage, take);
      if (stage === when) restored = lose();
    };
    const view = await View.create(modar, { simd: modar.kind === 'simd', picture, models });
    drawn.patterns = view.patterns.map(({ name }) => name);
    const coarse = new Promise((resolve) => view.addEventListener('refined', () => resolve(hash(view)), { once: true }));
    view.addEventListener('refined', () => { drawn.refined = (drawn.refined ?? 0) + 1; });
    drawn.first = await hash(view);
    if (when === true) restored = await lose();
    if (!modar.arrival.inOrder) drawn.coarse = await Promise.race([coarse, view.whole.then(() => coarse)]);
    await view.whole;
    drawn.lost = await restored;
    drawn.whole = await hash(view);
    drawn.fading = await fading;
    view.drawFrom(0, Float32Array.of(1, 0, 0, 0, 0, 0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, -1.6, 1), 300);
    drawn.left = document.querySelectorAll('canvas').length;
    drawn.kept = view.bytes.reduce((count, byte) => count + (byte !== 0), 0);
    if (when === 'after') {
      const refined = new Promise((resolve) => view.addEventListener('refined', resolve, { once: true }));
      await lose();
      drawn.meanwhile = await hash(view);
      await refined;
      drawn.again = await hash(view);
    }
  } catch (error) {
    drawn.error = error.code ?? String(error);
  }
  drawn.progress = got.at(-1);
  modar?.close();
  document.body.replaceChildren();
  return drawn;
})()"""


# Answers of a network, released one after the other.
RELEASE = """(async () => {
  const { release } = await import('/engine.js');
  const answer = new Blob([new Uint8Array(1e6).fill(7)]);
  const lengths = [];
  for (let i = 0; i < 48; ++i) {
    const bytes = new Uint8Array(await answer.arrayBuffer());
    release(bytes);
    lengths.push(bytes.length);
  }
  return Math.max(...lengths);
})()"""


def pieces_of(packed):
    """[(first byte, bytes, stage)] by the specification: formats/shipping.md."""
    count, at = int.from_bytes(packed[12:16], "little"), 0
    pieces, at = [], HEADER + PIECE * count
    for i in range(count):
        record = packed[HEADER + PIECE * i:HEADER + PIECE * (i + 1)]
        size = int.from_bytes(record[44:48], "little")
        pieces.append((at, size, record[55]))
        at += size
    assert at == len(packed)
    return pieces


def flipped(data, at):
    return data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1:]


class Host(Quiet):
    """Answers of /KIND/demo.packed are damaged in that way: each, or the first alone. The pages of VISITS are the site's."""

    VISITS = ("visited", "mended")

    def do_GET(self):
        kind, _, name = urllib.parse.urlsplit(self.path).path.lstrip("/").partition("/")
        if not name.endswith("demo.packed"):
            if kind in self.VISITS:
                self.path = "/" + name
            return super().do_GET()
        whole = self.server.packed
        asked = self.server.asked.setdefault(kind, [])
        ranged = self.headers.get("Range")
        asked.append(ranged)
        first = len(asked) == 1
        (a, a_size, _), (b, b_size, _) = self.server.swapped
        damage = {
            "flipped": lambda: flipped(whole, a + a_size // 2) if first else whole,
            "recipe": lambda: flipped(whole, HEADER + 30) if first else whole,
            "version": lambda: flipped(whole, 9),
            "count": lambda: whole[:12] + b"\xff\xff\xff\xff" + whole[16:],
            "swapped": lambda: whole[:a] + whole[b:b + b_size] + whole[a:a + a_size] + whole[b + b_size:] if first else whole,
            "mended": lambda: flipped(whole, b + b_size // 2) if len(asked) <= 3 else whole,
            "forged": lambda: flipped(whole, b + b_size // 2),
        }
        body = damage.get(kind, lambda: whole)()
        start, end = ranged[6:].split("-") if ranged and kind != "rangeless" else (0, "")
        start, end = int(start), int(end or len(body) - 1)
        part = body[start:end + 1]
        ranged = ranged if kind != "rangeless" else None
        cut = {"torn": len(whole) // 3, "rangeless": len(whole) // 2 if first else None, "closing": len(whole) // 4,
               "short": len(whole) // 2 if first else None}.get(kind)
        self.send_response(206 if ranged else 200)
        self.send_header("Content-Type", "application/octet-stream")
        self.send_header("Content-Length", str(len(part) if kind != "short" or cut is None else cut))
        if kind not in self.VISITS:
            self.send_header("Cache-Control", "no-store")
        if ranged:
            self.send_header("Content-Range", f"bytes {start}-{end}/{len(body)}")
        self.end_headers()
        try:
            self.wfile.write(part[:cut])
            self.server.sent[kind] = self.server.sent.get(kind, 0) + len(part[:cut])
            if cut:
                time.sleep(0.3)  # a browser drops what it has not handed on yet
        except OSError:
            pass  # the page has what it wants
        self.close_connection = True


class Arrival(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-arrival-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        test = cls("run_program")
        test.folder = cls.base
        bundle, site = cls.base / "demo.modar", cls.base / "site"
        for words in (["bake", "--model", POTTERY, "--pattern", COVER, "--scene", "cover=pottery,scale=0.5", "-o", bundle, "--quiet", *QUICK],
                      ["web", bundle, "-o", site, "--quiet"]):
            done = test.modar(*words)
            if done.returncode != 0:
                raise AssertionError(done.stderr)
        cls.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Host, directory=str(site)))
        cls.http.packed, cls.http.asked = (site / "bundles" / "demo.packed").read_bytes(), {}
        cls.http.sent = {}
        cls.raw = (site / "bundles" / "demo.modar").stat().st_size
        pieces = pieces_of(cls.http.packed)
        cls.pieces = pieces
        cls.http.swapped = pieces[-2:]
        threading.Thread(target=cls.http.serve_forever, daemon=True).start()
        cls.addClassCleanup(cls.http.server_close)
        cls.addClassCleanup(cls.http.shutdown)
        cls.browser = Browser(cls.base / "profile", cls.base / "none.y4m")
        cls.addClassCleanup(cls.browser.close)
        cls.browser.open(f"http://localhost:{cls.http.server_port}/site.json")
        cls.wanted = cls.draw("'/bundles/demo.modar'")

    @classmethod
    def draw(cls, source, lose=False, simd=True):
        return cls.browser.run(DRAW % (source, json.dumps(simd), json.dumps(lose)))

    def test_it_is_drawn_as_the_raw_bundle_is(self):
        self.assertNotIn("error", self.wanted)
        self.assertEqual(self.wanted["first"], self.wanted["whole"])
        drawn = self.draw("'/right/demo.packed'")
        print(f"raw {self.raw} bytes, packed {len(self.http.packed)}, the patterns {sum(size for _, size, stage in self.pieces if stage == 1)}")
        self.assertEqual(drawn.pop("fading"), {"seen": drawn["coarse"], "to": "0", "ms": 250}, "coarse models fade away over fine ones")
        self.assertIsNone(self.wanted["fading"])
        self.assertEqual({**drawn, "coarse": 0, "first": 0},
                         {"coarse": 0, "first": 0, "left": 2, "refined": 2, "whole": self.wanted["whole"], "patterns": ["cover"], "lost": False,
                          "kept": self.wanted["kept"], "progress": [len(self.http.packed)] * 2})
        # First nothing, then something that is not all.
        self.assertEqual(len({drawn["first"], drawn["coarse"], drawn["whole"]}), 3)
        self.assertEqual(self.http.asked["right"], [None])
        self.assertLess(len(self.http.packed), 0.65 * self.raw)
        # Whatever unpacks it, its hashes hold: those of the pieces, then those of the sections.
        self.assertEqual(self.draw("'/plain/demo.packed'", simd=False)["whole"], self.wanted["whole"])

    def test_what_shows_something_is_asked_for_first(self):
        address = json.loads((self.base / "site" / "site.json").read_text())["bundles"][0]["file"]
        first = int(address.rpartition("&first=")[2])
        self.assertEqual(first, next(at for at, _, stage in self.pieces if stage == 3))
        for kind, asked in (("staged", ["bytes=0-40959", f"bytes=40960-{first - 1}", range_from(first)]), ("rangeless", ["bytes=0-40959"])):
            self.http.asked[kind] = ["before"] if kind == "rangeless" else []  # its first answer is cut short
            drawn = self.draw(f"'/{kind}/demo.packed?first={first}'")
            self.assertEqual((drawn.get("whole"), drawn["refined"]), (self.wanted["whole"], 2))
            self.assertEqual(self.http.asked.pop(kind)[-len(asked):], asked)

    def visit(self, kind):
        """A first visit, until the service worker keeps the page: requests of the bundle, their bytes, and the kept ones."""
        self.addCleanup(self.browser.open, f"http://localhost:{self.http.server_port}/site.json")
        self.browser.open(f"http://localhost:{self.http.server_port}/{kind}/")
        engine = "performance.getEntriesByType('resource').find(({ name }) => name.endsWith('/engine-simd.wasm'))"
        self.browser.wait(f"{engine}?.initiatorType === 'link'", "what index.html asks for before any script does", 30)
        self.browser.wait(KEPT, "the bundle is kept")
        kept = self.browser.run("""(async () => {
          const names = (await caches.keys()).filter((name) => name.includes(location.pathname));
          const bundle = await (await caches.open(names[0])).match('bundles/demo.packed', { ignoreSearch: true });
          const hash = new Uint8Array(await crypto.subtle.digest('SHA-256', await bundle.arrayBuffer()));
          return [names.length, Array.from(hash, (byte) => byte.toString(16).padStart(2, '0')).join('')];
        })()""")
        self.assertEqual(kept, [1, hashlib.sha256(self.http.packed).hexdigest()])
        return self.http.asked[kind], self.http.sent[kind]

    def test_a_first_visit_brings_the_bundle_once_by_ranges(self):
        first = next(at for at, _, stage in self.pieces if stage == 3)
        staged = ["bytes=0-40959", f"bytes=40960-{first - 1}", range_from(first)]
        asked, sent = self.visit("visited")
        print(f"a first visit, with what the service worker fetches: {len(asked)} requests, {sent} bytes of a bundle of {len(self.http.packed)}")
        self.assertEqual((asked, sent), (staged, len(self.http.packed)))
        # Of damaged downloads, no copy is kept: the worker downloads its own.
        asked, _ = self.visit("mended")
        at, size, _ = self.http.swapped[1]
        self.assertEqual(asked[:-1], [*staged, f"bytes={at}-{at + size - 1}"])
        self.assertIn(asked[-1], (None, "bytes=0-"))  # the browser's own range, of what it has in part

    def test_bytes_in_hand_and_lost_contexts(self):
        bytes_of = "await (await fetch('/bundles/demo.packed')).arrayBuffer()"
        for lose in (False, True, 2):
            drawn = self.draw(bytes_of, lose)
            self.assertEqual((drawn.get("whole"), drawn.get("lost")), (self.wanted["whole"], lose is not False), (lose, drawn))
        self.assertIn(self.draw(f"new Uint8Array({bytes_of}).fill(7, 99999, 100200)").get("error", "").split(".")[0], ("piece", "record"))

    def test_what_the_gpu_draws_from_is_not_kept_and_asked_for_again_after_a_loss(self):
        bundle = (self.base / "site" / "bundles" / "demo.modar").read_bytes()
        count, entries = int.from_bytes(bundle[12:16], "little"), []
        for at in range(64, 64 + 48 * count, 48):
            entries.append((int.from_bytes(bundle[at:at + 4], "little"), *(int.from_bytes(bundle[i:i + 8], "little") for i in (at + 16, at + 24))))
        head = min(offset for kind, offset, _ in entries if kind >= 512)
        drawn_from = len(bundle) - head - bundle[head:].count(0)
        kept = self.wanted["kept"] - (head - bundle[:head].count(0))
        print(f"of {drawn_from} bytes that are drawn from, {kept} are kept in the page's memory")
        self.assertLess(kept, 0.6 * drawn_from)
        first = next(at for at, _, stage in self.pieces if stage == 3)
        for name, begins in (("after/demo.packed", first), ("bundles/demo.modar", head)):
            with self.subTest(name):
                drawn = self.draw(f"'/{name}'", lose="after")
                self.assertEqual((drawn.get("whole"), drawn.get("again"), drawn.get("error")), (self.wanted["whole"], self.wanted["whole"], None))
                self.assertNotIn(drawn["meanwhile"], (drawn["first"], drawn["whole"]) if "packed" in name else (None,), "the coarsest")
                if "packed" in name:
                    self.assertEqual(self.http.asked["after"], [None, f"bytes={begins}-"])

    def test_what_is_released_leaves_memory_at_once(self):
        renderer = lambda: resident_by_process(self.browser.process.pid)["renderer"] / 1e6  # noqa: E731
        before = renderer()
        self.assertEqual(self.browser.run(RELEASE), 0)
        print(f"of 48 MB that were released, {renderer() - before:.0f} MB are in memory")
        self.assertLess(renderer() - before, 20)

    def test_damaged_raw_bundles_are_refused(self):
        bytes_of = "new Uint8Array(await (await fetch('/bundles/demo.modar')).arrayBuffer())"
        for change, code in (("fill(7, -900, -890)", "section.hash"), ("fill(7, 60, 90)", "bundle."), ("slice(0, -4096)", "web.download"), ("slice(0, 30)", "bundle.")):
            with self.subTest(change):
                drawn = self.draw(f"{bytes_of}.{change}")
                self.assertTrue(drawn.get("error", "").startswith(code), drawn)
                self.assertNotIn("whole", drawn)

    def test_damaged_downloads_are_mended(self):
        for kind in ("flipped", "recipe", "swapped", "torn", "short", "rangeless", "closing"):
            with self.subTest(kind):
                drawn = self.draw(f"'/{kind}/demo.packed'")
                self.assertEqual((drawn.get("whole"), drawn.get("error")), (self.wanted["whole"], None))
                asked = self.http.asked[kind]
                self.assertGreater(len(asked), 1)
                if kind == "flipped":  # that piece alone
                    at, size, _ = self.http.swapped[0]
                    self.assertEqual(asked[1], f"bytes={at}-{at + size - 1}")

    def test_what_stays_damaged_is_refused(self):
        for kind, code in (("forged", "piece."), ("version", "recipe.version"), ("count", "web.download"), ("none", "web.download")):
            with self.subTest(kind):
                if kind == "none":
                    drawn = self.draw("'/none.packed'")
                else:
                    drawn = self.draw(f"'/{kind}/demo.packed'")
                self.assertTrue(drawn.get("error", "").startswith(code), drawn)
                self.assertNotIn("whole", drawn)


if __name__ == "__main__":
    unittest.main()
