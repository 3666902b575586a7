"""Projects: modar.toml, the parts that are baked again, the cache, `modar init`."""
import base64
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import time
import tomllib
import unittest

from programs import BIN, COVER, POTTERY, ROOT, STATUE, ProgramTest, picture, needs

SCHEMA = json.loads((ROOT / "bake/project/modar.schema.json").read_text())
# Few views of a pattern, no scores, one level: enough for tests.
LIT = "loop-views = 8\nscore = false\nlods = 1\nparameters = \"none\"\n"
FAST = LIT + "occlusion = false\nshadows = false\n"
LIT_DIRECT = ["--loop-views", "8", "--no-score", "--no-lods", "--parameters", "none", "--quiet"]
KEEP = "[[bundle]]\nname = \"museum\"\nmodels = \"*\"\npatterns = \"*\"\n"
DIRECT = [*LIT_DIRECT, "--no-occlusion", "--no-shadows"]

CUBE = """mtllib cube.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
usemtl wall
f 1/1 2/2 3/3
f 1/1 3/3 4/2
"""
CUBE_MTL = "newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n"


class ProjectTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.place = self.folder / "museum"
        (self.place / "models").mkdir(parents=True)
        (self.place / "pictures").mkdir()
        for name in ("a", "b"):
            text = CUBE if name == "a" else CUBE.replace("1 1 0", "1 2 0").replace("mtllib cube.mtl\n", "")
            (self.place / f"models/{name}.obj").write_text(text)
        (self.place / "models/cube.mtl").write_text(CUBE_MTL)
        shutil.copy(ROOT / "assets/models/bust.png", self.place / "models/wall.png")
        picture(self.place / "pictures/a.png", 144, 108)
        self.write("[bake]\n" + FAST + "[[model]]\nfile = \"models/*.obj\"\n[[pattern]]\nfile = \"pictures/*\"\n")

    def write(self, text):
        """Most tests bake models that no pattern shows: where the text says nothing of bundles, all are kept."""
        keep = "" if any(table in text for table in ("[[scene]]", "[[bundle]]", "[project]")) else KEEP
        (self.place / "modar.toml").write_text(text + keep)

    def bake(self, *arguments, cwd=None):
        done = self.modar("bake", "--json", *arguments, cwd=cwd or self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.told = done.stderr
        return json.loads(done.stdout)

    def never_shown(self, *words):
        return [finding["message"] for finding in self.bake(*words)["findings"] if finding["id"] == "project.never-shown"]

    def states(self, report):
        return {asset["name"] + asset["tier"]: asset["state"] for asset in report["assets"]}

    def findings(self, report):
        return [finding["id"] for finding in report["findings"]]

    def reasons(self, *arguments):
        return {asset["name"]: asset["reason"] for asset in self.bake("--dry-run", *arguments)["assets"]
                if asset["state"] == "stale"}


class Files(ProjectTest):
    def test_one_model_and_one_pattern_are_the_bytes_of_a_single_bake(self):
        cover = self.folder / "cover.png"
        picture(cover)
        self.write("[project]\nname = \"both\"\n[bake]\n" + LIT + f"[[model]]\nfile = \"{STATUE}\"\n"
                   f"[[model]]\nfile = \"{POTTERY}\"\n[[pattern]]\nfile = \"{cover}\"\nwidth = \"210mm\"\n"
                   "[[scene]]\npattern = \"cover\"\nmodel = \"pottery\"\nup = \"y\"\nscale = 0.8\noffset = [0, 0.1, 0]\n"
                   f"light = \"{cover}\"\n"
                   "[[bundle]]\nname = \"one\"\npatterns = \"cov*\"\n")
        self.bake("--outside")
        direct = self.folder / "direct.modar"
        done = self.modar("bake", "--model", POTTERY, "--pattern", f"{cover}:210mm", "--scene",
                          f"cover=pottery,up=y,scale=0.8,offset=0:0.1:0,light={cover}", *LIT_DIRECT, "-o", direct)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.place / "out/one.modar").read_bytes(), direct.read_bytes())
        checked = self.modar("check", direct, "--json", "--source", "modar.toml", cwd=self.place)
        self.assertEqual(json.loads(checked.stdout)["issues"], [])  # its light is its pattern

    def test_several_assets_are_as_baked_alone(self):
        cover, painting = self.folder / "cover.png", self.folder / "painting.png"
        picture(cover)
        picture(painting, 150, 160)
        self.write("[bake]\n" + FAST + f"[[model]]\nfile = [\"{STATUE}\", \"{POTTERY}\", \"models/*.obj\"]\n"
                   f"[[pattern]]\nfile = [\"{cover}\", \"{painting}\"]\n")
        self.bake("--outside")
        bundle = self.place / "out/museum.modar"
        self.assertEqual(self.modar_json("check", bundle)["errors"], 0)
        whole = self.modar_json("inspect", bundle)
        self.assertEqual([model["name"] for model in whole["models"]], ["statue", "pottery", "a", "b"])
        for model, path in zip(whole["models"], [STATUE, POTTERY]):
            alone = self.folder / "alone.modar"
            self.modar("bake", "--model", path, "-o", alone, *DIRECT)
            self.assertEqual(model, self.modar_json("inspect", alone)["models"][0])
        for pattern, path in zip(whole["patterns"], [cover, painting]):
            self.modar("bake", "--pattern", path, "-o", alone, *DIRECT)
            self.assertEqual(pattern, self.modar_json("inspect", alone)["patterns"][0])

    def test_equal_textures_are_stored_once(self):
        shutil.copy(self.place / "models/a.obj", self.place / "models/b.obj")
        self.bake()
        self.assertEqual(len(self.modar_json("inspect", self.place / "out/museum.modar")["textures"]), 1)

    def test_tiers_gates_and_texts(self):
        text = (self.place / "modar.toml").read_text()
        self.write(text + "[[tier]]\nname = \"low\"\nmax-texture = 64\n[[tier]]\nname = \"high\"\n"
                   "[[scene]]\npattern = \"a\"\nmodel = \"a\"\ntext.en = \"A house.\"\ntext.de = \"Ein Haus.\"\n")
        states = self.states(self.bake())
        self.assertEqual(set(states.values()), {"baked"})
        self.assertNotIn("ahigh", [name for name in states if name.startswith("picture")])
        sides = [self.modar_json("inspect", self.place / f"out/museum-{tier}.modar")["textures"][0]["width"]
                 for tier in ("low", "high")]
        self.assertEqual(sides[0], 64)
        self.assertGreater(sides[1], 64)
        words = (self.place / "out/museum-low.modar").read_bytes()
        self.assertIn("Ein Haus.".encode(), words)
        self.assertEqual(self.modar("check", self.place / "out/museum-low.modar").returncode, 0)
        for gate, value in (("min-psnr", 98), ("max-bytes", 1000), ("min-grade", '"A"')):
            shutil.rmtree(self.place / "out", ignore_errors=True)
            self.write(text + f"[gates]\n{gate} = {value}\n")
            self.assert_fails(self.modar("bake", cwd=self.place), 3, "project.gate")
            self.assertEqual(list((self.place / "out").glob("*")), [])

    def test_what_no_action_shows_is_named(self):
        scene = ('[bake]\n' + FAST + '[[model]]\nfile = "models/b.obj"\n[[pattern]]\nfile = "pictures/a.png"\n'
                 '[[scene]]\npattern = "a"\nmodel = "b"\nname = "pot"\nhidden = true\n')
        action = '[[scene.action]]\non = "found"\ndo = "%s pot"\n'
        for text, told in ((scene, True), (scene + action % "show", False), (scene + action % "toggle", False), (scene + action % "hide", True)):
            with self.subTest(text):
                self.write(text)
                self.assertEqual("node.never-shown" in self.findings(self.bake()), told)

    def test_globs(self):
        (self.place / "models/deep/er").mkdir(parents=True)
        shutil.copy(self.place / "models/b.obj", self.place / "models/deep/er/c.obj")
        self.write("[bake]\n" + FAST + "[[model]]\nfile = [\"models/**/*.obj\", \"!models/a*\"]\n")
        report = self.bake("--dry-run")
        self.assertEqual([asset["name"] for asset in report["assets"]], ["b", "c"])
        self.assertFalse((self.place / ".modar").exists())
        self.assertFalse((self.place / "out").exists())

    def test_mistakes_name_their_line_and_cure(self):
        mistakes = [
            ("[bake]\neffrot = \"best\"\n", "modar.toml:2:1", "did you mean 'effort'", "project.key"),
            ("[modle]\n", "modar.toml:1", "did you mean 'model'", "project.key"),
            ("[bake]\neffort = \"better\"\n", "modar.toml:2", "fast, good, best", "project.value"),
            ("[bake]\nlods = 99\n", "modar.toml:2", "1 to 12", "project.value"),
            ("[bake]\nmipmaps = 1\n", "modar.toml:2", "true or false", "project.value"),
            ("[bake]\ndevice = \"ace3\"\n", "modar.toml:2", "ace2", "project.value"),
            ("[[model]]\nfile = \"*.fbx\"\n", "modar.toml:2", "'*.fbx'", "project.no-match"),
            ("[[model]]\nwidth = 3\n", "modar.toml:2", "there is no key 'width'", "project.key"),
            ("[[model]]\nfile = [\"models/a.obj\", \"models/a.obj\"]\n", "modar.toml:2", "models/a.obj is listed twice", "project.same-name"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\n[[scene]]\npattern = \"aa\"\n", "modar.toml:4", "did you mean 'a'",
             "project.scene-unknown"),
            ("[bake\n", "modar.toml:1", "project.toml"),
            ("[[pattern]]\nfile = \"pictures\\a.png\"\n", "modar.toml:2", "write / for \\", "project.toml"),
            ("[[pattern]]\nfile = \u201cpictures/a.png\u201d\n", "modar.toml:2", "straight quotes", "project.toml"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\nwidth = 210\n", "modar.toml:3", "as in \"210mm\"", "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\nwidth = \"8 inches\"\n", "modar.toml:3", "write 8in", "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\ncopies = 17\n", "modar.toml:3", "from 1 to 16", "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\ncopies = 2.5\n", "modar.toml:3", "from 1 to 16", "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\nwidth = 210mm\n", "modar.toml:3", "values with a unit in quotes", "project.toml"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\nwidth = \"210\"\n", "modar.toml:3", 'width = "..."', "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\nwidth = 2\n", "modar.toml:2", 'close the text with "', "project.toml"),
            ("[[scene]]\nturn = 0:0:90\n", "modar.toml:2", '"0:0:90" or [0, 0, 90]', "project.toml"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\nheight = \"20cm\"\n", "modar.toml:3", "state the width alone", "project.value"),
            ("[[pattern]]\nfile = \"pictures/a.png\"\ncorners = [[0, 0], [9, 9], [9, 0], [0, 9]]\n", "modar.toml:3", "clockwise",
             "project.value"),
            ("[[tier]]\nname = \"low\"\n[[tier]]\nname = \"low\"\n", "modar.toml:4", "give each a name of its own", "project.value"),
            ("[[bundle]]\nname = \"low\"\n[[bundle]]\nname = \"low\"\n", "modar.toml:4", "give each a name of its own", "project.value"),
            ("[tier]\nname = \"low\"\n", "modar.toml:1", "[[tier]]", "project.value"),
        ]
        for text, *words in mistakes:
            with self.subTest(text=text):
                self.write(text)
                self.assert_fails(self.modar("bake", cwd=self.place), 3, *words)
        (self.place / "modar.toml").write_text("[bake]\n", "utf-16")
        self.assert_fails(self.modar("bake", cwd=self.place), 3, "save it as UTF-8", "project.toml")
        self.assert_fails(self.modar("bake", cwd=self.folder), 2, "modar.toml", "modar init", "project.open")
        for option in ("--effort=fast", "-ox.modar", "--output=x.modar"):
            self.assert_fails(self.modar("bake", option, cwd=self.place), 1, "bake.project-option")
        self.assert_fails(self.modar("bake", "--model", POTTERY, "-o", "x.modar", "--explain"), 1, "bake.project-option")
        self.assert_fails(self.modar("bake", "--model", POTTERY), 1, "-o")

    def test_a_dry_run_refuses_what_the_bake_refuses(self):
        head = "[[model]]\nfile = \"models/b.obj\"\n[[pattern]]\nfile = \"pictures/a.png\"\n[[scene]]\npattern = \"a\"\n"
        for scene in ("model = \"b\"\n", "[[scene.picture]]\nfile = \"pictures/a.png\"\n"):
            self.write(head + scene + "height = \"80mm\"\n")
            for words in ((), ("--dry-run",)):
                with self.subTest(scene=scene, words=words):
                    self.assert_fails(self.modar("bake", *words, cwd=self.place), 3, "scene.no-width")
        # A list, as `modar init` wrote it once.
        self.write("[bake]\nparameters = [\"none\"]\n" + head + "model = \"b\"\n")
        self.assertEqual(self.modar("bake", "--dry-run", cwd=self.place).returncode, 0)

    def test_the_schema_knows_the_keys_of_the_program(self):
        tables = {key: value.get("items", value)["properties"] for key, value in SCHEMA["properties"].items()}
        tables[""] = SCHEMA["properties"]
        for table, properties in tables.items():
            head = "" if table == "" else f"[[{table}]]\n" if SCHEMA["properties"][table]["type"] == "array" else f"[{table}]\n"
            self.write(head + "qqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqq = 1\n")
            done = self.modar("bake", cwd=self.place)
            known = done.stderr.split("the keys are ")[1].split(" [project.key]")[0].split(", ")
            self.assertEqual(sorted(known), sorted(properties), table)

    def test_the_schema_is_that_of_the_program(self):
        self.assertEqual(json.loads(self.modar("init", "--schema").stdout), SCHEMA,
                         "stale: modar init --schema > bake/project/modar.schema.json")

    def test_the_schema_and_the_program_refuse_the_same(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        jsonschema.Draft7Validator.check_schema(SCHEMA)
        head = "[[model]]\nfile = \"models/*.obj\"\n[[pattern]]\nfile = \"pictures/*\"\n"
        for text in ("[bake]\nmax-texture = 3", "[bake]\nmax-texture = 8192", "[bake]\nlods = 13", "[bake]\nlods = 12",
                     "[bake]\nloop-views = 0", "[bake]\nunit = \"ell\"", "[bake]\nunit = \"ft\"", "[bake]\nscore = \"no\"",
                     "[bake]\nparameters = [\"none\"]", "[bake]\nparameters = []", "[bake]\nparameters = 4", "[project]\nname = 3",
                     "[bake]\nlods = 2.5",
                     "[[scene]]\npattern = \"a\"\nmodel = \"a\"\nscale = 0", "[[scene]]\npattern = \"a\"\nmodel = \"a\"\nup = \"-y\"",
                     "[[scene]]\npattern = \"a\"\nmodel = \"a\"\noffset = [1, 2]", "[[tier]]\nlods = 1",
                     "[[bundle]]\npatterns = \"a\"", "[gates]\nmin-psnr = -1", "[gates]\nmin-psnr = 30"):
            with self.subTest(text=text):
                self.write(head + text + "\n")
                valid = jsonschema.Draft7Validator(SCHEMA).is_valid(tomllib.loads(head + text))
                self.assertEqual(self.modar("bake", "--dry-run", cwd=self.place).returncode == 0, valid)


class Again(ProjectTest):
    def test_nothing_changed_nothing_is_done(self):
        self.assertEqual(self.states(self.bake()), {"a": "baked", "b": "baked"} | {"a": "baked"})
        bundle = self.place / "out/museum.modar"
        before = bundle.stat()
        report = self.bake()
        self.assertEqual({asset["state"] for asset in report["assets"]}, {"fresh"})
        self.assertFalse(report["bundles"][0]["written"])
        self.assertEqual((before.st_ino, before.st_mtime_ns), (bundle.stat().st_ino, bundle.stat().st_mtime_ns))
        self.assertIn("3 assets, 3 up to date", self.told)

    def test_one_changed_file_bakes_one_asset(self):
        self.bake()
        for change, name, words in [
                ("models/b.obj", "b", "models/b.obj changed"),
                ("models/cube.mtl", "a", "models/cube.mtl changed"),
                ("models/wall.png", "a", "models/wall.png changed")]:
            path = self.place / change
            path.write_bytes(path.read_bytes() + b"\n# more")
            self.assertEqual(self.reasons(), {name: words})
            report = self.bake("--explain")
            self.assertEqual([asset["name"] for asset in report["assets"] if asset["state"] == "baked"], [name])
            self.assertIn(f"baked   {name}: {words}", self.told)
        (self.place / "models/b.obj").touch()  # a new time, the same bytes
        self.assertEqual(self.reasons(), {})

    def test_settings_bake_what_they_concern(self):
        self.bake()
        text = (self.place / "modar.toml").read_text()
        self.write(text.replace("lods = 1", "lods = 2"))
        self.assertEqual(sorted(self.reasons()), ["a", "b"])
        self.write(text.replace("shadows = false", "shadows = true"))
        self.assertEqual(self.reasons(), {})
        self.write(text.replace("loop-views = 8", "loop-views = 9"))
        self.assertEqual(self.reasons(), {"a": "its settings in modar.toml changed"})
        self.write(text + "[[scene]]\npattern = \"a\"\nmodel = \"b\"\n")
        report = self.bake()
        self.assertEqual({asset["state"] for asset in report["assets"]}, {"cached"})
        self.assertTrue(report["bundles"][0]["written"])

    def test_light_concerns_the_bundle_alone(self):
        room = self.place / "room.png"
        picture(room, 64, 32)
        self.write("[project]\nlight = \"room.png\"\n" + (self.place / "modar.toml").read_text())
        self.bake("--depfile", "deps")
        self.assertIn("room.png", (self.place / "deps").read_text())
        dark = (self.place / "out/museum.modar").read_bytes()
        picture(room, 32, 64)
        report = self.bake()
        self.assertEqual({asset["state"] for asset in report["assets"]}, {"cached"})
        self.assertNotEqual((self.place / "out/museum.modar").read_bytes(), dark)
        room.unlink()
        self.assert_fails(self.modar("bake", cwd=self.place), 3, "modar.toml:2", "'room.png'", "project.no-match")

    def test_a_missing_file_is_noticed_when_it_comes(self):
        wall = (self.place / "models/wall.png").read_bytes()
        (self.place / "models/wall.png").unlink()
        first = self.bake()
        self.assertIn("mtl.missing-map", self.findings(first))
        self.assertEqual({asset["state"] for asset in self.bake()["assets"]}, {"fresh"})
        (self.place / "models/wall.png").write_bytes(wall)
        self.assertEqual(self.reasons(), {"a": "models/wall.png is there now"})
        self.assertNotIn("mtl.missing-map", self.findings(self.bake()))

    def test_a_missing_file_is_noticed_under_the_names_that_the_reader_takes(self):
        wall = (self.place / "models/wall.png").read_bytes()
        (self.place / "models/wall.png").unlink()
        (self.place / "models/cube.mtl").write_text(CUBE_MTL.replace("wall.png", "C:\\Users\\Ann\\Wall.PNG"))
        self.assertIn("mtl.missing-map", self.findings(self.bake()))
        (self.place / "models/wall.png").write_bytes(wall)
        self.assertEqual(self.reasons(), {"a": "models/wall.png is there now"})
        self.assertNotIn("mtl.missing-map", self.findings(self.bake()))
        self.assertEqual({asset["state"] for asset in self.bake()["assets"]}, {"fresh"})
        # "b" names no material file: pictures are its texture by their names, and b.mtl is its material file.
        for name in ("b_albedo.png", "B.mtl"):
            (self.place / "models" / name).write_bytes(wall if name.endswith("png") else CUBE_MTL.encode())
            self.assertEqual(self.reasons(), {"b": f"models/{name} is there now"})
            self.bake()
            self.assertEqual({asset["state"] for asset in self.bake()["assets"]}, {"fresh"})
        (self.place / "models/b_albedo.png").unlink()
        self.assertEqual(self.reasons(), {"b": "models/b_albedo.png is gone"})

    def test_a_cached_asset_says_again_what_is_wrong_with_it(self):
        (self.place / "models/wall.png").unlink()
        self.bake()
        shutil.rmtree(self.place / "out")
        again = self.bake()
        self.assertEqual({asset["state"] for asset in again["assets"]}, {"cached"})
        self.assertIn("mtl.missing-map", self.findings(again))

    def test_a_stage_counts_assets_only_where_not_all_are_baked(self):
        def stages():
            done = self.modar("bake", "--quiet", "--progress-json", cwd=self.place)
            return {json.loads(line)["stage"] for line in done.stderr.splitlines() if line.startswith("{")}
        self.assertEqual(stages(), {"bake 3 assets"})
        (self.place / "models/a.obj").write_text((self.place / "models/a.obj").read_text() + "# new\n")
        self.assertEqual(stages(), {"bake 1 of 3 assets"})

    def test_one_bad_file_fails_alone(self):
        (self.place / "models/b.obj").write_text("no model")
        done = self.modar("bake", "--json", cwd=self.place)
        self.assertEqual(done.returncode, 3)
        report = json.loads(done.stdout)
        self.assertEqual([e["code"] for e in report["errors"]], ["obj.no-faces"])
        self.assertFalse((self.place / "out/museum.modar").exists())
        shutil.copy(self.place / "models/a.obj", self.place / "models/b.obj")
        self.assertEqual(sorted(a["state"] for a in self.bake()["assets"]), ["baked", "cached", "cached"])

    def test_what_make_is_told(self):
        self.bake("--depfile", "deps")
        text = (self.place / "deps").read_text().replace("\\\n", " ")
        target, inputs = text.split(" :")
        self.assertEqual(target, "out/museum.modar")
        self.assertEqual(sorted(inputs.split()), sorted(
            ["modar.toml", "models/a.obj", "models/b.obj", "models/cube.mtl", "models/wall.png", "pictures/a.png"]))


class Strangers(ProjectTest):
    """Projects that somebody else wrote: they get the files of their folder, and write into it."""

    def refused(self, text, *words, code=3):
        self.write(text)
        before = sorted(p for p in self.folder.rglob("*") if ".modar" not in p.parts)
        done = self.modar("bake", "--quiet", cwd=self.place)
        self.assertEqual(done.returncode, code, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertEqual(sorted(p for p in self.folder.rglob("*") if ".modar" not in p.parts), before)
        return done.stderr

    def table(self, project="", model="models/*.obj", rest=""):
        return f"[project]\n{project}\n[bake]\n{FAST}[[model]]\nfile = \"{model}\"\n{rest}"

    def test_names_lead_nowhere(self):
        for name in ("../../evil", "/tmp/evil", "..", ".hidden", "a\\u001b[2Jb", ""):
            self.refused(self.table(f'name = "{name}"'), "project.value", "modar.toml:2:")
            self.refused(self.table(rest=f'[[bundle]]\nname = "{name}"\n'), "project.value")
            self.refused(self.table(rest=f'[[tier]]\nname = "{name}"\n'), "project.value")

    def test_paths_stay_in_the_folder(self):
        shutil.copytree(self.place / "models", self.folder / "others")
        (self.place / "models/link.obj").symlink_to(self.folder / "others/b.obj")
        (self.place / "linked").symlink_to(self.folder / "others")
        shutil.copy(self.place / "pictures/a.png", self.folder / "room.png")
        for project in ('out = "../elsewhere"', 'out = "/tmp/elsewhere"', 'cache = "../cache"', 'out = "linked/out"',
                        'light = "../room.png"'):
            self.refused(self.table(project), "project.outside", "--outside", "modar.toml:2:")
        for model in ("../others/b.obj", f"{self.folder}/others/b.obj", "models/link.obj", "linked/b.obj", "../o*/b.obj"):
            self.refused(self.table(model=model), "project.outside", "--outside")
            self.write(self.table(model=model))
            self.bake("--outside", "--dry-run")
        (self.place / "models/link.obj").unlink()
        (self.place / ".modar").symlink_to(self.folder / "others")
        self.refused(self.table(), "project.outside")

    def test_what_models_name_outside_the_folder_is_left_out(self):
        """Textures, material files and images, by dots, whole paths and links: a warning, and the bundle of a model without them."""
        outside = self.folder / "private"
        outside.mkdir()
        shutil.copy(self.place / "models/wall.png", outside / "private.png")
        (outside / "private.mtl").write_text(CUBE_MTL.replace("wall.png", f"{outside}/private.png"))
        (self.place / "models/link.png").symlink_to(outside / "private.png")
        (self.place / "models/link.mtl").symlink_to(outside / "private.mtl")
        ply = ("ply\nformat ascii 1.0\ncomment TextureFile {}\nelement vertex 3\n" + "".join(f"property float {each}\n" for each in "xyzst") +
               "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n3 0 1 2\n")
        buffer = base64.b64encode(struct.pack("<9f6f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0, 1, 1)).decode()
        gltf = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                           "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64," + buffer}],
                           "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
                           "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                                         {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}],
                           "images": [{"uri": "NAME"}], "textures": [{"source": 0}], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
                           "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}]}).replace("NAME", "{}")
        cases = {"map.obj": CUBE.replace("cube.mtl", "map.mtl"), "library.obj": CUBE.replace("cube.mtl", "{}"), "scan.ply": ply, "model.gltf": gltf}
        for file, text in cases.items():
            kind = "mtl" if file == "library.obj" else "png"
            for name in (f"../../private/private.{kind}", f"link.{kind}", *([] if file == "model.gltf" else [f"{outside}/private.{kind}"])):
                (self.place / "models/map.mtl").write_text(CUBE_MTL.replace("wall.png", name))
                (self.place / "models" / file).write_text(text.replace("{}", name))
                self.write(self.table('name = "m"', model=f"models/{file}"))
                for options, textures in (([], 0), (["--outside"], 1)):
                    report = self.bake(*options)
                    told = [one for one in report["findings"] if "outside the project's folder" in one["message"]]
                    self.assertEqual((len(told), *({"--outside" in one["cure"] for one in told})), (1, True) if textures == 0 else (0,), (file, name, report["findings"]))
                    self.assertEqual(len(self.modar_json("inspect", self.place / "out/m.modar")["textures"]), textures, (file, name))
        shutil.copy(outside / "private.png", self.place / "models")  # as the warning says
        (self.place / "models/model.gltf").write_text(gltf.replace("{}", "../../private/private.png"))
        self.bake()
        self.assertEqual(len(self.modar_json("inspect", self.place / "out/m.modar")["textures"]), 1)

    @needs("report")
    def test_pipes_are_no_inputs(self):
        def piped(name):
            path = self.place / name
            path.unlink(missing_ok=True)
            os.mkfifo(path)  # nobody writes to it: what opens it waits for ever
            return path
        for name, words in (("models/a.obj", ["--model", "models/a.obj"]), ("x.glb", ["--model", "x.glb"]), ("x.ply", ["--model", "x.ply"]),
                            ("x.stl", ["--model", "x.stl"]), ("x.png", ["--pattern", "x.png"]), ("x.jpg", ["--pattern", "x.jpg"])):
            piped(name)
            done = self.modar("bake", *words, "-o", "y.modar", cwd=self.place)
            self.assertIn(done.returncode, (2, 3), (name, done.stderr))
            self.assertIn("not a regular file", done.stderr, name)
        (self.place / "models/a.obj").unlink()
        (self.place / "models/a.obj").write_text(CUBE)
        for name in ("models/cube.mtl", "models/wall.png"):
            piped(name)
            done = self.modar("bake", "--model", "models/a.obj", "-o", "y.modar", *DIRECT, cwd=self.place)
            self.assertIn(done.returncode, (0, 2, 3), (name, done.stderr))
        gltf = {"asset": {"version": "2.0"}, "buffers": [{"uri": "x.bin", "byteLength": 12}], "images": [{"uri": "y.png"}],
                "bufferViews": [{"buffer": 0, "byteLength": 12}], "textures": [{"source": 0}],
                "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]}
        (self.place / "z.gltf").write_text(json.dumps(gltf))
        for name in ("x.bin", "y.png"):
            piped(name)
        done = self.modar("bake", "--model", "z.gltf", "-o", "y.modar", cwd=self.place)
        self.assertIn(done.returncode, (2, 3), done.stderr)
        for command in (["check", "p.modar"], ["inspect", "p.modar"], ["report", "p.modar"]):
            piped("p.modar")
            self.assertIn(self.modar(*command, cwd=self.place).returncode, (1, 2, 3), command)
        self.assertEqual(self.modar("init", "--force", cwd=self.place).returncode, 0)

    def test_no_name_commands_the_terminal(self):
        escape = "\x1b]0;owned\x07\x1b[2J"
        (self.place / "models/a.obj").write_text(CUBE.replace("usemtl wall", f"usemtl w{escape}"))
        evil = self.place / f"models/{escape}.obj"
        evil.write_text(CUBE.replace("f 1/1", "f 9/1"))
        for words in (["bake", "--model", "models/a.obj", "-o", "y.modar", *DIRECT[:-1], "--notes"],
                      ["bake", "--model", evil, "-o", "y.modar"], ["check", f"{escape}.modar"], ["inspect", f"{escape}"],
                      ["bake", "--model", f"{escape}.xyz", "-o", "y.modar"], ["bake", f"--{escape}"], [escape]):
            done = self.modar(*words, cwd=self.place)
            self.assertNotIn("\x1b", done.stderr + done.stdout, words)
            self.assertNotIn("\x07", done.stderr + done.stdout, words)
        self.refused(self.table(model="models/*.obj"), "control characters")


class Cache(ProjectTest):
    def parts(self, cache):
        return sorted(pathlib.Path(cache).rglob("*.modar"))

    def leftovers(self):
        return [p.name for p in self.folder.rglob("*")
                if p.is_file() and p.suffix not in (".modar", ".json", ".txt", ".TAG", ".toml", ".obj", ".mtl", ".png")]

    def test_damaged_entries_heal(self):
        cache = self.folder / "cache"
        self.bake("--cache", cache)
        good = (self.place / "out/museum.modar").read_bytes()
        for number, damage in enumerate([lambda b: b[:-100], lambda b: b[:-10] + bytes([b[-10] ^ 1]) + b[-9:],
                                         lambda b: b"", lambda b: bytes(200) + b[200:]]):
            part = self.parts(cache)[number % 3]
            part.write_bytes(damage(part.read_bytes()))
            shutil.rmtree(self.place / "out")
            report = self.bake("--cache", cache, "--explain")
            self.assertEqual(sorted(a["state"] for a in report["assets"]), ["baked", "cached", "cached"])
            self.assertIn("was damaged", self.told)
            self.assertEqual((self.place / "out/museum.modar").read_bytes(), good)

    def test_show_verify_and_prune(self):
        cache = self.folder / "cache"
        self.bake("--cache", cache)
        shown = self.modar_json("cache", "show", "--cache", cache)
        files = self.parts(cache)
        self.assertEqual(shown["entries"], 3)
        self.assertEqual(shown["bytes"], sum(f.stat().st_size + f.with_suffix(".json").stat().st_size for f in files))
        self.assertEqual(self.modar_json("cache", "verify", "--cache", cache)["damaged"], [])
        notes = files[0].with_suffix(".json")
        notes.write_text(notes.read_text().replace("0", "1", 1))
        done = self.modar("cache", "verify", "--cache", cache)
        self.assertEqual(done.returncode, 3)
        self.assertIn(files[0].name, done.stdout)
        self.assertEqual(len(self.parts(cache)), 2)
        would = self.modar("cache", "prune", "--cache", cache)
        self.assertEqual((would.returncode, len(self.parts(cache))), (0, 2))
        self.assertRegex(would.stdout, r"nothing removed of 2 entries, .*\n(.*\n)+  --size 0 +would remove 2 entries")
        os.utime(files[2], (1, 1))
        left_behind = files[1].with_name(files[1].name + ".host.77")
        left_behind.write_text("half of it")
        os.utime(left_behind, (1, 1))
        self.modar("cache", "prune", "--size",
                   files[1].stat().st_size + files[1].with_suffix(".json").stat().st_size, "--cache", cache)
        self.assertNotIn(files[2], self.parts(cache))
        self.assertFalse(left_behind.exists())
        self.modar("cache", "prune", "--size", 0, "--cache", cache)
        self.assertEqual(self.parts(cache), [])
        self.assert_fails(self.modar("cache", "show", "--cache", self.folder / "none"), 2, "cache.folder")

    def states_with(self, cache, *options):
        """Bakes again without the project's own state, but for the cache."""
        for name in ("out", ".modar"):
            shutil.rmtree(self.place / name, ignore_errors=True)
        report = self.bake("--cache", cache, "--explain", *options)
        self.assertEqual((self.place / "out/museum.modar").read_bytes(), self.good)
        return sorted(asset["state"] for asset in report["assets"])

    def test_an_entry_is_that_of_its_key_and_name(self):
        cache = self.folder / "cache"
        self.bake("--cache", cache)
        self.good = (self.place / "out/museum.modar").read_bytes()
        one, two = [p for p in self.parts(cache) if b'"name": "a.png"' not in p.with_suffix(".json").read_bytes()]
        self.assertEqual({json.loads(p.with_suffix(".json").read_text().partition("\n")[2])["name"] for p in (one, two)},
                         {"a.obj", "b.obj"})

        def exchange(suffix):
            first, second = one.with_suffix(suffix), two.with_suffix(suffix)
            kept = first.read_bytes()
            first.write_bytes(second.read_bytes())
            second.write_bytes(kept)

        for suffixes in ([".modar"], [".modar", ".json"], [".json"]):
            for suffix in suffixes:
                exchange(suffix)
            self.assertEqual(self.states_with(cache), ["baked", "baked", "cached"], suffixes)
            self.assertIn("was damaged" if suffixes == [".modar"] else "another part", self.told)
            for suffix in suffixes:
                exchange(suffix)
            damaged = self.modar("cache", "verify", "--cache", cache)
            self.assertEqual(damaged.returncode, 3)
            for part in (one, two):
                self.assertIn(f"{part}: damaged, removed", damaged.stdout)
            self.assertEqual(self.states_with(cache), ["baked", "baked", "cached"])
        lists = sorted(cache.rglob("*.txt"))
        lists[0].write_bytes(lists[1].read_bytes())  # the files that another model names
        self.assertEqual(self.modar_json("cache", "show", "--cache", cache)["entries"], 3)
        damaged = self.modar("cache", "verify", "--cache", cache)
        self.assertEqual((damaged.returncode, lists[0].exists()), (3, False), damaged.stdout)

    def test_pipes_and_folders_in_an_entrys_place(self):
        cache = self.folder / "cache"
        self.bake("--cache", cache)
        self.good = (self.place / "out/museum.modar").read_bytes()
        for make in (os.mkfifo, os.mkdir):
            for suffix in (".modar", ".json"):
                part = self.parts(cache)[0].with_suffix(suffix)
                part.unlink()
                make(part)
                if suffix == ".modar":
                    damaged = self.modar("cache", "verify", "--cache", cache)
                    self.assertEqual((damaged.returncode, part.exists()), (3, False), damaged.stdout)
                    make(part)
                self.assertEqual(self.states_with(cache), ["baked", "cached", "cached"])
                self.assertTrue(part.is_file())
        for make in (os.mkfifo, os.mkdir):
            file = sorted(cache.rglob("*.txt"))[0]
            file.unlink()
            make(file)
            self.assertEqual(self.states_with(cache), ["baked", "cached", "cached"])
            self.assertTrue(file.is_file())

    def test_a_key_keeps_planted_entries_out(self):
        cache, plant, key, other = (self.folder / name for name in ("cache", "plant", "key", "other"))
        for name in (key, other):
            self.modar("ship", "keygen", "-o", name)
        self.bake("--cache", cache)
        self.good = (self.place / "out/museum.modar").read_bytes()
        # Who has no key writes entries that are sound but for the signature.
        self.assertEqual(self.states_with(cache, "--cache-key", key), ["baked", "baked", "baked"])
        self.assertIn("not signed with the cache's key", self.told)
        self.assertEqual(self.states_with(cache, "--cache-key", key), ["cached", "cached", "cached"])
        self.assertEqual(self.states_with(cache), ["cached", "cached", "cached"])
        self.assertEqual(self.modar("cache", "verify", "--cache", cache, "--cache-key", key).returncode, 0)
        # Another bundle under a signed name, with a digest that fits.
        self.states_with(plant, "--cache-key", other)
        for file in plant.rglob("*.*"):
            if file.suffix in (".json", ".modar"):
                shutil.copy(file, cache / file.relative_to(plant))
        self.assertEqual(self.states_with(cache, "--cache-key", key), ["cached", "cached", "cached"])  # the same bytes
        signatures = [p.with_suffix(".minisig") for p in self.parts(plant)]
        for file in signatures:  # by another key
            shutil.copy(file, cache / file.relative_to(plant))
            break
        self.assertEqual(self.states_with(cache, "--cache-key", key), ["baked", "cached", "cached"])
        for file in signatures:
            shutil.copy(file, cache / file.relative_to(plant))
        checked = self.modar("cache", "verify", "--cache", cache, "--cache-key", key)
        self.assertEqual((checked.returncode, len(self.parts(cache))), (3, 0), checked.stdout)
        locked = self.folder / "locked"
        locked.write_text("untrusted comment: x\n")
        self.assert_fails(self.modar("bake", "--cache", cache, "--cache-key", locked, cwd=self.place), 3, "key.secret")

    def test_several_processes_share_it(self):
        copies = [self.folder / f"copy{i}" for i in range(3)]
        for copy in copies:
            shutil.copytree(self.place, copy)
            (copy / "modar.toml").write_text("[project]\nname = \"museum\"\n" + (copy / "modar.toml").read_text())
        cache = self.folder / "shared"
        bakes = [subprocess.Popen([BIN / "modar", "bake", "--quiet", "--cache", cache], cwd=copy) for copy in copies]
        self.assertEqual([bake.wait() for bake in bakes], [0, 0, 0])
        self.assertEqual(len({(copy / "out/museum.modar").read_bytes() for copy in copies}), 1)
        self.assertEqual(len(self.parts(cache)), 3)
        self.assertEqual(self.modar_json("cache", "verify", "--cache", cache)["damaged"], [])
        self.assertEqual(self.leftovers(), [])
        shutil.rmtree(copies[0] / ".modar", ignore_errors=True)
        self.assertEqual({a["state"] for a in self.bake("--cache", cache, cwd=copies[0])["assets"]}, {"cached"})

    def test_an_interrupted_bake_resumes(self):
        self.write((self.place / "modar.toml").read_text().replace("loop-views = 8", "loop-views = 400"))
        bake = subprocess.Popen([BIN / "modar", "bake", "--jobs", "1"], cwd=self.place, stderr=subprocess.PIPE)
        cache = self.place / ".modar/cache"
        while len(self.parts(cache)) < 1 and bake.poll() is None:
            time.sleep(0.01)
        bake.send_signal(signal.SIGINT)
        told = bake.communicate()[1].decode()
        self.assertEqual(bake.returncode, 130, told)
        self.assertIn("interrupted", told)
        self.assertEqual(self.leftovers(), [])
        self.assertFalse((self.place / "out/museum.modar").exists())
        done = len(self.parts(cache))
        states = [a["state"] for a in self.bake()["assets"]]
        self.assertEqual(states.count("cached"), done)

    def test_an_asset_alone_goes_to_the_cache(self):
        self.bake("--asset", "b", "--cache", self.folder / "cache")
        self.assertEqual(len(self.parts(self.folder / "cache")), 1)
        self.assertFalse((self.place / "out").exists())
        self.assertEqual(sorted(self.states(self.bake("--cache", self.folder / "cache")).values()), ["baked", "cached"])


class Plan(ProjectTest):
    def ninja(self):
        done = subprocess.run(["ninja", "-j2"], cwd=self.place, capture_output=True, text=True,
                              env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_ssh_starts_elsewhere_and_takes_words_apart(self):
        if shutil.which("ninja") is None:
            self.skipTest("ninja is not installed")
        shutil.move(self.place / "models/b.obj", self.place / "models/b $x 1.obj")
        ssh = self.folder / "ssh"
        ssh.write_text("#!/bin/sh\nshift\ncd / && exec sh -c \"$*\"\n")  # what sshd does with words
        ssh.chmod(0o755)
        shutil.copy(ROOT / "assets/models/bust.png", self.place / "room.png")
        self.write("[project]\nlight = \"room.png\"\n" + (self.place / "modar.toml").read_text())
        plan = self.modar("plan", "--ninja", "--run", f"{ssh} baker", cwd=self.place)
        self.assertEqual(plan.returncode, 0, plan.stderr)
        (self.place / "build.ninja").write_text(plan.stdout)
        self.ninja()
        bundle = (self.place / "out/museum.modar").read_bytes()
        self.assertIn("no work to do", self.ninja())
        (self.place / "room.png").write_bytes((self.place / "pictures/a.png").read_bytes())
        self.assertIn("[1/1] link the bundles", self.ninja())
        self.assertNotEqual((self.place / "out/museum.modar").read_bytes(), bundle)

    def test_ninja_bakes_each_asset_apart(self):
        if shutil.which("ninja") is None:
            self.skipTest("ninja is not installed")
        shutil.move(self.place / "models/b.obj", self.place / "models/b $x 1.obj")
        log = self.folder / "log"
        runner = self.folder / "runner"
        runner.write_text(f"#!/bin/sh\necho ran >> {log}\nexec \"$@\"\n")
        runner.chmod(0o755)
        plan = self.modar("plan", "--ninja", "--cache", self.folder / "cache", "--run", runner, cwd=self.place)
        self.assertEqual(plan.returncode, 0, plan.stderr)
        (self.place / "build.ninja").write_text(plan.stdout)
        self.ninja()
        self.assertEqual(log.read_text().count("ran"), 2)  # "a" is a model and a pattern
        by_ninja = (self.place / "out/museum.modar").read_bytes()
        self.assertIn("no work to do", self.ninja())
        (self.place / "models/cube.mtl").write_text(CUBE_MTL + "Ks 1 1 1\n")
        self.ninja()
        self.assertEqual(log.read_text().count("ran"), 3)
        self.assertNotEqual((self.place / "out/museum.modar").read_bytes(), by_ninja)
        (self.place / "models/cube.mtl").write_text(CUBE_MTL)
        shutil.rmtree(self.place / "out")
        self.bake()
        self.assertEqual((self.place / "out/museum.modar").read_bytes(), by_ninja)
        shutil.copy(self.place / "models/a.obj", self.place / "models/c.obj")
        self.ninja()
        self.assertEqual(log.read_text().count("ran"), 5)  # the third model, and the first unchanged
        self.assertNotEqual((self.place / "out/museum.modar").read_bytes(), by_ninja)
        self.assertIn("no work to do", self.ninja())
        (self.place / "models/c.obj").unlink()
        self.ninja()
        self.assertEqual((self.place / "out/museum.modar").read_bytes(), by_ninja)
        (self.place / "modar.toml").touch()  # every edge runs, and the bundle stays unchanged
        self.ninja()
        self.assertIn("no work to do", self.ninja())


class NeverShown(ProjectTest):
    """a.obj is on a.png by its name; nothing says where b.obj is."""

    def models(self):
        return [model["name"] for model in self.modar_json("inspect", self.place / "out/museum.modar")["models"]]

    def rules(self):
        return [issue["where"] for issue in self.modar_json("check", self.place / "out/museum.modar")["issues"]
                if issue["id"] == "NEVER_SHOWN"]

    def test_models_without_a_scene_are_left_out_and_each_bake_says_so(self):
        text = (self.place / "modar.toml").read_text().replace(KEEP, "")
        (self.place / "modar.toml").write_text(text)
        for words in (["--dry-run"], [], []):  # the last has nothing to do
            self.assertEqual(self.never_shown(*words), ["no pattern shows the models b: they are left out"])
        self.assertEqual((self.models(), self.rules()), (["a"], []))
        self.assertFalse([name for name in self.states(self.bake()) if name == "b"])
        self.assertNotIn("name = b", self.modar("plan", "--ninja", cwd=self.place).stdout)
        (self.place / "modar.toml").write_text(text + "[[scene]]\npattern = \"a\"\nmodel = \"b\"\n")
        self.assertEqual(self.never_shown(), ["no pattern shows the models a: they are left out"])
        self.assertEqual(self.models(), ["b"])
        (self.place / "modar.toml").write_text(text + KEEP)
        self.assertEqual(self.never_shown(), ["no pattern shows the models b"])
        self.assertEqual((self.models(), self.rules()), (["a", "b"], ["model 'b'"]))

    def test_a_project_without_patterns_keeps_its_models(self):
        (self.place / "modar.toml").write_text("[bake]\n" + FAST + "[[model]]\nfile = \"models/*.obj\"\n")
        self.assertEqual(self.never_shown(), [])
        self.assertEqual((self.models(), self.rules()), (["a", "b"], []))

    def test_a_pattern_with_nothing_on_it_is_named(self):
        picture(self.place / "pictures/bare.png", 120, 108)
        self.assertEqual(self.never_shown(), ["no pattern shows the models b", "nothing is on the patterns bare"])
        self.assertEqual(self.rules(), ["model 'b'", "pattern 'bare'"])

    def test_a_device_gets_no_keypoints_unless_they_are_asked_for(self):
        text = "[bake]\n" + FAST.replace("parameters = \"none\"\n", "{}") + "[[model]]\nfile = \"models/a.obj\"\n" \
               "[[pattern]]\nfile = \"pictures/*\"\n[[tier]]\nname = \"high\"\n[[tier]]\nname = \"low\"\ndevice = \"mali400\"\n"
        for asked, high, low in (("", ["orb-2000"], []), ("parameters = \"orb-500\"\n", ["orb-500"], ["orb-500"])):
            (self.place / "modar.toml").write_text(text.format(asked))
            self.assertEqual(len(self.bake()["assets"]), 3)  # the pattern is baked once
            for tier, sets in (("high", high), ("low", low)):
                bundle = self.place / f"out/museum-{tier}.modar"
                self.assertEqual(list(self.modar_json("inspect", bundle)["patterns"][0]["keypoints"]), sets)
                self.assertEqual(self.modar("check", bundle, "--source", "modar.toml", cwd=self.place).returncode, 0)


class Watch(ProjectTest):
    def test_a_saved_file_is_baked_again(self):
        picture(self.place / "new.png", 144, 108)  # next to modar.toml, where a bake makes folders
        bundle = self.place / "out/museum.modar"
        with subprocess.Popen([BIN / "modar", "bake", "--watch"], cwd=self.place, stderr=subprocess.PIPE,
                              text=True) as baker:
            try:
                said = []
                wait = lambda: next(line for line in iter(baker.stderr.readline, "")
                                    if said.append(line) or line.startswith("watching"))
                wait()
                first = bundle.read_bytes()
                (self.place / "models/cube.mtl").write_text(CUBE_MTL + "Ks 1 1 1\n")
                wait()
                self.assertNotEqual(bundle.read_bytes(), first)
                first = bundle.read_bytes()
                self.write("[bake]\n" + FAST + "[[model]]\nfile = \"models/*.obj\"\n[[pattern]]\nfile = \"*.png\"\n")
                wait()
                self.assertNotEqual(bundle.read_bytes(), first)
                first = bundle.read_bytes()
                picture(self.place / "newer.png", 150, 108)
                wait()
                self.assertNotEqual(bundle.read_bytes(), first)
                (self.place / "modar.toml").write_text("[bake\n")  # a broken file waits for its repair
                wait()
                self.assertIn("project.toml", "".join(said))
                self.write("[bake]\n" + FAST + "[[model]]\nfile = \"models/*.obj\"\n")
                wait()
                self.assertNotEqual(bundle.read_bytes(), first)
            finally:
                baker.send_signal(signal.SIGINT)
        self.assertNotEqual(baker.returncode, 0)
        self.assert_fails(self.modar("bake", "--watch", "--dry-run", cwd=self.place), 1, "--dry-run")


class Init(ProjectTest):
    def test_a_folder_becomes_a_project(self):
        (self.place / "modar.toml").unlink()
        shutil.copy(self.place / "pictures/a.png", self.place / "models/a_albedo.png")  # a texture by its name
        done = self.modar("init", self.place)
        self.assertEqual(done.returncode, 0, done.stderr)
        text = (self.place / "modar.toml").read_text()
        self.assertIn("#", text)
        project = tomllib.loads(text)
        self.assertEqual([m["file"] for m in project["model"]], ["models/*.obj"])
        self.assertEqual([p["file"] for p in project["pattern"]], ["pictures/a.png"])  # wall.png is a texture
        self.assert_fails(self.modar("init", self.place), 1, "--force")
        self.write(text.replace("[bake]", "[bake]\nloop-views = 8\nscore = false\nocclusion = false"))
        self.bake()
        scenes = self.modar_json("inspect", self.place / "out/museum.modar")["scenes"]
        self.assertEqual([(s["pattern"], s["model"]) for s in scenes], [("a", "a")])  # by their name

    def test_a_texture_is_no_pattern(self):
        for name, sides in (("models/b.png", (64, 32)), ("models/b_normal.png", (64, 64)), ("models/cover.png", (48, 32)),
                            ("models/poster.png", (48, 36)), ("models/l.png", (48, 36))):  # wall.png does not name l.png
            picture(self.place / name, *sides)
        (self.place / "modar.toml").unlink()
        done = self.modar("init", self.place)
        self.assertIn("textures, so no patterns: models/b.png, models/b_normal.png, models/wall.png", done.stderr)
        self.write((self.place / "modar.toml").read_text().replace("[bake]", "[bake]\nloop-views = 8\nscore = false\nocclusion = false"))
        assets = [asset["name"] for asset in self.bake("--dry-run")["assets"]]
        self.assertEqual(sorted(assets), sorted(["a", "a", "cover", "poster", "l"]))
        self.assertEqual(self.never_shown(), ["no pattern shows the models b: they are left out",
                                              "nothing is on the patterns cover, l, poster"])
        with open(self.place / "modar.toml", "a") as file:
            file.write(KEEP)
        self.assertEqual(self.never_shown()[0], "no pattern shows the models b")
        bundle = self.place / "out/museum.modar"
        textures = lambda: {texture["name"] for texture in self.modar_json("inspect", bundle)["textures"]}
        source = lambda: self.assertEqual(self.modar("check", bundle, "--source", "modar.toml", cwd=self.place).returncode, 0)
        self.assertEqual(textures(), {"wall.png", "b.png"})
        source()
        # A project that names it as a pattern is believed.
        with open(self.place / "modar.toml", "a") as file:
            file.write("[[pattern]]\nfile = \"models/b.png\"\n[[bundle]]\nname = \"one\"\nmodels = \"*\"\npatterns = \"a\"\n")
        bundle = self.place / "out/one.modar"
        self.assertEqual(self.reasons()["b"], "its settings in modar.toml changed")
        self.bake()
        self.assertEqual(textures(), {"wall.png"})
        source()

    def test_names_that_collide_and_odd_ones(self):
        (self.place / "more").mkdir()
        shutil.copy(self.place / "models/b.obj", self.place / "more/b.obj")
        shutil.copy(self.place / "models/b.obj", self.place / "more/odd [1] \"x\".obj")
        (self.place / "modar.toml").unlink()
        self.modar("init", cwd=self.place)
        with open(self.place / "modar.toml", "a") as file:
            file.write(KEEP)
        report = self.bake("--dry-run")
        self.assertEqual(sorted(a["name"] for a in report["assets"]),
                         sorted(["a", "a", "b", "more", "odd [1] \"x\""]))
        try:
            import jsonschema
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        jsonschema.validate(tomllib.loads((self.place / "modar.toml").read_text()), SCHEMA)

    def test_a_folder_without_anything(self):
        (self.folder / "empty").mkdir()
        self.assert_fails(self.modar("init", self.folder / "empty"), 3, "project.nothing")
        fresh = self.folder / "nowhere"
        done = self.modar("init", fresh)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("again", done.stderr)
        self.assertEqual(sorted(path.name for path in fresh.iterdir()), ["models", "patterns"])
        self.assert_fails(self.modar("init", fresh), 3, "project.nothing")


if __name__ == "__main__":
    unittest.main()
