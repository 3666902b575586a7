"""<modar-viewer> in a page of somebody else's, in each browser that is installed: what it shows, what it tells, who can use it."""
import json
import math
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import axe_core, engines, report_of  # noqa: E402
from programs import COVER, ROOT, ProgramTest, demo_files  # noqa: E402

PAGE = ROOT / "build" / "web" / "web"
HERE = pathlib.Path(__file__).resolve().parent / "viewer"
TEXTS = """
text.de = "Um 1890."
alt.de = "Eine Vase mit zwei Henkeln"
"""


class Viewer(ProgramTest):
    def make_page(self):
        site = self.folder / "site"
        shutil.copytree(HERE, site)
        for file in json.loads((PAGE / "package.json").read_text())["files"]:
            copy = shutil.copytree if (PAGE / file).is_dir() else shutil.copy
            (site / "modar").mkdir(exist_ok=True)
            copy(PAGE / file, site / "modar" / file)
        shutil.copy(self.bake_project(TEXTS), site)
        shutil.copy(demo_files() / "clip" / "frame_00001.png", site / "frame.png")
        subprocess.run(["ffmpeg", "-v", "error", "-i", COVER, "-vf", "scale=-2:300", site / "poster.jpg"], check=True)
        axe = axe_core(self.folder)
        if axe:
            shutil.copy(axe, site / "axe.js")
            page = site / "index.html"
            page.write_text(page.read_text().replace("</title>", '</title><script src="axe.js"></script>'))
        return site, axe is not None

    def assert_models_stand_on_the_picture(self, seen):
        """The middle of the drawing is near the picture's corners as the event states them, in a frame that fills the layer."""
        corners, camera = [seen["detection"]["corners"][str(i)] for i in range(8)], seen["detection"]["camera"]
        scale = max(seen["width"] / camera["width"], seen["height"] / camera["height"])
        place = lambda axis, side: seen[side] / 2 + scale * (sum(corners[axis::2]) / 4 - camera[side] / 2)
        diagonal = scale * math.dist(corners[0:2], corners[4:6])
        self.assertLess(math.dist((place(0, "width"), place(1, "height")), (seen["x"], seen["y"])), diagonal / 2)

    def judge(self, facts, with_axe):
        self.assertEqual(facts["errors"], [])
        cover = facts["cover"]
        self.assertEqual((cover["start"], cover["alt"], cover["loaded"]), ("Kamera starten", "Eine Vase auf einem Buch", False))
        self.assertGreater(cover["poster"], 0)
        self.assertEqual(cover["size"][2], 320)
        self.assertGreaterEqual(cover["size"][3], 240)
        self.assertEqual((cover["font"], cover["opacity"]), ("15px", "1"))  # not the site's
        self.assertEqual(facts["looking"]["plates"], 1)
        self.assertIn("Suchen", facts["looking"]["hint"])
        # Over the whole window, though the page around it is moved.
        self.assertEqual(facts["looking"]["stage"][:2], [0, 0])
        self.assertGreater(facts["looking"]["stage"][2], 500)
        self.assertGreater(facts["seen"]["lit"], 1000)
        self.assertGreater(facts["seen"]["colour"], 20, "the camera's picture is below")
        self.assert_models_stand_on_the_picture(facts["seen"])
        self.assertGreater(facts["larger"]["lit"], 1.05 * facts["seen"]["lit"])
        self.assertEqual(facts["label"], {"name": "pottery", "text": "Um 1890.", "lang": "de", "aria": facts["label"]["aria"]})
        self.assertIn("Eine Vase mit zwei Henkeln", facts["label"]["aria"])
        self.assertEqual(facts["found"], {"name": "cover", "view": 16})
        self.assertEqual(facts["photo"], "image/jpeg")
        self.assertEqual(facts["lost"]["name"], "cover")
        self.assertEqual(facts["stopped"], {"state": "start", "tracks": ["ended"], "open": False})
        around = facts["around"]
        self.assertGreater(around["lit"], 5000)
        self.assertLess(abs(around["x"] / around["width"] - 0.5), 0.05)
        self.assertGreater(facts["keys"]["ArrowUp"]["lit"], 1.1 * around["lit"])
        for key in ("ArrowLeft", "PageUp"):
            self.assertNotEqual(facts["keys"][key], around, key)
        self.assertGreater(facts["ground"]["colour"], 12, "the picture's colours, of the bundle")
        self.assertEqual(facts["refused"], {"failure": {"name": "NotAllowedError", "message": "refused"}, "state": "error", "open": True,
                                            "title": facts["refused"]["title"]})
        self.assertIn("Kamera", facts["refused"]["title"])
        self.assertEqual(facts["removed"], {"tracks": ["ended"] * 3, "state": "start", "loaded": False})
        events = facts["events"]
        for before, after in (("load", "found"), ("looking", "seen"), ("found", "lost"), ("lost", "around"), ("around", "error")):
            self.assertLess(events.index(before), events.index(after), events)
        if with_axe:
            self.assertEqual(facts["axe"], {each: [] for each in ("cover", "looking", "seen", "around", "problem")})

    def test_it_plays_in_each_browser(self):
        site, with_axe = self.make_page()
        names = []
        for name, start in engines(self):
            with self.subTest(name):
                names.append(name)
                self.judge(report_of(site, start), with_axe)
        print(f"played in {', '.join(names)}; axe-core {'found nothing' if with_axe else 'is not there'}")
        self.assertTrue(names, "no browser is installed")


if __name__ == "__main__":
    unittest.main()
