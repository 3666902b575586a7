"""Clips of glTF files from the command line: which one plays, in a single bake and in a project, and files that contradict themselves."""
import copy
import json
import math
import re
import subprocess
import sys
import unittest

from programs import QUICK, ROOT, ProgramTest, picture
from usd_skel import Skeleton

MOVING = ROOT / "tests/import/clips/moving.gltf"


class Clips(ProgramTest):
    def setUp(self):
        super().setUp()
        self.document = json.loads(MOVING.read_text())
        self.document["animations"] = [{**self.document["animations"][0], "name": name} for name in ("walk", "wave")]
        self.write(self.document)
        picture(self.folder / "cover.png")

    def write(self, document):
        (self.folder / "m.gltf").write_text(json.dumps(document))

    def played(self, *words):
        """The names of clips that scenes play, and whether they loop."""
        done = self.modar("bake", "m.gltf", "cover.png", "-o", "m.modar", *QUICK, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.modar("check", "m.modar").returncode, 0)
        return self.scene_clips(self.folder / "m.modar")

    def scene_clips(self, bundle):
        read = self.read(bundle)
        return [(read["clips"][each["clip"]]["name"], each["flags"]) for each in read.get("scene_clips", [])]

    def test_the_first_loops_unless_a_scene_says_otherwise(self):
        for words, wanted in (((), [("walk", 1)]), (("--scene", "cover=m,clip=wave"), [("wave", 1)]),
                              (("--scene", "cover=m,clip=wave,once"), [("wave", 0)]), (("--scene", "cover=m,clip=none"), [])):
            with self.subTest(words):
                self.assertEqual(self.played(*words), wanted)
        done = self.modar("bake", "m.gltf", "cover.png", "-o", "n.modar", *QUICK, "--scene", "cover=m,clip=wale")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("'walk'", done.stderr)
        self.assertFalse((self.folder / "n.modar").exists())

    def test_moving_triangles_that_are_seen_through_have_no_order(self):
        self.document = json.loads((MOVING.parent / "skinned.gltf").read_text())
        self.document["materials"] = [{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.35]}}]
        self.document["meshes"][0]["primitives"][0]["material"] = 0
        self.write(self.document)
        self.assertEqual(len(self.played()), 1)

    def test_a_project_says_it_too_and_actions_play_and_stop(self):
        project = self.folder / "museum"
        project.mkdir()
        (project / "m.gltf").write_bytes((self.folder / "m.gltf").read_bytes())
        picture(project / "cover.png")
        text = ('[bake]\nloop-views = 8\nscore = false\nparameters = "none"\n[[model]]\nfile = "m.gltf"\n[[pattern]]\nfile = "cover.png"\n'
                '[[scene]]\npattern = "cover"\nmodel = "m"\nname = "pot"\nclip = "wave"\nonce = true\n')
        for action, code in (('on = "tap pot"\ndo = "play walk on pot"', 0), ('on = "tap pot"\ndo = "stop pot"', 0), ('on = "tap pot"\ndo = "play dance on pot"', 1)):
            with self.subTest(action):
                (project / "modar.toml").write_text(text + "[[scene.action]]\n" + action + "\n")
                done = self.modar("bake", cwd=project)
                self.assertEqual(done.returncode != 0, code != 0, done.stderr)
                if code:
                    self.assertIn("dance", done.stderr)
                    continue
                [bundle] = (project / "out").glob("*.modar")
                self.assertEqual(self.scene_clips(bundle), [("wave", 0)])
                self.assertEqual(self.modar("check", bundle).returncode, 0)

    def test_exports_keep_clips(self):
        """An extracted GLB bakes to the same clips, on which the second reader agrees."""
        self.write(json.loads((MOVING.parent / "morphs.gltf").read_text()))
        self.assertEqual(self.played(), [("linear", 1)])
        self.assertEqual(self.modar("inspect", "m.modar", "--extract", "out").returncode, 0)
        glb = (self.folder / "out/m.glb").read_bytes()
        document = json.loads(glb[20:20 + int.from_bytes(glb[12:16], "little")])
        self.assertEqual([(each["name"], sorted({channel["target"]["path"] for channel in each["channels"]})) for each in document["animations"]],
                         [("linear", ["rotation", "weights"]), ("cubic", ["weights"])])
        self.assertEqual({document["accessors"][each["samplers"][0]["input"]]["max"][0] for each in document["animations"]}, {2})
        self.assertEqual(self.modar("bake", "out/m.glb", "-o", "again.modar").returncode, 0)
        self.assertEqual(self.modar("check", "again.modar", "--source", "out/m.glb").returncode, 0)
        first, again = (self.clips(self.folder / name) for name in ("m.modar", "again.modar"))
        self.assertEqual([clip[:2] for clip in first], [clip[:2] for clip in again])

    def test_usdz_moves_as_three_has_it(self):
        """Nodes that shear what they move, morph targets, a skin of 40 joints: at 20 times, by a reader of UsdSkel that is not the writer's."""
        for name, most in (("morphs", 1.5e-3), ("skinned", 5e-4)):
            self.assertEqual(self.modar("bake", MOVING.parent / f"{name}.gltf", "cover.png", "-o", "m.modar", *QUICK).returncode, 0)
            self.assertEqual(self.modar("inspect", "m.modar", "--extract", name).returncode, 0)
            skeleton = Skeleton(self.folder / name / "cover.usdz")
            [model], [clip, *_] = (self.read("m.modar")[key] for key in ("models", "clips"))
            lines = (MOVING.parent / f"{name}.txt").read_text().splitlines()
            count = len(lines) // 20
            for step in range(20):
                points = [[c + model["scale"] * x for c, x in zip(model["center"], point)] for point in skeleton.at(clip["seconds"] * (step + 0.37) / 20)]
                for line in lines[step * count:(step + 1) * count]:
                    wanted = [float(each) for each in line.split()]
                    self.assertLess(min(math.dist(wanted, point) for point in points), most * model["diagonal"], (name, step))

    def read(self, bundle):
        """By the second reader."""
        return json.loads(subprocess.run([sys.executable, ROOT / "scripts/read_bundle.py", "--json", bundle], cwd=self.folder, capture_output=True, text=True, check=True).stdout)

    def clips(self, bundle):
        return [(each["name"], each["seconds"]) for each in self.read(bundle)["clips"]]

    def test_clips_are_looked_at_beside_their_source_and_shown(self):
        """`check --visual`, the report's stills and the turntable. A source of which one clip moves otherwise is found: its rest is the same."""
        self.document["materials"] = [{"doubleSided": True}]
        self.document["meshes"][0]["primitives"][0]["material"] = 0
        self.write(self.document)
        self.assertEqual(self.modar("bake", "m.gltf", "-o", "m.modar").returncode, 0)
        channels = self.document["animations"][1]["channels"]
        for code, differs in ((0, []), (3, ["model 'm', clip 'wave'"])):
            done = self.modar("check", "m.modar", "--source", "m.gltf", "--visual", "looks", "--json")
            self.assertEqual(done.returncode, code, done.stderr)
            told = json.loads(done.stdout)
            self.assertEqual([issue["where"] for issue in told["issues"] if issue["id"] == "VISUAL_DIFFERS"], differs)
            clips = told["looks"][0]["clips"]
            self.assertEqual([(clip["clip"], clip["ssim_worst"] > 0.95 and clip["delta_e_worst"] < 3) for clip in clips], [("walk", True), ("wave", code == 0)])
            self.document["animations"][1]["channels"] = [each for each in channels if each["target"]["path"] != "translation"]
            self.write(self.document)
        self.assertEqual(self.modar("report", "m.modar", "-o", "m.html", "--quiet").returncode, 0)
        stills = re.findall(r'alt="Clip .(\w+). at (\d\.\d\d) s" src="([^"]+)"', (self.folder / "m.html").read_text(encoding="utf-8"))
        self.assertEqual([each[:2] for each in stills], [(clip, at) for clip in ("walk", "wave") for at in ("0.33", "1.00", "1.67")])
        self.assertEqual([len({each[2] for each in stills[:3]}), stills[0][2]], [3, stills[3][2]])
        done = self.run_program("modar-play", "m.modar", "--turntable", "3", "--out", "turn", "--size", "96x64", "--json")
        self.assertEqual([(line["clip"], line["angle_deg"]) for line in map(json.loads, done.stdout.splitlines())],
                         [(clip, angle) for clip in ("walk", "wave") for angle in (0, 120, 240)])
        pictures = [path.read_bytes() for path in sorted((self.folder / "turn").iterdir())]
        self.assertEqual((len(set(pictures)), pictures[:3]), (3, pictures[3:]))

    def test_repair_says_that_it_leaves_them_out(self):
        done = self.modar("bake", "m.gltf", "cover.png", "-o", "m.modar", "--repair", *QUICK)
        self.assertIn("leaves out 2 clips", done.stderr)

    def test_keys_at_time_0_alone_are_a_pose(self):
        self.document = json.loads((MOVING.parent / "morphs.gltf").read_text())
        for clip in self.document["animations"]:
            for sampler in clip["samplers"]:
                accessor = self.document["accessors"][sampler["input"]]
                accessor.update(count=1, min=[0], max=[0])
        self.write(self.document)
        self.assertEqual(self.played(), [("linear", 0)])

    def test_files_that_contradict_themselves_are_findings_or_errors(self):
        def changed(change):
            document = copy.deepcopy(self.document)
            change(document, document["animations"][0])
            return document

        def cycle(document, _):
            document["nodes"][0]["children"] = [0]

        def crowd(document, _):
            document["scenes"][0]["nodes"] += range(len(document["nodes"]), len(document["nodes"]) + 10000)
            document["nodes"] += [{"name": f"n{i}"} for i in range(10000)]

        def camera(document, clip):
            document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
            document["nodes"].append({"camera": 0})
            document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
            clip["channels"][0]["target"]["node"] = len(document["nodes"]) - 1

        def pointer(document, clip):
            document["extensionsUsed"] = ["KHR_animation_pointer"]
            clip["channels"][0]["target"] = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/rotation"}}}

        def swapped(document, clip):
            clip["samplers"][0]["input"], clip["samplers"][0]["output"] = clip["samplers"][0]["output"], clip["samplers"][0]["input"]

        for change, code, told in (
                (cycle, 3, "gltf.read"), (crowd, 0, ""), (camera, 0, ""), (pointer, 0, "KHR_animation_pointer"), (swapped, 0, "gltf.clip"),
                (lambda d, clip: clip["channels"][0]["target"].update(node=99), 0, "gltf.clip"),
                (lambda d, clip: clip["channels"][0].update(sampler=7), 0, "gltf.clip"),
                (lambda d, clip: d["accessors"][clip["samplers"][0]["input"]].update(count=10**9), 0, "gltf.clip")):
            with self.subTest(told, change=getattr(change, "__name__", "")):
                self.write(changed(change))
                done = self.modar("bake", "--model", "m.gltf", "-o", "m.modar")
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(told, done.stderr)
                if code == 0:
                    self.assertEqual(self.modar("check", "m.modar").returncode, 0)


if __name__ == "__main__":
    unittest.main()
