"""Scenes that act: pictures, labels and actions from modar.toml to the bundle, and refusals before the bake."""
import json
import os
import shutil
import subprocess
import unittest

from programs import ROOT, ProgramTest, picture, needs

HEAD = """[bake]
loop-views = 8
score = false
lods = 1
parameters = "none"
occlusion = false
shadows = false
[[model]]
file = "pot.obj"
[[pattern]]
file = "cover.png"
width = "144mm"
"""
SCENE = """[[scene]]
pattern = "cover"
model = "pot"
hidden = true
text.en = "A pot."
[[scene.picture]]
file = "map.png"
width = "72mm"
offset = [10, 0, 0]
group = "views"
alt.en = "A map"
[[scene.picture]]
file = "map.png"
name = "standing"
scale = 0.25
turn = [90, 0, 0]
hidden = true
group = "views"
[[scene.label]]
name = "rim"
offset = [0, 36, 18]
title.en = "The rim"
title.de = "Der Rand"
text.en = "Chipped."
[[scene.action]]
on = "found"
do = "show pot"
[[scene.action]]
on = "tap pot"
part = "wall"
do = "turn pot by 90 about x in 1.5s"
[[scene.action]]
on = "tap rim"
do = "next map"
[[scene.action]]
on = "after 2s"
do = "link https://museum.org/pot"
"""
POT = "mtllib pot.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nusemtl wall\nf 1 2 3\nf 1 3 4\n"


class Acting(ProgramTest):
    def setUp(self):
        super().setUp()
        (self.folder / "pot.obj").write_text(POT)
        (self.folder / "pot.mtl").write_text("newmtl wall\nKd 1 1 1\n")
        picture(self.folder / "cover.png", 144, 108)
        shutil.copy(ROOT / "assets/models/bust.png", self.folder / "map.png")

    def bake(self, scene=SCENE):
        (self.folder / "modar.toml").write_text(HEAD + scene)
        return self.modar("bake", "--quiet", cwd=self.folder)

    def test_a_project_becomes_nodes_and_actions(self):
        done = self.bake()
        self.assertEqual(done.returncode, 0, done.stderr)
        bundle = next((self.folder / "out").glob("*.modar"))
        read = json.loads(subprocess.run(["python3", ROOT / "scripts/read_bundle.py", bundle, "--json"], capture_output=True,
                                         text=True, check=True).stdout)
        pot, flat, standing, rim = read["nodes"]
        self.assertEqual([pot["name"], pot["kind"], pot["subject"], pot["flags"]], ["pot", 1, 0, 1])
        # The cover is two units wide and 144 mm: 72 mm are half of that; the map is as wide as high.
        self.assertEqual([flat["name"], flat["kind"], flat["flags"], flat["half_size"]], ["map", 2, 0, [0.5, 0.5]])
        self.assertAlmostEqual(flat["place"][0], 20 / 144, 6)
        self.assertEqual(flat["place"][1:], [0, 0])
        # A quarter of the cover's longer side; it stands: its middle is half of its height above the plane.
        self.assertEqual([standing["flags"], standing["half_size"], standing["group"]], [1, [0.25, 0.25], flat["group"]])
        self.assertEqual(standing["subject"], flat["subject"])
        self.assertAlmostEqual(standing["place"][2], 0.25, 6)
        for ours, theirs in zip(standing["rotation"], (0.5 ** 0.5, 0, 0, 0.5 ** 0.5)):
            self.assertAlmostEqual(ours, theirs, 6)
        self.assertEqual([rim["kind"], rim["mark"], rim["place"]], [3, "1", [0, 0.5, 0.25]])
        found, turn, following, link = read["actions"]
        self.assertEqual([found["event"], found["command"], found["source"], found["target"]], [1, 3, 0, 0])
        self.assertEqual([turn["event"], turn["command"], turn["part"], turn["axis"], turn["degrees"], turn["duration"]],
                         [3, 10, "wall", [1, 0, 0], 90, 1.5])
        self.assertEqual([following["source"], following["command"], following["target"]], [3, 8, 1])
        self.assertEqual([link["event"], link["seconds"], link["command"], link["address"]], [4, 2, 7, "https://museum.org/pot"])
        self.assertEqual(json.loads(read["meta"])["nodes"], [
            {"pattern": "cover", "node": "map", "alt": {"en": "A map"}},
            {"pattern": "cover", "node": "rim", "title": {"de": "Der Rand", "en": "The rim"}, "text": {"en": "Chipped."}}])

        told = json.loads(self.modar("inspect", bundle, "--json").stdout)
        self.assertEqual([(node["name"], node["kind"], node["hidden"]) for node in told["nodes"]],
                         [("pot", "model", True), ("map", "picture", False), ("standing", "picture", True), ("rim", "label", False)])
        self.assertEqual([action["words"] for action in told["actions"]],
                         ["found: show pot", "tap pot (wall): turn pot by 90 about x in 1.5s", "tap rim: next map",
                          "after 2s: link https://museum.org/pot"])
        self.assertEqual((told["scenes"][0]["labels"], told["scenes"][0]["actions"]), (1, 4))
        checked = self.modar("check", bundle, "--source", self.folder / "modar.toml", "--json")
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertEqual([issue["id"] for issue in json.loads(checked.stdout)["issues"]], [])

    def test_a_changed_picture_bakes_again_and_nothing_else(self):
        self.assertEqual(self.bake().returncode, 0)
        bundle = next((self.folder / "out").glob("*.modar"))
        before = bundle.read_bytes()
        again = json.loads(self.modar("bake", "--json", cwd=self.folder).stdout)
        self.assertEqual({asset["state"] for asset in again["assets"]}, {"fresh"})
        shutil.copy(ROOT / "assets/models/pottery.png", self.folder / "map.png")
        changed = json.loads(self.modar("bake", "--json", cwd=self.folder).stdout)
        self.assertEqual({asset["state"] for asset in changed["assets"]}, {"cached"})
        self.assertNotEqual(bundle.read_bytes(), before)

    def test_pictures_and_labels_need_no_model(self):
        scene = '[[scene]]\npattern = "cover"\ntext.en = "A map."\n[[scene.picture]]\nfile = "map.png"\n'
        done = self.bake(scene)
        self.assertEqual(done.returncode, 0, done.stderr)
        bundle = next((self.folder / "out").glob("*.modar"))
        told = json.loads(self.modar("inspect", bundle, "--json").stdout)
        self.assertEqual((len(told["scenes"]), [node["name"] for node in told["nodes"]]), (0, ["map"]))

    def film(self, name, *words):
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "lavfi", "-i", "testsrc=s=1280x960:d=1:r=10", "-f", "lavfi", "-i",
                        "sine=d=1", *words, self.folder / name], check=True)

    def test_a_video_becomes_what_every_phone_plays(self):
        self.film("film.avi", "-c:v", "mpeg4", "-c:a", "mp2")
        scene = ('[[scene]]\npattern = "cover"\n[[scene.video]]\nfile = "film.avi"\nwidth = "72mm"\nloop = true\nalpha = "#00ff00"\n'
                 '[[scene.action]]\non = "tap film"\ndo = "pause film"\n')
        self.assertEqual(self.bake(scene).returncode, 0)
        bundle = next((self.folder / "out").glob("*.modar"))
        told = json.loads(self.modar("inspect", bundle, "--json").stdout)
        (media,), (node,), (action,) = told["media"], told["nodes"], told["actions"]
        self.assertEqual((media["name"], media["width"], media["height"], media["sound"]), ("film.avi", 640, 480, True))
        self.assertAlmostEqual(media["seconds"], 1, delta=0.1)
        self.assertEqual((node["kind"], node["media"], action["words"]), ("video", 0, "tap film: pause film"))
        for side, wanted in zip(node["half_size"], (0.5, 0.375)):
            self.assertAlmostEqual(side, wanted, 6)
        self.assertEqual((told["textures"][0]["source_width"], told["textures"][0]["source_height"]), (1280, 960))
        issue, = json.loads(self.modar("check", bundle, "--json").stdout)["issues"]
        self.assertEqual((issue["id"], issue["severity"], issue["where"]), ("CAPTIONS_MISSING", "warning", "sound of 'film'"))
        # What FFmpeg says of the file in the bundle.
        at = bundle.read_bytes().index(b"ftyp") - 4
        (self.folder / "taken.mp4").write_bytes(bundle.read_bytes()[at:at + media["bytes"]])
        said = json.loads(subprocess.run(["ffprobe", "-loglevel", "error", "-show_streams", "-of", "json", self.folder / "taken.mp4"],
                                         capture_output=True, text=True, check=True).stdout)["streams"]
        self.assertEqual([(each["codec_name"], each.get("profile")) for each in said],
                         [("h264", "Constrained Baseline"), ("aac", "LC")])
        # It is fit already and stays unchanged, as does the bundle again but for the poster and names.
        shutil.move(self.folder / "taken.mp4", self.folder / "film.mp4")
        before = bundle.read_bytes()[at:at + media["bytes"]]
        self.assertEqual(self.bake(scene.replace("film.avi", "film.mp4")).returncode, 0)
        self.assertIn(before, bundle.read_bytes())
        # Encoded once: a new bake with the same film asks FFmpeg for nothing.
        self.film("other.avi", "-c:v", "mpeg4", "-c:a", "mp2")
        (self.folder / "tools").mkdir()
        (self.folder / "tools/ffmpeg").write_text(f'#!/bin/sh\necho "$@" >>{self.folder}/asked\nexec {shutil.which("ffmpeg")} "$@"\n')
        (self.folder / "tools/ffmpeg").chmod(0o755)
        path = {**os.environ, "PATH": f"{self.folder}/tools:{os.environ['PATH']}"}

        other = scene.replace('"film.avi"', '"other.avi"\nname = "film"')

        def encoded(*options):
            (self.folder / "asked").unlink(missing_ok=True)
            done = self.modar("bake", "--quiet", *options, cwd=self.folder, env=path)
            self.assertEqual(done.returncode, 0, done.stderr)
            return (self.folder / "asked").read_text().count("libx264") if (self.folder / "asked").exists() else 0
        (self.folder / "modar.toml").write_text(HEAD + other)
        self.assertEqual(encoded(), 1)
        first = bundle.read_bytes()
        (self.folder / "modar.toml").write_text(HEAD + other.replace("72mm", "60mm"))
        self.assertEqual(encoded(), 0)
        (self.folder / "modar.toml").write_text(HEAD + other)
        self.assertEqual(encoded(), 0)
        self.assertEqual(bundle.read_bytes(), first)
        shutil.rmtree(self.folder / ".modar")
        self.assertEqual(encoded(), 1)
        self.assertEqual(bundle.read_bytes(), first)
        # Twice on the pattern, once in the bundle.
        twice = '[[scene.video]]\nfile = "film.mp4"\nname = "other"\nwidth = "20mm"\n'
        self.assertEqual(self.bake(scene.replace("film.avi", "film.mp4") + twice).returncode, 0)
        told = json.loads(self.modar("inspect", bundle, "--json").stdout)
        self.assertEqual((len(told["media"]), [node["media"] for node in told["nodes"]]), (1, [0, 0]))
        (self.folder / "film.mp4").write_bytes(b"no film")
        done = self.bake(scene.replace("film.avi", "film.mp4"))
        self.assertIn("video.decode", done.stderr)

    @needs("report")
    def test_a_sound_with_captions(self):
        subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i", "sine=d=2:r=44100", self.folder / "voice.wav"], check=True)
        (self.folder / "voice.srt").write_text("1\n00:00:00,500 --> 00:00:01,250\n<i>This</i> pot\nis old.\n\n"
                                               "2\n00:00:01,500 --> 00:00:02,000\n[bell]\n")
        (self.folder / "voice.vtt").write_text("WEBVTT\n\n00:00.500 --> 00:01.250 align:start\nAlter Topf & Krug\n")
        scene = ('[[scene]]\npattern = "cover"\n[[scene.sound]]\nfile = "voice.wav"\nplay = false\ncaptions.en = "voice.srt"\n'
                 'captions.de = "voice.vtt"\n[[scene.label]]\n[[scene.action]]\non = "tap 1"\ndo = "play voice"\n')
        self.assertEqual(self.bake(scene).returncode, 0)
        bundle = next((self.folder / "out").glob("*.modar"))
        told = json.loads(self.modar("inspect", bundle, "--json").stdout)
        (media,), (node, _), (action,) = told["media"], told["nodes"], told["actions"]
        self.assertEqual((media["name"], media["kind"], media["width"], media["sound"], media["poster"]), ("voice.wav", "sound", 0, True, None))
        self.assertEqual((node["name"], node["kind"], node["media"], action["words"]), ("voice", "sound", 0, "tap 1: play voice"))
        self.assertEqual(node["words"]["captions"], {
            "en": "WEBVTT\n\n00:00.500 --> 00:01.250\n<i>This</i> pot\nis old.\n\n00:01.500 --> 00:02.000\n[bell]\n",
            "de": "WEBVTT\n\n00:00.500 --> 00:01.250 align:start\nAlter Topf & Krug\n"})
        self.assertEqual(json.loads(self.modar("check", bundle, "--json").stdout)["issues"], [])
        at = bundle.read_bytes().index(b"ftyp") - 4
        (self.folder / "taken.mp4").write_bytes(bundle.read_bytes()[at:at + media["bytes"]])
        stream, = json.loads(subprocess.run(["ffprobe", "-loglevel", "error", "-show_streams", "-of", "json", self.folder / "taken.mp4"],
                                            capture_output=True, text=True, check=True).stdout)["streams"]
        self.assertEqual((stream["codec_name"], stream["profile"]), ("aac", "LC"))
        self.assertAlmostEqual(float(stream["duration"]), 2, delta=0.1)
        done = self.modar("report", bundle, "-o", "report.html", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        page = (self.folder / "report.html").read_text(encoding="utf-8")
        for words in ("This pot is old.\n[bell]", "Alter Topf &amp; Krug", "tap 1: play voice", "<td>sound</td><td>2.0 s</td>"):
            self.assertIn(words, page)
        # Changed captions are baked again; a second language of one sound alone is reported.
        (self.folder / "voice.vtt").write_text("WEBVTT\n\n00:00.500 --> 00:01.250\nEin alter Topf\n")
        self.assertEqual(self.bake(scene).returncode, 0)
        self.assertIn("Ein alter Topf", self.modar("inspect", bundle, "--json").stdout)
        other = '[[scene.sound]]\nfile = "voice.wav"\nname = "other"\ncaptions.en = "voice.srt"\n'
        self.assertEqual(self.bake(scene + other).returncode, 0)
        issue, = json.loads(self.modar("check", bundle, "--json").stdout)["issues"]
        self.assertEqual((issue["id"], issue["where"]), ("CAPTIONS_MISSING", "sound of 'other'"))
        self.assertIn("in 'de'", issue["message"])
        for text in ("WEBVTT\n\nwords\n", "\x00\x01", ""):
            (self.folder / "voice.vtt").write_text(text)
            done = self.bake(scene)
            self.assertEqual((done.returncode, "captions.read" in done.stderr), (3, True), (text, done.stderr))
        (self.folder / "voice.wav").write_bytes(b"no sound")
        self.assertIn("FFmpeg reads no sound", self.bake(scene.replace('captions.de = "voice.vtt"\n', "")).stderr)

    @needs("report")
    def test_what_flashes_is_told(self):
        scene = '[[scene]]\npattern = "cover"\n[[scene.video]]\nfile = "flash.mp4"\n'
        # Changes a second, and the share of the width that changes: WCAG allows three flashes, and any on less than a quarter.
        for changes, share, dangerous in ((6, 1, False), (8, 1, True), (12, 0.2, False), (12, 0.3, True)):
            luma = f"lum='if(mod(floor(T*{changes}+0.01),2)*lt(X,W*{share}),200,30)':cb=128:cr=128"
            subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "lavfi", "-i", f"nullsrc=s=320x180:d=2:r=30,geq={luma}",
                            "-pix_fmt", "yuv420p", self.folder / "flash.mp4"], check=True)
            self.assertEqual(self.bake(scene).returncode, 0)
            bundle = next((self.folder / "out").glob("*.modar"))
            self.assertEqual(json.loads(self.modar("inspect", bundle, "--json").stdout)["media"][0]["flashes"], dangerous, (changes, share))
            issues = [issue["id"] for issue in json.loads(self.modar("check", bundle, "--json").stdout)["issues"]]
            self.assertEqual(issues, ["MEDIA_FLASHES"] if dangerous else [], (changes, share))
            self.modar("report", bundle, "-o", "report.html", "--quiet")
            page = (self.folder / "report.html").read_text(encoding="utf-8")
            self.assertEqual("more than three a second" in page, dangerous, (changes, share))

    def test_what_is_wrong_is_told_with_its_line_before_the_bake(self):
        for change, code, where in (
                (('do = "show pot"', 'do = "show pott"'), "action.unknown", 'do = "show pott"'),
                (('do = "show pot"', 'do = "text pot"'), "action.command", 'do = "text pot"'),
                (('do = "show pot"', 'do = "play pot"'), "action.command", 'do = "play pot"'),
                (('do = "show pot"', 'do = "next pot"'), "action.command", 'do = "next pot"'),
                (('do = "show pot"', 'do = "turn rim by 9"'), "action.command", 'do = "turn rim'),
                (('do = "show pot"', 'do = "sing"'), "project.value", 'do = "sing"'),
                (('do = "show pot"', 'do = "turn pot by 90 around x"'), "project.value", 'do = "turn pot by 90 around'),
                (('"link https:', '"link http:'), "project.value", 'do = "link'),
                (('"link https://', '"link https://museum.org@'), "user name", 'do = "link'),
                (('"link https://', '"link https://\u202e'), "invisible", 'do = "link'),
                (('on = "found"', 'on = "fund"'), "project.value", 'on = "fund"'),
                (('on = "found"', 'on = "found"\npart = "lid"'), "project.value", 'part = "lid"'),
                (('on = "tap rim"', 'on = "tap rim"\npart = "lid"'), "action.part", 'do = "next map"'),
                (('name = "standing"', 'name = "rim"'), "node.same-name", 'name = "rim"\noffset'),
                (('name = "standing"', 'title.en = "x"'), "project.key", 'title.en = "x"'),
                (('name = "rim"', 'mark = ""'), "project.value", 'mark = ""'),
                (('name = "rim"', f'mark = "{"x" * 33}"'), "project.value", 'mark = "x'),
                (('"map.png"', '"mop.png"'), "project.no-match", 'file = "mop.png"')):
            scene = SCENE.replace(*change, 1)
            done = self.bake(scene)
            line = (HEAD + scene)[:(HEAD + scene).index(where)].count("\n") + 1
            self.assertEqual(done.returncode, 3, (change, done.stderr))  # read, and invalid
            self.assertIn(code, done.stderr, change)
            self.assertIn(f"modar.toml:{line}:", done.stderr, change)
            self.assertFalse((self.folder / "out").exists() and list((self.folder / "out").glob("*.modar")), change)
        # A part is known once its model is baked.
        done = self.bake(SCENE.replace('part = "wall"', 'part = "wal"'))
        self.assertEqual((done.returncode, "did you mean 'wall'?" in done.stderr), (3, True), done.stderr)
        done = self.bake(SCENE + "[[scene.video]]\nfile = \"map.png\"\nname = \"film\"\n")
        self.assertEqual((done.returncode, "video.still" in done.stderr), (3, True), done.stderr)
        (self.folder / "map.png").write_bytes(b"no picture")
        self.assertIn("image.decode", self.bake().stderr)


if __name__ == "__main__":
    unittest.main()
