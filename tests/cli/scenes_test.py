"""The example projects of assets/make_scenes.py: each bakes, is good, and has what its text promises."""
import json
import os
import subprocess
import sys
import unittest

from programs import ROOT, ProgramTest

SAYS = {"speaking-painting": (["sound", "label", "label"], ["tap restorer: play voice", "tap restorer: text restorer", "tap restorer: show window"]),
        "playing-poster": (["picture", "video", "label"], ["tap trailer: pause trailer", "tap director: play trailer", "tap director: text director",
                                                          "tap tickets: link https://museum.example/tickets"]),
        "labelled-machine": (["model", "model", "label", "label", "label", "label"],
                             ["tap wheel: turn wheel by 360 about y in 3s", "tap flywheel: turn wheel by 360 about y in 3s",
                              "tap flywheel: text flywheel", "tap engine (brass): text boiler"])}


class Scenes(ProgramTest):
    def test_each_bakes_and_is_good(self):
        for out in ("first", "again"):
            subprocess.run([sys.executable, ROOT / "assets/make_scenes.py", self.folder / out], check=True, capture_output=True)
        for name, (kinds, actions) in SAYS.items():
            files = {path.name: path.read_bytes() for path in (self.folder / "first" / name).iterdir()}
            self.assertEqual(files, {path.name: path.read_bytes() for path in (self.folder / "again" / name).iterdir()}, name)
            project = self.folder / "first" / name
            toml = project / "modar.toml"
            toml.write_text(toml.read_text().replace("[bake]", "[bake]\nloop-views = 8\nscore = false"))
            done = self.modar("bake", "--quiet", cwd=project)
            self.assertEqual(done.returncode, 0, done.stderr)
            bundle = next((project / "out").glob("*.modar"))
            told = self.modar_json("inspect", bundle)
            self.assertEqual([node["kind"] for node in told["nodes"]], kinds, name)
            self.assertEqual([action["words"] for action in told["actions"]], actions, name)
            self.assertEqual(json.loads(self.modar("check", bundle, "--json").stdout)["issues"], [], name)
        self.assertLess(os.path.getsize(ROOT / "assets/make_scenes.py"), 20_000)


if __name__ == "__main__":
    unittest.main()
