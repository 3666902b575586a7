#!/usr/bin/env python3
"""A flight over a huge scan in a page that may have little of it on the GPU, in Chromium on a slow line.

    huge_page.py BUNDLE [--pan] [--max-bytes 64000000] [--line 10e6] [--latency 100] [--seconds 60] [--hold 20] [--nearest 0.02] [--page FOLDER] [--keep FOLDER]

Makes the page of `modar web`, serves it by ranges, and flies: from far down to the surface, along it, and up again; after a third, at the
nearest, and at the end it holds still. With --pan it comes down in a quarter of the time, swings to and fro at the surface, and holds still
at the end. Prints JSON: frames and the longest one of the flight (milliseconds, with the drawing, which is SwiftShader's on a CPU), the
longest task of the page's own, bytes that came, those of them that had come before, the greatest number of bytes on the GPU, resident
memory of all of the browser's processes next to a blank page's, the triangles that were drawn at the end of each hold, their mean over the
time of all pictures, how many pictures had less than three quarters of those of the one before (`drops`), and `pops`: each time that the
picture changed while the eye held still, how far the picture moved, pixels (median, 95 and 99 % of squares of 32 pixels, by phase
correlation), from one picture to the next of 30 a second, and in all. Needs python3-opencv for the pops.

`modar-model-probe make SCAN TRIANGLES OUT.obj` makes a huge scan out of one; bake it with default options. Needs modar on the path,
chromium, and the page's engine (preset `web`).
"""
import argparse
import base64
import functools
import http.server
import itertools
import json
import math
import pathlib
import re
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "web"))
from browser import CANVAS, Browser, Quiet  # noqa: E402
from first_visit import make_site  # noqa: E402
from page_memory import resident_by_process, settle  # noqa: E402

SQUARE = 32  # pixels, of which the way is measured
FLY = """(async () => {
  const [{ load }, { View }] = await Promise.all([import('/modar.js'), import('/modar-view.js')]);
  """ + CANVAS + """
  const flown = globalThis.flown = { frames: 0, longest: 0, task: 0, gpu: 0, triangles: [], mean: 0, drops: 0, pictures: [], done: false };
  new PerformanceObserver((list) => {
    for (const { duration } of list.getEntries()) flown.task = Math.max(flown.task, duration);
  }).observe({ type: 'longtask' });
  const began = performance.now();
  const modar = await load('%(bundle)s');
  const models = canvas(640, 480);
  const view = await View.create(modar, { picture: canvas(640, 480), models, fixedLight: true, maxBytes: %(bytes)d });
  await view.whole;
  flown.shown = (performance.now() - began) / 1000;
  const { low, high } = view.bounds(0);
  const middle = low.map((_, i) => (low[i] + high[i]) / 2), size = Math.max(...high.map((_, i) => high[i] - low[i]));
  const pan = %(pan)s;
  // The eye goes around the model's middle and looks at it: share of the flight to a matrix.
  const from = (share) => {
    const near = pan ? Math.min(1, 4 * share) : 0.5 - 0.5 * Math.cos(2 * Math.PI * Math.min(1, Math.max(0, share)));
    const turn = pan ? 1.5 * Math.sin(12 * share) : 4 * share;
    const eye = [Math.sin(turn), -Math.cos(turn), 0.35], length = Math.hypot(...eye);
    const back = eye.map((x) => x / length), right = [-back[1], back[0], 0].map((x) => x / Math.hypot(back[0], back[1]));
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
    const reach = back.reduce((sum, x, i) => sum + Math.abs(x) * (high[i] - middle[i]), 0);  // of the box around it
    const at = middle.map((x, i) => x + back[i] * (reach + size * (3 * (1 - near) + %(nearest)g * near))), dot = (a) => -a.reduce((sum, x, i) => sum + x * at[i], 0);
    return Float32Array.of(right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1);
  };
  let before = null, time = 0;
  const draw = (share) => {
    view.drawFrom(0, from(share), 500);
    ++flown.frames;
    const now = performance.now(), took = before ? now - before.now : 0;
    flown.mean += (view.triangles - flown.mean) * took / Math.max(1, time += took);
    if (view.triangles < 0.75 * (before?.triangles ?? 0)) ++flown.drops;
    before = { now, triangles: view.triangles };
    flown.gpu = Math.max(flown.gpu, view.gpuBytes);
  };
  const during = async (seconds, step) => {
    const start = performance.now();
    for (let before = start, now; (now = await new Promise(requestAnimationFrame)) - start < 1000 * seconds; before = now) {
      step((now - start) / 1000 / seconds, now - before);
    }
  };
  // The view while a picture fades over the models, 30 times a second.
  const fade = (over) => {
    const [animation] = over.getAnimations();
    animation.pause();
    const both = document.createElement('canvas').getContext('2d');
    Object.assign(both.canvas, { width: models.width, height: models.height });
    const seen = [];
    for (let time = 0; time <= animation.effect.getTiming().duration; time += 1000 / 30) {
      animation.currentTime = time;
      both.clearRect(0, 0, models.width, models.height);
      both.globalAlpha = 1;
      both.drawImage(models, 0, 0);
      both.globalAlpha = getComputedStyle(over).opacity;
      both.drawImage(over, 0, 0);
      seen.push(both.canvas.toDataURL());
    }
    animation.finish();
    return [...seen, models.toDataURL()];
  };
  for (const [begin, end] of pan ? [[0, 1]] : [[0, 1 / 3], [1 / 3, 1 / 2], [1 / 2, 1]]) {
    await during(%(seconds)g * (end - begin), (part, took) => {
      flown.longest = Math.max(flown.longest, took);
      draw(begin + part * (end - begin));
    });
    const held = [];
    let shown = 0;
    await during(%(hold)g, () => {
      draw(end);
      const over = models.nextElementSibling;
      if (view.triangles !== shown) held.push(over?.getAnimations().length ? fade(over) : [models.toDataURL()]);
      shown = view.triangles;
    });
    flown.pictures.push(held);
    flown.triangles.push(view.triangles);
  }
  flown.done = true;
})().catch((error) => { globalThis.flown = { done: true, error: String(error.stack ?? error) }; }), 0"""


class Ranged(Quiet):
    """Files by ranges, read on request."""

    def do_GET(self):
        path = pathlib.Path(self.translate_path(self.path))
        if not path.is_file():
            return super().do_GET()
        size, asked = path.stat().st_size, re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range") or "")
        first, last = (int(asked[1]), min(int(asked[2] or size - 1), size - 1)) if asked else (0, size - 1)
        self.send_response(206 if asked else 200)
        for name, value in (("Content-Type", self.guess_type(path)), ("Content-Length", str(last + 1 - first)), ("Cache-Control", "no-store"),
                            *((("Content-Range", f"bytes {first}-{last}/{size}"),) if asked else ())):
            self.send_header(name, value)
        self.end_headers()
        try:
            with open(path, "rb") as file:
                file.seek(first)
                while first <= last and (part := file.read(min(1 << 16, last + 1 - first))):
                    self.wfile.write(part)
                    first += len(part)
                    if path.suffix in (".packed", ".modar"):
                        self.server.count(first - len(part), first)
        except OSError:
            pass  # the page has what it wants


class Host(http.server.ThreadingHTTPServer):
    def __init__(self, site):
        super().__init__(("127.0.0.1", 0), functools.partial(Ranged, directory=str(site)))
        self.sent, self.again, self.kilobytes, self.lock = 0, 0, set(), threading.Lock()

    def count(self, begin, end):
        kilobytes = {*range(-(-begin // 1024), end // 1024)}
        with self.lock:
            self.sent += end - begin
            self.again += 1024 * len(kilobytes & self.kilobytes)
            self.kilobytes |= kilobytes


def ways(before, after):
    """How far squares of 32 pixels moved, by their median, 95 and 99 %: pictures as read() has them."""
    import cv2
    import numpy

    moved, window = [], cv2.createHanningWindow((SQUARE, SQUARE), cv2.CV_32F)
    for y, x in itertools.product(*(range(0, side + 1 - SQUARE, SQUARE // 2) for side in after[0].shape)):
        square = numpy.s_[y:y + SQUARE, x:x + SQUARE]
        old, new = before[0][square], after[0][square]
        if after[1][square].mean() < 0.3 or old.std() < 2:
            continue
        way, sure = cv2.phaseCorrelate(old - old.mean(), new - new.mean(), window)
        if sure > 0.3:
            moved.append(math.hypot(*way))
    return [float(numpy.percentile(moved, part)) for part in (50, 95, 99)] if moved else [0.0, 0.0, 0.0]


def read(url):
    """(brightness, covered share) of a picture."""
    import cv2
    import numpy

    picture = cv2.imdecode(numpy.frombuffer(base64.b64decode(url.split(",")[1]), numpy.uint8), cv2.IMREAD_UNCHANGED).astype(numpy.float32)
    shown = picture[..., 3] / 255
    return cv2.GaussianBlur(picture[..., :3].mean(2) * shown + 128 * (1 - shown), (0, 0), 1.5), shown


def pops(changes):
    """Of each change after the first, which is pictures one after the other: the greatest ways from one to the next, and from before it to its end."""
    found = []
    for (*_, before), change in itertools.pairwise([[read(url) for url in change] for change in changes]):
        steps = zip(*(ways(*pair) for pair in itertools.pairwise([before, *change])))
        found.append({"step": [round(max(each), 2) for each in steps], "all": [round(way, 2) for way in ways(before, change[-1])]})
    return found


def fly(site, bundle, options):
    server = Host(site)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    folder = tempfile.mkdtemp(prefix="modar-huge-")
    browser = Browser(folder, "none.y4m")
    try:
        (site / "blank.html").write_text("<!doctype html><title>blank</title>")
        browser.open(f"http://localhost:{server.server_port}/blank.html")
        blank = sum(settle(browser).values())
        browser.throttle(options.line / 8, options.latency)
        browser.run(FLY % {"bundle": "/" + bundle, "bytes": options.max_bytes, "seconds": options.seconds, "hold": options.hold, "nearest": options.nearest,
                           "pan": str(options.pan).lower()})
        most, end = 0, time.monotonic() + 300 + options.seconds + 3 * options.hold
        while not browser.run("globalThis.flown?.done ?? false") and time.monotonic() < end:
            most = max(most, sum(resident_by_process(browser.process.pid).values()))
            time.sleep(1)
        flown = browser.run("globalThis.flown ?? {}")
        flown["pops"] = [pops(held) for held in flown.pop("pictures", [])]
        flown.update(came_mb=server.sent / 1e6, again_mb=server.again / 1e6, rss_mb=(sum(settle(browser).values()) - blank) / 1e6, rss_most_mb=(most - blank) / 1e6)
        return flown
    finally:
        browser.close()
        server.shutdown()
        server.server_close()
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=pathlib.Path)
    parser.add_argument("--pan", action="store_true", help="swing to and fro near the surface")
    parser.add_argument("--max-bytes", type=float, default=64e6, help="of the GPU; 0: no limit")
    parser.add_argument("--line", type=float, default=10e6, help="bits a second")
    parser.add_argument("--latency", type=float, default=100, help="milliseconds")
    parser.add_argument("--seconds", type=float, default=60, help="of the flight")
    parser.add_argument("--hold", type=float, default=20, help="seconds that the eye holds still after each third")
    parser.add_argument("--nearest", type=float, default=0.02, help="of the eye to the box around the scan, in longest sides of it")
    parser.add_argument("--page", help="of another build")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for the site, which is used again where it is there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="modar-huge-site-") as base:
        site = options.keep or pathlib.Path(base) / "site"
        if not (site / "site.json").exists():
            make_site(site, options.bundle, options.page, False)
        bundle = json.loads((site / "site.json").read_text())["bundles"][0]["file"]
        flown = fly(site, bundle, options)
        print(json.dumps({name: [round(x, 2) if isinstance(x, float) else x for x in value] if isinstance(value, list) else round(value, 2) if isinstance(value, float) else value
                          for name, value in {"bundle_mb": options.bundle.stat().st_size / 1e6,
                                              "packed_mb": (site / bundle.split("?")[0]).stat().st_size / 1e6, **flown}.items()}))


if __name__ == "__main__":
    main()
