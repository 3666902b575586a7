"""What the studio's verbs answer: bakes as `modar bake` does them, previews, grades, exports, and how long it takes."""
import http.client
import json
import os
import re
import shutil
import stat
import subprocess
import time
import unittest
import urllib.parse
import zipfile

from studio import NATIVE, Events, StudioTest
from entry_test import museum
from programs import BIN, COVER, POTTERY, ROOT, picture

QUICK = '[project]\nname = "demo"\n\n[bake]\nloop-views = 8\nscore = false\nlods = 1\nparameters = "none"\n\n'
SCENE = '[[model]]\nfile = "pottery.obj"\n\n[[pattern]]\nfile = "cover.png"\nwidth = "210mm"\n'


class Server(StudioTest):
    def fill(self, text=QUICK + SCENE):
        for source in (POTTERY, POTTERY.with_suffix(".mtl"), POTTERY.with_suffix(".png")):
            shutil.copy(source, self.folder)
        picture(self.folder / "cover.png")
        (self.folder / "modar.toml").write_text(text)
        return self.studio()

    def test_models_without_a_picture_are_told_of_as_modar_bake_does(self):
        text = QUICK.replace('parameters = "none"\n', "") + SCENE.replace('"pottery.obj"', '["pottery.obj", "other.obj"]')
        studio = self.fill(text + '[[scene]]\npattern = "cover"\nmodel = "pottery"\n')
        shutil.copy(POTTERY, self.folder / "other.obj")
        _, done, _ = studio.job("api/bake", {})
        told = [finding for finding in done["findings"] if finding["id"] == "project.never-shown"]
        self.assertEqual([finding["message"] for finding in told], ["no pattern shows the models other: they are left out"])
        bundle = self.folder / "out" / "demo.modar"
        self.assertEqual([model["name"] for model in self.modar_json("inspect", bundle)["models"]], ["pottery"])
        self.assertEqual(set(self.modar_json("inspect", bundle)["patterns"][0]["keypoints"]), {"orb-2000"})
        check = self.good(studio.get("api/check"))
        self.assertEqual((check["good"], check["warnings"]), (True, 1))
        [finding] = check["findings"]
        self.assertEqual((finding["id"], finding["text"], finding["cure"]), (told[0]["id"], told[0]["message"], told[0]["cure"]))

    def test_bakes_the_bytes_of_modar_bake(self):
        studio = self.fill()
        self.assertEqual(studio.get("api/bundle").status, 404)
        name, done, seen = studio.job("api/bake", {})
        self.assertEqual(name, "baked", done)
        self.assertTrue(any(one[0] == "progress" and 0 < one[1]["done"] <= 1 for one in seen))
        bundle = studio.get("api/bundle")
        project = studio.project()
        self.assertEqual((project["bundle"]["stale"], project["bundle"]["baked"], len(project["bundle"]["scenes"])), (False, True, 1))
        other = self.folder / "other"
        other.mkdir()
        for name in ("pottery.obj", "pottery.mtl", "pottery.png", "cover.png", "modar.toml"):
            shutil.copy(self.folder / name, other)
        self.assertEqual(self.modar("bake", "--quiet", cwd=other).returncode, 0)
        self.assertEqual(bundle.body, (other / "out" / "demo.modar").read_bytes())
        # The folder's own bake has nothing to do: the state that the studio left is its own.
        if NATIVE:
            self.assertIn("up to date", self.modar("bake", "--dry-run").stderr)
        # A scene's change is linked from the cache; models stay up to date.
        self.good(studio.edit({"op": "set", "table": "scene", "pattern": "cover", "model": "pottery", "key": "turn", "value": 45}))
        self.assertTrue(studio.project()["bundle"]["stale"])
        _, done, _ = studio.job("api/bake", {})
        self.assertEqual({one["state"] for one in done["assets"]}, {"cached"})
        self.assertNotEqual(studio.get("api/bundle").body, bundle.body)
        for verb, key in (("api/check", "good"), ("api/check?device=mali400", "good"), ("api/sizes", "bytes")):
            self.assertTrue(self.good(studio.get(verb))[key], verb)
        self.assertAlmostEqual(sum(part["share"] for part in studio.get("api/sizes").json["parts"]), 1, places=3)
        told = self.modar_json("inspect", self.folder / "out" / "demo.modar")
        self.assertEqual(studio.project()["models"][0]["triangles"], told["models"][0]["triangles"])
        self.assertEqual({one["name"] for one in studio.get("api/devices").json}, set(studio.project()["devices"]))
        self.assertEqual(studio.get("api/check?device=none").status, 422)
        if NATIVE:  # Node has no renderer
            strip = studio.get("api/thumb/pottery.obj?size=64&turn=8")
            self.assertEqual((strip.status, strip.body[:2]), (200, b"\xff\xd8"), strip.body[:300])
        self.assertEqual(studio.get("api/thumb/none.obj?size=64&turn=8").status, 404)

    def test_the_same_files_become_the_bundle_that_modar_bake_makes_of_them(self):
        source = self.folder / "source"
        source.mkdir()
        museum(source)
        files = sorted(source.iterdir())
        baked = self.modar("bake", *files, "-o", self.folder / "files.modar", "--loop-views", "8", "--no-score")
        self.assertEqual(baked.returncode, 0, baked.stderr)
        studio = self.studio(self.folder / "project")
        told = [problem for file in files for problem in self.good(studio.put(file.name, file.read_bytes()))["problems"]]
        self.assertEqual([problem["where"].rsplit("/")[-1] for problem in told], ["IMG_1.HEIC"])
        self.assertIn("heif-convert", told[0]["cure"])
        found = self.good(studio.post("api/corners", {"file": "card.png"}))  # as the page does with each new picture
        self.assertEqual((found["cut"], found["doubt"]), (True, False))
        self.good(studio.edit({"op": "set", "table": "pattern", "name": "card", "key": "corners", "value": found["corners"]},
                              *({"op": "set", "table": "bake", "key": key, "value": value} for key, value in (("loop-views", 8), ("score", False)))))
        self.assertEqual(studio.job("api/bake", {})[0], "baked")
        self.assertEqual(studio.get("api/bundle").body, (self.folder / "files.modar").read_bytes())

    def test_what_is_shown_is_baked_before_the_rest(self):
        """A picture of three and its model come first, the others follow, and the end is what `modar bake` writes."""
        scenes = "".join(f'[[scene]]\npattern = "p{i}"\nmodel = "m{i}"\n\n' for i in range(3))
        for i in range(3):
            shutil.copy(POTTERY, self.folder / f"m{i}.obj")
            picture(self.folder / f"p{i}.png", 140 + 10 * i, 108)
        studio = self.fill(QUICK + '[[model]]\nfile = "m*.obj"\n\n[[pattern]]\nfile = "p?.png"\n\n' + scenes)
        events = Events(studio)
        self.assertEqual(studio.post("api/bake", {"shown": "p1"}).status, 202)
        events.until({"shown"}, 90)
        (self.folder / "seen.modar").write_bytes(studio.get("api/bundle").body)
        project = studio.project()
        name, done, seen = events.until({"baked", "failed"}, 90)
        events.close()
        self.assertEqual(name, "baked", done)
        inside = self.modar_json("inspect", self.folder / "seen.modar")
        self.assertEqual([(one["pattern"], one["model"]) for one in inside["scenes"]], [("p1", "m1")])
        self.assertEqual([(one["pattern"], one["model"]) for one in project["bundle"]["scenes"]], [("p1", "m1")])
        self.assertTrue(project["bundle"]["stale"])
        self.assertEqual([one["state"] for one in done["assets"] if one["name"] in ("p1", "m1")], ["cached"] * 2)
        self.assertFalse(studio.project()["bundle"]["stale"])
        whole = (self.folder / "out" / "demo.modar").read_bytes()
        shutil.rmtree(self.folder / ".modar")
        self.assertEqual(self.modar("bake", "--quiet").returncode, 0)
        self.assertEqual((self.folder / "out" / "demo.modar").read_bytes(), whole)
        self.assertEqual([path.name for path in self.folder.glob(".modar-*")], [])

    def test_failures_name_cause_cure_and_place(self):
        studio = self.fill()
        (self.folder / "pottery.obj").write_text("v 0 0 0\n")
        name, told, _ = studio.job("api/bake", {})
        self.assertEqual(name, "failed")
        self.assertTrue(told["errors"][0]["error"] and told["errors"][0]["cure"], told)
        self.assertIn("pottery.obj", told["errors"][0]["where"])

    def test_a_bake_can_be_cancelled_and_never_blocks_the_page(self):
        studio = self.fill(QUICK.replace("loop-views = 8", "loop-views = 1000") + SCENE)
        events = Events(studio)
        self.assertEqual(studio.post("api/bake", {}).status, 202)
        self.assertEqual(studio.post("api/bake", {}).json["code"], "studio.busy")
        self.assertTrue(studio.project()["baking"])
        self.good(studio.ask("DELETE", "api/job"))
        name, _, _ = events.until({"cancelled", "baked", "failed"}, 90)
        events.close()
        self.assertEqual(name, "cancelled")
        self.assertEqual([path for path in self.folder.rglob("*.tmp")], [])
        self.assertEqual(studio.job("api/bake", {})[0], "baked")

    def test_pages_follow_hands(self):
        studio = self.fill()
        events = Events(studio)
        (self.folder / "modar.toml").write_text(QUICK + SCENE + "# mine\n")
        name, told, _ = events.until({"project"}, 90)
        self.assertEqual((told["revision"], told["files"]), (studio.project()["revision"], False))
        events.close()
        events = Events(studio)
        with (self.folder / "pottery.obj").open("a") as file:
            file.write("# mine\n")
        _, told, _ = events.until({"project"}, 90)  # by which the page knows that there is something to bake
        self.assertEqual((told["revision"], told["files"]), (studio.project()["revision"], True))
        events.close()

    def test_corners_previews_thumbs_and_grades(self):
        studio = self.fill()
        shutil.copy(COVER, self.folder / "photo.png")
        found = self.good(studio.post("api/corners", {"file": "photo.png"}))
        self.assertEqual((found["reason"], found["sure"], found["width"]), ("fills", False, 348))
        for _ in range(2):
            start = time.monotonic()
            preview = studio.post("api/rectify", {"file": "photo.png", "corners": [[10, 10], [300, 20], [290, 400], [12, 410]], "width_mm": 100,
                                                  "height_mm": 125, "size": 360})
            took = time.monotonic() - start
        self.assertEqual((preview.status, preview.headers["Content-Type"], preview.headers["X-Aspect"][:3]), (200, "image/jpeg", "0.8"))
        print(f"second preview {1000 * took:.0f} ms")
        self.assertEqual(studio.post("api/rectify", {"file": "photo.png", "corners": [[0, 0], [9, 9], [1, 2], [3, 3]]}).json["code"], "rectify.corners")
        self.assertEqual(studio.post("api/rectify", {"file": "../x", "corners": []}).status, 422)
        self.assertEqual(studio.get("api/thumb/cover.png?size=64").body[:2], b"\xff\xd8")
        self.assertEqual(studio.get("api/thumb/cover.png?size=999999999999").status, 200)
        score = self.good(studio.get("api/score?pattern=cover"))
        told = json.loads(self.modar("pattern", "score", "cover.png", "--json").stdout)[0]
        self.assertEqual((score["grade"], score["score"]), (told["grade"], told["score"]))
        self.assertLess(score["range_cm"][0], score["range_cm"][1])

    def test_advice_has_words_in_every_language(self):
        picture(self.folder / "strip.png", width=400, height=60)
        causes = json.loads(self.modar("pattern", "score", "strip.png", "--json").stdout)[0]["causes"]
        words = {language: json.loads((ROOT / f"bake/extensions/studio/page/words/{language}.json").read_text()) for language in ("en", "de")}
        # Of what the checker says, a translation; not of damage, which no bake leaves, nor of what needs --source.
        issues = {key for key in words["de"] if key.startswith("issue.")}
        rows = [line.split(" | ") for line in self.modar("check", "--list-issues").stdout.splitlines() if line.startswith("| ") and " | " in line]
        said = [row[0][2:] for row in rows[1:] if not any(each in row[3] for each in ("bake the bundle again", "copy or download", "update this program", "pass a file"))
                and not row[0][2:].startswith(("SOURCE_", "POSE_", "VISUAL_"))]
        # English needs its own only where the command's cure is an option of it.
        own = {key for key in words["en"] if key.startswith("issue.")}
        self.assertLessEqual(own, {key for key in issues if key.endswith(".cure")})
        errors = {key for key in words["de"] if key.startswith("error.")}
        self.assertEqual(words["en"].keys() - own, words["de"].keys() - issues - errors)
        by_option = {row[0][2:] for row in rows[1:] if " --" in row[3] and f"issue.{row[0][2:]}" in issues}
        self.assertLessEqual({f"issue.{one}.cure" for one in by_option}, own)
        self.assertGreater(len(said), 10)
        self.assertEqual(issues, {f"issue.{one}{cure}" for one in said for cure in ("", ".cure")})
        self.assertEqual({key for key in words["en"] if key.startswith("advice.")}, {f"advice.{one['id']}" for one in causes})
        given = [one for one in causes if one["advice"]]
        self.assertGreater(len(given), 1)
        for one in given:
            self.assertEqual(words["en"][f"advice.{one['id']}"].rstrip(".").lower(), one["advice"])

    def test_errors_have_words_in_every_language(self):
        """Of each code that the rooms below the page give: its own words, or those of its kind. And each word that the page asks for is there."""
        rooms = ("extensions/studio", "project", "bundle", "options", "import", "image", "mesh", "texture", "pattern", "video", "io", "memory", "extensions/web", "ship")
        text = "".join(path.read_text() for room in rooms for path in (ROOT / "bake" / room).rglob("*.?pp"))
        text += "".join(path.read_text() for folder in ("formats/base", "runtime/platform", "runtime/record") for path in (ROOT / folder).rglob("*.cpp"))
        text += "".join(path.read_text().replace("'", '"') for path in (ROOT / "bake/extensions/wasm/studio").glob("*.js"))
        codes = set(re.findall(r'(?:ExitCode::\w+,\s*|wrong\w*\(|bad_\w+\(|not_read\()"([a-z]+\.[a-z0-9-]+)"', text))
        codes -= {code for code in codes if code.startswith(("calibrate.", "camera.", "confusion.", "pictures.", "simulate."))}  # of commands that the page does not have
        codes |= set(re.findall(r'"([a-z]+\.[a-z0-9-]+)",\s*DiagnosticSeverity::kWarning', text))
        self.assertGreater(len(codes), 150)
        pages = "".join(path.read_text() for path in (ROOT / "bake/extensions/studio/page").glob("*.js"))
        asked = set(re.findall(r"\bt\('([\w.]+)'", pages))
        for language in ("en", "de"):
            words = json.loads((ROOT / f"bake/extensions/studio/page/words/{language}.json").read_text())
            self.assertEqual({word for word in asked if word not in words}, set())
            if language == "en":
                continue
            self.assertEqual({code for code in codes if f"error.{code}" not in words and f"error.{code.split('.')[0]}" not in words}, set())
            own = {key.removeprefix("error.") for key in words if key.startswith("error.") and key.count(".") > 1}
            self.assertEqual({code for code in own if f'"{code}"' not in text}, set())  # none of a code that is gone

    def test_the_verdict_is_that_of_the_commands(self):
        """What `modar bake` warns of and `modar check` finds, neither more nor less; and of a device, what `modar check --device` says."""
        studio = self.fill()
        for name, damage in (("", None), ("mtl.missing-map", lambda: (self.folder / "pottery.png").unlink())):
            if damage:
                damage()
            self.assertEqual(studio.job("api/bake", {})[0], "baked")
            bundle = self.folder / "out" / "demo.modar"
            for device in ("", *studio.project()["devices"]):
                told = self.good(studio.get("api/check?device=" + device))
                checked = self.modar("check", bundle, "--json", *(["--device", device] if device else []))
                ours = json.loads(checked.stdout)["issues"]
                found = [one for one in told["findings"] if "." not in one["id"]]
                self.assertEqual([(one["id"], one["severity"]) for one in found], [(one["id"], one["severity"]) for one in ours])
                self.assertEqual([one["id"] for one in told["findings"] if "." in one["id"]], [name] if name else [])
                self.assertEqual(told["good"], checked.returncode == 0)
                self.assertEqual(told["warnings"], sum(one["severity"] == "warning" for one in told["findings"]))
            fits = {one["name"]: one for one in studio.get("api/devices").json}
            for device, one in fits.items():
                report = self.modar("check", bundle, "--device", device)
                self.assertEqual(one["fits"], report.returncode == 0)
                self.assertEqual(sum(f["severity"] != "info" for f in one["findings"]), sum(line.split()[0] in ("warning", "error") for line in report.stdout.splitlines()[1:]))
        # README's steps 2 and 3: a usual bake is good on such a phone, without a warning, and says so in whole words.
        report = self.modar("check", bundle, "--device", "mali400")
        self.assertEqual(report.returncode, 0)
        self.assertNotIn("warning", report.stdout)
        self.assertNotIn("(byte", report.stdout)

    def test_alike_pictures_are_rivals(self):
        for name in ("one", "two"):
            picture(self.folder / f"{name}.png", 144, 108)
        picture(self.folder / "other.png", 144, 108, mirrored=True)
        (self.folder / "modar.toml").write_text('[[pattern]]\nfile = "*.png"\n')
        rivals = self.good(self.studio().get("api/rivals?pattern=one"))["rivals"]
        self.assertEqual(rivals[0]["pattern"], "two")

    def test_exports(self):
        studio = self.fill()
        self.assertEqual(studio.post("api/export", {"kind": "release"}).json["code"], "studio.not-baked")
        self.assertEqual(studio.job("api/bake", {})[0], "baked")
        name, told, _ = studio.job("api/export", {"kind": "release"})
        self.assertEqual(name, "exported", told)
        key = self.folder / "keys" / "demo.key"
        self.assertEqual(stat.S_IMODE(key.stat().st_mode), 0o600)
        done = self.modar("ship", "verify", self.folder / told["path"], "--trust", str(key) + ".pub")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(studio.post("api/export", {"kind": "none"}).status, 400)
        # The page is another build's; without it the failure says so.
        name, told, _ = studio.job("api/export", {"kind": "zip", "title": "<Vases> & \"more\""})
        if name == "failed":
            self.assertTrue(told["cure"], told)
            self.assertFalse((ROOT / "build" / "web" / "web" / "bundle.js").exists(), told)
            return
        with zipfile.ZipFile(self.folder / told["path"]) as archive:
            self.assertIn("index.html", archive.namelist())
            self.assertIsNone(archive.testzip())
        self.assertEqual(studio.get(told["url"]).body, (self.folder / told["path"]).read_bytes())

    @unittest.skipUnless(NATIVE, "the program is in PATH")
    def test_a_missing_program_is_named_by_its_package(self):
        studio = self.fill()
        studio.end()
        tools = self.folder.parent / (self.folder.name + "-tools")
        tools.mkdir()
        self.addCleanup(shutil.rmtree, tools)
        (tools / "python3").symlink_to(shutil.which("python3"))
        # Each is reported before anybody requests the app, and refused as well.
        for env, code, word in (({"PATH": str(tools), "ANDROID_NDK": str(tools)}, "studio.app-tools", "aapt"), ({"ANDROID_NDK": ""}, "studio.app-ndk", "NDK"),
                                ({"ANDROID_NDK": str(tools / "none")}, "studio.app-ndk", "NDK")):
            studio = self.studio(env=env)
            if not (self.folder / "out").exists():
                self.assertEqual(studio.job("api/bake", {})[0], "baked")
            told = studio.project()["app"]
            self.assertEqual(told["code"], code)
            self.assertIn(word, told["error"])
            refused = studio.post("api/export", {"kind": "apk"})
            self.assertEqual((refused.status, refused.json["code"]), (501, code))
            studio.end()
        listed = re.search(r"for tool in (.*);", (ROOT / "scripts/apk.sh").read_text())[1].split()
        self.assertEqual(re.findall(r'"(\w+)"', re.search(r"const char\* tool : \{(.*?)\}", (ROOT / "bake/extensions/studio/exports.cpp").read_text(), re.S)[1]), listed)

    def test_200_models_and_100_pictures_open(self):
        for i in range(200):
            shutil.copy(POTTERY, self.folder / f"m{i}.obj")
        shutil.copy(POTTERY.with_suffix(".mtl"), self.folder)
        picture(self.folder / "p0.png")
        for i in range(1, 100):
            shutil.copy(self.folder / "p0.png", self.folder / f"p{i}.png")
        (self.folder / "modar.toml").write_text("".join(f'[[model]]\nfile = "m{i}.obj"\n\n' for i in range(200)) +
                                                '[[pattern]]\nfile = "p*.png"\n\n' + "".join(
            f'[[scene]]\npattern = "p{i % 100}"\nmodel = "m{i}"\n\n' for i in range(200)))
        start = time.monotonic()
        studio = self.studio()
        page = studio.get("")
        first = time.monotonic() - start
        project = studio.project()
        whole = time.monotonic() - start
        self.assertEqual((page.status, len(project["models"]), len(project["patterns"]), len(project["scenes"])), (200, 200, 100, 200))
        self.assertEqual(project["models"][0]["missing"], ["pottery.png"])
        print(f"first page {first:.2f} s, project {whole:.2f} s")

    def opener(self):
        """A folder whose xdg-open notes what it was given."""
        tools = self.folder / ".tools"
        tools.mkdir()
        (tools / "xdg-open").write_text('#!/bin/sh\necho "$1" > "$0.seen"\n')
        (tools / "xdg-open").chmod(0o755)
        return tools

    def test_the_folder_of_what_was_made_is_shown_where_there_is_a_desktop(self):
        tools = self.opener()
        studio = self.studio(env={"PATH": f"{tools}:{os.environ['PATH']}", "DISPLAY": ":0"})
        self.good(studio.post("api/show", {}))
        self.assertEqual((tools / "xdg-open.seen").read_text(), f"{self.folder.resolve()}/out\n")
        studio.end()
        answer = self.studio(env={"DISPLAY": "", "WAYLAND_DISPLAY": "", "PATH": f"{tools}:{os.environ['PATH']}"}).post("api/show", {})
        self.assertEqual((answer.status, answer.json["code"]), (501, "studio.show"))
        self.assertIn(f"{self.folder.resolve()}/out", answer.json["cure"])

    def test_opens_the_browser_by_an_address_that_works_once(self):
        tools = self.opener()
        process = subprocess.Popen([BIN / "modar", "studio", self.folder], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"})
        self.addCleanup(process.kill)
        self.assertIn("open in your browser", process.stderr.readline())
        seen = (tools / "xdg-open.seen").read_text().strip()
        address = (self.folder / ".modar" / "studio" / "address").read_text()
        self.assertNotIn(address.split("/")[3], seen)
        opened = urllib.parse.urlsplit(seen)
        answers = []
        for _ in range(2):
            connection = http.client.HTTPConnection(opened.hostname, opened.port)
            connection.request("GET", opened.path)
            answer = connection.getresponse()
            answers.append((answer.status, urllib.parse.urljoin(seen, answer.getheader("Location") or "")))
            connection.close()
        self.assertEqual(answers, [(303, address), (403, seen)])
        process.terminate()
        self.assertEqual(process.wait(30), 0)
        process.stdout.close()
        process.stderr.close()


if __name__ == "__main__":
    unittest.main()
