"""`modar pattern score|simulate|confusion` and `modar calibrate`: what they print, write and refuse."""
import json
import math
import shutil
import subprocess
import unittest

from programs import COVER, QUICK, ROOT, ProgramTest

CAMERA = """%YAML:1.0
---
image_width: 208
image_height: 156
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 220., 0., 104., 0., 220., 77., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0., 0., 0., 0. ]
"""
GAME = ROOT / "assets" / "patterns" / "game.png"
CAUSES = ["texture", "spread", "contrast", "repetition", "aspect", "size", "blur", "mirror", "fine"]


class Pattern(ProgramTest):
    def setUp(self):
        super().setUp()
        # A part of the game, found in most views: costs follow the pixels.
        self.part = self.folder / "part.png"
        cut = self.modar("pattern", "rectify", GAME, "--corners", "60,50,220,50,220,180,60,180", "-o", self.part)
        self.assertEqual(cut.returncode, 0, cut.stderr)

    def test_the_score_is_stored_and_printed_with_causes(self):
        project = self.folder / "project"
        project.mkdir()
        self.assert_fails(self.modar("pattern", "score", project), 2, "project")
        shutil.copy(self.part, project)
        (project / "notes.txt").write_text("no picture")
        one, = self.modar_json("pattern", "score", project, "--overlay", "overlays", "--jobs", "2")
        self.assertEqual((one["name"], one["version"]), ("part", 2))
        self.assertTrue(0 <= one["score"] <= 100)
        self.assertEqual([cause["id"] for cause in one["causes"]], CAUSES)
        self.assertIn(one["grade"], "ABCDE")
        self.assertLess(one["range"]["nearest_widths"], one["range"]["farthest_widths"])
        self.assertIn("times its width, to", one["range"]["sentence"])
        self.assertTrue((self.folder / "overlays/part.png").read_bytes().startswith(b"\x89PNG"))
        baked = self.modar("bake", "--pattern", f"{self.part}:20cm", "-o", "b.modar", "--jobs", "1", "--quiet",
                           "--parameters", "none")
        self.assertEqual(baked.returncode, 0, baked.stderr)
        stored = self.modar_json("inspect", "b.modar")["patterns"][0]
        self.assertEqual((stored["score"], stored["grade"]), (one["score"], one["grade"]))
        self.assertEqual(stored["range"]["tilt_deg"], one["range"]["tilt_deg"])
        self.assertIn(" cm to ", stored["range"]["sentence"])

    def test_simulate_tells_bands_and_a_range(self):
        (self.folder / "camera.yml").write_text(CAMERA)
        one, = self.modar_json("pattern", "simulate", self.part, "--camera", "camera.yml", "--views", "1",
                               "--width", "200mm", "--picture", "sheets")
        self.assertEqual([band["name"] for band in one["bands"]],
                         ["distance", "tilt", "rotation", "blur", "light", "noise", "occlusion"])
        for band in one["bands"]:
            for value in band["values"]:
                self.assertEqual(value["frames"], 2)
        self.assertIn("printed 20 cm wide, this camera recognises it from", one["sentence"])
        self.assertLess(one["nearest_mm"], one["farthest_mm"])
        self.assertTrue((self.folder / "sheets/part.png").read_bytes().startswith(b"\x89PNG"))

    def target(self, name, **changes):
        """An image target as 8th Wall's tools write it: its picture is on its side."""
        folder = self.folder / "image-targets"
        folder.mkdir(exist_ok=True)
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", self.part, "-vf", "transpose=clock", folder / f"{name}_cropped.png"],
                       check=True)
        target = {"imagePath": f"image-targets/{name}_luminance.png", "metadata": None, "name": name, "type": "PLANAR",
                  "properties": {"left": 0, "top": 0, "width": 130, "height": 160, "isRotated": True, "originalWidth": 130,
                                 "originalHeight": 160},
                  "resources": {"croppedImage": f"{name}_cropped.png", "luminanceImage": f"{name}_luminance.png"},
                  "created": 1, "updated": 1, **changes}
        file = folder / f"{name}.json"
        file.write_text(json.dumps(target))
        return file

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_targets_of_8th_wall_are_taken_as_they_are(self):
        target = self.target("part")
        # As the documents for moving have it: one picture, no resources.
        shutil.copy(self.part, target.parent / "poster.png")
        poster = self.target("poster", imagePath="./poster.png", resources=None, properties=None, xrMetadata={"isRotated": False})
        ours, *theirs = (self.modar_json("inspect", self.baked(file))["patterns"][0] for file in (self.part, target, poster))
        for pattern in theirs:
            self.assertEqual({**pattern, "name": ""}, {**ours, "name": ""})
        self.assertEqual(self.modar_json("pattern", "score", target)[0]["name"], "part")

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_targets_of_8th_wall_on_cylinders_and_cones(self):
        # The picture, 160 x 130 upright, is the middle half of the width and the lower 130 of 200 rows of the whole.
        curved = {"left": 0, "top": 80, "width": 130, "height": 160, "isRotated": True, "originalWidth": 200, "originalHeight": 320,
                  "cylinderSideLength": 100, "cylinderCircumferenceTop": 300, "cylinderCircumferenceBottom": 300, "arcAngle": 240,
                  "targetCircumferenceTop": 200, "coniness": 0, "inputMode": "ADVANCED", "unit": "mm"}
        shape_of = lambda file: self.modar_json("inspect", self.baked(file))["patterns"][0]
        can = shape_of(self.target("can", type="CYLINDER", properties=curved))
        self.assertEqual(can["shape"]["kind"], "round")
        self.assertAlmostEqual(can["shape"]["arc_deg"], 120)
        self.assertAlmostEqual(can["shape"]["top_mm"], 300 / math.pi, 3)
        self.assertAlmostEqual(can["width_mm"], 100)
        self.assertEqual((can["width"], can["height"]), (160, 104))  # 65 of 100 mm high
        cup = shape_of(self.target("cup", type="CONICAL",
                                   properties=curved | {"cylinderCircumferenceBottom": 8, "cylinderCircumferenceTop": 12, "unit": "in",
                                                        "cylinderSideLength": 4}))
        # Rows 70 to 200: circumferences of 10.6 and 8 inches.
        self.assertAlmostEqual(cup["shape"]["top_mm"], 10.6 * 25.4 / math.pi, 0)
        self.assertAlmostEqual(cup["shape"]["bottom_mm"], 8 * 25.4 / math.pi, 0)
        self.assertAlmostEqual(cup["height"] / cup["width"], 0.65 * 4 / (9.3 / 3), 1)

    def baked(self, pattern, *options):
        done = self.modar("bake", "--pattern", pattern, "-o", "shape.modar", "--quiet", *QUICK, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return "shape.modar"

    def test_shapes_are_stored_and_contradictions_refused(self):
        one = self.modar_json("inspect", self.baked(f"{self.part}:shape=cylinder,diameter=66mm,arc=120"))["patterns"][0]
        self.assertAlmostEqual(one["width_mm"], 66 * math.pi / 3)
        self.assertAlmostEqual(one["shape"]["top_mm"], 66)
        self.assertAlmostEqual(one["shape"]["bottom_mm"], 66)
        self.assertEqual(self.modar("check", "shape.modar").returncode, 0)
        self.assertEqual(self.modar("check", "shape.modar", "--source", self.part).returncode, 0)
        refuse = lambda shape, *words: self.assert_fails(
            self.modar("bake", "--pattern", f"{self.part}:{shape}", "-o", "b.modar", "--quiet", *QUICK), 1, *words)
        refuse("shape=bottle", "no shape 'bottle'")
        refuse("shape=cylinder,diameter=66mm", "arc=DEGREES")
        refuse("100mm:shape=cylinder,diameter=66mm,arc=90", "173.6 degrees, not 90.0")
        refuse("300mm:shape=cylinder,diameter=66mm", "correct the width or the diameter")
        refuse("shape=cone,top=200mm,bottom=20mm,arc=60", "too little for these diameters")

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_what_of_other_projects_is_refused(self):
        refuse = lambda file, code, *words: self.assert_fails(
            self.modar("bake", "--pattern", file, "-o", "b.modar", "--quiet", *QUICK), code, *words)
        refuse(self.target("ball", type="SPHERE"), 5, "SPHERE")
        refuse(self.target("can", type="CYLINDER"), 3, "cylinderCircumferenceTop")
        gone = self.target("gone")
        (gone.parent / "gone_cropped.png").unlink()
        refuse(gone, 2, "gone_cropped.png, gone_luminance.png")
        for command in ("simulate", "score"):
            self.assert_fails(self.modar("pattern", command, self.part, "--shape", "ball"), 1, "no shape 'ball'")
        mind = self.folder / "targets.mind"
        mind.write_bytes(b"\x82")
        refuse(mind, 5, "compiled from")
        wrong = self.folder / "wrong.json"
        wrong.write_text("[]")
        refuse(wrong, 3, "not an image target")

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_a_project_follows_the_pictures_of_targets(self):
        target = self.target("part")
        (self.folder / "modar.toml").write_text('[bake]\nloop-views = 8\nscore = false\nparameters = "none"\n'
                                                '[[pattern]]\nfile = "image-targets/*.json"\n')
        states = lambda: [asset["state"] for asset in self.modar_json("bake", cwd=self.folder)["assets"]]
        self.assertEqual(states(), ["baked"])
        self.assertEqual(states(), ["fresh"])
        picture = target.parent / "part_cropped.png"
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", self.part, "-vf", "transpose=clock,negate", picture], check=True)
        self.assertEqual(states(), ["baked"])

    def test_confusion_of_a_bundle_with_itself(self):
        done = self.modar("bake", "--pattern", self.part, "-o", "b.modar", "--quiet", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        alone = self.modar_json("pattern", "confusion", "b.modar", "--views", "2")
        self.assertEqual((alone["false_recognitions"], alone["keep_apart"]), (0, []))
        one, = alone["patterns"]
        self.assertIn(one.pop("mirrored"), (0, 1, 2))
        self.assertEqual(one, {"name": "part", "recognised": 2, "taken_for": {}, "in_photos": 0})
        twice = self.modar("pattern", "confusion", "b.modar", "b.modar", "--views", "2")
        self.assertEqual(twice.returncode, 3)
        self.assertIn("false recognitions: 4", twice.stdout)
        self.assertIn("keep apart: part and part", twice.stdout)

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_confusion_says_whom_one_bundle_tells_apart(self):
        other = self.folder / "edition.png"
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", self.part, "-vf", "split[a][b];[b]crop=iw:ih/4:0:ih*3/4,hflip,vflip[c];"
                        "[a][c]overlay=0:H*3/4", "-frames:v", "1", other], check=True)
        for name, picture in (("a", self.part), ("b", other)):
            done = self.modar("bake", "--pattern", picture, "-o", f"{name}.modar", "--quiet", *QUICK)
            self.assertEqual(done.returncode, 0, done.stderr)
        done = self.modar("pattern", "confusion", "a.modar", "b.modar", "--views", "2")
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("bake into one bundle, where they are distinguished: part and edition", done.stdout)

    def test_bench_prints_the_article_s_tables_beside_ours(self):
        rows = self.lab_json("bench", "pose", "--tables", "--patterns", GAME, "--backgrounds", COVER, "--frames", "1",
                               "--quiet")
        found = {row["measure"]: row for row in rows}
        # Of SCYTHE, whose size ours has: Table 6; first of Table 7, milliseconds and share; their sum; accuracy from afar.
        article = {"orb-2000": (1189, 86, 12.51, 434, 93), "orb-500": (430, 69, 12.02, 309, 88),
                   "brisk-3": (544, 2425, 49.47, 4880, 97), "brisk-2": (540, 2296, 47.73, 4614, 95)}
        bands = ("area 0.4-0.9", "area 0.9-4")
        methods = (*article, "ours")
        self.assertEqual(set(found), {
            *(f"table6_{kind}_features {of} {name}" for kind in ("blurred", "shipped") for of in ("game/scythe", "mean") for name in article),
            *(f"table6_{what}_{end} {name}" for what in ("frame_features", "inliers") for end in ("least", "most")
              for name in methods),
            *(f"table{table}_{stage}_{unit} {name}" for table in (7, 8) for unit in ("ms", "cpu_pct")
              for stage in ("detect", "describe", "match", "homography") for name in methods),
            *(f"table{table}_four_stages_ms {name}" for table in (7, 8) for name in methods),
            *(f"{what}_pct {band} {name}" for what in ("accuracy", "right") for band in bands for name in methods),
            *(f"{what}_ms {name}" for what in ("read_yml", "cpu") for name in methods),
            *(f"reduction_pct orb-2000/brisk-3 {device}" for device in ("low_end", "mid_range"))})
        for name, (features, milliseconds, share, four, accuracy) in article.items():
            self.assertEqual(found[f"table6_blurred_features game/scythe {name}"]["reference"], features)
            self.assertEqual(found[f"table7_detect_ms {name}"]["reference"], milliseconds)
            self.assertEqual(found[f"table7_detect_cpu_pct {name}"]["reference"], share)
            self.assertAlmostEqual(found[f"table7_four_stages_ms {name}"]["reference"], four, delta=0.1)
            self.assertEqual(found[f"accuracy_pct {bands[0]} {name}"]["reference"], accuracy)
            stages = [found[f"table8_{stage}_ms {name}"]["ours"] for stage in ("detect", "describe", "match", "homography")]
            self.assertAlmostEqual(sum(stages), found[f"table8_four_stages_ms {name}"]["ours"], places=6)
            self.assertGreater(min(stages), 0)
            self.assertLessEqual(sum(found[f"table7_{stage}_cpu_pct {name}"]["ours"]
                                     for stage in ("detect", "describe", "match", "homography")), 100)
        # The picture is blurred until it is as rich as the article's, not richer, and hardly poorer.
        self.assertTrue(0.8 * 544 <= found["table6_blurred_features mean brisk-3"]["ours"] <= 544, found)
        self.assertEqual(found["table6_blurred_features mean brisk-3"]["ours"], found["table6_blurred_features game/scythe brisk-3"]["ours"])
        self.assertAlmostEqual(found["reduction_pct orb-2000/brisk-3 low_end"]["reference"], 91.1, delta=0.05)
        self.assertEqual(found["read_yml_ms ours"]["ours"], 0)
        self.assertLessEqual(found["table6_blurred_features game/scythe orb-500"]["ours"], 500)
        for band in bands:
            self.assertEqual(found[f"accuracy_pct {band} ours"]["ours"], 100)
            self.assertEqual(found[f"right_pct {band} ours"]["ours"], 100)

    def test_bench_of_many_patterns_prints_each_measure(self):
        rows = self.lab_json("bench", "pose", "--many=2", "--patterns", GAME, "--backgrounds", COVER, "--frames", "1",
                               "--quiet")
        found = {row["measure"]: row for row in rows}
        self.assertEqual(set(found), {
            *(f"detection {what} x{count}" for what in ("cpu_ms", "right_pct", "others") for count in (1, 2)),
            *(f"detection tilt {tilt} {what} x2" for what in ("right_pct", "others")
              for tilt in ("45-60", "60-70", "70-75", "75-80")),
            "coming within_10_pct x2", "coming photos_named x2", "ready_ms x2", "ready_heap_bytes x2", "first_search cpu_ms x2", "searching_heap_bytes x2",
            *(f"return_{how} {what} x2" for how in ("alone", "beside")
              for what in ("mean_frames", "worst_frames", "times"))})
        for count in (1, 2):
            self.assertEqual(found[f"detection right_pct x{count}"]["ours"], 100)
            self.assertEqual(found[f"detection others x{count}"]["ours"], 0)
        self.assertEqual(found["return_alone times x2"]["reference"], 1)
        few = self.lab("bench", "pose", "--many", "--patterns", GAME, "--backgrounds", COVER)
        self.assertEqual(few.returncode, 1)
        self.assertIn("eight at most of each picture", few.stderr)

    def test_calibrate_says_what_is_missing(self):
        self.assert_fails(self.modar("calibrate", self.part, "-o", "c.yml"), 1, "--board")
        self.assert_fails(self.modar("calibrate", self.part, "--board", "9", "-o", "c.yml"), 1, "9x6")
        self.assert_fails(self.modar("calibrate", self.part, "--board", "9x6", "-o", "c.yml"), 3, "5 are needed")
        self.assert_fails(self.modar("calibrate", "nothing.mp4", "--board", "9x6", "-o", "c.yml"), 2)
        self.assertFalse((self.folder / "c.yml").exists())


if __name__ == "__main__":
    unittest.main()
