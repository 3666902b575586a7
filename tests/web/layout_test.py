"""Controls on the viewer's stage leave each other room, on small and large screens, at the usual size of text and at twice of it."""
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import Browser, Server  # noqa: E402
from programs import ROOT  # noqa: E402

PAGE = """<!doctype html><meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<link rel="stylesheet" href="style.css"><div id="viewer"><button id="shoot" slot="tools" class="tool camera"></button>
<button id="record" slot="tools" class="tool camera"></button></div>
<script type="module">
import { adopt, BASE, build } from './viewer-parts.js';
adopt(document, BASE);
const root = build(document.getElementById('viewer'));
globalThis.part = (id) => document.getElementById(id) ?? root.getElementById(id);
part('stage').showModal();
for (const id of ['media', 'volume', 'full']) part(id).hidden = false;
const texts = { 'label-name': 'The corner of the pot', 'label-text': 'It is bent. '.repeat(12), cue: 'A pot and its lid, which are of clay',
  reason: 'Look for this picture. Go closer, until the picture fills half of the screen.' };
for (const [id, text] of Object.entries(texts)) part(id).textContent = text;
globalThis.ready = true;
</script>"""
SHOW = """(({ percent, state, shown, above }) => {
  document.documentElement.style.fontSize = `${percent}%%`;
  part('viewer').setAttribute('state', state);
  part('said').classList.toggle('above', above);
  for (const id of ['label', 'label-open', 'which']) part(id).hidden = !shown.includes(id);
})(%s)"""
# Rectangles of what people read and press: {name: [left, top, right, bottom]}; hidden parts are left out.
LAYOUT = """(() => {
  const rects = {};
  const add = (name, element) => {
    const { left, top, right, bottom } = element.getBoundingClientRect();
    if (right > left && bottom > top) rects[name] = [left, top, right, bottom];
  };
  for (const id of ['label', 'label-open', 'cue', 'hint', 'which', 'shoot', 'record']) add(id, part(id));
  for (const id of ['handles', 'media', 'tools']) for (const child of part(id).querySelectorAll('button, input')) add(child.id, child);
  for (const [i, mark] of [...part('marks').children].entries()) add(`mark ${i}`, mark);
  return rects;
})()"""
SCREENS = [(360, 640), (640, 360), (320, 568), (568, 320), (390, 844), (1280, 800)]
SIGHTS = [("seen", ["label"], False), ("seen", ["label"], True), ("seen", ["label-open"], False), ("looking", [], False), ("around", ["label", "which"], False)]


def overlaps(rects, width, height):
    """Overlapping pairs, and parts not wholly on the screen."""
    names = sorted(rects)
    apart = lambda a, b: a[0] >= b[2] - 0.5 or b[0] >= a[2] - 0.5 or a[1] >= b[3] - 0.5 or b[1] >= a[3] - 0.5
    out = [name for name in names if not apart(rects[name], (-9e9, -9e9, 9e9, 0)) or rects[name][0] < 0 or rects[name][2] > width + 0.5 or rects[name][3] > height + 0.5]
    return out + [(a, b) for i, a in enumerate(names) for b in names[:i] if not apart(rects[a], rects[b])]


class Layout(unittest.TestCase):
    def test_nothing_overlaps(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-layout-"))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        for name in ("viewer-parts.js", "style.css"):
            shutil.copy(ROOT / "runtime" / "extensions" / "web" / name, folder)
        (folder / "index.html").write_text(PAGE)
        server = Server(folder)
        self.addCleanup(server.close)
        browser = Browser(folder / "profile", folder / "none.y4m")
        self.addCleanup(browser.close)
        for width, height in SCREENS:
            browser.resize(width, height, 1, True)
            browser.open(server.url)
            browser.wait("globalThis.ready", "the page")
            for percent in (100, 200):
                for state, shown, above in SIGHTS:
                    with self.subTest((width, height, percent, state, shown, above)):
                        told = {"percent": percent, "state": state, "shown": shown, "above": above}
                        browser.run(SHOW % str(told).replace("True", "true").replace("False", "false"))
                        rects = browser.run(LAYOUT)
                        self.assertTrue(set(shown) <= set(rects) and {"close", "larger", "sound", "volume", "cue"} <= set(rects), sorted(rects))
                        self.assertEqual("hint" in rects, state == "looking")
                        self.assertEqual(overlaps(rects, width, height), [], rects)


if __name__ == "__main__":
    unittest.main()
