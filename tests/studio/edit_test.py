"""Edits of modar.toml: what they say by another TOML reader, and that every other byte stays."""
import difflib
import random
import sys
import tomllib
import unittest

from studio import StudioTest
from programs import COVER, POTTERY, ROOT, picture

sys.path.insert(0, str(ROOT / "scripts"))
from bundle_bytes import Bundle  # noqa: E402

# Ways in which people write, with what the studio does not know between. {} is a value of the test's.
HEAD = ["# a comment at the top\n\n", "", "\ufeff# Windows wrote this\n", "#:schema x.json\n"]
PROJECT = ['[project]\nname = "vases"   # of the bundle\n', 'project.name = "vases"\n', 'project = { name = "vases" } # inline\n',
           "[project]\n'name' = '''vases'''\n", ""]
SCENES = [
    '[[scene]] # the first\npattern = "a"\nmodel = "pottery"\nturn = 90 # degrees\ntext.en = "A vase"\n#scale = 2\n\n'
    '[[scene.label]]\nname = "rim"\ntext.en = "Fixed # in 1890"\n',
    '[[ scene ]]\n  pattern = "b"\n  "model" = \'pottery\'\n  offset = [ # in mm\n    0, 0,\n    10, # up\n  ]\n  [scene.text]\n  de = "Eine \\"Vase\\""\n',
    '[[scene]]\npattern="a"\nmodel="pottery"\ntext = { en = "x", de = "]}#" }\nname = "second"\nscale = 1\n',
    '[[scene]]\npattern = "b"\nmodel = "pottery"\nname = """three\nlines = 1"""\n',
]
VALUES = [("turn", 45), ("turn", [0, 12.5, -90]), ("offset", [1e-7, -3, 2.25]), ("up", "-y"), ("clip", "walk"), ("scale", 0.8), ("height", "120mm"),
          ("text.en", "<script>alert('x')</script>"), ("text.he", "\u05db\u05d3 \u202eabc"), ("text.de", "\U0001f3fa \"quoted\" \\ back\n\ttab"),
          ("alt.en", ""), ("hidden", True), ("group", "a.b#c"), ("light", None)]


def project_text(rng):
    project = rng.choice(PROJECT)
    assets = '[[model]]\nfile = "pottery.obj"\n\n[[pattern]]\nfile = ["*.png", "!pottery.png"] # both\n'
    scenes = rng.sample(SCENES, rng.randrange(1, 4))
    rest = [assets, *scenes]
    if not project.startswith("project"):
        rest.insert(rng.randrange(len(rest) + 1) if project else 0, project)
        project = ""
    text = rng.choice(HEAD) + project + "\n".join(rest) + rng.choice(["", "\n\n# the end", "[gates]\nmin-score = 0\n"])
    return text.replace("\n", "\r\n") if rng.random() < 0.3 else text


def put(document, key, value):
    *tables, last = key.split(".")
    for table in tables:
        document = document.setdefault(table, {})
    document[last] = value


class Edit(StudioTest):
    def setUp(self):
        super().setUp()
        for source in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png")):
            (self.folder / source.name).write_bytes(source.read_bytes())
        for name in ("a", "b"):
            picture(self.folder / f"{name}.png", mirrored=name == "b")
        self.toml = self.folder / "modar.toml"

    def write(self, text):
        self.toml.write_bytes(text.encode())

    def read(self):
        return tomllib.loads(self.toml.read_bytes().decode("utf-8-sig"))

    def test_edits_change_what_they_say_and_no_other_byte(self):
        studio, rng, kept = self.studio(), random.Random(41), 0
        for _ in range(120):
            text = project_text(rng)
            self.write(text)
            wanted = tomllib.loads(text.encode().decode("utf-8-sig"))
            index = rng.randrange(len(wanted["scene"]))
            key, value = rng.choice(VALUES)
            if value is None or rng.random() < 0.2:
                key = rng.choice([key for key in wanted["scene"][index] if isinstance(wanted["scene"][index][key], (int, str))
                                  and key not in ("pattern", "model")] or ["group"])
                answer = studio.edit({"op": "remove", "table": "scene", "index": index, "key": key})
                wanted["scene"][index].pop(key, None)
            else:
                answer = studio.edit({"op": "set", "table": "scene", "index": index, "key": key, "value": value})
                for size in ("scale", "height", "width"):
                    if key in ("scale", "height", "width"):
                        wanted["scene"][index].pop(size, None)
                put(wanted["scene"][index], key, value)
            self.assertEqual(answer.status, 200, (answer.body, text, key, value))
            now = self.toml.read_bytes()
            self.assertEqual(self.read(), wanted, (text, key, value))
            # Lines that went or came are those of the key, or of the table in which it stands.
            before = text.encode().splitlines(keepends=True)
            changed = [line for line in difflib.ndiff([repr(line) for line in before], [repr(line) for line in now.splitlines(keepends=True)])
                       if line[0] in "-+"]
            self.assertLessEqual(len(changed), 5, (text, now.decode()))
            if now == text.encode():
                kept += 1
                continue
            self.good(studio.post("api/undo", {}))
            self.assertEqual(self.toml.read_bytes(), text.encode())
            self.good(studio.post("api/redo", {}))
            self.assertEqual(self.toml.read_bytes(), now)
        self.assertLess(kept, 30)

    def test_tables_come_go_and_split(self):
        studio = self.studio()
        text = ("# head\n[[model]]\nfile = \"pottery.obj\"\n\n# two pictures\n[[pattern]]\nfile = [\"?.png\"]\n#width = \"1mm\"\n\n# what stands\n"
                "[[scene]]\npattern = \"a\"\nmodel = \"pottery\"\n\n[[scene]]\npattern = \"b\"\nmodel = \"pottery\"\n")
        self.write(text)
        # One of the glob's two gets a table of its own.
        self.good(studio.edit({"op": "set", "table": "pattern", "name": "b", "key": "width", "value": "210mm"}))
        patterns = self.read()["pattern"]
        self.assertEqual(patterns, [{"file": ["?.png", "!b.png"]}, {"file": "b.png", "width": "210mm"}])
        view = {one["name"]: one for one in studio.project()["patterns"]}
        self.assertEqual((view["b"]["width_mm"], view["a"]["width_mm"], view["a"]["shared"]), (210, None, False))
        # A new name goes through the scenes.
        self.good(studio.edit({"op": "set", "table": "pattern", "name": "b", "key": "name", "value": "poster"}))
        self.assertEqual([scene["pattern"] for scene in self.read()["scene"]], ["a", "poster"])
        # What goes takes its scenes along; comments of the others stay.
        self.good(studio.edit({"op": "delete", "table": "pattern", "name": "poster"}))
        self.assertEqual(len(self.read()["scene"]), 1)
        self.good(studio.edit({"op": "add", "table": "scene", "value": {"pattern": "a", "model": "pottery", "turn": 30}}))
        self.assertEqual(self.read()["scene"][1], {"pattern": "a", "model": "pottery", "turn": 30})
        now = self.toml.read_text()
        for comment in ("# head\n", "# two pictures\n", "#width = \"1mm\"\n", "# what stands\n"):
            self.assertIn(comment, now)
        for _ in range(4):
            self.good(studio.post("api/undo", {}))
        self.assertEqual(self.toml.read_text(), text)
        self.assertEqual(studio.post("api/undo", {}).status, 409)

    def test_scenes_that_follow_from_names_are_written_when_one_is_edited(self):
        self.write('[[model]]\nfile = "pottery.obj"\nname = "a"\n\n[[pattern]]\nfile = "?.png"\n')
        studio = self.studio()
        self.assertEqual([(scene["index"], scene["pattern"]) for scene in studio.project()["scenes"]], [(None, "a")])
        self.good(studio.edit({"op": "set", "table": "scene", "pattern": "a", "model": "a", "key": "scale", "value": 2}))
        self.assertEqual(self.read()["scene"], [{"pattern": "a", "model": "a", "scale": 2}])

    def test_what_was_changed_by_hand_is_never_overwritten(self):
        self.write('[[pattern]]\nfile = "a.png"\n')
        studio = self.studio()
        revision = studio.project()["revision"]
        by_hand = '[[pattern]]\nfile = "b.png" # mine\n'
        self.write(by_hand)
        edit = {"op": "set", "table": "pattern", "index": 0, "key": "width", "value": "100mm"}
        answer = studio.edit(edit, revision=revision)
        self.assertEqual((answer.status, answer.json["code"]), (409, "studio.changed"))
        self.assertEqual(self.toml.read_text(), by_hand)
        self.good(studio.edit(edit))
        self.assertEqual(self.toml.read_text(), by_hand + "width = \"100mm\"\n")
        self.good(studio.post("api/undo", {}))
        self.good(studio.post("api/undo", {}))  # the hand's own step
        self.assertEqual(self.toml.read_text(), '[[pattern]]\nfile = "a.png"\n')

    def test_wrong_edits_are_refused_with_their_reason_and_wrong_files_are_shown(self):
        text = '[[pattern]]\nfile = "a.png"\n'
        self.write(text)
        studio = self.studio()
        for edit, word in (({"op": "set", "table": "pattern", "index": 0, "key": "width", "value": 2}, "width"),
                           ({"op": "set", "table": "pattern", "index": 0, "key": "corners", "value": [[0, 0], [9, 9], [1, 2], [3, 3]]}, "corners"),
                           ({"op": "set", "table": "pattern", "index": 7, "key": "name", "value": "x"}, "[[pattern]] 8"),
                           ({"op": "set", "table": "pattern", "name": "none", "key": "width", "value": "1mm"}, "none"),
                           ({"op": "add", "table": "scene", "value": {"pattern": "a", "model": "gone"}}, "gone"),
                           ({"op": "rename", "table": "scene"}, "rename")):
            answer = studio.edit(edit)
            self.assertEqual(answer.status, 422, edit)
            self.assertIn(word, answer.json["error"], edit)
            self.assertEqual(self.toml.read_text(), text)
        self.write('[[pattern]]\nfile = "a.png"\nwidht = 3\n\n[[pattern]]\nfile = "b.png"\n')
        project = studio.project()
        self.assertEqual([one["name"] for one in project["patterns"]], ["a", "b"])
        self.assertEqual([(one["line"], one["cure"]) for one in project["problems"]], [(3, "did you mean 'width'?")])
        # The table that is right may be edited meanwhile.
        self.good(studio.edit({"op": "set", "table": "pattern", "index": 1, "key": "width", "value": "5mm"}))
        self.write("[[pattern]\nfile = 3\n")
        self.assertEqual(studio.project()["problems"][0]["line"], 1)
        answer = studio.edit({"op": "set", "table": "project", "key": "name", "value": "x"})
        self.assertEqual((answer.status, answer.json["code"]), (422, "project.toml"))

    def test_corners_cut_as_rectify_does(self):
        """A photo with corners bakes as what `modar pattern rectify` makes of it."""
        photo = self.folder / "photo.png"
        photo.write_bytes(COVER.read_bytes())
        quick = "[bake]\nloop-views = 8\nscore = false\nparameters = \"none\"\n"
        corners = [[20, 15], [300, 25], [310, 600], [12, 580]]
        self.write(quick + '[[pattern]]\nfile = "photo.png"\nname = "cut"\n')
        studio = self.studio()
        self.good(studio.edit({"op": "set", "table": "pattern", "name": "cut", "key": "corners", "value": corners},
                              {"op": "set", "table": "pattern", "name": "cut", "key": "width", "value": "105mm"},
                              {"op": "set", "table": "pattern", "name": "cut", "key": "height", "value": "210.5mm"}))
        view = studio.project()["patterns"][0]
        self.assertEqual((view["corners"], view["width_mm"], view["height_mm"]), (corners, 105, 210.5))
        done = self.modar("pattern", "rectify", photo, "--corners", ",".join(str(n) for corner in corners for n in corner),
                          "--width", "105mm", "--height", "210.5mm", "-o", self.folder / "cut.png")
        self.assertEqual(done.returncode, 0, done.stderr)
        words = ["--loop-views", "8", "--no-score", "--parameters", "none"]
        text = "flat,corners=" + ":".join(str(n) for corner in corners for n in corner) + ",height=210.5mm"
        bundles = []
        for name, pattern in (("photo", f"cut={photo}:105mm:shape={text}"), ("cut", f"{self.folder / 'cut.png'}:105mm")):
            done = self.modar("bake", "--pattern", pattern, "-o", self.folder / f"{name}.modar", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            bundles.append(Bundle((self.folder / f"{name}.modar").read_bytes()).payload)
        # Texts differ: file names, and how the shape was written. What the tracker reads does not.
        tracked = [key for key in bundles[0] if key[1] == 0]
        self.assertGreaterEqual(len(tracked), 2)
        for key in tracked:
            self.assertEqual(bundles[0][key], bundles[1][key], key)


if __name__ == "__main__":
    unittest.main()
