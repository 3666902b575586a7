"""A bundle that is larger than what a page may have on the GPU: levels come by ranges when a view needs them, go when none does, and
no picture waits for them."""
import functools
import hashlib
import http.server
import json
import math
import pathlib
import shutil
import sys
import tempfile
import threading
import time
import unittest
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from arrival_test import flipped, pieces_of  # noqa: E402
from browser import CANVAS, Browser, Quiet  # noqa: E402
from programs import COVER, QUICK, ProgramTest  # noqa: E402

STEPS = 72  # squares along a side of each ground
BUDGET = 300_000  # bytes: one of them from near, and the drawing until it has come
# Opens a view of a bundle, then draws it from places above the ground, [x, y, height] in its plane, each until nothing more comes; the
# eye goes to and fro by `sway`.
LOOK = """(async () => {
  const [{ load }, { View }] = await Promise.all([import('/modar.js'), import('/modar-view.js')]);
  """ + CANVAS + """
  const from = ([x, y, height]) => Float32Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -height, 1);
  const hash = async (view, place) => {
    view.drawFrom(0, from(place), 300);
    const bytes = await (await view.photograph('image/png')).arrayBuffer();
    return [...new Uint8Array(await crypto.subtle.digest('SHA-1', bytes))].join();
  };
  const seen = { first: null, last: [], most: 0, longest: 0, frames: 0, fades: 0, told: [] };
  console.info = (text) => seen.told.push(text);
  let modar;
  try {
    modar = await load(%(source)s);
    const view = await View.create(modar, { picture: canvas(320, 240), models: canvas(320, 240), fixedLight: true, maxBytes: %(budget)d });
    await view.whole;
    let refined = performance.now();
    view.addEventListener('refined', () => { refined = performance.now(); });
    for (const place of %(places)s) {
      if (%(sway)g) view.drawFrom(0, from([place[0] + %(sway)g, place[1], place[2]]), 300);  // it moves before anything has come
      else seen.first ??= await hash(view, place);
      refined = performance.now();
      for (let before = refined, now; (now = await new Promise(requestAnimationFrame)) - refined < %(patience)d; before = now) {
        view.drawFrom(0, from([place[0] + %(sway)g * (seen.frames %% 2), place[1], place[2]]), 300);
        if (%(sway)g) await new Promise((done) => setTimeout(done, 100));  // longer than STILL_MS: the view repeats its drawing meanwhile
        const fades = document.getAnimations().length;
        if (fades > 0) refined = now;  // what has come meanwhile waits for its end
        seen.fades = Math.max(seen.fades, fades);
        seen.most = Math.max(seen.most, view.gpuBytes);
        seen.longest = Math.max(seen.longest, now - before);
        ++seen.frames;
      }
      seen.last.push(await hash(view, place));
    }
    seen.left = document.querySelectorAll('canvas').length;
  } catch (error) {
    seen.error = error.code ?? String(error);
  }
  modar?.close();
  document.body.replaceChildren();
  return seen;
})()"""


def write_ground(path, phase):
    """A hilly ground of two materials, hence chunks."""
    def height(i, j):
        return 0.02 * math.sin(0.5 * i + phase) * math.cos(0.4 * j) + 0.01 * math.sin(0.9 * i + 0.7 * j + phase)
    lines = [f"mtllib {path.stem}.mtl"]
    lines += [f"v {i / STEPS:.5f} {j / STEPS:.5f} {height(i, j):.5f}" for j in range(STEPS + 1) for i in range(STEPS + 1)]
    for half in range(2):
        lines.append(f"usemtl half{half}")
        for j in range(half * STEPS // 2, (half + 1) * STEPS // 2):
            for a in range(j * (STEPS + 1) + 1, j * (STEPS + 1) + 1 + STEPS):
                lines += [f"f {a} {a + 1} {a + STEPS + 2}", f"f {a} {a + STEPS + 2} {a + STEPS + 1}"]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text("".join(f"newmtl half{half}\nKd 0.{phase + 2} 0.5 0.{9 - 4 * half}\n" for half in range(2)))


class Host(Quiet):
    """/KIND/NAME: the site's file NAME, its ranges as the kind of host gives them."""

    def do_GET(self):
        kind, _, name = urllib.parse.urlsplit(self.path).path.lstrip("/").partition("/")
        if not name.startswith("ground."):
            return super().do_GET()
        whole = self.server.files[name]
        asked = self.headers.get("Range") if kind != "rangeless" else None
        start, end = asked[6:].split("-") if asked else (0, "")
        start, end = int(start), min(int(end or len(whole) - 1), len(whole) - 1)
        ranges = self.server.ranges.setdefault(kind, [])
        again = (start, end) in ranges
        ranges.append((start, end))
        body = whole[start:end + 1]
        with self.server.lock:
            self.server.at_once += 1
            self.server.most_at_once = max(self.server.most_at_once, self.server.at_once)
        if asked and start >= self.server.first[name]:
            if kind == "slow":
                time.sleep(0.4)
            if kind == "wrong" and not again and len(body) > 1:
                body = flipped(body, len(body) // 2)
            if kind == "short" and not again and len(body) > 1:
                body = body[:len(body) // 2]
        self.send_response(206 if asked else 200)
        self.send_header("Content-Type", "application/octet-stream")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        if asked:
            self.send_header("Content-Range", f"bytes {start}-{end}/{len(whole)}")
        self.end_headers()
        try:
            self.wfile.write(body)
        except OSError:
            pass  # the page has what it wants
        with self.server.lock:
            self.server.at_once -= 1


class Wanted(ProgramTest):
    # Three of four grounds from near.
    NEAR, OTHER, THIRD = [-0.5, -0.5, 0.45], [0.5, 0.5, 0.45], [-0.5, 0.5, 0.45]

    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-wanted-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        test = cls("run_program")
        test.folder = cls.base
        bundle, site = cls.base / "ground.modar", cls.base / "site"
        models = []
        for i in range(4):
            write_ground(cls.base / f"ground{i}.obj", i)
            models += ["--model", cls.base / f"ground{i}.obj", "--scene", f"cover=ground{i},up=z,scale=0.5,offset={i % 2 / 2 - 0.25}:{i // 2 / 2 - 0.25}:0"]
        for words in (["bake", *models, "--pattern", COVER, "--no-occlusion", "--no-shadows", "-o", bundle, "--quiet", *QUICK], ["web", bundle, "-o", site, "--quiet"]):
            done = test.modar(*words)
            if done.returncode != 0:
                raise AssertionError(done.stderr)
        cls.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Host, directory=str(site)))
        cls.http.files = {name: (site / "bundles" / name).read_bytes() for name in ("ground.packed", "ground.modar")}
        cls.pieces = pieces_of(cls.http.files["ground.packed"])
        cls.http.first = {"ground.packed": next(at for at, _, stage in cls.pieces if stage == 3), "ground.modar": 0}
        cls.http.ranges, cls.http.lock, cls.http.at_once, cls.http.most_at_once = {}, threading.Lock(), 0, 0
        threading.Thread(target=cls.http.serve_forever, daemon=True).start()
        cls.addClassCleanup(cls.http.server_close)
        cls.addClassCleanup(cls.http.shutdown)
        cls.browser = Browser(cls.base / "profile", cls.base / "none.y4m")
        cls.addClassCleanup(cls.browser.close)
        cls.browser.open(f"http://localhost:{cls.http.server_port}/site.json")
        cls.whole = cls.look("whole/ground.packed", [cls.NEAR, cls.OTHER, cls.THIRD], budget=0)

    @classmethod
    def look(cls, name, places, budget=BUDGET, patience=2000, sway=0):
        first = f"?first={cls.http.first[name.split('/')[1]]}" if name.endswith(".packed") else ""
        return cls.browser.run(LOOK % {"source": json.dumps(f"/{name}{first}"), "budget": budget, "places": json.dumps(places), "patience": patience,
                                       "sway": sway})

    def brought(self, kind):
        """Requested bytes of the last stage."""
        return sum(end + 1 - max(start, self.http.first["ground.packed"]) for start, end in self.http.ranges[kind]
                   if end > self.http.first["ground.packed"])

    def test_a_view_comes_to_what_the_whole_bundle_shows_within_the_budget(self):
        self.assertNotIn("error", self.whole)
        self.assertEqual(len({*self.whole["last"]}), 3)
        self.assertGreater(self.whole["most"], BUDGET)
        for name in ("right/ground.packed", "right/ground.modar"):
            with self.subTest(name):
                seen = self.look(name, [self.NEAR, self.OTHER, self.THIRD, self.NEAR])
                self.assertEqual(seen.get("error"), None)
                near, other, third = self.whole["last"]
                self.assertEqual(seen["last"], [near, other, third, near])
                self.assertNotEqual(seen["first"], near, "first the present levels: the coarsest")
                print(f"{name}: {seen['most']} bytes on the GPU of {self.whole['most']}, longest of {seen['frames']} frames {seen['longest']:.0f} ms")
                self.assertLessEqual(seen["most"], BUDGET)
                self.assertEqual((seen["fades"], seen["left"]), (1, 2), "the old view fades over the finer one, one picture at a time")
        # Evicted levels are downloaded again, and never all of them.
        asked = [(start, end) for start, end in self.http.ranges["right"] if end > start]
        self.assertGreater(len(asked), len(set(asked)))

    def test_nothing_fades_before_an_eye_that_moves(self):
        seen = self.look("right/ground.packed", [self.NEAR], sway=0.01)
        self.assertEqual((seen["last"], seen["fades"], seen["left"]), (self.whole["last"][:1], 0, 2))

    def test_no_picture_waits_for_a_slow_host(self):
        self.http.most_at_once = 0
        seen = self.look("slow/ground.packed", [self.NEAR, self.OTHER], patience=2000)
        self.assertEqual(seen["last"], self.whole["last"][:2])
        print(f"answers take 400 ms, the longest of {seen['frames']} frames {seen['longest']:.0f} ms, {self.http.most_at_once} requests at once")
        self.assertLess(seen["longest"], 300)
        self.assertGreater(self.http.most_at_once, 1, "Chromium's cache answers one request of an address after the other")
        # As many as MOST_OPEN bytes hold: 3 while levels came uncoded.
        self.assertLessEqual(self.http.most_at_once, 5)
        self.assertLess(self.brought("slow"), 0.7 * (len(self.http.files["ground.packed"]) - self.http.first["ground.packed"]))

    def test_what_is_wrong_is_not_drawn_and_comes_again(self):
        for kind in ("wrong", "short"):
            with self.subTest(kind):
                seen = self.look(f"{kind}/ground.packed", [self.NEAR], patience=3500)
                self.assertEqual((seen["last"], seen.get("error")), (self.whole["last"][:1], None))
                asked = [piece for piece in self.http.ranges[kind] if piece[0] >= self.http.first["ground.packed"] and piece[1] > piece[0]]
                self.assertGreater(len(asked), len(set(asked)))

    def test_a_host_without_ranges_gives_all_of_it_and_the_page_says_so(self):
        seen = self.look("rangeless/ground.packed", [self.NEAR])
        self.assertEqual((seen["last"], seen.get("error")), (self.whole["last"][:1], None))
        self.assertIn("has no ranges", " ".join(seen["told"]))
        self.assertGreater(seen["most"], BUDGET)


if __name__ == "__main__":
    unittest.main()
