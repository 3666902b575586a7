"""A page plays the clips of a glTF file: their names, their movement, their end, and actions that play and stop them."""
import base64
import functools
import http.server
import itertools
import json
import math
import pathlib
import shutil
import struct
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import CANVAS, Browser, Quiet  # noqa: E402
from programs import COVER, ProgramTest  # noqa: E402

SECONDS = 1.5
PROJECT = """[project]
name = "moving"
[bake]
loop-views = 8
score = false
parameters = "none"
[[model]]
file = "moving.gltf"
[[pattern]]
file = "cover.png"
[[pattern]]
file = "survey.png"
[[scene]]
pattern = "cover"
model = "moving"
name = "box"
[[scene.action]]
on = "tap box"
do = "stop box"
[[scene]]
pattern = "survey"
model = "moving"
name = "top"
clip = "none"
[[scene.action]]
on = "tap top"
do = "play turn on top"
"""
# Draws the model at four times, 250 ms apart: while what the bundle says plays, after a tap that stops it, and after a clip that is played
# once; that of the other picture, which keeps still, before and after a tap that plays it, and after stop().
LOOK = """(async () => {
  const [{ load }, { View }] = await Promise.all([import('/modar.js'), import('/modar-view.js')]);
  """ + CANVAS + """
  const modar = await load('/bundles/moving.packed');
  const view = await View.create(modar, { picture: canvas(320, 240), models: canvas(320, 240), fixedLight: true });
  await view.whole;
  const seen = { clips: view.clips, ended: [] };
  view.addEventListener('clipend', ({ detail }) => seen.ended.push(detail));
  const from = Float32Array.of(1, 0, 0, 0, 0, 0.5, -0.866, 0, 0, 0.866, 0.5, 0, 0, -0.2, -4, 1);
  const pictures = async (draws = true, pattern = 0) => {
    const all = [];
    for (let i = 0; i < 4; ++i) {
      if (draws || i === 0) view.drawFrom(pattern, from, 300);
      const bytes = await (await view.photograph('image/png')).arrayBuffer();
      all.push([...new Uint8Array(await crypto.subtle.digest('SHA-1', bytes))].join());
      await new Promise((done) => setTimeout(done, 250));
    }
    return all;
  };
  seen.playing = await pictures();
  seen.alone = await pictures(false);
  view.tap(160, 120);
  seen.stopped = await pictures();
  seen.ended.length = 0;
  view.play(view.clips[0].name, { loop: false, blend: 0 });
  const until = performance.now() + 20000;
  while (!seen.ended.length && performance.now() < until) await pictures();
  seen.ends = seen.ended.filter(({ scene }) => scene === 0).map(({ name }) => name);
  seen.after = await pictures();
  seen.still = await pictures(true, 1);
  view.tap(160, 120);
  seen.tapped = await pictures(true, 1);
  view.stop();
  seen.halted = await pictures(true, 1);
  modar.close();
  return seen;
})()"""


def write_turning_box(path):
    """A box that a clip turns by 150 degrees about its height."""
    corners = [(x, 2 * y, 3 * z) for x, y, z in itertools.product((-0.5, 0.5), repeat=3)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    corner = [at for a, b, c, d in sides for at in (a, b, c, a, c, d)]
    turn = math.radians(75)
    parts = [struct.pack("<24f", *itertools.chain(*corners)), struct.pack("<36H", *corner), struct.pack("<2f", 0, SECONDS),
             struct.pack("<8f", 0, 0, 0, 1, 0, math.sin(turn), 0, math.cos(turn))]
    starts = list(itertools.accumulate(map(len, parts), initial=0))
    kinds = [(5126, 8, "VEC3"), (5123, 36, "SCALAR"), (5126, 2, "SCALAR"), (5126, 2, "VEC4")]
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": starts[-1], "uri": "data:;base64," + base64.b64encode(b"".join(parts)).decode()}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": len(part)} for start, part in zip(starts, parts)],
        "accessors": [{"bufferView": i, "componentType": kind, "count": count, "type": shape, **(
            {"min": [-0.5, -1, -1.5], "max": [0.5, 1, 1.5]} if i == 0 else {"min": [0], "max": [SECONDS]} if i == 2 else {})}
            for i, (kind, count, shape) in enumerate(kinds)],
        "animations": [{"name": "turn", "samplers": [{"input": 2, "output": 3}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]}]}))


class Clips(ProgramTest):
    def test_what_plays_moves_and_what_stopped_stays(self):
        base = pathlib.Path(tempfile.mkdtemp(prefix="modar-clips-"))
        self.addCleanup(shutil.rmtree, base, ignore_errors=True)
        bundle, site = base / "out/moving.modar", base / "site"
        write_turning_box(base / "moving.gltf")
        (base / "modar.toml").write_text(PROJECT)
        for picture in (COVER, COVER.with_name("survey.png")):
            shutil.copy(picture, base)
        for words in (["bake", "--quiet"], ["web", bundle, "-o", site, "--quiet"]):
            done = self.modar(*words, cwd=base)
            self.assertEqual(done.returncode, 0, done.stderr)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(site)))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        browser = Browser(base / "profile", base / "none.y4m")
        self.addCleanup(browser.close)
        browser.open(f"http://localhost:{server.server_port}/site.json")
        seen = browser.run(LOOK)
        self.assertEqual(seen["clips"], [{"name": "turn", "seconds": SECONDS}])
        self.assertEqual(len({*seen["playing"]}), 4)
        self.assertGreater(len({*seen["alone"]}), 1, "the view draws on while a clip plays, as no camera gives it frames")
        self.assertEqual(len({*seen["stopped"]}), 1)
        self.assertEqual(seen["ends"], ["turn"])
        self.assertEqual(len({*seen["after"]}), 1, "its last pose stays")
        self.assertNotEqual(seen["after"][0], seen["stopped"][0])
        self.assertEqual(len({*seen["still"]}), 1)
        self.assertEqual(len({*seen["tapped"]}), 4)
        self.assertEqual(len({*seen["halted"]}), 1)


if __name__ == "__main__":
    unittest.main()
