"""`modar pattern rectify`: sizes, and corners that are no corners."""
import json
import math
import struct
import sys
import unittest

from programs import COVER, QUICK, ROOT, ProgramTest, picture


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


class Rectify(ProgramTest):
    def rectify(self, corners, *more, photo=COVER):
        return self.modar("pattern", "rectify", photo, "--corners", corners, "-o", self.folder / "out.png", *more)

    def whole_photo(self):
        """Of a shape that cameras make: the cover's says that it is cropped."""
        picture(self.folder / "whole.png", 510, 680)
        return "whole.png"

    def test_a_given_size_gives_the_aspect_ratio(self):
        done = self.rectify("10,10,300,40,310,600,20,650", "--width", "200mm", "--height", "300mm")
        self.assertEqual(done.returncode, 0, done.stderr)
        width, height = png_size(self.folder / "out.png")
        self.assertAlmostEqual(width / height, 2 / 3, delta=0.01)

    def test_an_aspect_that_is_not_well_known_is_told(self):
        frontal = self.rectify("40,30,300,30,300,600,40,600", "--json", photo=self.whole_photo())
        self.assertEqual(frontal.returncode, 0, frontal.stderr)
        self.assertAlmostEqual(json.loads(frontal.stdout)["aspect"], 260 / 570, delta=0.01)
        self.assertRegex(frontal.stderr, r"width by height 0\.45\d \+- 0\.0")
        self.assertNotIn("rectify.aspect", frontal.stderr)
        self.assertIn("rectify.aspect", self.rectify("40,30,300,30,300,600,40,600").stderr)
        tilted = self.rectify("10,10,300,160,310,500,20,650", "--width", "200mm")
        self.assertEqual(tilted.returncode, 0, tilted.stderr)
        self.assertRegex(tilted.stderr, r"rectify\.aspect")
        self.assertIn("--height", tilted.stderr)
        measured = self.rectify("10,10,300,160,310,500,20,650", "--width", "200mm", "--height", "300mm")
        self.assertNotIn("rectify.aspect", measured.stderr)

    def test_sizes_that_the_photo_contradicts_are_doubted(self):
        frontal = "40,30,300,30,300,600,40,600"  # 260 to 570
        photo = self.whole_photo()
        for height, doubted in (("210mm", True), ("438mm", False), ("360mm", False), ("330mm", True)):
            done = self.rectify(frontal, "--width", "200mm", "--height", height, photo=photo)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("rectify.sizes" in done.stderr, doubted, f"{height}: {done.stderr}")

    def test_the_width_travels_with_the_image(self):
        self.assertEqual(self.rectify("10,10,300,40,310,600,20,650", "--width", "200mm").returncode, 0)
        bundle = self.folder / "b.modar"
        self.assertEqual(self.modar("bake", "--pattern", "out.png", "-o", bundle, *QUICK).returncode, 0)
        self.assertAlmostEqual(self.modar_json("inspect", bundle)["patterns"][0]["width_mm"], 200, delta=0.5)

    def test_corners_that_are_found_are_shown(self):
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        from kit.canvas import Canvas
        true = [120, 60, 330, 90, 310, 260, 90, 230]
        photo = Canvas(420, 320, (190, 180, 160), 2)
        photo.polygon(list(zip(true[::2], true[1::2])), (40, 60, 120))
        photo.box(180, 130, 240, 180, (220, 200, 40))
        png.write(self.folder / "photo.png", photo.picture(), 6)
        photo.box(80, 120, 130, 160, (190, 180, 160))  # a finger over a fifth of the left side
        png.write(self.folder / "held.png", photo.picture(), 6)
        png.write(self.folder / "empty.png", Canvas(420, 320, (190, 180, 160), 2).picture(), 6)
        done = self.modar("pattern", "rectify", "photo.png", "-o", "cover.png", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = [number for corner in json.loads(done.stdout)["corners"] for number in corner]
        width = math.hypot(true[2] - true[0], true[3] - true[1])
        for one, other in zip(found, true):
            self.assertAlmostEqual(one, other, delta=0.01 * width)
        self.assertIn("--corners", done.stderr)
        self.assertEqual(png_size(self.folder / "cover.corners.png"), (420, 320))
        self.assertFalse(json.loads(done.stdout)["doubtful"])
        self.assertNotIn("rectify.doubtful", done.stderr)
        done = self.modar("pattern", "rectify", "held.png", "-o", "held-cover.png", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(json.loads(done.stdout)["doubtful"])
        self.assertIn("rectify.doubtful", done.stderr)
        self.assert_fails(self.modar("pattern", "rectify", "empty.png", "-o", "again.png"), 3, "--corners",
                          "rectify.not-found")
        self.assertFalse((self.folder / "again.png").exists())

    def test_corners_that_are_none(self):
        for corners, code in (("1,2,3", 1), ("1,2,3,4,5,6,7,x", 1), ("10,10,20,20,30,30,40,40", 3),
                              ("10,10,10,10,300,600,20,650", 3), ("10,10,9999,40,310,600,20,650", 3),
                              ("10,10,310,600,300,40,20,650", 3)):
            self.assert_fails(self.rectify(corners), code)
            self.assertFalse((self.folder / "out.png").exists())


if __name__ == "__main__":
    unittest.main()
