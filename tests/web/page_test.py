"""The page in Chromium with a fake camera: what a visitor sees, and that its poses are the player's."""
import base64
import gzip
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
import qr_test  # noqa: E402
from browser import KEPT, Browser, Counted, Server, axe_core  # noqa: E402
from programs import (COVER, COVERED, POTTERY, QUICK, READINGS, ROOT, TURNED, TURNS, ProgramTest, covered_clip,  # noqa: E402
                      demo_clip, picture, write_turns)

BROTLI = shutil.which("brotli")
PAGE = ROOT / "build" / "web" / "web"
WIDTH, HEIGHT, FRAMES = 640, 480, 6
# A folder that keeps the pictures, for people.
KEEP = os.environ.get("MODAR_WEB_PICTURES")

class Breaking(Counted):
    """Has ranges. While server.most is not None, it sends bundles up to that byte, and nothing more until server.over. server.gone: it
    answers nothing."""

    def do_GET(self):
        if self.server.gone:
            self.close_connection = True
            return None
        if ".packed" not in self.path:
            return super().do_GET()
        body = pathlib.Path(self.translate_path(self.path)).read_bytes()
        start, _, last = self.headers.get("Range", "bytes=0-").removeprefix("bytes=").partition("-")
        self.server.starts.append(int(start))
        body, most = body[:int(last) + 1 if last else None], self.server.most
        self.send_response(206)
        self.send_header("Content-Length", len(body) - int(start))
        self.send_header("Content-Range", f"bytes {start}-{len(body) - 1}/*")
        self.end_headers()
        try:
            self.wfile.write(body[int(start):most])
            if most is not None:
                self.server.over.wait(60)
        except OSError:
            pass  # the visit has ended


FEED = """(async () => {
  const { load } = await import('/modar.js');
  const modar = await load('/bundles/demo.packed', { simd: %s });
  const turns = %s;
  await modar.start(document.createElement('video'), { extended: turns.length > 0 });
  modar.stop();
  const frames = new Uint8Array(await (await fetch('/%s')).arrayBuffer());
  const size = %d * %d, seen = [];
  for (let i = 0; i * size < frames.length; ++i) {
    const { poses, reason, heapBytes } = await modar.step(frames.subarray(i * size, (i + 1) * size), %d, %d, i / 30, turns[i]);
    seen.push({ reason, heapBytes, pose: Array.from(poses) });
  }
  modar.close();
  return { kind: modar.kind, seen };
})()"""

RECORD = """(async () => {
  const { load } = await import('/modar.js');
  const modar = await load('/bundles/demo.modar');
  const stream = await navigator.mediaDevices.getUserMedia({ video: { width: %d, height: %d } });
  const video = document.createElement('video');
  Object.assign(video, { srcObject: stream, muted: true, playsInline: true });
  document.body.append(video);
  await video.play();
  const seen = [];
  await new Promise((resolve, reject) => {
    modar.addEventListener('error', ({ detail }) => reject(detail));
    modar.addEventListener('frame', ({ detail: { luma, poses, reason, source } }) => {
      if (seen.length === 6) return;
      let text = '';
      for (let i = 0; i < luma.length; i += 4096) text += String.fromCharCode(...luma.subarray(i, i + 4096));
      seen.push({ luma: btoa(text), reason, pose: Array.from(poses), source: source.constructor.name });
      if (seen.length === 6) resolve();
    });
    modar.start(video, { keepLuma: true });
  });
  modar.close();
  for (const track of stream.getTracks()) track.stop();
  return seen;
})()"""


# A picture that is not one of the bundle's, and frames that show it; then it is forgotten.
OWN = """(async () => {
  const { load } = await import('/modar.js');
  const modar = await load('/own/one.modar', { simd: %s });
  await modar.start(document.createElement('video'));
  modar.stop();
  const image = new Image();
  image.src = '/own/own.png';
  await image.decode();
  const began = performance.now();
  const index = await modar.addPattern(image, { name: 'mine', widthMm: 90 });
  const ms = performance.now() - began;
  const blank = Object.assign(document.createElement('canvas'), { width: 90, height: 90 });
  const refused = await modar.addPattern(blank).catch(({ code, cure }) => ({ code, cure }));
  const frames = new Uint8Array(await (await fetch('/own/own.gray')).arrayBuffer());
  const size = %d, seen = [];
  const step = (i) => modar.step(frames.subarray(i * size, (i + 1) * size), %d, %d, i / 30);
  for (let i = 0; i * size < frames.length; ++i) {
    const { poses, reason } = await step(i);
    seen.push({ reason, pose: Array.from(poses).slice(45), other: poses[0] });
  }
  const { patterns } = modar;
  const known = structuredClone(patterns);
  await modar.forgetPatterns();
  const after = await step(0);
  modar.close();
  return { index, ms, refused, seen, known, left: patterns.length, numbers: after.poses.length, reason: after.reason };
})()"""

# A frame of two prints of one pattern, twice.
COPIES = """(async () => {
  const { load } = await import('/modar.js');
  const modar = await load('/copies/two.modar');
  await modar.start(document.createElement('video'));
  modar.stop();
  const frame = new Uint8Array(await (await fetch('/copies/two.gray')).arrayBuffer());
  await modar.step(frame, %d, %d, 0);
  const { poses, copies } = await modar.step(frame, %d, %d, 1 / 30);
  modar.close();
  return { poses: Array.from(poses), copies };
})()"""

# Synthetic events at a gyroscope's clock: reading i of [time, rate...] as the browser would deliver it.
READ = """(async () => {
  const { allowMotion, Gyroscope } = await import('/gyroscope.js');
  const gyroscope = new Gyroscope(%s);
  await allowMotion();  // which it asks for first
  await new Promise((resolve) => { setTimeout(resolve); });
  for (const [timeStamp, alpha, beta, gamma] of %s) {
    const event = new DeviceMotionEvent('devicemotion', { interval: 10, rotationRate: { alpha, beta, gamma } });
    dispatchEvent(Object.defineProperty(event, 'timeStamp', { value: timeStamp }));
  }
  gyroscope.close();
  return %s.map(([from, to]) => gyroscope.turn(from ?? undefined, to) ?? null);
})()"""

# A phone that turns by one radian a second about its x axis, and what the page tells its worker.
PHONE = """(() => {
  globalThis.told = [];
  globalThis.allowed = 'granted';
  const post = Worker.prototype.postMessage;
  Worker.prototype.postMessage = function (message, ...more) {
    if (message.type === 'frame' || message.type === 'camera') told.push({ ...message, frame: null, pixels: null });
    return post.call(this, message, ...more);
  };
  const settings = MediaStreamTrack.prototype.getSettings;
  MediaStreamTrack.prototype.getSettings = function () { return { ...settings.call(this), facingMode: 'environment' }; };
  DeviceMotionEvent.requestPermission = async () => allowed;
  let timeStamp = performance.now();
  setInterval(() => {
    for (; timeStamp < performance.now(); timeStamp += 10) {
      const event = new DeviceMotionEvent('devicemotion', { rotationRate: { alpha: 180 / Math.PI, beta: 0, gamma: 0 } });
      dispatchEvent(Object.defineProperty(event, 'timeStamp', { value: timeStamp }));
    }
  }, 10);
})()"""


# A camera of 1920 x 1440: the clip enlarged, with stripes in a corner; the page asks for its size, and tells what it tracks.
LARGE = """(async () => {
  const canvas = Object.assign(document.createElement('canvas'), { width: 1920, height: 1440 });
  const context = canvas.getContext('2d');
  const frame = await createImageBitmap(await (await fetch('/clip/frame_00000.png')).blob());
  const draw = () => {
    context.drawImage(frame, 0, 0, 1920, 1440);
    for (let x = 0; x < 200; x += 4) {
      context.fillStyle = '#000';
      context.fillRect(x, 0, 2, 200);
      context.fillStyle = '#fff';
      context.fillRect(x + 2, 0, 2, 200);
    }
    requestAnimationFrame(draw);
  };
  draw();
  navigator.mediaDevices.getUserMedia = async ({ video }) => {
    globalThis.asked = video;
    return canvas.captureStream(30);
  };
  const { View } = await import('/app.js');
  const shown = View.prototype.draw;
  View.prototype.draw = function (detail, ...rest) {
    globalThis.tracked = [detail.camera.width, detail.camera.height];
    return shown.call(this, detail, ...rest);
  };
})()"""


def place_in(mappings, line, column):
    """(source, line) that a source map (ECMA-426) has for a place in the script."""
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
    source = at = 0
    for number, segments in enumerate(mappings.split(";")):
        begin, found = 0, None
        for segment in filter(None, segments.split(",")):
            numbers, value, shift = [], 0, 0
            for digit in map(letters.index, segment):
                value |= (digit & 31) << shift
                shift += 5
                if digit < 32:
                    numbers.append(-(value >> 1) if value & 1 else value >> 1)
                    value = shift = 0
            begin += numbers[0]
            if len(numbers) > 1:
                source, at = source + numbers[1], at + numbers[2]
            if begin <= column:
                found = (source, at)
        if number == line:
            return found
    return None


def rounded(value):
    """To a float and back, as C does."""
    return struct.unpack("f", struct.pack("f", value))[0]


class Page(ProgramTest):
    """One browser for all: starting it costs more than most tests."""

    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-web-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        test = cls("run_program")
        test.folder = cls.base
        bundle, site = cls.base / "demo.modar", cls.base / "site"
        texts = cls.base / "texts.json"
        texts.write_text(json.dumps({"cover": {"en": {"name": "The book of owls", "text": "A pot.", "alt": "A pot with two handles"},
                                               "de": {"name": "Das Buch der Eulen"}}}))
        statement = cls.base / "statement.json"
        statement.write_text(json.dumps({"publisher": "Museum of Pots", "date": "2026-11-26", "feedback": "mailto:access@example.org",
                                         "enforcement": "https://example.org/theAddressOfABodyThatEnforcesWhatTheLawSaysOfAccessibility"}))
        words = cls.base / "words"
        words.mkdir()
        shutil.copy(PAGE / "words" / "en.json", words / "ar.json")  # any words: their direction matters
        for words in (["bake", "--model", POTTERY, "--pattern", COVER, "--scene", "cover=pottery,scale=0.5", "-o", bundle,
                       "--quiet", "--no-lods", *QUICK],
                      ["web", bundle, "-o", site, "--title", "Pots & pans", "--words", words, "--link", "Imprint=https://example.org/imprint",
                       "--link", "Write to us=mailto:us@example.org", "--texts", texts, "--statement", statement, "--room",
                       "--quiet"]):
            done = test.modar(*words)
            if done.returncode != 0:
                raise AssertionError(done.stderr)
        clip = cls.base / "clip"
        clip.mkdir()
        subprocess.run(["ffmpeg", "-loglevel", "error", "-i", demo_clip(cls.base / "small", FRAMES) / "frame_%05d.png", "-vf",
                        f"scale={WIDTH}:{HEIGHT}", "-start_number", "0", clip / "frame_%05d.png"], check=True)
        cls.video = cls.base / "camera.y4m"
        convert = ["ffmpeg", "-loglevel", "error", "-y", "-framerate", "30", "-i", clip / "frame_%05d.png"]
        subprocess.run([*convert, "-pix_fmt", "yuv420p", cls.video], check=True)
        subprocess.run([*convert, "-pix_fmt", "gray", "-f", "rawvideo", site / "frames.gray"], check=True)
        covered_clip(site / "covered.gray", WIDTH, HEIGHT)
        write_turns(cls.base / "turns.txt", TURNS)
        (site / "played").mkdir()
        shutil.copytree(clip, site / "clip")
        # Both in the light that the bundle has: the page looks at a smaller copy of the camera's picture.
        plain = [word for word in ["--no-light-estimate"] if word in test.run_program("modar-play", "--help-all").stdout]
        # As a video, since pictures show at once what they hold.
        subprocess.run([*convert, "-c:v", "rawvideo", "-pix_fmt", "bgr24", cls.base / "clip.avi"], check=True)
        test.run_program("modar-play", bundle, "--input", cls.base / "clip.avi", "--out", site / "played", *plain)
        cls.server = Server(site)
        cls.site = site
        cls.bundle = bundle
        cls.browser = Browser(cls.base / "profile", cls.video)
        cls.addClassCleanup(cls.browser.close)
        cls.browser.camera("granted")

    def setUp(self):
        super().setUp()
        self.browser.errors.clear()
        self.browser.requests.clear()

    def keep(self, name):
        if KEEP:
            pathlib.Path(KEEP).mkdir(parents=True, exist_ok=True)
            self.browser.screenshot(pathlib.Path(KEEP) / name)

    def played(self, frames, *more):
        """What modar-play sees in gray frames: a dictionary a frame."""
        done = self.run_program("modar-play", self.bundle, "--input", f"grey:{WIDTH}x{HEIGHT}:{frames}", "--json", *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [line for line in map(json.loads, done.stdout.splitlines()) if "frame" in line]

    def assert_same_poses(self, seen, expected):
        self.assertEqual(len(seen), len(expected))
        for web, play in zip(seen, expected):
            self.assertEqual(web["reason"], play["reason"])
            self.assertEqual(web["pose"][0], len(play["visible"]))
            for each in play["visible"]:
                numbers = [*each["rotation"], *each["translation"], *sum(each["corners"], [])]
                self.assertEqual(web["pose"][4:24], [rounded(n) for n in numbers])
                self.assertEqual(web["pose"][2], each["inliers"])
                self.assertEqual(web["pose"][40] != 0, each.get("extended", False))
        return sum(len(play["visible"]) for play in expected)

    def test_poses_are_the_players_to_the_last_bit(self):
        self.browser.open(self.server.url)
        played = self.played(self.site / "frames.gray")
        covered = self.played(self.site / "covered.gray", "--extended", "--gyro", self.base / "turns.txt")
        for simd in ("true", "false"):
            done = self.browser.run(FEED % (simd, [], "frames.gray", WIDTH, HEIGHT, WIDTH, HEIGHT))
            self.assertEqual(done["kind"], "simd" if simd == "true" else "plain")
            self.assertGreater(self.assert_same_poses(done["seen"], played), FRAMES // 2)
            print(f"{done['kind']}: heap {done['seen'][-1]['heapBytes']} bytes")
            done = self.browser.run(FEED % (simd, json.dumps(TURNS), "covered.gray", WIDTH, HEIGHT, WIDTH, HEIGHT))
            self.assert_same_poses(done["seen"], covered)
            self.assertGreaterEqual(sum(each["pose"][40] for each in done["seen"]), COVERED - 1)

    def test_a_picture_of_ones_own_is_tracked_as_if_it_had_been_baked(self):
        place = self.site / "own"
        place.mkdir()
        game, painting = (ROOT / "assets" / "patterns" / f"{name}.png" for name in ("game", "painting"))
        own, clip = place / "own.png", self.folder / "clip"
        subprocess.run(["ffmpeg", "-v", "error", "-i", painting, "-pix_fmt", "gray", own], check=True)
        for bundle, patterns in ((place / "one.modar", [game]), (self.folder / "both.modar", [game, own])):
            words = [word for pattern in patterns for word in ("--pattern", pattern)]
            done = self.modar("bake", *words, "--no-score", "--parameters", "none", "-o", bundle, "--quiet")
            self.assertEqual(done.returncode, 0, done.stderr)
        subprocess.run([sys.executable, ROOT / "assets" / "make_clip.py", "--pattern", own, "--frames", "6", "--size", f"{WIDTH}x{HEIGHT}",
                        clip], check=True, capture_output=True)
        subprocess.run(["ffmpeg", "-v", "error", "-pattern_type", "glob", "-i", clip / "*.png", "-pix_fmt", "gray", "-f", "rawvideo",
                        place / "own.gray"], check=True)
        done = self.run_program("modar-play", self.folder / "both.modar", "--input", f"grey:{WIDTH}x{HEIGHT}:{place / 'own.gray'}", "--json")
        played = [line for line in map(json.loads, done.stdout.splitlines()) if "frame" in line]
        self.assertGreaterEqual([len(line["visible"]) for line in played].count(1), 5)
        self.browser.open(self.server.url)
        for simd in ("true", "false"):
            told = self.browser.run(OWN % (simd, WIDTH * HEIGHT, WIDTH, HEIGHT))
            print(f"simd {simd}: the visitor's picture takes {told['ms']:.0f} ms")
            self.assertEqual(told["index"], 1)
            self.assertEqual(told["known"], [{"name": "game", "widthMm": 0}, {"name": "mine", "widthMm": 90}])
            self.assertEqual(told["refused"]["code"], "pattern.no-features")
            self.assertGreater(len(told["refused"]["cure"]), 20)
            self.assert_same_poses(told["seen"], played)
            self.assertEqual((told["left"], told["numbers"], told["reason"] == "visible"), (1, 45, False))

    def test_each_copy_of_a_print_has_its_pose(self):
        place = self.site / "copies"
        place.mkdir()
        done = self.modar("bake", "--pattern", f"{COVER}:copies=3", "--no-score", "--parameters", "none", "-o", place / "two.modar", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        lefts, wide = (WIDTH // 20, 11 * WIDTH // 20), 2 * WIDTH // 5
        graph = (f"[1]scale={wide}:-1,split[a][b];[0][a]overlay={lefts[0]}:40[c];[c][b]overlay={lefts[1]}:40,format=gray")
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", f"color=gray:s={WIDTH}x{HEIGHT}", "-i", COVER, "-filter_complex", graph,
                        "-frames:v", "1", "-f", "rawvideo", place / "two.gray"], check=True)
        self.browser.open(self.server.url)
        told = self.browser.run(COPIES % (WIDTH, HEIGHT, WIDTH, HEIGHT))
        poses = [told["poses"][i:i + 45] for i in range(0, len(told["poses"]), 45)]
        self.assertEqual((told["copies"], [pose[0] for pose in poses]), (3, [1, 1, 0]))
        for left, x in zip(lefts, sorted(pose[16] for pose in poses[:2])):
            self.assertAlmostEqual(x, left, delta=2)

    def test_corners_are_found_on_a_plain_table(self):
        painting = ROOT / "assets" / "patterns" / "painting.png"
        for name, table, corners, wanted in (
                ("table", "0xb8a890", [(0.18, 0.22), (0.80, 0.14), (0.88, 0.86), (0.12, 0.78)], True),
                ("turned", "0x405040", [(0.30, 0.12), (0.86, 0.30), (0.70, 0.88), (0.14, 0.70)], True),
                ("none", "0x405040", [], False)):
            photo = self.site / f"{name}-photo.png"
            size = "800x600"
            if wanted:
                order = [corners[i] for i in (0, 1, 3, 2)]
                places = ":".join(f"x{i}={800 * x:.1f}:y{i}={600 * y:.1f}" for i, (x, y) in enumerate(order))
                mask = f"color=white:s={size},format=gray,pad=iw+2:ih+2:1:1:black,scale=800:600,perspective={places}:sense=destination"
                graph = (f"[1]scale=800:600,perspective={places}:sense=destination,format=rgb24[picture];{mask},format=gray[alpha];"
                         "[picture][alpha]alphamerge[thing];[0][thing]overlay,noise=alls=6,format=rgb24")
            else:
                graph = "[0]noise=alls=6,format=rgb24"
            subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", f"color={table}:s={size}", "-i", painting, "-filter_complex", graph,
                            "-frames:v", "1", photo], check=True)
            self.browser.open(self.server.url)
            found = self.browser.run("""(async () => {
              const { findCorners } = await import('/own-picture.js');
              const image = new Image();
              image.src = '%s';
              await image.decode();
              const canvas = Object.assign(document.createElement('canvas'), { width: 800, height: 600 });
              canvas.getContext('2d').drawImage(image, 0, 0);
              return findCorners(canvas);
            })()""" % photo.name)
            self.assertEqual(found is not None, wanted, name)
            for at, (x, y) in zip(found or [], corners):
                self.assertLess(math.dist(at, (800 * x, 600 * y)), 8, (name, found))

    def drag(self, corner, x, y):
        """The mouse, from a corner's handle in the dialog to a place of the photo, in shares of its sides."""
        from_x, from_y, to_x, to_y = self.browser.run(f"""(() => {{
          const middle = (element, u, v) => {{ const box = element.getBoundingClientRect(); return [box.left + u * box.width, box.top + v * box.height]; }};
          const handle = document.getElementById('own-corners').children[{corner}];
          return [...middle(handle, 0.5, 0.5), ...middle(document.getElementById('own-photo'), {x}, {y})];
        }})()""")
        for kind, at in (("mousePressed", (from_x, from_y)), ("mouseMoved", ((from_x + to_x) / 2, (from_y + to_y) / 2)),
                         ("mouseMoved", (to_x, to_y)), ("mouseReleased", (to_x, to_y))):
            self.browser.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", clickCount=1,
                              buttons=0 if kind == "mouseReleased" else 1)

    def give(self, file):
        root = self.browser.call("DOM.getDocument")["root"]["nodeId"]
        node = self.browser.call("DOM.querySelector", nodeId=root, selector="#own-file")["nodeId"]
        self.browser.call("DOM.setFileInputFiles", files=[str(file)], nodeId=node)

    def test_a_visitors_own_picture_is_marked_kept_and_forgotten(self):
        # The painting on a table, as a phone sees it from one side: four corners that the test knows.
        photo, painting = self.folder / "photo.png", ROOT / "assets" / "patterns" / "painting.png"
        corners = [(0.18, 0.22), (0.80, 0.14), (0.88, 0.86), (0.12, 0.78)]
        order = [corners[i] for i in (0, 1, 3, 2)]  # as the filter names them
        places = ":".join(f"x{i}={800 * x:.1f}:y{i}={600 * y:.1f}" for i, (x, y) in enumerate(order))
        subprocess.run(["ffmpeg", "-v", "error", "-i", painting, "-vf",
                        f"scale=800:600,format=rgba,perspective={places}:sense=destination:interpolation=cubic,format=rgb24", photo], check=True)
        plain = self.folder / "plain.png"
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "color=gray:s=320x240", "-frames:v", "1", plain], check=True)
        self.browser.resize(390, 844, 2, True)
        self.browser.open(self.server.url)
        self.browser.run("""globalThis.added = [];
          customElements.get('modar-viewer').prototype.addPattern = ((add) => async function (image, ...rest) {
            added.push(image);
            return add.call(this, image, ...rest);
          })(customElements.get('modar-viewer').prototype.addPattern)""")
        self.give(plain)
        self.browser.wait("document.getElementById('own').open", "the dialog")
        self.browser.run("document.getElementById('own-use').click()")
        self.browser.wait("document.getElementById('own-problem').textContent.includes('too little')", "the refusal")
        self.browser.run("document.getElementById('own-close').click()")
        self.give(photo)
        self.browser.wait("document.getElementById('own').open && document.getElementById('own-photo').width === 800", "the photo")
        for i, (x, y) in enumerate(corners):
            self.drag(i, x, y)
        self.browser.run("document.getElementById('own-corners').children[0].dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }))")
        self.keep("own.png")
        points = self.browser.run("document.querySelector('#own-quad polygon').getAttribute('points')").split()
        for at, (x, y) in zip((point.split(",") for point in points), corners):
            self.assertLess(math.dist((float(at[0]), float(at[1])), (800 * x, 600 * y)), 4)
        self.browser.run("document.getElementById('own-use').click()")
        self.browser.wait("!document.getElementById('own').open", "the picture")
        self.assertIn("Kept on this device", self.browser.run("document.getElementById('progress').textContent"))
        # Laid flat it is the painting: the mean difference of both, at one size.
        data = self.browser.run("added.at(-1).toDataURL().split(',')[1]")
        flat = self.folder / "flat.png"
        flat.write_bytes(base64.b64decode(data))
        grays = [subprocess.run(["ffmpeg", "-v", "error", "-i", file, "-vf", "scale=160:120:flags=area,format=gray", "-f", "rawvideo", "-"],
                                capture_output=True, check=True).stdout for file in (flat, painting)]
        off = sum(abs(a - b) for a, b in zip(*grays)) / len(grays[0])
        self.assertLess(off, 6, "gray values of 255")
        viewer = "document.getElementById('viewer')"
        self.assertEqual(self.browser.run(f"{viewer}.patterns.map(({{ title }}) => title)"), ["cover", "Your picture"])
        # The model is on it without a camera, too; the next visit has it again, until it is forgotten.
        self.browser.run(f"{viewer}.look(1)")
        self.browser.wait("part('ground').naturalWidth > 0", "the turntable")
        lit = "(() => { const c = new OffscreenCanvas(200, 200).getContext('2d'); c.drawImage(part('models'), 0, 0, 200, 200);" \
              " return c.getImageData(0, 0, 200, 200).data.filter((v, i) => i % 4 === 3 && v > 128).length; })()"
        self.browser.wait(f"new Promise((done) => requestAnimationFrame(() => done({lit} > 400)))", "the model")
        self.keep("own-around.png")
        self.browser.open(self.server.url)
        self.browser.wait(f"{viewer}.patterns.length === 2", "the kept pictures")
        self.browser.run("document.getElementById('forget').click()")
        self.browser.wait("caches.keys().then((names) => !names.some((name) => name.startsWith('modar own')))", "nothing kept")
        self.browser.open(self.server.url)
        self.browser.wait(f"{viewer}.modar", "the bundle")
        self.assertEqual(self.browser.run(f"{viewer}.patterns.length"), 1)
        self.assertEqual(self.browser.errors, [])

    def test_a_phones_turns_in_its_cameras_axes(self):
        # Held upright, screen to the visitor: the device's axes that point up and right, by how far the phone was turned
        # counterclockwise (its top is up, left, down, right).
        held = {0: ((0, 1, 0), (1, 0, 0)), 90: ((1, 0, 0), (0, -1, 0)), 180: ((0, -1, 0), (-1, 0, 0)), 270: ((-1, 0, 0), (0, 1, 0))}
        self.browser.open(self.server.url)
        for angle, (up, right) in held.items():
            kind = {0: "portraitPrimary", 90: "landscapePrimary", 180: "portraitSecondary", 270: "landscapeSecondary"}[angle]
            self.browser.resize(640, 480, screenOrientation={"type": kind, "angle": angle})
            # What the visitor does, about which axis by the right hand, and how each camera sees itself turn: x right, y down,
            # z forward. The front camera's right is the visitor's left.
            for axis, back, front in (([-c for c in up], (0, 1, 0), (0, 1, 0)),  # turns the phone to the right
                                      (right, (1, 0, 0), (-1, 0, 0)),  # leans its top back to the visitor: the back looks up
                                      ((0, 0, -1), (0, 0, 1), (0, 0, -1))):  # turns it clockwise
                rates = [[time, *(math.degrees(c) for c in axis)] for time in (1000, 1010, 1020)]
                for camera, wanted in ((back, "false"), (front, "true")):
                    turned, = self.browser.run(READ % (wanted, rates, [[1000, 1020]]))
                    for ours, theirs in zip(turned, camera):
                        self.assertAlmostEqual(ours, 0.02 * theirs, 12, (angle, axis, wanted))

    def test_turns_are_summed_between_frames_and_unknown_in_gaps(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        spans = {**TURNED, (50, 50): None, (None, 50): None}
        readings = [[time, rate, 0, 0] for time, rate in READINGS]
        found = self.browser.run(READ % ("false", readings, json.dumps(list(spans))))
        for (span, degrees), turned in zip(spans.items(), found):
            self.assertEqual(turned is None, degrees is None, span)
            if degrees is not None:
                self.assertAlmostEqual(math.degrees(turned[0]), degrees, 9, span)

    def test_the_page_tells_its_tracker_the_gyroscopes_turns(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.browser.run(PHONE)
        self.start()
        self.browser.wait("told.filter(({ turn }) => turn).length > 4", "turns")
        camera, *frames = self.browser.run("told")
        self.assertTrue(camera["extended"])
        for before, after in zip(frames, frames[1:]):
            if "turn" in after:  # also over frames that were dropped on the way
                self.assertAlmostEqual(after["turn"][0], after["time"] - before["time"], 6)
        # Refused: everything else continues.
        self.browser.run("part('close').click(), allowed = 'denied'")
        self.browser.wait("!part('video').srcObject", "the end")
        self.browser.run("told.length = 0")
        self.start()
        self.browser.wait("told.length > 4", "frames")
        self.assertNotIn("turn", {key for each in self.browser.run("told") for key in each if each[key] is not None})
        self.assertEqual(self.browser.errors, [])

    def test_camera_frames_arrive_without_a_read_back_and_track_alike(self):
        self.browser.open(self.server.url)
        for canvas in (False, True):
            script = RECORD % (WIDTH, HEIGHT)
            if canvas:
                script = "(delete globalThis.VideoFrame, " + script + ")"
            seen = self.browser.run(script)
            self.assertEqual({each["source"] for each in seen}, {"HTMLCanvasElement" if canvas else "VideoFrame"})
            frames = self.folder / "seen.gray"
            frames.write_bytes(b"".join(base64.b64decode(each["luma"]) for each in seen))
            self.assert_same_poses(seen, self.played(frames))
        self.assertEqual(self.browser.errors, [])

    def start(self, state="seen"):
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.browser.run("performance.clearMarks(), document.getElementById('start').click()")
        self.browser.wait(f"document.getElementById('viewer').state === '{state}'", f"state {state}")

    def test_a_visit(self):
        self.browser.resize(390, 844, 2, True)
        self.browser.open(self.server.url)
        self.browser.wait("document.images[0]?.complete && document.getElementById('start').textContent !== ''", "the cover")
        self.keep("cover-portrait.png")
        self.assertEqual(self.browser.run("document.title"), "Pots & pans")
        self.start()
        ms = [self.browser.run(f"performance.getEntriesByName('modar: {each}')[0].startTime - performance.getEntriesByName('modar: camera')[0].startTime")
              for each in ("tracked", "seen")]
        print("from the camera to the first tracked frame {:.0f} ms, to the model {:.0f} ms".format(*ms))
        self.browser.wait(f"({DRAWN}) > 5000", "the model, which comes after the picture")
        self.keep("stage-portrait.png")
        self.assertEqual(self.browser.run("part('label-name').textContent"), "The book of owls")
        # Long after the models were drawn: browsers have emptied their canvas by then. What the picture shows alone is kept.
        self.browser.run("""new Promise((shot) => { setTimeout(() => {
          const picture = part('picture');
          window.alone = picture.getContext('2d').getImageData(0, 0, picture.width, picture.height).data;
          document.getElementById('shoot').click();
          shot();
        }, 5); })""")
        self.browser.wait("document.getElementById('photo').open && document.getElementById('photo-image').naturalWidth > 0", "a photo")
        self.assertEqual(self.browser.run("document.getElementById('photo-image').naturalWidth"), 780)
        lit, drawn = self.browser.run("""(async () => {
          const image = document.getElementById('photo-image');
          const copy = new OffscreenCanvas(image.naturalWidth, image.naturalHeight).getContext('2d');
          copy.drawImage(image, 0, 0);
          const photo = copy.getImageData(0, 0, image.naturalWidth, image.naturalHeight).data;
          let [lit, drawn] = [0, 0];
          for (let i = 0; i < photo.length; i += 4) {
            const worst = Math.max(...[0, 1, 2].map((c) => Math.abs(photo[i + c] - window.alone[i + c])));
            lit += worst > 48;
            drawn += worst > 12;
          }
          return [lit, drawn];
        })()""")
        print(f"the photo differs from the camera's picture in {lit} pixels by more than 48 of 255, in {drawn} by more than 12")
        self.assertGreater(lit, 5000, "the model is on the photo")
        self.assertLess(drawn, 780 * 1688 / 3, "and the camera's picture around it")
        self.keep("photo-portrait.png")
        self.browser.run("document.getElementById('photo').close()")
        self.browser.resize(844, 390, 2, True)
        self.browser.wait("part('models').width === 1688", "the turn")
        self.keep("stage-landscape.png")
        self.browser.run("part('close').click()")
        self.browser.wait("!part('stage').open && !part('video').srcObject", "the end")
        self.keep("cover-landscape.png")
        self.assertEqual(self.browser.errors, [])
        own = (self.server.url, "blob:" + self.server.url, "data:", "about:")
        self.assertEqual([url for url in self.browser.requests if not url.startswith(own)], [])

    def test_everything_has_a_name(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        for stage in (False, True):
            if stage:
                self.start()
            nodes = [n for n in self.browser.call("Accessibility.getFullAXTree")["nodes"] if not n.get("ignored")]
            roles = {}
            for node in nodes:
                role = node["role"]["value"]
                if role in ("button", "image", "combobox", "heading", "link", "toolbar", "region", "application"):
                    roles.setdefault(role, []).append(node.get("name", {}).get("value", ""))
            self.assertIn("button", roles)
            for role, names in roles.items():
                self.assertNotIn("", names, role)
        self.assertIn("A pot with two handles, on the picture The book of owls.", roles["application"])

    def assert_accessible(self, what):
        found = self.browser.run("""axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] })
          .then(({ violations, passes }) => [passes.length, violations.map(({ id, nodes }) => id + ': ' + nodes.map(({ html }) => html).join(' | '))])""")
        self.assertGreater(found[0], 10, what)
        self.assertEqual(found[1], [], what)

    def test_axe_core_finds_nothing(self):
        axe = axe_core(self.folder)
        if axe is None:
            self.skipTest("npm cannot fetch axe-core")
        click = lambda part: self.browser.run(f"part('{part}').click()")
        self.browser.resize(390, 844, 2, True)
        self.browser.open(self.server.url)
        self.browser.run(axe.read_text() + "; 0")
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.assert_accessible("cover")
        click("about")
        self.assert_accessible("notes")
        click("notes-close")
        self.give(ROOT / "assets" / "patterns" / "painting.png")
        self.browser.wait("document.getElementById('own').open", "the visitor's picture")
        self.assert_accessible("own")
        click("own-close")
        self.start()
        self.assert_accessible("seen")
        click("shoot")
        self.browser.wait("document.getElementById('photo').open", "a photo")
        self.assert_accessible("photo")
        click("photo-close")
        click("cameras")
        self.browser.wait("part('choose').open", "the cameras")
        self.assert_accessible("cameras")
        click("choose-close")
        click("close")
        click("look")
        self.browser.wait("document.getElementById('viewer').state === 'around'", "the turntable")
        self.assert_accessible("around")
        self.browser.run("document.getElementById('viewer').fail(new DOMException('', 'NotFoundError'))")
        self.assert_accessible("problem")
        self.browser.open(self.server.url + "accessibility-de.html")
        self.browser.run(axe.read_text() + "; 0")
        self.assert_accessible("statement")
        self.keep("statement.png")

    def test_page_and_engine_are_a_quarter_of_a_megabyte(self):
        """Downloads of a first visitor's browser besides bundle, hint and words, compressed as servers do."""
        self.around()
        names = {urllib.parse.urlsplit(url).path.lstrip("/") or "index.html" for url in self.browser.requests if url.startswith(self.server.url)}
        names = {name for name in names if not name.startswith(("bundles/", "patterns/", "words/")) and (self.site / name).is_file()}
        self.assertIn("engine-simd.wasm", names)
        size = sum(len(gzip.compress((self.site / name).read_bytes(), 9)) for name in names)
        print(f"page and engine: {size} bytes gzipped, in {len(names)} files")
        if BROTLI:
            packed = {name: len(subprocess.run([BROTLI, "-q", "11", "-w", "24", "-c", self.site / name], capture_output=True, check=True).stdout)
                      for name in names}
            largest = sorted(packed.items(), key=lambda each: -each[1])[:3]
            print(f"by brotli: {sum(packed.values())} bytes, of these", ", ".join(f"{name} {bytes_}" for name, bytes_ in largest))
        # 250,000 before meshes had a coder of their own, which takes a third off what a model's page loads.
        self.assertLess(size, 262_144)

    def test_scripts_are_short_and_say_what_is_wrong(self):
        for script in ("engine.js", "modar-view.js", "modar-viewer.js"):
            source, short = (ROOT / "runtime" / "extensions" / "web" / script).read_text(), (self.site / script).read_text()
            self.assertLess(len(short), 0.9 * len(source), script)
            self.assertNotRegex(short, r"(?m)^\s*(//(?!# sourceMappingURL=)|/\*|  )", script)
            told = [text.replace("\\'", "'") for text in re.findall(r"(?:code|cause|cure): '((?:[^'\\]|\\.)+)'", source)]
            self.assertEqual([text for text in told if text not in short], [], script)

    def test_small_screens_scroll_one_way(self):
        self.browser.resize(320, 256)
        for page, shown in (("", "document.getElementById('start').textContent !== ''"), ("accessibility-de.html", "true")):
            self.browser.open(self.server.url + page)
            self.browser.wait(shown, page)
            self.assertLessEqual(self.browser.run("document.scrollingElement.scrollWidth"), 320, page)
            self.keep(f"small-{page or 'cover'}.png")

    def test_browsers_that_make_no_style_sheets_show_the_same(self):
        self.browser.resize(390, 844, 2, True)
        look = """(() => { const style = (element) => { const { position, width, color, borderTopWidth } = getComputedStyle(element);
          return [position, width, color, borderTopWidth]; };
          return [part('tools'), part('close'), part('shoot'), part('about')].map(style); })()"""
        looks = []
        for old in (False, True):
            if old:
                script = self.browser.call("Page.addScriptToEvaluateOnNewDocument", source="delete CSSStyleSheet.prototype.replaceSync")
            self.around()
            self.browser.wait("[...part('tools').getRootNode().querySelectorAll('link')].every(({ sheet }) => sheet)", "styles")
            looks.append(self.browser.run(look))
        self.browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])
        self.assertEqual(looks[0], looks[1])
        self.assertEqual(looks[0][0][0], "absolute")
        self.assertEqual(self.browser.errors, [])

    def test_keys_turn_and_resize(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.start()
        self.assertEqual(self.browser.run("part('models').getRootNode().activeElement.id"), "models")
        key = "part('models').dispatchEvent(new KeyboardEvent('keydown', {{ key: '{}', bubbles: true, cancelable: true }}))"
        self.assertFalse(self.browser.run(key.format("ArrowLeft")))  # taken
        self.assertTrue(self.browser.run(key.format("x")))
        self.assertFalse(self.browser.run(key.format("Escape")))
        self.browser.wait("!part('stage').open", "the end")

    def test_a_lost_context_is_restored(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.start()
        self.browser.run("globalThis.loser = part('models').getContext('webgl2').getExtension('WEBGL_lose_context'), loser.loseContext()")
        self.browser.wait("part('models').getContext('webgl2').isContextLost()", "the loss")
        # Lost again before the page can make use of it, as where the driver is still busy with what it lost.
        self.browser.run("""new Promise((done) => {
          const models = part('models');
          models.parentNode.addEventListener('webglcontextrestored', () => {
            models.addEventListener('webglcontextlost', () => setTimeout(done, 300), { once: true });
            loser.loseContext();
          }, { capture: true, once: true });
          loser.restoreContext();
        })""")
        self.browser.run("loser.restoreContext()")
        self.browser.wait(f"({DRAWN}) > 500", "models after the loss")
        self.assertEqual(self.browser.errors, [])
        self.assertEqual(self.browser.run("part('problem').dataset.kind ?? ''"), "")

    def around(self, address=""):
        self.browser.open(self.server.url + address)
        self.browser.wait("document.getElementById('look').textContent !== ''", "the cover")
        self.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
        self.addCleanup(self.browser.call, "Emulation.setEmulatedMedia", features=[])
        self.browser.run("document.getElementById('look').click()")
        self.browser.wait("document.getElementById('viewer').state === 'around'", "the turntable")
        self.browser.run("document.getElementById('viewer').whole")

    def test_a_look_without_a_camera(self):
        self.browser.resize(390, 844, 2, True)
        self.around()
        self.assertTrue(self.browser.run("part('video').srcObject === null"))
        picture = """(async () => {
          await new Promise(requestAnimationFrame);
          const { width, height } = part('models');
          const copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
          Object.assign(copy.canvas, { width, height });
          part('%s').click();
          copy.drawImage(part('models'), 0, 0);
          const { data } = copy.getImageData(0, 0, width, height);
          let [drawn, left] = [0, 0];
          for (let i = 3; i < data.length; i += 4) if (data[i] === 255) { ++drawn; left += i / 4 %% width < width / 2; }
          let hash = 0;
          for (const value of data) hash = (hash * 31 + value) | 0;
          return [drawn, left / drawn, hash];
        })()"""
        first = self.browser.run(picture % "reset")
        self.assertGreater(first[0], 20000)
        self.assertAlmostEqual(first[1], 0.5, delta=0.05, msg="the pot is in the middle")
        self.keep("around-portrait.png")
        for handle in ("turn-left", "larger", "higher"):
            self.assertNotEqual(self.browser.run(picture % handle)[2], first[2], handle)
            self.assertEqual(self.browser.run(picture % "reset")[2], first[2], handle)
        self.assertGreater(self.browser.run(picture % "larger")[0], first[0])
        part = """const models = part('models');
          models.setPointerCapture = () => {};
          for (const [type, x] of [['pointerdown', 0], ['pointermove', %d], ['pointerup', %d]])
            models.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: x, clientY: 400 }));"""
        self.browser.run("part('reset').click()")
        for across, same in ((390, True), (97, False)):  # of 390: once around, and a quarter
            dragged = self.browser.run(picture.replace("part('%s').click();", "%s") % (part % (across, across)))
            self.assertEqual(dragged[2] == first[2], same, across)
        names = self.browser.run("['models', 'stage', 'close'].map((id) => part(id).getAttribute('aria-label'))")
        self.assertEqual(names, ["A pot with two handles, on the picture The book of owls.", "View without a camera", "Back"])
        label = self.browser.run("part('label').textContent")
        self.assertIn("The book of owls", label)
        self.browser.resize(844, 390, 2, True)
        self.keep("around-landscape.png")
        self.assertEqual(self.browser.errors, [])
        self.browser.run("part('close').click()")
        self.assertFalse(self.browser.run("part('stage').open"))

    def test_phones_have_a_link_to_their_own_viewer(self):
        room = """(async () => {
          const links = [];
          for (const [name, viewer] of [['iPhone', true], ['Android', false], ['desk', false]]) {
            DOMTokenList.prototype.supports = () => viewer;
            Object.defineProperty(navigator, 'userAgent', { value: name, configurable: true });
            part('scene').dispatchEvent(new Event('change'));
            await new Promise((resolve) => setTimeout(resolve, 300));
            const link = document.getElementById('room');
            links.push([link.checkVisibility(), link.href, link.children.length, link.title]);
          }
          return links;
        })()"""
        self.around()
        iphone, android, desk = self.browser.run(room)
        self.assertEqual(iphone, [True, f"{self.server.url}patterns/demo-0.usdz", 1, "View in your room"])
        self.assertEqual(android[0], True)
        self.assertIn("file=" + urllib.parse.quote(f"{self.server.url}patterns/demo-0.glb", safe=""), android[1])
        self.assertRegex(android[1], "^intent://arvr.google.com/scene-viewer/.*scheme=https;.*end;$")
        self.assertEqual(desk[0], False)

    def test_the_picture_lies_where_the_turntables_eye_sees_it(self):
        self.browser.open(self.server.url)
        for turn, tilt in ((0, 0.5), (0.7, 0.3), (-2.5, 1.4)):
            target, distance, focal, (width, height), size = (0.1, -0.2, 0.4), 5.0, 700.0, (390, 844), (300, 500)
            matrix = self.browser.run("""(async () => {
              const { groundTransform, viewFrom } = await import('/turntable.js');
              return groundTransform(viewFrom({ target: %s, turn: %s, tilt: %s, distance: %s }), %s, { width: %s, height: %s }, { width: %s, height: %s });
            })()""" % (json.dumps(target), turn, tilt, distance, focal, width, height, *size))
            # An eye on a sphere about the target, its axes from its place and the up direction.
            back = (math.sin(turn) * math.cos(tilt), -math.cos(turn) * math.cos(tilt), math.sin(tilt))
            cross = lambda a, b: tuple(a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3))
            right = cross((0, 0, 1), back)
            right = tuple(c / math.hypot(*right) for c in right)
            up = cross(back, right)
            for x, y in ((0, 0), (300, 0), (120, 500)):
                from_eye = tuple(at - (target[i] + distance * back[i]) for i, at in enumerate(((2 * x - 300) / 500, (500 - 2 * y) / 500, 0)))
                dot = lambda axis: sum(a * b for a, b in zip(axis, from_eye))
                depth = -dot(back)
                column = [matrix[i] * x + matrix[4 + i] * y + matrix[12 + i] for i in range(4)]
                self.assertAlmostEqual(column[0] / column[3], width / 2 + focal * dot(right) / depth, 3)
                self.assertAlmostEqual(column[1] / column[3], height / 2 - focal * dot(up) / depth, 3)

    def test_a_desktop_without_a_camera_shows_the_address_for_a_phone(self):
        self.browser.resize(1280, 900)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.assertFalse(self.browser.run("document.getElementById('elsewhere').checkVisibility()"), "with a camera")
        none = """navigator.mediaDevices.enumerateDevices = async () => [];
          navigator.mediaDevices.getUserMedia = async () => { throw new DOMException('', 'NotFoundError'); }"""
        script = self.browser.call("Page.addScriptToEvaluateOnNewDocument", source=none)["identifier"]
        self.addCleanup(self.browser.call, "Page.removeScriptToEvaluateOnNewDocument", identifier=script)
        url = self.server.url + "?lang=en"
        self.browser.open(url)
        self.browser.wait("document.getElementById('elsewhere').checkVisibility()", "the code on the cover")
        self.browser.wait("document.getElementById('elsewhere').textContent.includes('on a phone')", "its sentence")
        self.keep("desktop.png")
        self.start("error")
        self.browser.wait("part('problem').querySelector('canvas').checkVisibility()", "the code in the dialog")
        self.assertEqual(self.browser.run("part('problem').dataset.kind"), "none")
        self.keep("desktop-problem.png")
        for canvas in ("document.getElementById('qr')", "part('problem').querySelector('canvas')"):
            size, dark = self.browser.run(f"""(() => {{
              const canvas = {canvas};
              const {{ data }} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
              return [canvas.width, Array.from(data.filter((_, i) => i % 4 === 0), (value) => Number(value < 128))];
            }})()""")
            rows = [dark[size * y + 4:size * y + size - 4] for y in range(4, size - 4)]
            if qr_test.ZBAR:
                self.assertEqual(qr_test.read(rows), [url])
            self.assertEqual(rows, qr_test.codes_of([url])[0])
        self.assertEqual(self.browser.errors, [])

    def test_numbers_that_are_none_are_refused(self):
        """As modar.h does: a place or an amount of bytes that is not a whole number."""
        self.browser.open(self.server.url)
        told = self.browser.run("""(async () => {
          const module = await (await import('/engine-plain.js')).default();
          const calls = { pass: (n) => module._web_pass(n, 0, 0), fill: (n) => module._web_fill(n, 0, 0), wanted: (n) => module._web_show_wanted(n, 0) };
          const told = {};
          for (const [name, call] of Object.entries(calls)) {
            told[name] = [NaN, -1, 1e300, Infinity, 2 ** 53].map((n) => call(n) !== 0 && module.UTF8ToString(module._web_error(0)));
          }
          return { ...told, reserve: [NaN, -1, 1e300, 2 ** 32].map((n) => module._web_reserve(n)), arrive: [NaN, -1, 1e300, 2 ** 32].map((n) => module._web_arrive(n)) };
        })()""")
        self.assertEqual(told, {**{name: 5 * ["capi.number"] for name in ("pass", "fill", "wanted")}, "reserve": 4 * [0], "arrive": 4 * [0]})

    def test_source_maps_lead_to_the_source(self):
        """The place of a text in a shortened script, by a reader of its own, is the line of the source that has the text."""
        found = 0
        for script, text, module in (("app.js", "'web.scene'", "modar-viewer.js"), ("app.js", "modar-language", "app.js"), ("modar.js", "web.worker", "modar.js"),
                                     ("modar-worker-simd.js", "'frame'", "modar-worker.js"), ("media.js", "text/vtt", "media.js")):
            code, text = (self.site / script).read_text(), text.strip("'")
            told = json.loads((self.site / f"{script}.map").read_text())
            self.assertTrue(code.endswith(f"\n//# sourceMappingURL={script}.map\n"), script)
            line, column = code[:code.index(text)].count("\n"), code.index(text) - (code.rfind("\n", 0, code.index(text)) + 1)
            source, at = place_in(told["mappings"], line, column)
            with self.subTest(script=script, text=text):
                self.assertEqual(told["sources"][source], module)
                self.assertEqual(told["sourcesContent"][source], (ROOT / "runtime" / "extensions" / "web" / module).read_text())
                self.assertIn(text, told["sourcesContent"][source].split("\n")[at])
                found += 1
        self.assertEqual(found, 5)

    def test_a_language_is_chosen_and_kept(self):
        self.browser.resize(390, 844, 2, True)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('language').options.length === 9", "the languages")
        choose = "(() => { const l = document.getElementById('language'); l.value = '%s'; l.dispatchEvent(new Event('change')); })()"
        self.browser.run(choose % "de")
        self.browser.wait("document.getElementById('start').textContent === 'Kamera starten'", "German")
        self.assertEqual(self.browser.run("document.getElementById('caption').textContent"), "Das Buch der Eulen")
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent === 'Kamera starten'", "German again")
        self.browser.open(self.server.url + "?lang=ar")
        self.browser.wait("document.documentElement.dir === 'rtl'", "right to left")
        self.keep("cover-from-right.png")
        self.browser.run("document.getElementById('about').click(), document.getElementById('forget').click()")
        self.browser.wait("document.getElementById('forget').disabled", "the kept pictures go")
        self.assertEqual(self.browser.run("Object.keys(localStorage).filter((key) => key.startsWith('modar-')).length"), 0)
        self.assertEqual(self.browser.run("caches.keys().then((names) => names.length)"), 0)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent === 'Start the camera'", "English")
        self.browser.wait("caches.match('words/en.json').then(Boolean)", "kept again")
        links = self.browser.run("[...document.querySelectorAll('#links a')].map(({ href, textContent }) => [textContent, href])")
        self.assertEqual(links, [["Accessibility statement", self.server.url + "accessibility-en.html"], ["Imprint", "https://example.org/imprint"], ["Write to us", "mailto:us@example.org"]])

    def test_a_visitors_answers_are_kept_and_saved_with_the_log(self):
        self.browser.open(self.server.url + "?survey&lang=de")
        self.browser.wait("document.getElementById('survey-open')?.textContent === 'Fragen zu Ihrem Besuch'", "the questions' button")
        self.browser.run("document.getElementById('start').click()")
        self.browser.wait("document.getElementById('viewer').state === 'seen'", "the picture")
        self.browser.run("document.getElementById('viewer').stop()")
        self.browser.run("document.getElementById('survey-open').click()")
        self.browser.run("""(() => {
  for (let i = 0; i < 10; ++i) document.querySelector(`[name=s${i}][value="${i % 2 ? 2 : 4}"]`).click();
  document.getElementById('answer-4').value = 'Mehr Töpfe';
  document.getElementById('answer-4').dispatchEvent(new Event('change', { bubbles: true }));
})()""")
        self.keep("survey.png")
        self.browser.open(self.server.url + "?survey&lang=en")  # on a later visit, the answers are there
        self.browser.wait("document.getElementById('survey-open')?.textContent === 'Questions about your visit'", "English")
        lines = self.browser.run("""(() => {
  document.getElementById('survey-open').click();
  const saved = new Promise((resolve) => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => {
      URL.createObjectURL = make;
      blob.text().then(resolve);
      return make.call(URL, blob);
    };
  });
  document.querySelector('#survey button').click();
  return saved;
})()""")
        head, survey = [json.loads(line) for line in lines.splitlines()]
        self.assertEqual((head["qos"]["page"], head["qos"]["version"]), ("Pots & pans", 1))
        self.assertEqual(survey["survey"], {"language": "de", "sus": [4, 2] * 5, "score": 75, "answers": ["", "", "", "", "Mehr Töpfe"]})
        self.assertEqual(self.browser.run("document.getElementById('answer-4').value"), "Mehr Töpfe")
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the plain page")
        self.assertFalse(self.browser.run("Boolean(document.getElementById('survey-open'))"))

    def test_lists_over_the_camera_choose_model_and_picture(self):
        bundles = [self.folder / f"{name}.modar" for name in ("pots", "pans")]
        for each in bundles:
            shutil.copy(self.bundle, each)
        done = self.modar("web", *bundles, "-o", self.folder / "two", "--languages", "en", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.modar("web", *bundles, "-o", self.folder / "three", "--baker", "--quiet")
        self.assertEqual((done.returncode, done.stderr.endswith("npx modar web --baker [web.page]\n")), (5, True), done.stderr)
        server = Server(self.folder / "two")
        self.addCleanup(server.close)
        state = "document.getElementById('viewer').state === '%s'"
        button = "[...document.querySelectorAll('#lists button')].find(({ textContent }) => textContent === '%s')"
        self.browser.open(server.url)
        self.browser.wait("document.getElementById('bundle').options.length === 2", "two models")
        self.browser.run("document.getElementById('start').click()")
        self.browser.wait(state % "seen", "the first model")
        self.browser.run("document.getElementById('lists-open').click()")
        self.browser.wait(f"Boolean({button % 'pots'})", "the lists")
        self.assertEqual(self.browser.run(f"{button % 'pots'}.ariaPressed + {button % 'pans'}.ariaPressed"), "truefalse")
        self.keep("lists.png")
        self.browser.run(f"{button % 'Back'}.click()")  # to the camera's picture
        self.assertTrue(self.browser.run("!document.getElementById('lists').open && " + state % "seen"))
        self.browser.run("document.getElementById('lists-open').click()")
        self.browser.wait(f"document.getElementById('lists').open && Boolean({button % 'pans'})", "the lists again")
        self.browser.run(f"{button % 'pans'}.click()")
        self.browser.wait("document.getElementById('bundle').selectedIndex === 1 && " + state % "seen", "the second model")
        self.browser.run("document.getElementById('lists-open').click()")
        self.browser.wait(f"document.getElementById('lists').open && {button % 'cover'}?.querySelector('img').complete", "the pictures")
        self.browser.run(f"{button % 'cover'}.click()")
        self.browser.wait(state % "around", "the picture's model without a camera")
        self.browser.run("document.getElementById('viewer').stop()")

    def test_a_film_shows_the_model(self):
        self.browser.resize(390, 844, 1, True)
        self.browser.open(self.server.url)
        self.browser.run(LARGE)  # stands still
        self.start()
        press = "document.getElementById('record').click()"
        self.browser.run("""(async () => {
          // A page on a loaded machine asks its camera for less, and tracking starts anew.
          (await import('/app.js')).Camera.prototype.copied = () => {};
          const { Recorder } = await import('/app.js');
          const add = Recorder.prototype.add;
          Recorder.prototype.add = function () { (globalThis.added ??= []).push(performance.now()); return add.call(this); };
        })()""")
        self.browser.run(press)
        # A machine with other work to do draws few frames a second.
        self.browser.wait("globalThis.added?.length > 15 && added.at(-1) - added[0] > 1500", "frames of a film")
        self.assertEqual(self.browser.run("document.getElementById('record').getAttribute('aria-pressed')"), "true")
        self.browser.run(press)
        self.browser.wait("document.getElementById('photo').open", "the film")
        # Its first and its last frame against the camera's picture without models.
        seen = self.browser.run("""(async () => {
          const film = document.getElementById('film');
          if (film.readyState < 1) await new Promise((resolve) => { film.onloadedmetadata = resolve; });
          const { videoWidth: width, videoHeight: height } = film;
          const copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
          Object.assign(copy.canvas, { width, height });
          const read = (source) => { copy.drawImage(source, 0, 0, width, height); return copy.getImageData(0, 0, width, height).data; };
          const mean = (data) => data.reduce((sum, value, i) => sum + (i % 4 === 3 ? 0 : value), 0) / (0.75 * data.length);
          const alone = read(part('picture'));
          const litAt = async (time) => {
            await new Promise((resolve) => { film.onseeked = resolve; film.currentTime = time; });
            let shot, tries = 0;
            do {  // a browser with other work to do shows a frame some time after it has found it
              await new Promise((resolve) => setTimeout(resolve, 100));
              shot = read(film);
            } while (mean(shot) < 10 && ++tries < 100);
            let lit = 0;
            for (let i = 0; i < shot.length; i += 4) lit += Math.abs(shot[i] - alone[i]) + Math.abs(shot[i + 1] - alone[i + 1]) > 96;
            return lit / (width * height);
          };
          const lit = [await litAt(1e6)], seconds = film.currentTime;
          lit.push(await litAt(0));
          return { width, height, seconds, lit, name: document.getElementById('save').download };
        })()""")
        print(f"the film: {seen}")
        self.assertEqual([seen["width"], seen["height"]], [390, 844])
        self.assertGreater(seen["seconds"], 0.8)
        for lit in seen["lit"]:
            self.assertGreater(lit, 0.03)
            self.assertLess(lit, 0.4)
        self.assertRegex(seen["name"], r"^modar\.(mp4|webm)$")
        self.assertEqual(self.browser.errors, [])

    def test_a_large_camera_is_tracked_small_and_shown_large(self):
        self.browser.resize(960, 720, 2)
        self.browser.open(self.server.url)
        self.browser.run(LARGE)
        self.start()
        seen = self.browser.run("globalThis.asked")
        self.assertEqual([seen["width"]["ideal"], seen["height"]["ideal"]], [1920, 1080])
        self.assertEqual(self.browser.run("(async () => { for (;;) { if (globalThis.tracked) return tracked; await new Promise(requestAnimationFrame); } })()"),
                         [640, 480])
        # Stripes two pixels wide, which a copy of 640 pixels would make gray.
        contrast = """(() => {
          const canvas = part('picture');
          const copy = document.createElement('canvas').getContext('2d');
          Object.assign(copy.canvas, { width: 64, height: 8 });
          copy.drawImage(canvas, 100, 100, 64, 8, 0, 0, 64, 8);
          const row = [...copy.getImageData(0, 4, 64, 1).data].filter((_, i) => i % 4 === 1);
          return Math.max(...row) - Math.min(...row);
        })()"""
        self.assertEqual(self.browser.run("part('picture').width"), 1920)
        self.assertGreater(self.browser.run(contrast), 150)
        self.assertEqual(self.browser.errors, [])

    def test_a_slow_camera_is_asked_for_less(self):
        self.browser.open(self.server.url)
        sizes = self.browser.run("""(async () => {
          const { Camera } = await import('/app.js');
          const asked = [];
          for (const first of [[1920, 1080], [1080, 1920], [1600, 1200], [640, 480]]) {
            const camera = new Camera();
            let [width, height] = first;
            const applyConstraints = async (wanted) => {
              [width, height] = [wanted.width.ideal, wanted.height.ideal];
              asked.push(`${width} x ${height}`);
            };
            camera.stream = { getVideoTracks: () => [{ getSettings: () => ({ width, height }), applyConstraints }] };
            for (const milliseconds of [2, 30, 30, 30, 30]) for (let i = 0; i < 15; ++i) await camera.copied(milliseconds);
          }
          return asked;
        })()""")
        self.assertEqual(sizes, ["1280 x 720", "640 x 360", "720 x 1280", "360 x 640", "800 x 600"])

    def test_models_stay_while_a_slow_camera_gives_less(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.browser.run("""(async () => {
          const canvas = Object.assign(document.createElement('canvas'), { width: 1920, height: 1440 });
          const frame = await createImageBitmap(await (await fetch('/clip/frame_00000.png')).blob());
          const draw = () => {
            canvas.getContext('2d').drawImage(frame, 0, 0, canvas.width, canvas.height);
            requestAnimationFrame(draw);
          };
          draw();
          navigator.mediaDevices.getUserMedia = async () => {
            const stream = canvas.captureStream(30);
            const [track] = stream.getVideoTracks();
            track.getSettings = () => ({ width: canvas.width, height: canvas.height });
            track.applyConstraints = async ({ width, height }) => Object.assign(canvas, { width: width.ideal, height: height.ideal });
            return stream;
          };
          const { Camera } = await import('/app.js');
          const copied = Camera.prototype.copied;
          Camera.prototype.copied = function () { return copied.call(this, globalThis.slow ? 50 : 1); };
          globalThis.seen = { lost: 0, sizes: [], tracked: [] };
          const viewer = document.getElementById('viewer');
          viewer.addEventListener('lost', () => { seen.lost += 1; });
          viewer.addEventListener('frame', ({ detail: { source, camera } }) => {
            if (!globalThis.slow) return;
            seen.sizes.push(source.displayWidth ?? source.width);
            seen.tracked.push(`${camera.width} x ${camera.height}`);
          });
        })()""")
        self.start()
        self.browser.run("globalThis.slow = true")
        self.browser.wait("seen.sizes.filter((size) => size === 640).length > 5", "the smallest pictures")
        seen = self.browser.run("seen")
        self.assertEqual(sorted(set(seen["sizes"])), [640, 1280, 1920])
        self.assertEqual((seen["lost"], set(seen["tracked"])), (0, {"640 x 480"}))

    def test_the_main_camera_is_chosen_and_a_choice_kept(self):
        self.browser.open(self.server.url)
        phones = {  # as browsers name them: Android's with four, an iPhone's, one without names
            "a": ["camera2 1, facing front", "camera2 3, facing back", "camera2 2, facing back", "camera2 0, facing back"],
            "b": ["Front Camera", "Back Ultra Wide Camera", "Back Dual Wide Camera", "Back Camera", "Back Telephoto Camera"],
            "c": ["", ""], "d": ["Integrated Webcam"]}
        found = self.browser.run("""(async () => {
          const { mainCamera, Camera } = await import('/camera.js');
          const main = Object.values(%s).map((labels) =>
            mainCamera(labels.map((label, i) => ({ kind: 'videoinput', label, deviceId: String(i) })))?.label ?? null);
          new Camera().choose('the third');
          const kept = localStorage.getItem('modar-camera');
          new Camera().choose('');
          return [...main, kept];
        })()""" % json.dumps(phones))
        self.assertEqual(found, ["camera2 0, facing back", "Back Camera", None, None, "the third"])

    def test_a_browser_within_an_app_says_where_to_open_the_page(self):
        agent = "Mozilla/5.0 (iPhone; CPU iPhone OS 17_5 like Mac OS X) AppleWebKit/605.1.15 (KHTML, like Gecko) Mobile/15E148 Instagram 331.0.0.29.90"
        self.browser.resize(390, 844, 2, True)
        self.browser.call("Emulation.setUserAgentOverride", userAgent=agent)
        self.browser.camera("denied")
        try:
            self.browser.open(self.server.url)
            self.start("error")
            self.assertEqual(self.browser.run("part('problem').dataset.kind"), "host")
            words = self.browser.run("part('problem').innerText")
            for word in ("Instagram", "Safari", self.server.url):
                self.assertIn(word, words)
            self.assertTrue(self.browser.run("part('copy').checkVisibility() && !part('again').checkVisibility()"))
            self.keep("within-an-app.png")
        finally:
            self.browser.camera("granted")
            self.browser.call("Emulation.setUserAgentOverride", userAgent="")

    def test_a_hidden_page_stops_the_camera(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.start()
        hide = "Object.defineProperty(document, 'hidden', {{ value: {}, configurable: true }}), document.dispatchEvent(new Event('visibilitychange'))"
        self.browser.run(hide.format("true"))
        self.assertTrue(self.browser.run("part('video').srcObject === null"))
        self.browser.run(hide.format("false"))
        self.browser.wait("part('video').srcObject !== null", "the camera again")

    def test_a_refused_camera_is_told(self):
        self.browser.resize(390, 844, 2, True)
        self.browser.open(self.server.url)
        self.browser.camera("denied")
        try:
            self.start("error")
            self.assertEqual(self.browser.run("part('problem').dataset.kind"), "refused")
            self.assertIn("settings", self.browser.run("part('problem').textContent"))
            self.keep("refused.png")
        finally:
            self.browser.camera("granted")
        self.browser.run("part('again').click()")
        self.browser.wait("document.getElementById('viewer').state === 'seen'", "the second try")

    def test_webgl_2_and_1_draw_the_players_pictures(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        for webgl in (2, 1):
            drawn = self.browser.run(COMPARE % ("true" if webgl == 1 else "false", FRAMES))
            self.assertEqual(drawn["webgl"], webgl)
            self.assertGreater(max(frame["lit"] for frame in drawn["frames"]), 5000)
            for frame in drawn["frames"]:
                # Both smooth edges, each in its own way.
                self.assertLess(frame["mean"], 1, frame)
                self.assertLess(frame["off"], 0.005, frame)
            print(f"WebGL {webgl}: {drawn}")

    def test_without_the_server_the_second_visit_works(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.browser.wait(KEPT, "the kept bundles")
        type(self).server.close()
        try:
            self.browser.open(self.server.url + "?again")
            self.start()
            self.assertEqual(self.browser.errors, [])
        finally:
            type(self).server = Server(self.site)

    def test_a_first_visit_brings_the_bundle_once(self):
        server = Server(self.site)  # another origin: nothing of it is stored yet
        self.addCleanup(server.close)
        self.browser.open(server.url)
        self.browser.wait(KEPT, "the kept bundles")
        brought = [path for path, _ in server.http.answered if path.startswith("/bundles/")]
        self.assertEqual(len(brought), 1, server.http.answered)
        kept = "caches.keys().then(async (names) => (await caches.match('bundles/demo.packed', { ignoreSearch: true }))?.ok)"
        self.assertTrue(self.browser.run(kept))

    def test_visits_after_one_that_was_broken_off_go_on(self):
        part = 10_000
        site = self.folder / "parts"
        shutil.copytree(self.site, site)
        script = (site / "app.js").read_text()
        self.assertEqual(script.count("=1e6"), 1)
        (site / "app.js").write_text(script.replace("=1e6", "=1e4"))  # the bundle is small; the service worker knows the script's size
        server = Server(site, Breaking)
        self.addCleanup(server.close)
        address = json.loads((site / "site.json").read_text())["bundles"][0]["file"]
        packed = (site / address.partition("?")[0]).read_bytes()
        first = int(address.rpartition("=")[2])
        server.http.starts, server.http.most, server.http.over, server.http.gone = [], (first + len(packed)) // 2, threading.Event(), False
        self.addCleanup(server.http.over.set)
        kept = f"caches.open('modar {server.url} downloads').then((cache) => cache.keys()).then(({{ length }}) => length)"
        self.browser.open(server.url)
        self.start()
        self.browser.wait(f"{kept}.then((count) => count === {(first + len(packed)) // 2 // part})", "parts that are kept")
        self.browser.wait("navigator.serviceWorker.ready.then(() => true)", "the service worker")
        # Without a network what came is shown.
        self.browser.open("about:blank")
        server.http.over.set()
        server.http.gone = True
        self.browser.open(server.url + "?offline")
        self.start()
        whole = "document.getElementById('viewer').whole.then(() => true)"
        self.assertFalse(self.browser.run(f"Promise.race([{whole}, new Promise((done) => setTimeout(done, 100))])"))
        self.browser.open("about:blank")
        server.http.starts, server.http.most, server.http.gone = [], None, False
        self.browser.open(server.url + "?again")
        self.start()
        self.browser.wait(KEPT, "the bundle is kept")
        self.assertEqual(server.http.starts[0], (first + len(packed)) // 2 // part * part)
        self.assertEqual(server.http.starts, sorted(set(server.http.starts)), "requested the missing ones, once")
        hashed = self.browser.run(f"""caches.match('{address}').then((kept) => kept.arrayBuffer())
          .then((bytes) => crypto.subtle.digest('SHA-256', bytes)).then((hash) => Array.from(new Uint8Array(hash)))""")
        self.assertEqual(bytes(hashed), hashlib.sha256(packed).digest())


class Updates(ProgramTest):
    """A page with a release folder: its downloads, and its refusals."""

    INSTALLED = """(async () => {
      const scope = new URL('./', location).href;
      const { installedBundles, installedFile } = await import('./installed-release.js');
      const bundles = await installedBundles(scope);
      if (!bundles) return null;
      const bytes = await (await installedFile(scope, bundles[0].file)).arrayBuffer();
      const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
      const hint = await createImageBitmap(await installedFile(scope, bundles[0].patterns[0].image));
      const { width, height, texts, models } = bundles[0].patterns[0];
      return { sha: Array.from(digest, (b) => b.toString(16).padStart(2, '0')).join(''), texts, models,
        hint: hint.width === width && hint.height === height };
    })()"""

    @classmethod
    def setUpClass(cls):
        if not (PAGE / "engine-update.wasm").exists():
            raise unittest.SkipTest("the engine was built without updates: no network for scripts/sources.sh --libraries")

    def check(self, done):
        self.assertEqual(done.returncode, 0, done.stderr)

    def publish(self, bundle):
        # Later than 32 bits of seconds reach, which is where time_t ends in WebAssembly.
        self.check(self.modar("ship", "publish", bundle, "--to", self.release, "--key", self.folder / "museum.key",
                              "--expires", "2050-06-30T23:59:58Z"))

    def visit(self, result):
        """Opens the page; the update's result, and the installed release afterwards."""
        self.browser.errors.clear()
        self.browser.open(self.server.url + "?" + result.replace(" ", "-"))
        self.browser.wait("document.documentElement.dataset.update !== undefined", "an update")
        told = self.browser.run("document.documentElement.dataset.update")
        self.assertEqual(told, result, self.browser.told)
        return self.browser.run(self.INSTALLED)

    def test_releases_come_whole_or_not_at_all(self):
        self.cover = self.folder / "cover.png"
        picture(self.cover)
        first = self.bake_project("", self.cover).rename(self.folder / "demo.modar")
        site = self.folder / "site"
        self.release = site / "release"
        self.check(self.modar("ship", "keygen", "--out", self.folder / "museum.key"))
        self.check(self.modar("web", first, "-o", site, "--release", "release", "--trust", self.folder / "museum.key.pub", "--quiet"))
        self.publish(first)
        self.server = Server(site)
        self.addCleanup(self.server.close)
        self.browser = Browser(self.folder / "profile", "/dev/null")
        self.addCleanup(self.browser.close)
        # The site's own bundle is the release: nothing to download.
        self.assertIsNone(self.visit("current"))
        second = self.bake_project('text.en = "Printed in 1890."\nalt.en = "A pot"\n', self.cover)
        self.publish(second)
        installed = self.visit("updated")
        sha = hashlib.sha256(second.read_bytes()).hexdigest()
        self.assertEqual(installed["sha"], sha)
        self.assertTrue(installed["hint"])
        self.assertEqual(installed["texts"]["en"], {"text": "Printed in 1890.", "alt": "A pot"})
        self.assertEqual(installed["models"], "pottery")
        # The next visit shows it, and has nothing to download.
        self.assertEqual(self.visit("current")["sha"], sha)
        self.browser.wait("document.getElementById('caption').textContent === 'cover'", "the cover")
        self.browser.wait("document.images[0].naturalWidth > 0 && document.images[0].src.startsWith('blob:')", "the hint")
        self.refuses(sha)

    def refuses(self, sha):
        latest = (self.release / "latest").read_text()
        # Rolled back.
        (self.release / "latest").write_text("1\n")
        self.assertEqual(self.visit("failed fetch.roll-back")["sha"], sha)
        (self.release / "latest").write_text(latest)
        # Forged: another document under the signature.
        third = self.bake_project('text.en = "Printed in 1891."\n', self.cover)
        self.publish(third)
        document = next(iter(sorted(self.release.glob("releases/*.json"), reverse=True)))
        good = document.read_bytes()
        document.write_bytes(good.replace(b"demo", b"dema"))
        self.assertEqual(self.visit("failed signature.bad")["sha"], sha)
        document.write_bytes(good)
        # Torn: a piece that lacks its end.
        objects = sorted(self.release.glob("objects/*/*"), key=lambda file: file.stat().st_mtime)
        piece = objects[-1]
        whole = piece.read_bytes()
        piece.write_bytes(whole[:len(whole) // 2])
        self.assertEqual(self.visit("failed fetch.network")["sha"], sha)
        # Repaired.
        piece.write_bytes(whole)
        self.assertEqual(self.visit("updated")["sha"], hashlib.sha256(third.read_bytes()).hexdigest())
        self.assertEqual([error for error in self.browser.errors if "404" not in error], [])


# Pixels of the models' canvas that are not transparent.
DRAWN = """(() => {
  const canvas = part('models');
  const copy = document.createElement('canvas');
  Object.assign(copy, { width: canvas.width, height: canvas.height });
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let lit = 0;
  for (let i = 3; i < data.length; i += 4) lit += data[i] > 0;
  return lit;
})()"""

# The clip's pictures through engine and view, each next to the player's: mean difference of the colour values, share of
# pixels that are off by more than 64 in one of them, pixels of the model.
COMPARE = """(async () => {
  const { load } = await import('/modar.js');
  const { View } = await import('/modar-view.js');
  const modar = await load('/bundles/demo.modar');
  await modar.start(document.createElement('video'));
  modar.stop();
  const canvas = () => {
    const made = document.createElement('canvas');
    made.style.cssText = 'position:fixed;left:0;top:0;width:640px;height:480px';
    document.body.append(made);
    return made;
  };
  const pixels = async (source) => {
    const copy = new OffscreenCanvas(640, 480);
    const context = copy.getContext('2d', { willReadFrequently: true });
    context.drawImage(source, 0, 0);
    return context.getImageData(0, 0, 640, 480).data;
  };
  const picture = async (address) => createImageBitmap(await (await fetch(address)).blob());
  const models = canvas();
  const view = await View.create(modar, { picture: canvas(), models, webgl1: %s, fixedLight: true });
  const frames = [];
  for (let i = 0; i < %d; ++i) {
    const number = String(i).padStart(5, '0');
    const source = await picture(`/clip/frame_${number}.png`);
    const rgba = await pixels(source);
    const gray = new Uint8Array(640 * 480);
    for (let p = 0; p < gray.length; ++p) gray[p] = (19595 * rgba[4 * p] + 38470 * rgba[4 * p + 1] + 7471 * rgba[4 * p + 2] + 32768) >> 16;
    const frame = await modar.step(gray, 640, 480, i / 30);
    view.draw({ source, poses: frame.poses, camera: frame });
    const shown = await pixels(models);
    const ours = await pixels(await createImageBitmap(await view.photograph('image/png')));
    const theirs = await pixels(await picture(`/played/frame_0${number}.png`));
    let sum = 0, off = 0, lit = 0;
    for (let p = 0; p < ours.length; p += 4) {
      let worst = 0;
      for (let c = 0; c < 3; ++c) {
        const difference = Math.abs(ours[p + c] - theirs[p + c]);
        sum += difference;
        worst = Math.max(worst, difference);
      }
      off += worst > 64;
      lit += shown[p + 3] > 0;
    }
    frames.push({ mean: sum / (ours.length * 0.75), off: off / (ours.length / 4), lit });
  }
  modar.close();
  return { frames, webgl: view.webgl, heap: view.heapBytes, gpu: view.gpuBytes };
})()"""

if __name__ == "__main__":
    unittest.main()
