"""A scene that acts, in Chromium with a fake camera: pictures, labels, taps and links as a visitor meets them."""
import base64
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import Browser, Server  # noqa: E402
from programs import COVER, POTTERY, ProgramTest, demo_clip  # noqa: E402

WIDTH, HEIGHT, FRAMES = 640, 480, 6
KEEP = os.environ.get("MODAR_WEB_PICTURES")
GREEN, BLUE = (16, 180, 60), (30, 60, 210)
PROJECT = """[bake]
loop-views = 8
score = false
lods = 1
occlusion = false
[[model]]
file = "pottery.obj"
[[pattern]]
file = "cover.png"
[[scene]]
pattern = "cover"
model = "pottery"
scale = 0.5
hidden = true
group = "views"
alt.en = "A pot"
[[scene.picture]]
file = "green.png"
scale = 0.4
hidden = true
group = "views"
alt.en = "A green sheet"
[[scene.picture]]
file = "blue.png"
scale = 0.2
offset = [0, 0.35, 0]
[[scene.video]]
file = "film.mp4"
scale = 0.15
offset = [-0.1, -0.4, 0]
loop = true
alt.en = "A film"
[[scene.sound]]
file = "voice.wav"
play = false
captions.en = "voice.vtt"
captions.de = "stimme.vtt"
[[scene.label]]
name = "corner"
mark = "A"
offset = [0.2, -0.3, 0]
title.en = "The corner"
text.en = "It is bent."
title.de = "Die Ecke"
[[scene.label]]
name = "behind"
hidden = true
[[scene.action]]
on = "found"
do = "show green"
[[scene.action]]
on = "tap green"
do = "next green"
[[scene.action]]
on = "tap blue"
do = "show behind"
[[scene.action]]
on = "tap corner"
do = "play voice"
[[scene.action]]
on = "tap corner"
do = "text corner"
[[scene.action]]
on = "tap blue"
do = "link https://museum.org/blue"
"""

# The colour of the models' canvas at a point of the page, CSS pixels, just after something was drawn: browsers empty it then.
PIXEL = """new Promise((resolve) => {
  const canvas = part('models');
  const copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  Object.assign(copy.canvas, { width: canvas.width, height: canvas.height });
  const scale = canvas.width / canvas.clientWidth;
  const send = EventTarget.prototype.dispatchEvent;
  EventTarget.prototype.dispatchEvent = function (event) {
    if (event.type === 'drawn') {
      EventTarget.prototype.dispatchEvent = send;
      copy.drawImage(canvas, 0, 0);
      resolve(Array.from(copy.getImageData(%f * scale, %f * scale, 1, 1).data));
    }
    return send.call(this, event);
  };
})"""
# Before the page's own scripts: its films, and their uploads while a frame is drawn.
WATCH_FILMS = """(() => {
  globalThis.films = [];
  globalThis.drawings = [];
  const create = document.createElement;
  document.createElement = function (name) {
    const made = create.call(this, name);
    if (name === 'video') films.push(made);
    return made;
  };
  for (const { prototype } of [WebGLRenderingContext, WebGL2RenderingContext]) {
    const upload = prototype.texImage2D;
    prototype.texImage2D = function (...given) {
      upload.apply(this, given);
      if (!films.includes(given.at(-1))) return;
      const texture = this.getParameter(this.TEXTURE_BINDING_2D);
      globalThis.filmTextureIsThere = () => this.isTexture(texture);
      if (drawings.length > 0) ++drawings.at(-1).uploads;
    };
  }
})()"""
# A click where nobody drags.
CLICK = """(() => {
  const canvas = part('models');
  canvas.setPointerCapture = () => {};
  for (const type of ['pointerdown', 'pointerup']) {
    canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: %f, clientY: %f, bubbles: true }));
  }
})()"""
MARKS = """[...part('marks').children].map((button) => {
  const { left, right, top, bottom } = button.getBoundingClientRect();
  return { text: button.textContent, name: button.getAttribute('aria-label'), x: (left + right) / 2, y: (top + bottom) / 2 };
})"""


def plain(path, colour, side=64):
    rows = b"".join(b"\0" + bytes(colour) * side for _ in range(side))
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks))


class Acting(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-acting-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        test = cls("run_program")
        test.folder = cls.base
        project = cls.base / "project"
        project.mkdir()
        for file in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png"), COVER):
            shutil.copy(file, project)
        plain(project / "green.png", GREEN)
        plain(project / "blue.png", BLUE)
        # Another colour each second.
        subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i",
                        "nullsrc=s=64x64:d=4:r=10,geq=r='60+40*floor(T)':g=120:b='220-40*floor(T)'", "-f", "lavfi", "-i", "sine=d=4",
                        "-pix_fmt", "yuv420p", project / "film.mp4"], check=True)
        subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i", "sine=d=3", project / "voice.wav"], check=True)
        (project / "voice.vtt").write_text("WEBVTT\n\n00:00.200 --> 00:01.200\nA <i>pot</i> &amp; its lid\n\n"
                                           "00:01.300 --> 00:02.900\nof clay\n")
        (project / "stimme.vtt").write_text("WEBVTT\n\n00:00.200 --> 00:02.900\nEin Topf\n")
        (project / "modar.toml").write_text(PROJECT)
        for words in (["bake", "--project", project / "modar.toml", "--quiet"],
                      ["web", project / "out" / "project.modar", "-o", cls.base / "site", "--quiet"]):
            done = test.modar(*words)
            if done.returncode != 0:
                raise AssertionError(done.stderr)
        clip = demo_clip(cls.base / "small", FRAMES)
        cls.video = cls.base / "camera.y4m"
        # One frame: where things are on the screen stays.
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-i", clip / "frame_00000.png", "-vf", f"scale={WIDTH}:{HEIGHT}",
                        "-pix_fmt", "yuv420p", cls.video], check=True)
        cls.server = Server(cls.base / "site")
        cls.browser = Browser(cls.base / "profile", cls.video)
        cls.addClassCleanup(cls.browser.close)
        cls.browser.camera("granted")

    def assert_colour(self, place, colour, what):
        pixel = self.browser.run(PIXEL % tuple(place))
        for got, wanted in zip(pixel, (*colour, 255)):
            self.assertAlmostEqual(got, wanted, delta=8, msg=(what, pixel))  # ETC1 is not exact

    def keep(self, name):
        if KEEP:
            self.browser.screenshot(pathlib.Path(KEEP) / name)

    def click(self, place):
        self.browser.run(CLICK % tuple(place))

    def test_a_visit(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.browser.run("""['text', 'link'].forEach((type) => document.getElementById('viewer').addEventListener(type, ({ detail }) => {
          (globalThis.told ??= []).push(detail);
        })), document.getElementById('start').click()""")
        self.browser.wait("document.getElementById('viewer').state === 'seen'", "the picture")
        self.browser.wait("performance.getEntriesByName('modar: whole').length === 1", "all of it, which actions wait for where something plays")
        self.browser.wait(f"({MARKS}).length === 1", "the label")
        mark, = self.browser.run(MARKS)
        self.assertEqual((mark["text"], mark["name"]), ("A", "A: The corner"))
        application = "part('models').getAttribute('aria-label')"
        self.assertEqual(self.browser.run(application), "A pot; A green sheet; A film, on the picture cover.")
        # The corner's place, told by the pose: the label is on it, the blue sheet and the green one where the bundle has them.
        places = self.browser.run("""(async () => {
          const { View } = await import('/app.js');
          const draw = View.prototype.draw;
          const frame = await new Promise((resolve) => {
            View.prototype.draw = function (detail, ...rest) { resolve(detail); return draw.call(this, detail, ...rest); };
          });
          View.prototype.draw = draw;
          const view = frame.poses.slice(24, 40);
          return [[0.4, -0.6], [0, 0.7], [0, 0]].map(([x, y]) => {
            const at = [0, 1, 2].map((i) => view[i] * x + view[4 + i] * y + view[12 + i]);
            const { focal, width, height } = frame.camera;
            return [innerWidth / 2 - (focal * at[0]) / at[2] * innerWidth / width, innerHeight / 2 + (focal * at[1]) / at[2] * innerHeight / height];
          });
        })()""")
        corner, blue, green = places
        self.assertAlmostEqual(mark["x"], corner[0], delta=1.5)
        self.assertAlmostEqual(mark["y"], corner[1], delta=1.5)
        self.assert_colour(blue, BLUE, "the blue sheet")
        self.assert_colour(green, GREEN, "found has shown the green sheet")
        self.click(green)
        self.browser.wait(f"{PIXEL % tuple(green)}.then(([r, g, b]) => g < r + 60)", "the pot in place of the green sheet")
        self.click(green)
        self.assertTrue(self.browser.run("part('label-name').textContent") == "pottery", "the pot has no action")
        self.browser.run("part('marks').firstChild.click()")
        self.browser.wait("part('label-name').textContent === 'The corner'", "the label's words")
        self.assertEqual(self.browser.run("part('label-text').textContent"), "It is bent.")
        self.click(corner)  # next to everything: the picture's own label is back
        self.assertEqual(self.browser.run("part('label-name').textContent"), "pottery")
        self.click(blue)
        self.browser.wait("part('leave').open", "the question")
        self.assertEqual(self.browser.run("part('leave-open').href"), "https://museum.org/blue")
        self.assertEqual(self.browser.run("part('leave-open').rel"), "noopener noreferrer")
        self.assertEqual(self.browser.run("told"), [
            {"pattern": 0, "node": "corner", "language": "en", "title": "The corner", "text": "It is bent."},
            {"address": "https://museum.org/blue"}])
        self.browser.run("part('leave-close').click()")
        self.browser.wait(f"({MARKS}).length === 2", "the hidden label")
        self.assertEqual([each["text"] for each in self.browser.run(MARKS)], ["A", "2"])
        self.browser.run("part('close').click()")
        self.assertEqual(self.browser.run(MARKS), [])
        self.assertEqual(self.browser.errors, [])

    def test_a_video_plays_where_it_stands(self):
        self.browser.resize(640, 480)
        watch = self.browser.call("Page.addScriptToEvaluateOnNewDocument", source=WATCH_FILMS)["identifier"]
        self.addCleanup(self.browser.call, "Page.removeScriptToEvaluateOnNewDocument", identifier=watch)
        self.browser.open(self.server.url)
        self.browser.wait("films[0]?.readyState >= 2", "a film whose first picture waits, on the cover")
        self.assertEqual(self.browser.run("[films[0].paused, films[0].currentTime]"), [True, 0])
        self.browser.run("""(async () => {
          const { View } = await import('/app.js');
          const draw = View.prototype.draw;
          View.prototype.draw = function (detail, ...rest) {
            drawings.push({ seen: detail.poses[1] !== 0, still: films.every(({ paused }) => paused), uploads: 0 });
            return draw.call(this, detail, ...rest);
          };
          document.getElementById('start').click();
        })()""")
        self.browser.wait("drawings.some(({ seen }) => seen)", "the picture")
        drawings = self.browser.run("drawings")
        found = next(i for i, drawing in enumerate(drawings) if drawing["seen"])
        self.assertEqual({(drawing["still"], drawing["uploads"]) for drawing in drawings[:found]} - {(True, 0)}, set())
        self.assertGreater(drawings[found]["uploads"], 0, "the frame that finds the picture shows the film")
        self.browser.wait("globalThis.films?.[0]?.currentTime > 0.2", "the film")
        self.assertEqual(self.browser.run("[films.length, films[0].muted, films[0].loop, films[0].videoWidth]"), [1, True, True, 64])
        began = self.browser.run("""(async () => {
          const { View } = await import('/app.js');
          const draw = View.prototype.draw;
          const frame = await new Promise((resolve) => {
            View.prototype.draw = function (detail, ...rest) { resolve(detail); return draw.call(this, detail, ...rest); };
          });
          View.prototype.draw = draw;
          const view = frame.poses.slice(24, 40);
          const at = [0, 1, 2].map((i) => view[i] * -0.2 + view[4 + i] * -0.8 + view[12 + i]);
          const { focal, width, height } = frame.camera;
          return [innerWidth / 2 - (focal * at[0]) / at[2] * innerWidth / width, innerHeight / 2 + (focal * at[1]) / at[2] * innerHeight / height];
        })()""")
        press = "part('{}').click()".format
        for _ in range(2):
            self.browser.run(press("pause"))
            self.browser.wait("films[0].paused", "the pause")
            shown = self.browser.run("""(async () => {
              await new Promise((resolve) => { setTimeout(resolve, 300); });
              const copy = document.createElement('canvas').getContext('2d');
              copy.drawImage(films[0], 0, 0);
              return Array.from(copy.getImageData(32, 32, 1, 1).data);
            })()""")
            pixel = self.browser.run(PIXEL % tuple(began))
            for got, wanted in zip(pixel, shown):
                self.assertAlmostEqual(got, wanted, delta=2, msg=(pixel, shown))
            time = self.browser.run("films[0].currentTime")
            self.browser.run(press("pause"))
            self.browser.wait(f"!films[0].paused && Math.abs(films[0].currentTime - {time}) > 1", "continuing")
        self.browser.run(press("sound"))
        self.assertEqual(self.browser.run("[films[0].muted, part('sound').getAttribute('aria-pressed')]"), [False, "true"])
        self.assertTrue(self.browser.run("filmTextureIsThere()"))
        self.browser.run(press("close"))
        self.assertEqual(self.browser.run("[films[0].paused, filmTextureIsThere()]"), [True, False])
        self.assertEqual(self.browser.errors, [])

    def test_a_sound_with_captions_and_transcript(self):
        """The times of captions are the file's, what sounds is what the browser's own meter measures."""
        self.browser.resize(390, 844)
        self.addCleanup(self.browser.resize, 640, 480)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.browser.run("""(() => {
          globalThis.voices = [];
          globalThis.said = [];
          const create = document.createElement;
          document.createElement = function (name) {
            const made = create.call(this, name);
            if (name === 'audio') voices.push(made);
            return made;
          };
          new MutationObserver(() => said.push([part('cue').textContent, voices[0]?.currentTime])).observe(part('cue'), { childList: true });
          document.getElementById('start').click();
        })()""")
        self.browser.wait(f"({MARKS}).length === 1", "the label")
        self.assertEqual(self.browser.run("[voices.length, part('sound').getAttribute('aria-pressed'), part('volume').hidden]"), [0, "false", True])
        self.assertEqual(self.browser.run("[part('heard').hidden, part('heard-text').textContent]"), [False, "A pot & its lid\nof clay"])
        self.keep("acting-transcript.png")
        self.browser.run("part('marks').firstChild.click()")
        self.browser.wait("part('cue').textContent === 'A pot & its lid'", "the first words")
        self.keep("acting-captions.png")
        self.assertEqual(self.browser.run("[part('heard').hidden, part('label-name').textContent]"), [True, "The corner"])
        # The visitor asked for it: it is heard, and can be made quieter or silent.
        self.assertEqual(self.browser.run("[voices[0].muted, part('sound').getAttribute('aria-pressed'), part('volume').hidden]"), [False, "true", False])
        loud = self.browser.run("""(async () => {
          const context = new AudioContext();
          const meter = context.createAnalyser();
          context.createMediaStreamSource(voices[0].captureStream()).connect(meter);
          await context.resume();
          const samples = new Float32Array(meter.fftSize);
          for (let i = 0; i < 100; ++i) {
            await new Promise((resolve) => { setTimeout(resolve, 20); });
            meter.getFloatTimeDomainData(samples);
            const loudest = Math.max(...samples.map(Math.abs));
            if (loudest > 0.01) return loudest;
          }
          return 0;
        })()""")
        self.assertGreater(loud, 0.05)
        self.browser.run("Object.assign(part('volume'), { value: 0.3 }).dispatchEvent(new Event('input'))")
        self.assertAlmostEqual(self.browser.run("voices[0].volume"), 0.3, 6)
        self.browser.wait("voices[0].ended && part('cue').textContent === ''", "the end")
        said = [[text, time] for text, time in self.browser.run("said") if text]
        self.assertEqual([text for text, _ in said], ["A pot & its lid", "of clay"])
        for (_, time), wanted in zip(said, (0.2, 1.3)):
            self.assertTrue(wanted <= time < wanted + 0.4, said)
        self.browser.run("part('captions').click()")
        self.browser.run("part('marks').firstChild.click()")  # again, from the beginning
        self.browser.wait("!voices[0].ended && voices[0].currentTime > 0.4", "the sound again")
        self.assertEqual(self.browser.run("part('cue').textContent"), "")
        self.browser.run("part('captions').click()")
        self.assertEqual(self.browser.run("part('cue').textContent"), "A pot & its lid")
        self.browser.run("part('sound').click()")
        self.assertEqual(self.browser.run("[voices[0].muted, part('volume').hidden]"), [True, True])
        self.browser.run("part('close').click()")
        self.assertEqual(self.browser.run("[voices[0].paused, part('cue').textContent]"), [True, ""])
        self.assertEqual(self.browser.errors, [])

    def test_without_a_camera(self):
        self.browser.resize(640, 480)
        self.browser.open(self.server.url + "?lang=de")
        self.browser.wait("document.getElementById('look').textContent !== ''", "the cover")
        self.browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
        self.addCleanup(self.browser.call, "Emulation.setEmulatedMedia", features=[])
        self.browser.run("document.getElementById('look').click()")
        self.browser.wait(f"({MARKS}).length === 1", "the label")
        mark, = self.browser.run(MARKS)
        self.assertEqual(mark["name"], "A: Die Ecke")
        self.assertEqual(self.browser.run("part('heard-text').textContent"), "Ein Topf")
        self.browser.run("part('marks').firstChild.click()")
        self.browser.wait("part('label-name').textContent === 'Die Ecke'", "the label's words")
        before = mark["x"]
        self.browser.run("part('turn-left').click()")
        self.assertNotAlmostEqual(self.browser.run(MARKS)[0]["x"], before, delta=3)
        self.click((5, 240))
        self.assertEqual(self.browser.run("part('label-name').textContent"), "pottery")
        # A page that shows the words itself.
        self.browser.run("""document.getElementById('viewer').addEventListener('text', (event) => {
          event.preventDefault();
          globalThis.own = event.detail.title;
        }), part('marks').firstChild.click()""")
        self.browser.wait("globalThis.own === 'Die Ecke'", "the event")
        self.assertEqual(self.browser.run("part('label-name').textContent"), "pottery")
        self.browser.run("part('close').click()")
        self.assertEqual(self.browser.errors, [])

    def test_a_label_leaves_marks_free_and_can_be_folded(self):
        """On a small phone. Where all are, without the engine: layout_test.py."""
        self.browser.resize(360, 640, 1, True)
        self.addCleanup(self.browser.resize, 640, 480)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.browser.run("document.getElementById('start').click()")
        self.browser.wait(f"({MARKS}).length === 1 && (!part('label').hidden || !part('label-open').hidden)", "the label")
        covered = "(() => { const [a, b] = [part('label'), part('marks').firstChild].map((each) => each.getBoundingClientRect()); return a.width > 0 && a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom; })()"
        folded = "[part('label').hidden, part('label-open').hidden]"
        self.assertFalse(self.browser.run(covered))
        self.keep("label-small.png")
        self.assertEqual(self.browser.run(folded), [False, True])
        self.browser.run("part('label-close').click()")
        self.assertEqual(self.browser.run(folded), [True, False])
        self.assertEqual(self.browser.run("part('label').getRootNode().activeElement.id"), "label-open")
        self.browser.run("part('label-open').click()")
        self.assertEqual(self.browser.run(folded), [False, True])
        self.assertEqual(self.browser.run("part('label').getRootNode().activeElement.id"), "label-close")
        self.browser.run("part('label-close').click()")
        self.browser.run("part('marks').firstChild.click()")  # its words are shown
        self.browser.wait("!part('label').hidden && part('label-name').textContent === 'The corner'", "the label's words")
        self.assertTrue(self.browser.run("part('label-open').hidden"))
        # A visitor who has folded the label finds it folded when the picture is found again.
        self.browser.run("part('label-close').click()")
        self.click((5, 320))
        self.assertEqual(self.browser.run("[part('label-name').textContent, part('label').hidden]"), ["pottery", True])
        self.browser.run("part('close').click()")
        self.assertEqual(self.browser.run(folded), [True, True])
        self.assertEqual(self.browser.errors, [])

    def test_a_film_has_the_sound_of_what_plays(self):
        """Whether the visitor hears it or not: a voice of 3 s that is tapped, by ffmpeg."""
        self.browser.resize(390, 640)
        self.addCleanup(self.browser.resize, 640, 480)
        self.browser.open(self.server.url)
        self.browser.wait("document.getElementById('start').textContent !== ''", "the cover")
        self.browser.run("""(async () => {
          const { Recorder } = await import('/app.js');
          const add = Recorder.prototype.add;
          Recorder.prototype.add = function () {
            globalThis.recorder = this;
            (globalThis.added ??= []).push(performance.now());
            return add.call(this);
          };
          const play = HTMLMediaElement.prototype.play;
          HTMLMediaElement.prototype.play = function () { globalThis.voice = this; return play.call(this); };
          document.getElementById('start').click();
        })()""")
        self.browser.wait(f"({MARKS}).length === 1", "the label")
        press = "document.getElementById('record').click()"
        pressed = "part('sound').getAttribute('aria-pressed') === 'true'"
        for heard in (False, True):
            self.browser.run("globalThis.added = []; globalThis.voice = undefined")
            self.browser.run(press)
            self.browser.wait("globalThis.added.length > 0", "the film's first frame, with which its sound begins")
            self.browser.run("part('marks').firstChild.click()")
            if not heard:
                self.browser.wait(pressed, "the sound that the tap has asked for")
            self.browser.run("part('sound').click()")
            self.assertEqual(self.browser.run(pressed), heard)
            self.browser.wait("globalThis.voice?.currentTime > 1", "a second of the voice")
            self.browser.wait("added.length > 5 && added.at(-1) - added[0] > 1200", "frames of a film")
            self.browser.run(press)
            self.browser.wait("document.getElementById('photo').open", "the film")
            film = self.folder / f"film-{heard}"
            film.write_bytes(base64.b64decode(self.browser.run("""(async () => {
              const bytes = new Uint8Array(await (await recorder.done).arrayBuffer());
              let text = '';
              for (const byte of bytes) text += String.fromCharCode(byte);
              return btoa(text);
            })()""")))
            kinds = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=codec_type", "-of", "csv=p=0", film], capture_output=True, text=True).stdout
            self.assertEqual(sorted(kinds.split()), ["audio", "video"])
            measured = subprocess.run(["ffmpeg", "-nostdin", "-i", film, "-af", "volumedetect", "-vn", "-f", "null", "-"], capture_output=True, text=True).stderr
            loudest = float(re.search(r"max_volume: (\S+) dB", measured)[1])
            self.assertGreater(loudest, -30, "a sine of -18 dB")
            self.browser.run("document.getElementById('photo').close()")
            self.browser.wait("voice.ended", "the end of the voice, after which a tap begins it again")
        # Sound is still the visitor's choice.
        self.assertEqual(self.browser.run("part('volume').hidden"), False)
        self.browser.run("part('close').click()")
        self.assertEqual(self.browser.errors, [])

    def test_the_viewer_shows_the_bundles_picture(self):
        """<modar-viewer> has it of a raw bundle with a video, as the page of its own file (tests/cli/web_test.py holds it against the print)."""
        self.browser.open(self.server.url)
        same = self.browser.run("""(async () => {
          const viewer = document.createElement('modar-viewer');
          viewer.src = 'bundles/project.modar';
          document.body.append(viewer);
          await viewer.load();
          const [of, own] = await Promise.all([viewer.patterns[0].image(), 'patterns/project-0.webp'].map(async (address) => {
            const image = Object.assign(new Image(), { src: address });
            await image.decode();
            const copy = new OffscreenCanvas(48, 64).getContext('2d');
            copy.drawImage(image, 0, 0, 48, 64);
            return copy.getImageData(0, 0, 48, 64).data.join();
          }));
          viewer.remove();
          return of === own;
        })()""")
        self.assertTrue(same)

    def test_a_picture_of_ones_own_gets_the_model_alone(self):
        self.browser.open(self.server.url)
        drawn, tapped, marks = self.browser.run("""(async () => {
          const [{ View }, { viewFrom }, { bundles }] = await Promise.all(
            [import('/modar-view.js'), import('/turntable.js'), (await fetch('/site.json')).json()]);
          const [picture, models] = [0, 1].map(() => document.createElement('canvas'));
          models.style.cssText = picture.style.cssText = 'position: fixed; left: 0; top: 0; width: 320px; height: 240px';
          document.body.append(picture, models);
          const view = await View.create(new Uint8Array(await (await fetch(bundles[0].file.replace(/[.]packed.*/, '.modar'))).arrayBuffer()), { picture, models });
          view.stand('mine', 0);
          const poses = new Float32Array(90);
          poses[45 + 1] = 1;
          poses.set(viewFrom({ target: [0, 0, 0.3], turn: 0, tilt: 0.6, distance: 4 }), 45 + 24);
          const source = Object.assign(document.createElement('canvas'), { width: 320, height: 240 });
          source.getContext('2d');
          view.draw({ source, camera: { width: 320, height: 240, focal: 320 }, poses });
          const copy = Object.assign(document.createElement('canvas'), { width: models.width, height: models.height }).getContext('2d');
          copy.drawImage(models, 0, 0);
          const { data } = copy.getImageData(0, 0, models.width, models.height);
          const drawn = data.filter((value, i) => i % 4 === 3 && value > 128).length / (data.length / 4);
          return [drawn, view.tap(160, 120), view.labels()];
        })()""")
        self.assertGreater(drawn, 0.005)
        self.assertLess(drawn, 0.3)
        self.assertEqual((tapped, marks), (None, []))
        self.assertEqual(self.browser.errors, [])


if __name__ == "__main__":
    unittest.main()
