"""The same files give the same bundle, whoever is handed them; files other than models and pictures are named by their kind, everywhere."""
import json
import struct
import subprocess
import sys
import shutil
import tomllib
import unittest

from programs import COVER, POTTERY, QUICK, ROOT, STATUE, ProgramTest, picture

sys.path.insert(0, str(ROOT / "assets"))
from kit import png  # noqa: E402
from kit.canvas import Canvas  # noqa: E402

HEIC = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + bytes(99)
CORNERS = [(120, 60), (330, 90), (310, 260), (90, 230)]
STL = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid x\n"


def photo(path, height=320, corners=tuple(CORNERS)):
    """A card on a table."""
    canvas = Canvas(420, height, (190, 180, 160), 2)
    canvas.polygon(corners, (40, 60, 120))
    for x, y, side in ((180, 130, 50), (140, 100, 30), (250, 180, 40), (260, 110, 24), (130, 190, 28)):
        canvas.box(x, y, x + side, y + side, (220, 200, 40))
    png.write(path, canvas.picture(), 6)


def museum(folder):
    """A model with its material and texture, a photo of a card, and a picture that nothing reads."""
    for source in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png")):
        shutil.copy(source, folder)
    photo(folder / "card.png")
    (folder / "IMG_1.HEIC").write_bytes(HEIC)


FAST = "[bake]\nloop-views = 8\nscore = false\n"


class SameFiles(ProgramTest):
    def setUp(self):
        super().setUp()
        self.place = self.folder / "museum"
        self.place.mkdir()

    def init(self):
        done = self.modar("init", cwd=self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        text = (self.place / "modar.toml").read_text()
        (self.place / "modar.toml").write_text(text.replace("[bake]\n", FAST))
        return done.stderr, tomllib.loads(text)

    def test_bake_and_init_give_the_same_bytes(self):
        museum(self.place)
        files = sorted(path.name for path in self.place.iterdir())
        baked = self.modar("bake", *files, "-o", self.folder / "files.modar", *QUICK, cwd=self.place)
        self.assertEqual(baked.returncode, 0, baked.stderr)
        self.assertIn("pottery.png: it is a model's texture, so no pattern", baked.stderr)
        told, project = self.init()
        [pattern] = project["pattern"]
        for (x, y), (true_x, true_y) in zip(pattern["corners"], CORNERS):
            self.assertAlmostEqual(x, true_x, delta=2)
            self.assertAlmostEqual(y, true_y, delta=2)
        for words in (told, baked.stderr):
            self.assertRegex(words, r"card\.png.*corners 1\d\d")  # it says what it cut out
            self.assertRegex(words, r"IMG_1\.HEIC.*heif-convert '[^']*IMG_1\.HEIC' '[^']*IMG_1'\.jpg")
            self.assertNotIn("pattern.doubtful", words)
        done = self.modar("bake", cwd=self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.place / "out/museum.modar").read_bytes(), (self.folder / "files.modar").read_bytes())

    def test_a_photo_gets_the_same_grade_from_score_and_bake(self):
        photo(self.place / "card.png")
        done = self.modar("pattern", "score", "card.png", "--json", cwd=self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"card\.png.*corners 1\d\d")
        self.assertEqual(self.modar("bake", "card.png", "-o", "a.modar", cwd=self.place).returncode, 0)
        [pattern] = self.modar_json("inspect", self.place / "a.modar")["patterns"]
        self.assertEqual(json.loads(done.stdout)[0]["score"], pattern["score"])

    def test_what_measures_a_photo_measures_what_the_bake_cuts_out(self):
        photo(self.place / "card.png")
        bands = []
        for command, *shape in (("confusion",), ("simulate",), ("simulate", "--shape", "flat")):
            done = self.modar("pattern", command, "card.png", "--views", "1", "--json", "--quiet", *shape, cwd=self.place)
            self.assertEqual("corners 1" in done.stderr, not shape, done.stderr)
            bands.append(json.loads(done.stdout)[0]["bands"] if command == "simulate" else None)
        self.assertNotEqual(bands[1], bands[2])

    def test_a_cropped_photo_leaves_the_shape_in_doubt(self):
        for height, cropped in ((315, False), (300, True)):  # 4:3, as cameras make them, and another
            photo(self.place / "card.png", height, [(80, 40), (340, 100), (340, 220), (80, 280)])
            done = self.modar("bake", "card.png", "-o", "a.modar", *QUICK, cwd=self.place)
            self.assertEqual((done.returncode, "pattern.shape" in done.stderr), (0, cropped), done.stderr)

    def test_a_print_from_straight_above_is_doubted(self):
        for size, words in (((640, 480), True), ((640, 440), False)):  # the shape of a camera's photos, and another
            sheet = Canvas(*size, (190, 180, 160), 2)
            sheet.box(110, 40, 530, 400, (40, 60, 120))
            for i in range(40):
                sheet.box(130 + i * 67 % 360, 60 + i * 91 % 300, 150 + i * 67 % 360, 76 + i * 91 % 300, (220, 40 + 5 * i, 40))
            png.write(self.place / "sheet.png", sheet.picture(), 6)
            done = self.modar("bake", "sheet.png", "-o", "a.modar", *QUICK, cwd=self.place)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("pattern.doubtful" in done.stderr, words, done.stderr)

    def test_the_whole_file_is_taken_where_that_is_asked(self):
        photo(self.place / "card.png")
        sizes = []
        for words in ("card.png", "card.png:shape=flat"):
            self.assertEqual(self.modar("bake", words, "-o", "a.modar", *QUICK, cwd=self.place).returncode, 0)
            [pattern] = self.modar_json("inspect", self.place / "a.modar")["patterns"]
            sizes.append((pattern["width"], pattern["height"]))
        self.assertLess(sizes[0][0], 260)
        self.assertEqual(sizes[1], (420, 320))

    def test_files_that_are_not_read_cost_no_edit(self):
        museum(self.place)
        (self.place / "zero.obj").touch()
        (self.place / "zero.png").touch()
        picture(self.place / "tiny.png", 20, 16)
        (self.place / "broken.png").write_bytes(COVER.read_bytes()[:2000])
        (self.place / "points.ply").write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", COVER, "-lossless", "1", self.place / "cover.webp"], check=True)
        told, project = self.init()
        for name in ("zero.obj", "zero.png", "tiny.png", "broken.png", "points.ply", "IMG_1.HEIC"):
            self.assertRegex(told, rf"{name}.*left out: .*; ")
        self.assertEqual(sorted(one["file"] for one in project["pattern"]), ["card.png", "cover.webp"])
        done = self.modar("bake", cwd=self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(self.modar_json("inspect", self.place / "out/museum.modar")["patterns"]), 2)

    def test_pairs_that_are_a_guess_are_called_so(self):
        for source in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png"), STATUE):
            shutil.copy(source, self.place)
        shutil.copy(POTTERY, self.place / "vase.obj")
        for name in ("a", "b"):
            picture(self.place / f"{name}.png")
        told, project = self.init()
        self.assertEqual([(one["pattern"], one["model"]) for one in project["scene"]], [("a", "pottery"), ("b", "statue")])
        self.assertIn("guess: pottery on a, statue on b; change pattern = and model = in [[scene]]", told)
        self.assertIn("no picture is left for: vase", told)
        for name in ("pottery", "statue"):  # names that say what belongs together are no guess
            (self.place / f"{'a' if name == 'pottery' else 'b'}.png").rename(self.place / f"{name}_print.png")
        for name in ("pottery", "statue"):
            (self.place / f"{name}.obj").rename(self.place / f"{name}_print.obj")
        (self.place / "modar.toml").unlink()
        told, project = self.init()
        self.assertNotIn("guess", told)
        self.assertIn("no picture has the name of: vase", told)
        self.assertNotIn("scene", project)


class WrongFiles(ProgramTest):
    """The same cause and cure from `bake`, a project and `init`."""

    def assert_everywhere(self, name, *words, model=True, code=3):
        other = "good.png" if model else "good.stl"
        done = self.modar("bake", name, other, "-o", "out.modar")
        self.assert_fails(done, code, name, *words)
        flag = "--model" if model else "--pattern"
        self.assert_fails(self.modar("bake", flag, name, "-o", "out.modar"), code, name, *words)
        (self.folder / "modar.toml").write_text(f'[[{"model" if model else "pattern"}]]\nfile = "{name}"\n')
        # What a command line names wrongly (1) is a mistake of the file (3) here.
        self.assert_fails(self.modar("bake"), 3 if code == 1 else code, name, *words)
        told = self.modar("init", "--force").stderr
        for word in words:
            self.assertIn(word, told)

    def setUp(self):
        super().setUp()
        picture(self.folder / "good.png")
        (self.folder / "good.stl").write_text(STL)

    def test_bundles_and_other_files_are_told_apart(self):
        shutil.copy(ROOT / "tests/golden/v1_0.modar", self.folder / "b.png")
        self.assert_fails(self.modar("pattern", "score", "b.png"), 1, "this is a bundle (ModAR), not a picture; `modar check`")
        self.assert_fails(self.modar("bake", "b.png", "good.stl", "-o", "out.modar"), 1, "this is a bundle (ModAR), not a picture")
        self.modar("ship", "keygen", "--out", "k.key")
        publish = ("ship", "publish", "good.png", "--to", "ar", "--key", "k.key", "--dry-run")
        for words in (("check", "good.png"), ("inspect", "good.png"), ("report", "good.png", "-o", "r.html"), publish):
            self.assert_fails(self.modar(*words), 1, "this is a picture (PNG), not a bundle; bake it first")

    def test_an_empty_file_is_called_empty(self):
        for name in ("zero.obj", "zero.glb", "zero.gltf", "zero.stl", "zero.ply", "zero.png", "zero.jpg", "zero.webp"):
            (self.folder / name).touch()
            self.assert_everywhere(name, "the file is empty; make it again, or copy it again", model=name[5:] in ("obj", "glb", "gltf", "stl", "ply"))
            (self.folder / name).unlink()

    def test_a_picture_is_no_model_and_a_model_no_picture(self):
        for ending in ("obj", "glb", "stl", "ply"):
            shutil.copy(COVER, self.folder / f"p.{ending}")
            self.assert_everywhere(f"p.{ending}", "this is a picture (PNG), not a model; pass it as a pattern", code=1)
            (self.folder / f"p.{ending}").unlink()
        binary = bytes(80) + struct.pack("<I", 1) + bytes(50)
        for data, kind in ((STL.encode(), "STL"), (binary, "STL"), (b"glTF" + bytes(40), "glTF"), (b"ply\n" + bytes(40), "PLY")):
            (self.folder / "m.png").write_bytes(data)
            self.assert_everywhere("m.png", f"this is a model ({kind}), not a picture; pass it as a model", model=False, code=1)

    def test_a_video_and_a_zip_are_neither(self):
        for data in (b"\0\0\0\x20ftypisom" + bytes(40), b"RIFF\0\0\0\0AVI " + bytes(40), b"\x1a\x45\xdf\xa3" + bytes(40)):
            (self.folder / "clip.png").write_bytes(data)
            self.assert_everywhere("clip.png", "not a picture; take a picture of it: ffmpeg", model=False, code=1)
        (self.folder / "all.zip").write_bytes(b"PK\3\4" + bytes(40))
        self.assert_fails(self.modar("bake", "all.zip"), 1, "this is a zip (PKZIP), not a model; unzip it")

    def test_what_is_missing_is_named_before_options(self):
        for words in (("missing.glb",), ("../nofolder",), (COVER, "missing.png")):
            self.assert_fails(self.modar("bake", *words), 2, words[-1], "the file cannot be opened or read")

    def test_widths_that_no_print_has_are_doubted(self):
        for width, doubted in (("4.9mm", True), ("5mm", False), ("20m", False), ("20.1m", True)):
            done = self.modar("bake", f"{COVER}:{width}", "-o", "w.modar", *QUICK)
            self.assertEqual((done.returncode, "pattern.width" in done.stderr), (0, doubted), done.stderr)

    def test_a_first_version_of_gltf_is_called_so(self):
        (self.folder / "old.gltf").write_text('{"nodes": {"a": {"meshes": ["m"]}}, "meshes": {"m": {}}}')
        self.assert_fails(self.modar("bake", "old.gltf", "-o", "o.modar"), 5, "this is glTF 1.0; convert it to glTF 2.0")
        for words in (("--model", "good.png"), ("--pattern", "good.stl")):
            self.assert_fails(self.modar("bake", *words, "-o", "out.modar"), 1, "this is a ", "pass it as a ")

    def test_what_is_wrong_with_a_model_is_named(self):
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        (self.folder / "beyond.obj").write_text("quad 1\n" + corners + "f 1 2 9\nf 1 2 7\n")
        self.assert_fails(self.modar("bake", "beyond.obj", "-o", "o.modar"), 3, "none of its 2 faces can be used: ", "refer to vertices that do not exist")
        (self.folder / "plain.obj").write_text("mtllib odd.mtl\nusemtl a\n" + corners + "f 1 2 3\n")
        (self.folder / "odd.mtl").write_bytes(b"newmtl a\n\0\1\2")
        self.assertIn("odd.mtl: the material file is not text", self.modar("bake", "plain.obj", "-o", "o.modar").stderr)
        self.assert_fails(self.modar("bake", "plain.obj", "-o", "o.modar", "--memory", "1X"), 1, "--memory: it is no size; write bytes, or a number with k, M or G")

    def test_an_address_is_no_file(self):
        address = "https://museum.org/a"
        for words in (("bake", f"{address}.png", "-o", "o.modar"), ("bake", f"{address}.obj", "-o", "o.modar"), ("bake", "good.stl", "--light", address, "good.png", "-o", "o.modar"),
                      ("pattern", "score", address), ("pattern", "rectify", address, "-o", "o.png"), ("init", address), ("inspect", address), ("check", address)):
            self.assert_fails(self.modar(*words), 2, "is a web address, and only files are read; download it (curl -LO 'https://museum.org/a")
        (self.folder / "modar.toml").write_text(f'[[pattern]]\nfile = "{address}.png"\n')
        self.assert_fails(self.modar("bake"), 3, "web address", "curl")
        self.assertFalse((self.folder / "https:").exists())

    def test_a_shape_is_refused_with_what_its_part_may_be(self):
        for shape, *words in (("cylinder,diameter=66mm,arc=361", "'arc=361'", "at most 360"), ("cylinder,diameter=-66mm", "'diameter=-66mm'"),
                              ("cylinder,diameter=66", "'diameter=66'", "write 66mm"), ("box,size=120x180mm", "120x180x40mm"),
                              ("box,size=1x2x3mm,righ=good.png", "did you mean 'right'"), ("cone,diameter=3mm", "cone has no 'diameter'"),
                              ("flat,corners=1:2:3", "eight numbers with colons"), ("box,size=1x2x3mm,top=", "'top='", "its file is missing")):
            self.assert_fails(self.modar("bake", f"good.png:shape={shape}", "-o", "o.modar"), 1, "cli.shape", *words)

    def test_a_decimal_comma_is_named_with_the_point(self):
        for scene, point in (("height=12,5cm", "height=12.5cm"), ("scale=0,8", "scale=0.8"), ("turn=12,5", "turn=12.5"), ("offset=0:0:2,5cm", "offset=0:0:2.5cm"),
                             ("up=z,height=1,5cm,turn=9", "height=1.5cm")):
            self.assert_fails(self.modar("bake", "good.stl", "good.png:210mm", "--scene", f"good=good,{scene}", "-o", "o.modar"), 1,
                              "the number contains a comma", f"write {point}, with a point")
        self.assert_fails(self.modar("bake", "good.png:shape=cylinder,diameter=6,6cm,arc=90", "-o", "o.modar"), 1, "write diameter=6.6cm, with a point")
        self.assert_fails(self.modar("bake", "good.png:12,5cm", "-o", "o.modar"), 1, "write 12.5cm, with a point")
        self.assert_fails(self.modar("bake", "good.stl", "-o", "o.modar", "--max-error", "0,5mm"), 1, "write 0.5mm, with a point")
        for line in ('width = "12,5mm"', "file = x.png, y.png"):
            (self.folder / "modar.toml").write_text(f'[[pattern]]\nfile = "good.png"\n{line}\n')
            self.assert_fails(self.modar("bake"), 3, "modar.toml:3")


if __name__ == "__main__":
    unittest.main()
