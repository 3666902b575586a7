"""`modar adopt`: pages for MindAR and 8th Wall, their pictures, and the lines that change."""
import json
import unittest

from programs import ProgramTest, needs, picture

MINDAR = """<html><head>
<script src="https://aframe.io/releases/1.5.0/aframe.min.js"></script>
<script src="https://cdn.jsdelivr.net/npm/mind-ar@1.2.5/dist/mindar-image-aframe.prod.js"></script>
</head><body>
<a-scene mindar-image="imageTargetSrc: ./assets/card.mind; maxTrack: 2" vr-mode-ui="enabled: false">
<a-entity mindar-image-target="targetIndex: 0"></a-entity>
</a-scene></body></html>
"""
WALL = """<html><head>
<script src="//cdn.8thwall.com/web/aframe/8frame-1.3.0.min.js"></script>
<script src="//cdn.8thwall.com/web/xrextras/xrextras.js"></script>
<script async src="//apps.8thwall.com/xrweb?appKey=XXXXX"></script>
</head><body>
<a-scene xrextras-loading xrweb="disableWorldTracking: true">
<xrextras-named-image-target name="poster"></xrextras-named-image-target>
<a-entity xrextras-named-image-target="name: flyer"></a-entity>
</a-scene></body></html>
"""


@needs("adopt")
class Adopt(ProgramTest):
    def setUp(self):
        super().setUp()
        for folder in ("assets", "image-targets", "targets"):
            (self.folder / folder).mkdir()
        self.page = self.folder / "index.html"

    def patterns(self, bundle):
        return [each["name"] for each in json.loads(self.modar("inspect", bundle, "--json").stdout)["patterns"]]

    def test_a_page_for_mindar(self):
        self.page.write_text(MINDAR)
        done = self.modar("adopt", "index.html", "--quiet")
        self.assert_fails(done, 1, "adopt.image")
        self.assertIn("no usable picture", done.stderr)
        self.assertFalse((self.folder / "index.modar").exists())
        picture(self.folder / "assets" / "card.png")
        done = self.modar("adopt", "index.html", "--quiet")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines(), [
            '3: - <script src="https://cdn.jsdelivr.net/npm/mind-ar@1.2.5/dist/mindar-image-aframe.prod.js"></script>',
            '3: + <script src="modar/adapters/aframe.js"></script>',
            '5: - <a-scene mindar-image="imageTargetSrc: ./assets/card.mind; maxTrack: 2" vr-mode-ui="enabled: false">',
            '5: + <a-scene mindar-image="imageTargetSrc: index.modar; maxTrack: 2" vr-mode-ui="enabled: false">'])
        self.assertEqual(self.patterns("index.modar"), ["card"])
        self.assertEqual(self.page.read_text(), MINDAR)

    def test_targets_keep_the_compilers_order_and_write_keeps_the_page(self):
        self.page.write_text(MINDAR.replace("</a-scene>", '<a-entity mindar-image-target="targetIndex: 1"></a-entity></a-scene>'))
        before = self.page.read_text()
        for name in ("b", "a"):
            picture(self.folder / f"{name}.png", mirrored=name == "a")
        picture(self.folder / "assets" / "card.png")
        self.assert_fails(self.modar("adopt", "index.html", "--quiet"), 1, "adopt.image")
        words = ("adopt", "index.html", "--image", "b.png", "--image", "a.png", "-o", "both.modar", "--write", "--quiet",
                 "--script", "https://museum.example/aframe.js")
        self.assertEqual(self.modar(*words).returncode, 0)
        self.assertEqual(self.patterns("both.modar"), ["b", "a"])
        self.assertEqual((self.folder / "index.html.orig").read_text(), before)
        text = self.page.read_text()
        self.assertIn('<script src="https://museum.example/aframe.js"></script>', text)
        self.assertIn("imageTargetSrc: both.modar; maxTrack", text)
        self.assert_fails(self.modar(*words), 1, "adopt.kept")

    def test_a_page_for_8th_wall(self):
        self.page.write_text(WALL)
        picture(self.folder / "targets" / "flyer.png", mirrored=True)
        self.assert_fails(self.modar("adopt", "index.html", "--quiet"), 1, "adopt.image")
        picture(self.folder / "image-targets" / "poster_cropped.png")
        (self.folder / "image-targets" / "poster.json").write_text(json.dumps({
            "name": "poster", "type": "PLANAR", "imagePath": "image-targets/poster_cropped.png",
            "resources": {"croppedImage": "poster_cropped.png"}, "properties": {"isRotated": False}}))
        done = self.modar("adopt", "index.html", "--quiet", "--write")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.patterns("index.modar"), ["poster", "flyer"])
        lines = self.page.read_text().splitlines()
        self.assertEqual(lines[1:3], ['<script src="https://aframe.io/releases/1.3.0/aframe.min.js"></script>',
                                      '<script src="modar/adapters/aframe.js" data-bundle="index.modar"></script>'])
        self.assertEqual(lines[3:], WALL.splitlines()[4:])
        self.assertEqual(done.stdout.count("+ "), 2)
        self.assertEqual(done.stdout.count("- "), 3)

    def test_other_pages(self):
        self.page.write_text("<html><a-scene></a-scene></html>")
        self.assert_fails(self.modar("adopt", "index.html"), 1, "adopt.page")


if __name__ == "__main__":
    unittest.main()
