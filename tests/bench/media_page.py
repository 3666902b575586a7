#!/usr/bin/env python3
"""What a video on a picture costs on the page, in Chromium: run it on a quiet machine, after `cmake --build --preset web`.

    media_page.py [--frames N] [--seconds S]
    media_page.py --engines     Chromium, Firefox and WebKitGTK, where they are: a film plays on its plane without a camera, and how far a
                                pixel of the plane is from the film's own, of 255

Prints JSON:
  start_ms       from the first frame in which the picture is seen to the first one that shows the film, and to the first one in which it moves
  edge_px        how far the corners of a film as large as the picture are from the picture's true ones in that very frame, whose number is
                 written into it: median, 95th percentile, greatest, the share within half a pixel, and each frame that is farther
                 (number, since how many drawn frames the picture is seen, distance)
  cpu_ms         of all of the browser's processes for a drawn frame: without a film, with one of 480 lines that is held (the plane's own
                 cost), and with one that plays (decoding and upload as well); ratios to the first
Needs MODAR_BIN (build/release/bin by default), ffmpeg and chromium.
"""
import argparse
import functools
import json
import os
import pathlib
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/web"), str(ROOT / "tests/cli")]
from browser import Browser, Counted, Server, engines  # noqa: E402

BIN = pathlib.Path(os.environ.get("MODAR_BIN", ROOT / "build/release/bin"))
WIDTH, HEIGHT = 640, 480
PROJECT = """[project]
name = "film"
[bake]
loop-views = 24
score = false
parameters = "none"
[[pattern]]
file = "cover.png"
[[scene]]
pattern = "cover"
[[scene.label]]
name = "corner"
"""
FILM = '[[scene.video]]\nfile = "film.mp4"\nscale = 1\ncentred = true\nloop = true\n'
# A frame's number is written into its first row of BITS squares of BIT pixels, the lowest bit first.
BITS, BIT = 9, 16
# Every drawn frame: when, its number, whether the picture is seen, its corners by the drawn pose; when the film was uploaded first, and moved.
WATCH = """(async () => {
  globalThis.drawn = [];
  globalThis.uploaded = [0, 0];
  for (const { prototype } of [WebGLRenderingContext, WebGL2RenderingContext]) {
    const upload = prototype.texImage2D;
    prototype.texImage2D = function (...given) {
      if (given.at(-1) instanceof HTMLVideoElement && given.at(-1).src.startsWith('blob:')) {
        uploaded[0] ||= performance.now();
        if (given.at(-1).currentTime > 0) uploaded[1] ||= performance.now();
      }
      return upload.apply(this, given);
    };
  }
  const strip = Object.assign(document.createElement('canvas'), { width: BITS * BIT, height: BIT }).getContext('2d', { willReadFrequently: true });
  const numberOf = (source) => {
    strip.drawImage(source, 0, 0);
    const { data } = strip.getImageData(0, BIT / 2, BITS * BIT, 1);
    return Array.from({ length: BITS }, (_, i) => (data[4 * (i * BIT + BIT / 2)] > 127 ? 2 ** i : 0)).reduce((sum, each) => sum + each);
  };
  const { View } = await import('/app.js');  // as it comes: its modules are one file
  const draw = View.prototype.draw;
  View.prototype.draw = function (detail, ...rest) {
    const { source, poses, camera: { focal, width, height } } = detail;
    const view = poses.slice(24, 40);
    const corners = [[-1, 1], [1, 1], [1, -1], [-1, -1]].map(([x, y]) => {
      const at = [0, 1, 2].map((i) => view[i] * x * SIDES[0] + view[4 + i] * y * SIDES[1] + view[12 + i]);
      return [width / 2 - 0.5 - focal * at[0] / at[2], height / 2 - 0.5 + focal * at[1] / at[2]];
    });
    drawn.push({ at: performance.now(), number: numberOf(source), source: source.constructor.name, seen: poses[0] !== 0, corners });
    return draw.call(this, detail, ...rest);
  };
  document.getElementById('start').click();
})()"""


# For any engine: looks around, holds the film, and posts a pixel of the plane's middle next to the film's.
PROBE = """const part = (id) => document.getElementById(id) ?? document.querySelector('modar-viewer').shadowRoot.getElementById(id);
const sleep = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
const pixelOf = (source, x, y) => {
  const copy = Object.assign(document.createElement('canvas'), { width: source.videoWidth || source.width, height: source.videoHeight || source.height });
  const context = copy.getContext('2d');
  context.drawImage(source, 0, 0);
  return Array.from(context.getImageData(x * copy.width, y * copy.height, 1, 1).data).slice(0, 3);
};
const films = [];
const create = document.createElement;
document.createElement = function (name) {
  const made = create.call(this, name);
  if (name === 'video') films.push(made);
  return made;
};
(async () => {
  const told = {};
  try {
    while (!document.getElementById('look').textContent) await sleep(100);
    document.getElementById('look').click();
    for (let i = 0; i < 600 && !(films[0]?.currentTime > 0.5); ++i) await sleep(100);
    told.played = films[0]?.currentTime ?? null;
    part('pause').click();
    await sleep(700);
    told.film = pixelOf(films[0], 0.5, 0.5);
    const send = EventTarget.prototype.dispatchEvent;
    const drawn = new Promise((resolve) => {
      EventTarget.prototype.dispatchEvent = function (event) {
        if (event.type === 'drawn') resolve(pixelOf(part('models'), 0.5, 0.5));
        return send.call(this, event);
      };
    });
    part('turn-left').click();
    told.plane = await Promise.race([drawn, sleep(5000)]);
  } catch (error) {
    told.error = String(error);
  }
  await fetch('told', { method: 'POST', body: JSON.stringify(told) });
})();
"""


def cpu_seconds(root):
    """Of a process and all that it started."""
    parents, spent = {}, {}
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            words = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue  # it ended
        parents[int(stat.parent.name)] = int(words[1])
        spent[int(stat.parent.name)] = sum(map(int, words[11:13])) / os.sysconf("SC_CLK_TCK")
    mine, before = {root}, 0
    while len(mine) != before:
        before = len(mine)
        mine |= {pid for pid, parent in parents.items() if parent in mine}
    return sum(spent.get(pid, 0) for pid in mine)


def bake(folder, text):
    (folder / "modar.toml").write_text(text)
    for words in (["bake", "--quiet"], ["web", "out/film.modar", "-o", "site", "--quiet", "--force"]):
        subprocess.run([BIN / "modar", *map(str, words)], cwd=folder, check=True)


def visit(folder, seconds, held=False):
    """The drawn frames of a visit, when the film came, and the browser's CPU seconds a frame after the first second."""
    server = Server(folder / "site")
    browser = Browser(folder / "profile", folder / "camera.y4m")
    try:
        browser.camera("granted")
        browser.resize(WIDTH, HEIGHT)
        browser.open(server.url)
        browser.wait("document.getElementById('start').textContent !== '' && performance.getEntriesByName('modar: whole').length > 0", "the page")
        browser.run(re.sub(r"\b(SIDES|BITS|BIT)\b", lambda word: {"SIDES": json.dumps(sides(folder)), "BITS": str(BITS), "BIT": str(BIT)}[word[0]], WATCH))
        browser.wait("drawn.some(({ seen }) => seen)", "the picture")
        time.sleep(1)
        if held:
            browser.wait("uploaded[1] > 0", "the film")
            browser.run("part('pause').click()")
            time.sleep(0.5)
        before, count = cpu_seconds(browser.process.pid), browser.run("drawn.length")
        time.sleep(seconds)
        spent, frames = cpu_seconds(browser.process.pid) - before, browser.run("drawn.length") - count
        return browser.run("drawn"), browser.run("uploaded"), spent / frames
    finally:
        browser.close()
        server.close()
        shutil.rmtree(folder / "profile", ignore_errors=True)


def sides(folder):
    """Half of the picture's sides in units of half its longer one."""
    told = subprocess.run(["ffprobe", "-loglevel", "error", "-show_entries", "stream=width,height", "-of", "csv=p=0", folder / "cover.png"],
                          capture_output=True, text=True, check=True).stdout
    width, height = map(int, re.findall(r"\d+", told))
    return [width / max(width, height), height / max(width, height)]


def corner_errors(drawn, truth):
    """Of each drawn frame that shows the picture: (distance, its number, frames since it was found, number and distance of the nearest truth)."""
    def distance(frame, corners):
        return max(abs(complex(*a) - complex(*b)) for a, b in zip(frame["corners"], corners))

    errors, since = [], 0
    for frame in drawn:
        since = since + 1 if frame["seen"] else 0
        if since:
            nearest = min(range(len(truth)), key=lambda number: distance(frame, truth[number]))
            errors.append((distance(frame, truth[frame["number"]]), frame["number"], since - 1, nearest, distance(frame, truth[nearest]), frame["source"]))
    return sorted(errors)


class Told(Counted):
    def do_POST(self):
        self.server.told = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()


class Folder:
    """What engines() asks for of a test."""

    def __init__(self, folder):
        self.folder, self.cleanups = folder, []

    def addCleanup(self, what, *arguments):
        self.cleanups.append((what, arguments))


def try_engines(folder):
    # One colour, another each second.
    subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i",
                    "nullsrc=s=854x480:d=8:r=10,geq=r='60+20*floor(T)':g=120:b='220-20*floor(T)'", "-pix_fmt", "yuv420p", folder / "film.mp4"], check=True)
    bake(folder, PROJECT + FILM)
    index = folder / "site/index.html"
    index.write_text(index.read_text().replace("</body>", '<script src="probe.js"></script></body>'))
    (folder / "site/probe.js").write_text(PROBE)
    server = Server(folder / "site")
    server.http.RequestHandlerClass = functools.partial(Told, directory=str(folder / "site"))
    test = Folder(folder)
    try:
        for name, start in engines(test):
            server.http.told = None
            process = start(server.url)
            end = time.monotonic() + 120
            while server.http.told is None and time.monotonic() < end:
                time.sleep(0.2)
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            told = server.http.told or {"error": "it told nothing"}
            if told.get("plane"):
                told["off"] = max(abs(a - b) for a, b in zip(told["plane"], told["film"]))
            print(json.dumps({"engine": name, **told}))
    finally:
        server.close()
        for what, arguments in reversed(test.cleanups):
            what(*arguments)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=60, help="of the clip (60: a quick hand; 240: a slow one)")
    parser.add_argument("--seconds", type=float, default=8, help="of each visit (8)")
    parser.add_argument("--engines", action="store_true", help="try every browser instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="modar-media-bench-") as name:
        folder = pathlib.Path(name)
        shutil.copy(ROOT / "assets/patterns/cover.png", folder)
        if options.engines:
            return try_engines(folder)
        subprocess.run([sys.executable, ROOT / "assets/make_clip.py", "--pattern", folder / "cover.png", "--frames", str(options.frames), "--size",
                        f"{WIDTH}x{HEIGHT}", folder / "clip"], check=True)
        # To and fro over the first frames with the picture, so that it never jumps.
        rows = [line.split(",") for line in (folder / "clip/truth.csv").read_text().splitlines()[1:]]
        count = next((i for i, row in enumerate(rows) if not int(row[-1])), len(rows))
        truth = [[tuple(map(float, row[i:i + 2])) for i in range(1, 9, 2)] for row in rows[:count]]
        order = [*range(count), *range(count - 2, 0, -1)]
        truth = [truth[number] for number in order]
        for i, number in enumerate(order):
            (folder / f"clip/to_and_fro_{i:05}.png").symlink_to(f"frame_{number:05}.png")
        box = f"drawbox=y=0:w={BIT}:h={BIT}:t=fill"
        bits = [f"{box}:x={i * BIT}:c={colour}:enable='eq(mod(floor(n/{2 ** i}),2),{on})'" for i in range(BITS) for on, colour in enumerate(("black", "white"))]
        subprocess.run(["ffmpeg", "-loglevel", "error", "-r", "15", "-i", folder / "clip/to_and_fro_%05d.png", "-vf", ",".join(bits), "-pix_fmt",
                        "yuv420p", folder / "camera.y4m"], check=True)
        subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i", "testsrc2=s=854x480:r=25:d=10", "-pix_fmt", "yuv420p", folder / "film.mp4"],
                       check=True)
        bake(folder, PROJECT)
        _, _, without = visit(folder, options.seconds)
        bake(folder, PROJECT + FILM)
        drawn, uploaded, playing = visit(folder, options.seconds)
        _, _, held = visit(folder, options.seconds, held=True)
        errors = corner_errors(drawn, truth)
        found = next(frame["at"] for frame in drawn if frame["seen"])
        print(json.dumps({"start_ms": [round(at - found, 1) for at in uploaded], "edge_px": {
            "median": round(statistics.median(error for error, *_ in errors), 3), "p95": round(errors[int(0.95 * len(errors))][0], 3),
            "greatest": round(errors[-1][0], 3), "within_half": round(sum(error <= 0.5 for error, *_ in errors) / len(errors), 3),
            "frames": len(errors), "farther": [(round(error, 2), *more) for error, *more in errors if error > 0.5]}, "cpu_ms": {
                "without": round(1000 * without, 1), "held": round(1000 * held, 1), "playing": round(1000 * playing, 1),
                "held_ratio": round(held / without, 3), "playing_ratio": round(playing / without, 3)}}))


if __name__ == "__main__":
    main()
