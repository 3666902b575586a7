"""`modar check` from the outside: verdicts, documents that keep their schemas, severities, devices, the proof."""
import json
import math
import os
import pathlib
import random
import shutil
import struct
import subprocess
import tarfile
import unittest

try:
    import jsonschema
except ImportError:
    jsonschema = None

from programs import COVER, POTTERY, QUICK, ROOT, ProgramTest, picture, write_png

OURS = json.loads((ROOT / "bake" / "commands" / "check.schema.json").read_text())
PROOF = json.loads((ROOT / "bake" / "extensions" / "lab" / "mutation.schema.json").read_text())
SARIF = json.loads((ROOT / "tests" / "cli" / "sarif.schema.json").read_text())
CORRUPT = sorted((ROOT / "tests" / "corrupt").glob("*.modar"))
GOLDEN = ROOT / "tests" / "golden" / "v1_0.modar"


@unittest.skipUnless(jsonschema, "python3-jsonschema is not installed")
class Check(ProgramTest):
    def check(self, code, *arguments):
        done = self.modar("check", *arguments)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout

    baked = []  # the bytes of bundle()

    def bundle(self):
        """Pottery with a small texture, baked once."""
        path = self.folder / "pottery.modar"
        if not Check.baked:
            done = self.modar("bake", "--model", POTTERY, "--max-texture", 64, "--lods", 2, "-o", path, "--quiet")
            self.assertEqual(done.returncode, 0, done.stderr)
            Check.baked.append(path.read_bytes())
        path.write_bytes(Check.baked[0])
        return path

    def test_corrupt_bundles_give_documents_that_keep_their_schemas(self):
        # check_test.cpp reads all of them; starting the program with ASan takes longer than checking.
        for path in CORRUPT[::4] + [ROOT / "tests" / "corrupt" / "PATTERN_YML_DIFFERS.modar"]:
            with self.subTest(path.stem):
                expected = path.with_suffix(".txt").read_text().splitlines()
                bad = expected[-1] == "bad" or path.stem == "PATTERN_YML_DIFFERS"
                newer = path.stem in ("BUNDLE_VERSION", "BUNDLE_SECTION_REQUIRED", "BUNDLE_SECTION_VERSION")
                ours = json.loads(self.check(5 if newer else 3 if bad else 0, path, "--json"))
                jsonschema.validate(ours, OURS)
                self.assertEqual(ours["verdict"], "bad" if bad else "good")
                self.assertIn(path.stem, [issue["id"] for issue in ours["issues"]])
        for path in CORRUPT[::10]:
            with self.subTest(path.stem):
                ours = json.loads(self.modar("check", path, "--json").stdout)
                sarif = json.loads(self.modar("check", path, "--sarif").stdout)
                jsonschema.validate(sarif, SARIF)
                run = sarif["runs"][0]
                self.assertEqual([result["ruleId"] for result in run["results"]],
                                 [issue["id"] for issue in ours["issues"]])
                for result in run["results"]:
                    rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
                    self.assertEqual(rule["id"], result["ruleId"])

    def test_verdict_comes_first_and_each_issue_takes_one_line(self):
        lines = self.check(3, ROOT / "tests" / "corrupt" / "MODEL_COUNTS.modar").splitlines()
        self.assertTrue(lines[0].endswith("MODEL_COUNTS.modar: BAD"), lines[0])
        self.assertTrue(lines[1].startswith("error MODEL_COUNTS model 'octahedron' (byte "), lines[1])
        self.assertIn("; bake the bundle again", lines[1])

    def test_paths_in_sarif_are_uris(self):
        odd = self.folder / "a b%é.modar"
        shutil.copy(GOLDEN, odd)
        sarif = json.loads(self.check(0, odd, "--sarif"))
        jsonschema.validate(sarif, SARIF)
        uri = sarif["runs"][0]["artifacts"][0]["location"]["uri"]
        self.assertTrue(uri.endswith("/a%20b%25%C3%A9.modar"), uri)

    def test_sarif_keeps_the_schema_of_oasis(self):
        packed = shutil.which("npm") and subprocess.run(["npm", "pack", "--silent", "@microsoft/jest-sarif@1.0.0-beta.0"],
                                                        cwd=self.folder, capture_output=True, text=True)
        if not packed or packed.returncode != 0:
            self.skipTest("npm cannot fetch the schema")
        with tarfile.open(self.folder / packed.stdout.strip().splitlines()[-1]) as package:
            schema = json.load(package.extractfile("package/lib/schemas/sarif-2.1.0-rtm.5.json"))
        oasis = jsonschema.Draft4Validator(schema)
        for path in [GOLDEN, *CORRUPT[::15]]:
            with self.subTest(path.stem):
                oasis.validate(json.loads(self.modar("check", path, "--sarif").stdout))
        with self.assertRaises(jsonschema.ValidationError):
            oasis.validate({"version": "2.1.0", "runs": [{"results": []}]})

    def test_severities_are_weighed_anew(self):
        bad = ROOT / "tests" / "corrupt" / "MODEL_COUNTS.modar"
        warned = json.loads(self.check(0, bad, "--json", "--severity", "MODEL_COUNTS=warning"))
        self.assertEqual((warned["errors"], warned["warnings"]), (0, 1))
        self.check(3, bad, "--severity", "MODEL_COUNTS=warning", "--warnings-as-errors")
        ignored = json.loads(self.check(0, bad, "--json", "--severity", "MODEL_COUNTS=ignore"))
        self.assertEqual(ignored["issues"], [])
        warning = ROOT / "tests" / "corrupt" / "CHUNK_GRID.modar"
        self.check(0, warning)
        self.check(3, warning, "--warnings-as-errors")
        self.check(3, warning, "--severity", "CHUNK_GRID=error")
        for wrong in ("NO_SUCH_ID=error", "MODEL_COUNTS=loud", "MODEL_COUNTS"):
            self.assert_fails(self.modar("check", bad, "--severity", wrong), 1, "check.severity")

    def test_device_breaches_name_the_asset(self):
        path = self.bundle()
        good = json.loads(self.check(0, path, "--json", "--device", "desktop"))
        self.assertEqual((good["device"], good["issues"]), ("desktop", []))
        poor = json.loads(self.check(0, path, "--json", "--device", "noext"))
        jsonschema.validate(poor, OURS)
        self.assertEqual({(i["id"], i["where"]) for i in poor["issues"]},
                         {("DEVICE_ETC1", "texture 'pottery.png'"), ("DEVICE_HALF_FLOAT", "model 'pottery'")})
        self.assert_fails(self.modar("check", path, "--device", "brick"), 1, "device.unknown", "mali400")

    def test_devices_of_ones_own_come_from_files(self):
        mali = ROOT / "assets" / "devices" / "mali400.json"
        ours = json.loads(self.check(0, GOLDEN, "--json", "--device", mali))
        self.assertEqual((ours["device"], ours["issues"]),
                         ("mali400", json.loads(self.check(0, GOLDEN, "--json", "--device", "mali400"))["issues"]))
        profile = json.loads(mali.read_text())
        file = self.folder / "own.json"
        for key, wrong in (("ram_mib", 0), ("ram_mib", 1e9), ("es_version", "20"), ("screen", [480]), ("name", ""),
                           ("extensions", ["GL_A GL_B"]), ("cores", None)):
            with self.subTest(key, wrong=wrong):
                file.write_text(json.dumps({**profile, key: wrong}))
                self.assert_fails(self.modar("check", GOLDEN, "--device", file), 3, "device.file", f"'{key}'")
        file.write_text("{")
        self.assert_fails(self.modar("check", GOLDEN, "--device", file), 3, "device.file")
        self.assert_fails(self.modar("check", GOLDEN, "--device", self.folder / "none.json"), 2, "io.open")

    def test_the_proof_keeps_its_schema_and_its_goals(self):
        path = self.bundle()
        words = ("mutate", path, "--count", 1000, "--json", "--second-reader", ROOT / "scripts" / "read_bundle.py")
        done = self.lab(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        proof = json.loads(done.stdout)
        jsonschema.validate(proof, PROOF)
        self.assertEqual(proof["mutation"]["n"], 1000)
        self.assertEqual(proof["mutation"]["rate_unhashed"], 1)
        self.assertGreaterEqual(proof["mutation"]["rate_rehashed"], 0.995)
        self.assertEqual(done.stdout, self.lab(*words).stdout)
        bad = ROOT / "tests" / "corrupt" / "MODEL_COUNTS.modar"
        self.assert_fails(self.lab("mutate", bad, "--count", 10), 3, "mutate.bad")

    # What differs from its source, in shape, colour, counts or looks, is for corrupt_test.py.
    def test_sources_are_held_against_the_bundle(self):
        path = self.bundle()
        same = json.loads(self.check(0, path, "--json", "--source", POTTERY))
        jsonschema.validate(same, OURS)
        model = same["source"]["models"][0]
        self.assertTrue(model["same_bytes"])
        self.assertEqual(same["source"]["same"], ["texture 'pottery.png'"])
        self.assertGreater(model["stated_error"], 0)
        for way in ("source_to_bundle", "bundle_to_source"):
            self.assertLessEqual(model[way], model["stated_error"])

    def test_bakes_with_other_lights_and_parameters_are_told_apart(self):
        (self.folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nf 1 2 3\nf 1 3 4\n")
        for name in ("card", "one", "two"):
            picture(self.folder / f"{name}.png", 144, 108 if name == "card" else 120, mirrored=name == "two")
        (self.folder / "other").mkdir()
        shutil.copy(self.folder / "two.png", self.folder / "other/one.png")
        fast = ["--loop-views", 8, "--no-score", "--no-lods", "--no-occlusion", "--no-shadows", "--quiet"]
        baked = {}
        for light in ("one", "two", "card"):
            baked[light] = self.folder / f"lit-{light}.modar"
            done = self.modar("bake", "--model", "a.obj", "--pattern", "card.png", "--light", f"{light}.png", *fast,
                              "--parameters", "orb-500", "-o", baked[light])
            self.assertEqual(done.returncode, 0, done.stderr)
        sources = lambda *names: [word for name in ("a.obj", "card.png", *names) for word in ("--source", name)]
        found = lambda document: {issue["id"] for issue in document["issues"]}
        for light, given, ids in (("one", ["one.png"], set()), ("two", ["two.png"], set()), ("card", [], set()),
                                  ("one", ["two.png"], {"SOURCE_MISSING"}), ("one", ["other/one.png"], {"SOURCE_SCENE"})):
            done = self.modar("check", baked[light], "--json", *sources(*given))
            self.assertEqual(found(json.loads(done.stdout)), ids, (light, given))
        self.assertIn(b'"parameters": [\n      "orb-500"\n    ]', baked["one"].read_bytes())
        self.assertIn(b'"light": "one.png"', baked["one"].read_bytes())

    def look_at(self, model):
        """What `modar check --visual` says of a model that was baked by default."""
        path = self.folder / f"{model}.modar"
        done = self.modar("bake", "--model", model, "-o", path, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        looks = json.loads(self.check(0, path, "--json", "--source", model, "--visual", self.folder / f"{model}-looks"))["looks"]
        self.assertEqual(len(looks), 1)
        return looks[0]

    def test_models_are_looked_at_beside_their_sources(self):
        path = self.folder / "pottery.modar"
        done = self.modar("bake", "--model", POTTERY, "-o", path, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        looks = json.loads(self.check(0, path, "--json", "--source", POTTERY, "--visual", self.folder / "looks"))
        jsonschema.validate(looks, OURS)
        look = looks["looks"][0]
        self.assertGreater(look["ssim_worst"], 0.97)
        self.assertLess(look["delta_e_worst"], 4)
        self.assertEqual(pathlib.Path(look["picture"]).read_bytes()[1:4], b"PNG")
        # Levels are smaller and coarser from one to the next, and none is drawn where it shows.
        levels = look["levels"]
        self.assertGreater(len(levels), 1)
        for finer, level in zip([{"triangles": levels[0]["finest_triangles"], "side_px": 1e9}, *levels], levels):
            self.assertLessEqual(level["triangles"], finer["triangles"])
            self.assertLessEqual(level["side_px"], finer["side_px"])
            self.assertLess(level["difference_mean"], 1.5)
            self.assertLessEqual(level["difference_mean"], level["difference_p99"])
        self.assertLess(levels[-1]["triangles"], levels[0]["triangles"])

    def test_occlusion_is_no_difference_from_the_source(self):
        # Thirty leaves of a book, open at the sides: deep in between, light comes from few sides.
        with open(self.folder / "leaves.obj", "w") as file:
            for i in range(30):
                file.write("".join(f"v {x} {y} {0.05 * i}\n" for y in range(9) for x in range(9)))
                for k in (81 * i + 9 * y + x + 1 for y in range(8) for x in range(8)):
                    file.write(f"f {k} {k + 1} {k + 10} {k + 9}\n")
        look = self.look_at("leaves.obj")
        self.assertLess(look["delta_e_worst"], 2.5)

    def test_what_is_cut_out_is_looked_at_and_what_is_seen_through_is_not(self):
        # Right half clear, left half full: there or not. Then faint all over.
        for name, alphas in (("fence", [255] * 32 + [0] * 32), ("veil", [100] * 64), ("shade", range(64))):
            write_png(self.folder / f"{name}.png", 64, [b"".join(bytes([200, 60, 30, alpha]) for alpha in alphas)] * 64, kind=6)
            (self.folder / f"{name}.mtl").write_text(f"newmtl m\nmap_Kd {name}.png\n")
            (self.folder / f"{name}.obj").write_text(
                f"mtllib {name}.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0.2\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n")
            look = self.look_at(f"{name}.obj")
            self.assertEqual(look["judged"], name == "fence")

    def test_light_changes_across_large_faces_as_on_the_device(self):
        # A cube of 8 vertices, whose normals are those of a ball; its highlight has the light's colour.
        (self.folder / "cube.mtl").write_text("newmtl m\nKd 0.1 0.1 0.9\nKs 0.5 0.5 0.5\nNs 20\n")
        (self.folder / "cube.obj").write_text("mtllib cube.mtl\n" + "".join(
            f"v {x} {y} {z}\nvn {x} {y} {z}\n" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)) + "usemtl m\n" + "".join(
            "f " + " ".join(f"{k}//{k}" for k in face) + "\n" for face in
            ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))))
        look = self.look_at("cube.obj")
        self.assertLess(look["delta_e_worst"], 3)

    def test_white_marks_do_not_colour_what_black_plastic_reflects(self):
        # By the mean of the texture in linear light, this ball is off by 6.3.
        columns, rows = 24, 12
        write_png(self.folder / "ball.png", 256, [bytes([240 if 100 <= y < 112 else 20]) * 256 for y in range(256)])
        (self.folder / "ball.mtl").write_text("newmtl m\nKs 0.5 0.5 0.5\nNs 300\nmap_Kd ball.png\n")
        with open(self.folder / "ball.obj", "w") as file:
            file.write("mtllib ball.mtl\nusemtl m\n")
            for k in range((columns + 1) * (rows + 1)):
                turn, fall = 2 * math.pi * (k % (columns + 1)) / columns, math.pi * (k // (columns + 1)) / rows
                x, y, z = math.sin(fall) * math.cos(turn), math.cos(fall), math.sin(fall) * math.sin(turn)
                file.write(f"v {x:.5f} {y:.5f} {z:.5f}\nvn {x:.5f} {y:.5f} {z:.5f}\nvt {turn / (2 * math.pi):.5f} {1 - fall / math.pi:.5f}\n")
            for k in range(1, (columns + 1) * rows + 1):
                if k % (columns + 1):
                    file.write("f " + " ".join(f"{i}/{i}/{i}" for i in (k, k + 1, k + columns + 2, k + columns + 1)) + "\n")
        look = self.look_at("ball.obj")
        self.assertLess(look["delta_e_worst"], 4)

    def test_sheets_are_looked_at(self):
        # Flat, and seen from both sides: some of the 12 views see its back, and some hardly more than its edge.
        points = struct.pack("<20f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 3, 0, 3, 3, 0, 3) + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
        picture(self.folder / "sheet.png", 256, 256)
        (self.folder / "sheet.bin").write_bytes(points)
        (self.folder / "sheet.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"mesh": 0}, {"mesh": 0, "translation": [1.1, 0.3, 0.01]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}]}],
            "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}], "images": [{"uri": "sheet.png"}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                          {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
                          {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 80, "byteLength": 12},
                            {"buffer": 0, "byteOffset": 48, "byteLength": 32}],
            "buffers": [{"uri": "sheet.bin", "byteLength": 92}]}))
        look = self.look_at("sheet.gltf")
        self.assertGreater(look["ssim_worst"], 0.9)

    def test_what_cannot_be_seen_is_named(self):
        # Sheets that look down into the pattern, or away from the visitor: glTF says that backs are not drawn, OBJ says nothing.
        for name, corners in (("down", (0, 0, 0, 1, 0, 0, 0, 0, 1)), ("back", (0, 0, 0, 0, 1, 0, 1, 0, 0)), ("front", (0, 0, 0, 1, 0, 0, 0, 1, 0))):
            (self.folder / f"{name}.bin").write_bytes(struct.pack("<9f", *corners))
            (self.folder / f"{name}.gltf").write_text(json.dumps({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                               "max": [max(corners[i::3]) for i in range(3)]}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": f"{name}.bin", "byteLength": 36}]}))
        (self.folder / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n")
        picture(self.folder / "p.png")
        done = self.modar("bake", "down.gltf", "back.gltf", "front.gltf", "sheet.obj", "p.png", "--scene", "p=down", "--scene",
                          "p=sheet,up=y,offset=0:20:0", "--scene", "p=down", "--scene", "p=back", "--scene", "p=back,turn=40",
                          "--scene", "p=front", "--scene", "p=front,turn=40", "--scene", "p=front,turn=220", *QUICK, "-o", "o.modar")
        self.assertIn("sheet: 1 of 1 material is on open or inside-out surfaces: both sides are drawn", done.stderr)
        self.assertIn("p=sheet: its offset is 20 times the pattern's longer side", done.stderr)
        self.assertEqual(done.stderr.count("p=down: nothing of the model is drawn"), 1)
        self.assertEqual([done.stderr.count(f"p={name}: nothing of the model is drawn") for name in ("back", "front")], [1, 1])
        self.assertEqual(done.stderr.count("p=down: another scene has the same model at the same place"), 1)
        self.assertNotIn("p=sheet: nothing", done.stderr)
        said = self.check(0, "o.modar")
        self.assertIn("warning MODEL_UNSEEN model 'down'", said)
        self.assertEqual([said.count(f"model '{name}'") for name in ("back", "front")], [2, 1])
        self.assertEqual(self.modar("report", "o.modar", "-o", "o.html", "--quiet").returncode, 0)
        self.assertEqual((self.folder / "o.html").read_text(encoding="utf-8").count("MODEL_UNSEEN"), said.count("MODEL_UNSEEN"))
        self.assertNotIn("model 'sheet'", said)

    def test_rough_models_are_looked_at_in_many_samples(self):
        # Where every sample falls on another triangle, pictures of 16 samples a pixel differ by 2.75 of 255.
        side, rough = 60, random.Random(1)
        with open(self.folder / "rough.obj", "w") as file:
            for i in range(side * side):
                file.write(f"v {i % side} {i // side} {0.4 * rough.random():.4f}\n")
            for i in range(1, side * (side - 1)):
                if i % side:
                    file.write(f"f {i} {i + 1} {i + side + 1} {i + side}\n")
        look = self.look_at("rough.obj")
        levels = look["levels"]
        self.assertGreater(levels[0]["side_px"], 5)
        self.assertLess(max(level["difference_mean"] for level in levels), 2.5)  # noise of single vertices

    @unittest.skipUnless(os.environ.get("MODAR_SOAK", "0") != "0", "seconds under ASan: with --all")
    def test_patterns_are_tracked_in_rendered_views(self):
        path = self.folder / "cover.modar"
        done = self.modar("bake", "--pattern", COVER, "-o", path, "--quiet", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        document = json.loads(self.check(0, path, "--json", "--source", COVER, "--pose", "--pose-views", 1))
        jsonschema.validate(document, OURS)
        pose = document["poses"][0]
        self.assertEqual(len(pose["steps"]), 14)
        front = next(s for s in pose["steps"] if s["area"] == 1 and s["tilt_deg"] == 0)
        self.assertEqual((front["views"], front["right"]), (1, 1))
        self.assertLess(front["corner_px"], 5)
        self.assertLess(pose["rotation_deg"], 3)
        self.assertLess(pose["area_low"], 1)

    def test_bakes_are_proven_to_be_reproducible(self):
        out = self.folder / "a.modar"
        picture(self.folder / "card.png")
        done = self.modar("bake", "--model", POTTERY, "--pattern", "card.png:210mm", "--max-texture", 64, "--no-lods", "-o", out, "--jobs", 2,
                          "--prove-reproducible")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("a second bake elsewhere gave the same bytes", done.stderr)
        self.check(0, out)

    def test_schemas_refuse_what_is_wrong(self):
        good = {"verdict": "good", "errors": 0, "warnings": 0, "device": None, "issues": [], "left_out": {}}
        jsonschema.validate(good, OURS)
        for change in ({"verdict": "fine"}, {"errors": 1}, {"issues": [{"id": "X"}]}):
            with self.assertRaises(jsonschema.ValidationError):
                jsonschema.validate({**good, **change}, OURS)
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.validate({"version": "2.1.0", "runs": [{"tool": {}, "results": []}]}, SARIF)


if __name__ == "__main__":
    unittest.main()
