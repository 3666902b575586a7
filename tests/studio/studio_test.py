"""`modar studio` as a curator uses it: from an empty folder to a page, by mouse and by keys, in a browser."""
import functools
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import time
import tomllib
import unittest

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / room) for room in ("cli", "web")]
from browser import FIREFOX, XVFB, axe_core  # noqa: E402
from fox import Fox  # noqa: E402
from hand import Hand  # noqa: E402
from programs import POTTERY, ROOT, picture  # noqa: E402
from studio import StudioTest  # noqa: E402

# A folder that keeps a picture of every step, for people.
KEEP = os.environ.get("MODAR_WEB_PICTURES")
MOST_CLICKS = 12
# Where the bake's quality does not matter: few views of a pattern, no score but the page's.
QUICK = '[bake]\nloop-views = 8\nscore = false\nparameters = "none"\n\n'
SIDE = 60  # cut from each side of the photo

AXE = """axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] })
  .then(({ passes, violations }) => [...(passes.length > 10 ? [] : ['it looked at nothing']),
    ...violations.map(({ id, nodes }) => id + ': ' + nodes.map(({ html }) => html).join(' | '))])"""
# When the pointer was moved, when the preview showed it, and what the stage did of it in the same event.
WATCH = """(() => {
  globalThis.seen = { moves: [], shown: [], drawn: [] };
  let place = '';
  addEventListener('pointermove', ({ clientX, clientY }) => {
    if (place !== `${clientX} ${clientY}`) seen.moves.push(performance.now());  // browsers repeat events where nothing moved
    place = `${clientX} ${clientY}`;
    seen.before = stage()?.dataset.drawn;
  }, true);
  addEventListener('pointermove', () => {
    if (stage()) seen.drawn.push([performance.now() - seen.moves.at(-1), stage().dataset.drawn - seen.before]);
  });
  const stage = () => document.querySelector('.stage3d');
  new MutationObserver(() => seen.shown.push(performance.now())).observe(document.body, { subtree: true, attributeFilter: ['data-shown'] });
})()"""


# Controls that are cut off: outside of the window or of what hides what goes over it, other than what scrolls.
CUT_OFF = """[...document.querySelectorAll('button, a[href], select, input:not(.unseen), label.button, textarea')].filter((each) => {
  const box = each.getBoundingClientRect();
  if (!each.checkVisibility() || !box.width || each.closest('.rail, .stage3d, .options')) return false;
  const out = (left, right) => box.left < left - 1 || box.right > right + 1;
  for (let over = each.parentElement; over; over = over.parentElement) {
    const { left, right } = over.getBoundingClientRect();
    if (getComputedStyle(over).overflowX === 'hidden' && over.tagName !== 'BODY' && out(left, right)) return true;
  }
  return out(0, innerWidth) || (each.closest('.bar') && box.bottom > innerHeight);
}).map((each) => (each.getAttribute('aria-label') ?? each.innerText) || each.id)"""


def homography(points):
    """Takes (x, y) of the first of each pair to the second: by Gauss' elimination."""
    rows = []
    for (x, y), (u, v) in points:
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, u], [0, 0, 0, x, y, 1, -v * x, -v * y, v]]
    for i in range(8):
        best = max(range(i, 8), key=lambda k: abs(rows[k][i]))
        rows[i], rows[best] = rows[best], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for k in range(8):
            if k != i:
                rows[k] = [a - rows[k][i] * b for a, b in zip(rows[k], rows[i])]
    h = [row[8] for row in rows] + [1]
    return lambda x, y: tuple((h[3 * i] * x + h[3 * i + 1] * y + h[3 * i + 2]) / (h[6] * x + h[7] * y + 1) for i in (0, 1))


def wall(path):
    """A photo of a framed painting on a wall, a little from the side. Answers the frame's corners in it."""
    width, height = 900, 676
    mat, frame, wide, high = 75, 30, 350, 190
    inner = (width + 2 * (mat + frame), height + 2 * (mat + frame))
    whole = (inner[0] + 2 * wide, inner[1] + 2 * high)
    shifts = [(-40, -20), (10, 30), (10, 10), (-20, 60)]  # of the corners, in ffmpeg's order
    corners = [(x, y) for y in (0, whole[1]) for x in (0, whole[0])]
    moved = [(x + dx, y + dy) for (x, y), (dx, dy) in zip(corners, shifts)]
    names = ":".join(f"x{i}={x}:y{i}={y}" for i, (x, y) in enumerate(moved))
    subprocess.run(["ffmpeg", "-v", "error", "-i", ROOT / "assets/patterns/painting.png", "-vf",
                    f"scale={width}:{height},pad=iw+{2 * mat}:ih+{2 * mat}:{mat}:{mat}:0xf2eee4,pad=iw+{2 * frame}:ih+{2 * frame}:{frame}:{frame}:0x3d2817,"
                    f"pad={whole[0]}:{whole[1]}:{wide}:{high}:0xd9d2c4,format=rgb24,noise=alls=5:all_seed=3,perspective={names}:sense=destination,"
                    f"crop=iw-{2 * SIDE}:ih-{2 * SIDE}", "-frames:v", "1", "-q:v", "2", path], check=True)
    place = homography(list(zip(corners, moved)))
    box = [(wide, high), (wide + inner[0], high), (wide + inner[0], high + inner[1]), (wide, high + inner[1])]
    return [tuple(value - SIDE for value in place(x, y)) for x, y in box]


def walk(photo, film):
    """A hand's way past the photo, six pictures: as long as a camera repeats it."""
    subprocess.run(["ffmpeg", "-v", "error", "-loop", "1", "-i", photo, "-vf", "scale=iw/2:-2,crop=2*trunc(iw/2)-32:ih-32:4*n:2*n,format=yuv420p",
                    "-frames:v", "6", film], check=True)
    return film


def can(label, photo, diameter, arc, size=(1312, 992)):
    """A photo of a label round a can, by a pinhole camera as long as the photo is wide: each pixel's ray meets the can at an angle and a height."""
    (width, height), radius, far = size, diameter / 2, 3.2 * diameter
    high = math.pi * diameter * arc / 360 * 0.75  # the label's sides are 4:3
    half = math.radians(arc) / 2
    ray = f"st(0,(X-{width / 2})/{width});st(1,(Y-{height / 2})/{width});st(2,1+ld(0)*ld(0));st(3,{far * far}-ld(2)*{far * far - radius * radius})"
    hit = f"st(4,({far}-sqrt(max(ld(3),0)))/ld(2));st(5,atan2(ld(0)*ld(4),{far}-ld(4)));st(6,ld(1)*ld(4))"
    inside = f"gt(ld(3),0)*lt(abs(ld(5)),{half})*lt(abs(ld(6)),{high / 2})"
    planes = ":".join(f"{plane}='{ray};{hit};if({inside},{plane}(W*(0.5+ld(5)/{2 * half}),H*(0.5+ld(6)/{high})),if(gt(ld(3),0),225,120))'" for plane in "rgb")
    # The label is as large as the photo, so that geq's picture has its size.
    subprocess.run(["ffmpeg", "-v", "error", "-i", label, "-vf", f"scale={width}:{height},format=gbrp,geq=interpolation=bilinear:{planes}", "-frames:v", "1", photo], check=True)


def turned_model(folder):
    """The pot with Y up, as most programs write OBJ files."""
    lines = []
    for line in POTTERY.read_text().splitlines():
        kind, *numbers = line.split() or [""]
        if kind in ("v", "vn"):
            x, y, z = map(float, numbers)
            line = f"{kind} {x:.6g} {z:.6g} {-y:.6g}"
        if not kind.startswith("#"):
            lines.append(line)
    (folder / "pottery.obj").write_text("\n".join(lines) + "\n")
    for name in ("pottery.mtl", "pottery.png"):
        shutil.copy(POTTERY.with_name(name), folder)
    return [folder / name for name in ("pottery.obj", "pottery.mtl", "pottery.png")]


class Page(StudioTest):
    axe = None  # its program, where a test uses it

    def setUp(self):
        super().setUp()
        self.project = self.folder / "project"
        self.source = self.folder / "source"
        self.source.mkdir()

    def start(self, size=(1280, 720), words="?lang=en", **preferences):
        """The studio of the project, and a browser that shows it."""
        self.url = self.studio(self.project).address
        self.hand = Hand(self.folder / f"profile-{size[0]}", size, camera=self.folder / "walk.mjpeg")
        self.addCleanup(self.hand.close)
        self.addCleanup(self.keep, "last")
        self.hand.prefer(**preferences)
        self.hand.call("Page.setBypassCSP", enabled=self.axe is not None)
        self.hand.open(self.url + words)
        self.hand.wait("document.querySelector('h1')", "the first screen")
        self.hand.run(WATCH)

    def files(self):
        self.corners = wall(self.source / "wall.jpg")
        walk(self.source / "wall.jpg", self.folder / "walk.mjpeg")
        return [self.source / "wall.jpg", *turned_model(self.source)]

    def use_axe(self):
        Page.axe = Page.axe or axe_core(self.folder) and axe_core(self.folder).read_text()

    def keep(self, name):
        if KEEP:
            pathlib.Path(KEEP).mkdir(parents=True, exist_ok=True)
            self.hand.screenshot(pathlib.Path(KEEP) / f"studio-{name}.png")

    def look(self, name):
        """A picture of the screen for people, and axe-core's verdict of it."""
        self.hand.settle()
        self.keep(name)
        if not self.axe:
            return
        if not self.hand.run("!!globalThis.axe"):
            self.hand.run(self.axe + "; 0")
        self.assertEqual(self.hand.run(AXE), [], name)

    def assert_no_errors(self):
        """A bake or an export that is requested while one ends is refused, and asked for again."""
        self.assertEqual([error for error in self.hand.errors if not ("409" in error and error.endswith(("api/bake", "api/export")))], [])

    def toml(self):
        return (self.project / "modar.toml").read_text()

    def wait_for(self, words, seconds=90):
        """In modar.toml."""
        end = time.monotonic() + seconds
        while words not in self.toml():
            self.assertLess(time.monotonic(), end, self.toml())
            time.sleep(0.1)

    def assert_the_page_plays(self):
        """What the person has made plays a video of that wall: the picture is found where it hangs, with the pot on it."""
        [bundle] = (self.site / "bundles").glob("*.modar")
        film = walk(self.source / "wall.jpg", self.folder / "walk.mp4")
        done = self.run_program("modar-play", bundle, "--input", film, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        frames = [line for line in map(json.loads, done.stdout.splitlines()) if "frame" in line]
        self.assertEqual([len(line["visible"]) for line in frames[2:]], [1] * 4)
        found = frames[-1]["visible"][0]["corners"]
        for (x, y), (u, v) in zip(found, self.corners):
            self.assertAlmostEqual(x, u / 2 - 20, delta=3)
            self.assertAlmostEqual(y, v / 2 - 10, delta=3)
        inside = self.modar_json("inspect", bundle)
        self.assertEqual([(scene["pattern"], scene["model"]) for scene in inside["scenes"]], [("wall", "pottery")])

    @functools.cached_property
    def site(self):
        return next(path.parent for path in self.project.rglob("site.json"))

    # ---- other editors ----

    def drag_a_corner(self):
        """Away and back to where the frame's corner is, in one go; the preview follows within its time."""
        hand = self.hand
        start = hand.place(".corner", 1)
        box = hand.run("(b => [b.x, b.y, b.width])(document.querySelector('.sheet').getBoundingClientRect())")
        scale = box[2] / hand.run("Number(document.querySelector('.sheet svg').getAttribute('viewBox').split(' ')[2])")
        end = (box[0] + scale * self.corners[1][0], box[1] + scale * self.corners[1][1])
        away = [(start[0] - 6 * i, start[1] + 5 * i) for i in range(1, 6)]
        waits = []

        def hold():
            before = hand.run("seen.moves.at(-1)")
            hand.wait(f"seen.shown.at(-1) > {before}", "the preview")
            time.sleep(0.3)
            waits.append(hand.run(f"seen.shown.find((time) => time > {before}) - {before}"))
            self.look("05-corner")
            for _ in range(3):
                hand._mouse("mouseMoved", (away[-1][0] + 1, away[-1][1]))
                hand._mouse("mouseMoved", away[-1])
                hand.wait("seen.shown.at(-1) > seen.moves.at(-1)", "the preview")
                time.sleep(0.2)
                waits.append(hand.run("seen.shown.find((time) => time > seen.moves.at(-1)) - seen.moves.at(-1)"))
            hand._mouse("mouseMoved", end)

        hand.drag(start, away, hold)
        print(f"preview after a corner moved: {', '.join(f'{wait:.0f}' for wait in waits)} ms")
        self.assertTrue(waits)

    def drag_a_handle(self, kind, by, name):
        """A dragged model is drawn in the event that moves it."""
        hand = self.hand
        x, y = hand.place(f"[data-handle={kind}]")
        hand.run("seen.drawn.length = 0")
        hand.drag((x, y), [(x + by[0] * i / 6, y + by[1] * i / 6) for i in range(1, 7)], lambda: self.look(name) if name else None)
        drawn = hand.run("seen.drawn")
        self.assertGreaterEqual(len(drawn), 6)
        self.assertTrue(all(times >= 1 for _, times in drawn[-5:]), drawn)
        print(f"a handle's event, drawn: {statistics.median(ms for ms, _ in drawn):.1f} ms")

    def test_from_an_empty_folder_to_a_page_in_twelve_clicks(self):
        self.use_axe()
        files = self.files()
        self.start()
        hand = self.hand
        self.look("01-empty")
        hand.drop(files)
        hand.wait("document.querySelectorAll('.cards li').length === 2", "the files")
        self.look("02-files")
        hand.click("a.primary")
        hand.wait("document.querySelector('canvas[data-shown]')", "the preview")
        self.look("03-picture")
        self.drag_a_corner()
        hand.settle()
        hand.click("input[value=a4]")
        hand.wait("document.querySelector('input[value=a4]').checked", "A4")
        self.look("06-sized")
        hand.click(".foot a.primary")
        hand.wait("document.querySelector('.layers canvas')", "the stage")
        self.look("07-scene")
        before = self.toml()
        self.drag_a_handle("turn", (45, -12), "08-turning")
        self.drag_a_handle("size", (-40, 40), "09-size")
        self.look("10-placed")
        self.assertNotEqual(self.toml(), before)
        hand.click(".foot a.primary")
        self.look("11-try")
        hand.click(".top a.primary")
        self.look("12-publish")
        hand.click(".way-out button.primary")
        hand.wait("document.querySelector('.made')", "the page")
        self.look("13-made")
        print(f"{hand.clicks} clicks, drags and drops")
        self.assertLessEqual(hand.clicks, MOST_CLICKS)
        self.assert_no_errors()
        self.assertEqual([url for url in hand.requests if not url.startswith((self.url, "blob:", "data:"))], [])
        self.assert_the_page_plays()
        self.try_it()
        self.other_looks()

    def try_it(self):
        """The camera and a film see the wall: its name is reported, the pot is drawn."""
        hand = self.hand
        hand.camera("granted")
        hand.run("location.hash = '#/try'")
        for source in ("camera", "film"):
            hand.wait("document.querySelectorAll('.way').length === 3", "the ways")
            if source == "camera":
                hand.click(".way button.quiet")
            else:
                self.choose_film()
            hand.wait("document.querySelector('.playing .hint')?.textContent.includes('wall')", source)
            self.keep(f"14-{source}")
            self.wait_for_the_model(source)
            hand.click(".playing .over")

    def choose_film(self):
        call = self.hand.call
        node = call("DOM.querySelector", nodeId=call("DOM.getDocument")["root"]["nodeId"], selector=".way input[type=file]")["nodeId"]
        call("DOM.setFileInputFiles", files=[str(self.folder / "walk.mp4")], nodeId=node)

    def wait_for_the_model(self, source, seconds=90):
        """The print is named at its first frame; the model is drawn when its files are there."""
        end = time.monotonic() + seconds
        while (seen := self.model_pixels()) <= 2000:
            self.assertLess(time.monotonic(), end, f"{source}: {seen} bright pixels")

    def model_pixels(self):
        """Of the screen that are bright where the camera's picture is taken away: the pot's."""
        hand = self.hand
        hand.run("document.querySelector('canvas.picture').style.opacity = 0")
        x, y, width, height = hand.run("(b => [b.x, b.y, b.width, b.height].map(Math.round))(document.querySelector('canvas.models').getBoundingClientRect())")
        hand.screenshot(self.folder / "models.png")
        seen = subprocess.run(["ffmpeg", "-v", "error", "-i", self.folder / "models.png", "-vf", f"crop={width // 2}:{height // 2}:{x + width // 4}:{y + height // 4}",
                               "-f", "rawvideo", "-pix_fmt", "gray", "-"], capture_output=True, check=True).stdout
        return sum(value > 60 for value in seen)

    def other_looks(self):
        """The same project in German, in the dark, on a tablet."""
        hand = self.hand
        hand.resize(1024, 768)
        hand.prefer(prefers_color_scheme="dark")
        hand.open(self.url + "?lang=de")
        for view in ("files", "picture", "scene", "try", "ship"):
            hand.run(f"location.hash = '#/{view}'")
            hand.wait("document.querySelector('h1')", view)
            self.look(f"de-{view}")
            self.assertEqual(hand.run("document.documentElement.scrollWidth"), 1024, view)
        self.assert_no_errors()

    # ---- by keys ----

    def test_the_same_by_keys_alone(self):
        files = self.files()
        self.project.mkdir()
        (self.project / "modar.toml").write_text(QUICK)
        self.start()
        hand = self.hand
        hand.call("Page.setInterceptFileChooserDialog", enabled=True)
        hand.tab_to("input[type=file]:not([webkitdirectory])")
        hand.press(" ")
        hand.choose(files)
        hand.wait("document.querySelectorAll('.cards li').length === 2", "the files")
        hand.settle()
        hand.tab_to("a.primary")
        hand.press("Enter")
        hand.wait("document.querySelector('canvas[data-shown]')", "the preview")
        hand.settle()
        hand.tab_to(".corner:nth-of-type(2)")
        before = hand.run("document.querySelector('.panel canvas').dataset.shown")
        hand.press("ArrowLeft", 2)
        hand.press("ArrowDown")
        hand.wait("document.querySelector('.panel canvas').dataset.shown !== " + json.dumps(before), "a corner that moves")
        hand.tab_to("input[name=paper]")
        hand.press("ArrowRight")  # from the last one to the first, A4
        hand.wait("document.querySelector('input[value=a4]').checked", "A4")
        hand.settle()
        hand.tab_to(".foot a.primary")
        hand.press("Enter")
        hand.wait("document.querySelector('.layers canvas')", "the stage")
        hand.settle()
        hand.tab_to("[data-handle=turn]")
        hand.press("ArrowRight", 2, modifiers=8)  # with Shift: by 15 degrees
        hand.wait("document.getElementById('turn-2').value === '30'", "the turn")
        hand.tab_to("#size")
        hand.press("ArrowDown", 5)
        hand.settle()
        self.assertIn("turn = 30", self.toml())
        self.wait_for('height = "292mm"')
        hand.press("z", modifiers=2)  # Ctrl: in a field, the field's own; next to it, the project's
        hand.tab_to(".foot a.primary")
        hand.press("Enter")
        hand.wait("location.hash === '#/try'", "the next screen")
        hand.tab_to(".top a.primary")
        hand.press("Enter")
        hand.wait("document.querySelector('.way-out')", "the last screen")
        hand.settle()
        hand.tab_to(".way-out button.primary")
        hand.press("Enter")
        hand.wait("document.querySelector('.made')", "the page")
        self.assertEqual(hand.clicks, 0)
        self.assert_no_errors()
        self.corners[1] = (self.corners[1][0] - 2, self.corners[1][1] + 1)
        self.assert_the_page_plays()

    # ---- by a finger ----

    @unittest.skipUnless(FIREFOX and XVFB, "no Firefox or Xvfb")
    def test_a_finger_places_the_pot_in_firefox(self):
        """A tablet: a corner, the paper, the model; taps and drags only, in the other engine."""
        self.use_axe()
        self.project.mkdir()
        for file in self.files():
            shutil.copy(file, self.project)
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "wall.jpg"\n\n[[model]]\nfile = "pottery.obj"\n\n[[scene]]\npattern = "wall"\nmodel = "pottery"\n')
        address = self.studio(self.project).address
        self.fox = fox = Fox(self.folder / "fox")
        self.addCleanup(fox.close)
        fox.open(address + "?lang=en")
        fox.wait("document.querySelectorAll('.cards li').length === 2", "the files")
        fox.tap(".cards a[href='#/picture/wall']")
        fox.wait("document.querySelector('canvas[data-shown]')", "the preview")
        fox.tap(".hint .link")
        x, y = fox.place(".corner:nth-of-type(2)")
        fox.slide((x, y), [(x - 4 * i, y + 3 * i) for i in range(1, 6)])
        self.wait_for("corners")
        self.keep_fox("corner")
        fox.tap("input[value=a4]")
        self.wait_for("width = \"297mm\"")
        fox.tap(".foot a.primary")
        fox.wait("document.querySelector('.layers canvas')", "the stage")
        before = self.toml()
        x, y = fox.place("[data-handle=turn]")
        fox.slide((x, y), [(x + 8 * i, y - 2 * i) for i in range(1, 7)])
        self.wait_for("turn = ")
        x, y = fox.place("[data-handle=size]")
        fox.slide((x, y), [(x - 6 * i, y + 6 * i) for i in range(1, 7)])
        self.wait_for("scale = ")
        self.keep_fox("scene")
        self.assertNotEqual(self.toml(), before)

    def keep_fox(self, name):
        if KEEP:
            self.fox.screenshot(pathlib.Path(KEEP) / f"studio-fox-{name}.png")
        if self.axe:
            self.fox.run(f"(() => {{ if (!globalThis.axe) globalThis.eval({json.dumps(self.axe)}); return 0; }})()")
            self.assertEqual(self.fox.run(f"{AXE}"), [], name)

    # ---- shapes ----

    def type_in(self, field, text):
        self.hand.click(f"#{field}")
        self.hand.call("Input.insertText", text=text)  # a field that is empty
        self.hand.press("Tab")

    def test_a_model_plays_the_animation_that_is_chosen(self):
        self.project.mkdir()
        picture(self.project / "cover.png")
        moving = json.loads((ROOT / "tests/import/clips/moving.gltf").read_text())
        moving["animations"] = [{**moving["animations"][0], "name": name} for name in ("walk", "wave")]
        (self.project / "moving.gltf").write_text(json.dumps(moving))
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "cover.png"\n\n[[model]]\nfile = "moving.gltf"\n\n[[scene]]\npattern = "cover"\nmodel = "moving"\n')
        self.start()
        hand = self.hand
        hand.run("location.hash = '#/scene/cover'")
        hand.wait("document.querySelector('.standing button')", "the list of models")
        hand.click(".standing button")
        hand.wait("document.querySelector('#clip')", "its animations, once it was baked")
        self.assertEqual(hand.run("[...document.querySelector('#clip').options].map(({ value }) => value)"), ["walk", "wave", "none"])
        self.assertEqual(hand.run("document.querySelector('#clip').value"), "walk")
        for value, line in (("wave", 'clip = "wave"'), ("none", 'clip = "none"')):
            hand.run("((field) => { field.value = '%s'; field.dispatchEvent(new Event('change')); })(document.querySelector('#clip'))" % value)
            self.wait_for(line)
        hand.run("((field) => { field.value = 'walk'; field.dispatchEvent(new Event('change')); })(document.querySelector('#clip'))")
        end = time.monotonic() + 90
        while "clip" in self.toml():
            self.assertLess(time.monotonic(), end, self.toml())
            time.sleep(0.1)
        self.assert_no_errors()

    def test_a_scan_on_a_cup_as_a_ruler_says_it(self):
        """Lengths only. The cup is seen under the model, and its models are measured in its millimetres."""
        self.project.mkdir()
        picture(self.project / "band.png")
        picture(self.project / "twin.png")
        shutil.copy(POTTERY, self.project)
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "*.png"\n\n[[model]]\nfile = "pottery.obj"\n\n[[scene]]\npattern = "band"\nmodel = "pottery"\n')
        self.start()
        hand = self.hand
        hand.run("location.hash = '#/picture/band'")
        hand.wait("document.querySelector('canvas[data-shown]')", "the preview, below which the lengths are")
        hand.settle()
        hand.click("input[value=a4]")
        self.wait_for("width = \"297mm\"")
        hand.wait("document.querySelector('.advice a')", "the twin, which is a rival")
        self.assertEqual(hand.run("document.querySelector('.advice a').hash"), "#/picture/twin")
        hand.click("input[value=cone]")
        for field, text in (("top", "8"), ("bottom", "6"), ("along", "11")):
            self.type_in(field, text)
        self.wait_for("shape = ")
        [table] = [one for one in tomllib.loads(self.toml())["pattern"] if one["file"] == "band.png"]  # of half of a cup with 7 cm in the middle, and 0.1 degrees more
        self.assertEqual({key: table[key] for key in table if key != "file"}, {"shape": "cone,top=80mm,bottom=60mm,arc=180.1"})
        hand.run("document.getElementById('arc').focus(); location.hash = '#/scene/band'")
        hand.settle()
        drawn = hand.run("""(canvas => [canvas.hidden, ...[0.5, 0.02].map((y) => canvas.getContext('2d').getImageData(canvas.width / 2, y * canvas.height, 1, 1).data[3])])
          (document.querySelector('.body'))""")
        self.assertEqual(drawn, [False, 255, 0])
        self.look("cup")
        self.assertEqual(hand.run("document.querySelector('#size').closest('.number').innerText.trim()"), "cm")
        self.assert_no_errors()
        while hand.run("fetch('api/project').then((answer) => answer.json()).then(({ bundle }) => bundle.stale)"):
            time.sleep(0.2)
        bundle = next((self.project / "out").glob("*.modar"))
        band = next(one for one in self.modar_json("inspect", bundle)["patterns"] if one["name"] == "band")
        self.assertAlmostEqual(band["width_mm"], 110, delta=0.1)

    def test_a_label_on_a_can_is_found_in_a_film_of_it(self):
        """This tries the behaviour of a device: both know the can of the same film, and the pot is on it."""
        self.project.mkdir()
        picture(self.project / "band.png", 480, 360)
        shutil.copy(POTTERY, self.project)
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "band.png"\nshape = "cylinder,diameter=80mm,arc=150"\n\n'
                                                 '[[model]]\nfile = "pottery.obj"\n\n[[scene]]\npattern = "band"\nmodel = "pottery"\n')
        can(self.project / "band.png", self.folder / "can.png", diameter=80, arc=150)
        walk(self.folder / "can.png", self.folder / "walk.mp4")
        self.start()
        hand = self.hand
        hand.wait("document.querySelector('.status')?.textContent.includes('Ready')", "the bake")
        hand.run("location.hash = '#/try'")
        hand.wait("document.querySelector('.way input[type=file]')", "the ways")
        self.choose_film()
        hand.wait("document.querySelector('.playing .hint')?.textContent.includes('band')", "the can")
        self.keep("can")
        self.wait_for_the_model("the film")
        bundle = next((self.project / "out").glob("*.modar"))
        done = self.run_program("modar-play", bundle, "--input", self.folder / "walk.mp4", "--json")
        frames = [line for line in map(json.loads, done.stdout.splitlines()) if "frame" in line]
        self.assertEqual([len(line["visible"]) for line in frames[2:]], [1] * 4, done.stderr)
        self.assert_no_errors()

    # ---- by an editor, meanwhile ----

    def test_what_a_hand_writes_is_shown_and_baked_as_the_command_does(self):
        """modar.toml changes under the open page; what the page then adds keeps it, and `modar bake` makes the same bytes."""
        self.project.mkdir()
        picture(self.project / "cover.png")
        for name in ("pottery.obj", "pottery.mtl", "pottery.png"):
            shutil.copy(POTTERY.with_name(name), self.project)
        text = ('[bake]\nloop-views = 8\nparameters = "none"\n\n[[pattern]]\nfile = "cover.png"\nwidth = "200mm"\n\n[[model]]\nfile = "pottery.obj"\n\n'
                '[[scene]]\npattern = "cover"\nmodel = "pottery"\n')
        (self.project / "modar.toml").write_text(text)
        self.start()
        hand = self.hand
        hand.run("location.hash = '#/scene/cover'")
        hand.wait("document.querySelector('.layers canvas')", "the stage")
        by_hand = text + "turn = 33  # other editor\nheight = \"90mm\"\n\n# the end\n"
        (self.project / "modar.toml").write_text(by_hand)
        hand.wait("document.getElementById('turn-2').value === '33' && document.getElementById('size').value === '9'", "what the hand has written")
        hand.tab_to("#offset-lift")
        hand.press("ArrowUp", 2)
        self.wait_for("offset = ")
        self.assertEqual([line for line in by_hand.splitlines() if line not in self.toml()], [])
        hand.wait("fetch('api/project').then((answer) => answer.json()).then(({ bundle, baking }) => bundle.baked && !bundle.stale && !baking)", "the bake")
        other = self.folder / "other"
        other.mkdir()
        for file in self.project.iterdir():
            if file.is_file():
                shutil.copy(file, other)
        self.assertEqual(self.modar("bake", "--quiet", cwd=other).returncode, 0)
        [ours], [theirs] = ([*(folder / "out").glob("*.modar")] for folder in (self.project, other))
        self.assertEqual(ours.read_bytes(), theirs.read_bytes())
        self.assert_no_errors()

    # ---- what cannot be used ----

    def test_what_cannot_be_used_is_named_with_its_cure(self):
        """Kinds that nothing here reads stay outside; damaged parts is named, and leaves the project by a click."""
        self.project.mkdir()
        picture(self.project / "cover.png")
        shutil.copy(POTTERY, self.project)
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "cover.png"\n\n[[model]]\nfile = "pottery.obj"\n\n[[scene]]\npattern = "cover"\nmodel = "pottery"\n')
        for name, data in (("IMG_1.HEIC", b"ftypheic"), ("vase.fbx", b"Kaydara"), ("broken.obj", b"hello\n")):
            (self.source / name).write_bytes(data)
        self.start()
        hand = self.hand
        hand.drop(sorted(self.source.iterdir()))
        hand.wait("document.querySelectorAll('.problems .finding').length === 2", "kinds that are not read")
        # What no scene shows is not baked: it is found to be damaged once it is placed.
        (self.project / "modar.toml").write_text(self.toml() + '\n[[scene]]\npattern = "cover"\nmodel = "broken"\n')
        hand.wait("document.querySelectorAll('.problems .finding').length === 3", "the fault")
        told = hand.run("document.querySelector('.problems').innerText")
        for words in ("IMG_1.HEIC", "JPEG", "vase.fbx", "GLB", "broken.obj", "no usable face"):
            self.assertIn(words, told)
        self.assertEqual([path.name for path in self.project.iterdir() if path.name in ("IMG_1.HEIC", "vase.fbx")], [])
        self.keep("problems")
        hand.click(".problems .link")
        hand.wait("document.querySelectorAll('.problems .finding').length === 2 && document.querySelector('.status')?.textContent.includes('Ready')", "a bake")
        self.assertNotIn("broken", self.toml())

    # ---- small and large windows, and numbers ----

    def test_nothing_is_cut_off_from_360_to_1600_pixels(self):
        """Every control of every step is in the window, in both languages, with a name that is long and a dozen of models."""
        self.project.mkdir()
        for name in ("cover", "the poster of the exhibition in the east wing"):
            picture(self.project / f"{name}.png")
        for i in range(12):
            (self.project / f"a-vase-with-a-long-name-{i}.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        scene = '[[scene]]\npattern = "cover"\nmodel = "a-vase-with-a-long-name-3"\n'
        (self.project / "modar.toml").write_text(QUICK + '[project]\nname = "treasures of the old museum"\n[[pattern]]\nfile = "*.png"\nwidth = "200mm"\n[[model]]\nfile = "*.obj"\n' + scene)
        self.start()
        hand = self.hand
        hand.wait("document.querySelector('.status')?.textContent.includes('Ready')", "the bake")
        for language in ("en", "de"):
            hand.open(self.url + "?lang=" + language)
            for view in ("files", "picture/cover", "scene/cover", "try", "ship"):
                hand.run(f"location.hash = '#/{view}'")
                hand.wait("document.querySelector('h1')", view)
                hand.settle()
                for width in (360, 480, 600, 780, 810, 900, 1000, 1100, 1280, 1600):
                    hand.resize(width, 720)
                    hand.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))).then(() => 0)")
                    self.assertEqual((hand.run(CUT_OFF), hand.run("document.documentElement.scrollWidth")), ([], width), (language, view, width))
                    if width in (360, 780, 1280):
                        self.keep(f"{language}-{view.split('/')[0]}-{width}")
        self.assert_no_errors()

    def test_numbers_and_errors_in_german(self):
        """A decimal comma is shown and read; what a model is put upright with is there after it was tipped over; errors have German words."""
        self.project.mkdir()
        picture(self.project / "cover.png")
        shutil.copy(POTTERY, self.project)
        (self.project / "modar.toml").write_text(QUICK + '[[pattern]]\nfile = "cover.png"\nwidth = "200mm"\n\n[[model]]\nfile = "pottery.obj"\n\n'
                                                 '[[scene]]\npattern = "cover"\nmodel = "pottery"\nheight = "123.5mm"\n')
        (self.source / "modar.toml").write_text("x = 1\n")
        self.start(words="?lang=de")
        hand = self.hand
        hand.run("location.hash = '#/scene/cover'")
        hand.wait("document.querySelector('.layers canvas')", "the stage")
        self.assertEqual(hand.run("document.getElementById('size').value"), "12,35")
        for typed, toml, shown in (("7,25", 'height = "72.5mm"', "7,25"), ("8.5", 'height = "85mm"', "8,5"), ("1.230,0", 'height = "12300mm"', "1230"),
                                   ("9", 'height = "90mm"', "9")):
            hand.run("document.getElementById('size').select()")
            hand.call("Input.insertText", text=typed)
            hand.run("document.getElementById('size').blur()")
            self.wait_for(toml)
            hand.wait(f"document.getElementById('size').value === '{shown}'", typed)
        upright = "[...document.querySelectorAll('.row.three button')].find((each) => each.innerText.trim() === 'Aufrecht')"
        self.assertTrue(hand.run(f"{upright}.disabled"))
        before = self.toml()
        hand.click(".row.three button")
        self.wait_for("up = ")
        hand.wait(f"!{upright}.disabled", "something to undo")
        hand.run(f"{upright}.click()")
        hand.wait(f"{upright}.disabled", "the model in its old state")
        self.assertEqual(self.toml(), before)
        hand.run("document.querySelector('.repair').open = true")
        for chosen, toml, done in (("support", "repair-support = true", "Nichts zu reparieren"), ("after", "repair = true", "Nichts zu reparieren")):
            hand.run(f"document.querySelector('.repair input[value={chosen}]').click()")
            self.wait_for(toml)
            hand.wait(f"document.querySelector('.repaired').innerText === '{done}'", "the repair")
        hand.run("document.querySelector('.repair input[value=before]').click()")
        hand.wait("document.querySelector('.repaired').innerText === ''", "the model before its repair")
        self.assertEqual(self.toml(), before)
        hand.run("location.hash = '#/files'")
        hand.wait("document.querySelector('.cards')", "the files")
        hand.drop([self.source / "modar.toml"])
        hand.wait("document.querySelectorAll('.problems .finding').length > 0", "the fault")
        self.assertIn("Mit diesem Namen", hand.run("document.querySelector('.problems').innerText"))
        self.assertEqual(hand.run("[...document.querySelectorAll('[lang=en]')].filter((each) => each.checkVisibility() && each.tagName !== 'OPTION').map((each) => each.innerText)"), [])

    # ---- names and texts ----

    def test_names_and_texts_are_shown_and_never_run(self):
        names = ["<img src=x onerror=ran=1>", "it's \"quoted\" & 50 %", "\u05ea\u05de\u05d5\u05e0\u05d4 \U0001f3fa"]
        self.project.mkdir()
        for name in names:
            picture(self.project / f"{name}.png")
        model = turned_model(self.source)[0]
        (self.project / "<script>ran=1<script>.obj").write_text("\n".join(line for line in model.read_text().splitlines() if not line.startswith(("mtllib", "usemtl"))))
        self.start()
        hand = self.hand
        hand.click("button.primary")  # the files that are there become a project
        hand.wait("document.querySelectorAll('.cards li').length === 4", "the files")
        shown = hand.run("[...document.querySelectorAll('.cards b')].map((b) => b.textContent)")
        self.assertEqual(sorted(shown), sorted([*names, "<script>ran=1<script>"]))
        for i, name in enumerate(sorted(names)):
            hand.run(f"location.hash = '#/picture/' + encodeURIComponent({json.dumps(name)})")
            hand.wait(f"document.querySelector('h1').textContent === {json.dumps(name)}", name)
        hand.run(f"location.hash = '#/picture/' + encodeURIComponent({json.dumps(names[1])})")
        hand.click(".titled .tool")
        hand.call("Input.insertText", text="<b>\u05d0</b> \"new\"")
        hand.press("Enter")
        hand.wait("document.querySelector('h1')?.textContent === '<b>\u05d0</b> \"new\"'", "the new name")
        self.assertIn("<b>\u05d0</b> \"new\"", [table.get("name") for table in tomllib.loads(self.toml())["pattern"]])
        hand.run(f"location.hash = '#/scene/' + encodeURIComponent({json.dumps(names[0])})")
        hand.wait("document.querySelector('.stage3d')", "the scene")
        if hand.run("document.querySelectorAll('.standing li').length") == 0:
            hand.click(".panel section .primary")
        hand.wait("document.querySelectorAll('.standing li').length === 1", "a model")
        hand.click("details:has(#text) summary")
        hand.click("#text")
        text = "</textarea><script>ran=1</script> \u05e9\u05dc\u05d5\u05dd \"\U0001f3fa\" \\ '''"
        hand.call("Input.insertText", text=text)
        hand.press("Tab")
        self.wait_for("ran=1</script>")
        hand.open(self.url + "?again")
        hand.run(f"location.hash = '#/scene/' + encodeURIComponent({json.dumps(names[0])})")
        hand.wait(f"document.getElementById('text')?.value === {json.dumps(text)}", "the text, read back")
        self.assertEqual(hand.run("typeof ran"), "undefined")
        self.look("names")


if __name__ == "__main__":
    unittest.main()
