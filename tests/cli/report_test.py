"""`modar report`: one page that needs nothing else, says what `modar inspect` says, and opens in a browser."""
import json
import re
import shutil
import subprocess
import unittest
from html.parser import HTMLParser

from programs import POTTERY, ProgramTest, picture

VOID = {"meta", "link", "img", "br", "rect", "path"}


class Page(HTMLParser):
    """Elements in order, with their attributes; open elements have to be closed."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.words = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, (tag, self.getpos())

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.words.append(data.strip())

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


class Report(ProgramTest):
    def report(self, bundle, *arguments):
        out = self.folder / "report.html"
        done = self.modar("report", bundle, "-o", out, "--quiet", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.text = out.read_text(encoding="utf-8")
        return Page(self.text)

    def test_the_page_is_whole_and_fetches_nothing(self):
        page = self.report(self.bake_demo())
        self.assertEqual(page.open, [])
        self.assertEqual(page.all("script"), [])
        self.assertNotRegex(self.text, r"(src|href)=\"(?!data:)|url\(|@import|https?://")
        self.assertEqual(page.all("html")[0]["lang"], "en")
        for image in page.all("img"):
            self.assertGreater(len(image["alt"]), 5)
        for svg in page.all("svg"):
            self.assertTrue(svg.get("aria-label") or svg.get("aria-hidden") == "true", svg)
        ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
        self.assertEqual(len(ids), len(set(ids)))
        for section in page.all("section"):
            self.assertIn(section["aria-labelledby"], ids)

    def test_it_says_what_inspect_and_check_say(self):
        bundle = self.bake_demo()
        page = self.report(bundle)
        inspect = self.modar_json("inspect", bundle)
        for kind in ("models", "textures", "patterns"):
            for asset in inspect[kind]:
                self.assertIn(asset["name"], page.words)
        self.assertIn(f"{inspect['models'][0]['triangles']:,}", page.words)
        self.assertIn(f"{inspect['textures'][0]['psnr_db']:.1f} dB", page.words)
        self.assertIn("Good", page.words)
        self.assertEqual(len([i for i in page.all("img") if "on the pattern" in i["alt"]]), len(inspect["scenes"]))
        broken = bytearray(bundle.read_bytes())
        broken[-100] ^= 1
        bundle.write_bytes(broken)
        page = self.report(bundle)
        self.assertIn("Bad", page.words)
        for issue in self.modar("check", bundle).stdout.split("\n"):
            if "error" in issue.split(" "):
                self.assertIn(re.search(r"[A-Z]+_[A-Z_]+", issue).group(), page.words)

    def test_what_the_bake_said_is_in_it(self):
        bundle = self.folder / "b.modar"
        done = self.modar("bake", "--model", POTTERY, "--no-lods", "-o", bundle, "--quiet", "--json",
                          "--texture-pictures", "lost")
        self.assertEqual(done.returncode, 0, done.stderr)
        (self.folder / "bake.json").write_text(done.stdout)
        page = self.report(bundle, "--bake", "bake.json", "--texture-pictures", "lost")
        for stage in json.loads(done.stdout)["stages"]:
            self.assertIn(stage["name"], page.words)
        self.assertEqual(len([i for i in page.all("img") if "difference" in i["alt"]]), 1)
        faces = sum(line.startswith("f ") for line in POTTERY.read_text().splitlines())
        self.assertRegex(" ".join(page.words), rf"What became of the files' content.*pottery\s*faces\s*{faces:,}\s*0\s*0")
        (self.folder / "bake.json").write_text("{}")
        self.assert_fails(self.modar("report", bundle, "-o", "x.html", "--bake", "bake.json", "--quiet"), 3, "report.bake")

    def test_a_pattern_shows_its_grade_and_range(self):
        picture(self.folder / "small.png", 60, 45)
        done = self.modar("bake", "--pattern", "small.png:150mm", "-o", "b.modar", "--loop-views", "8", "--parameters", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        page = self.report(self.folder / "b.modar")
        self.assertIn(page.words[page.words.index("Grade, A to E") + 1], list("ABCDE"))
        words = " ".join(page.words)
        self.assertRegex(words, r"Recognised from [\d.]+ c?m to [\d.]+ m, to \d+ degrees, \d+ % right when half covered\.")
        self.assertIn("Give a larger picture", words)

    def test_areas_are_as_sizes(self):
        bundle = self.bake_demo()
        page = self.report(bundle)
        inspect = self.modar_json("inspect", bundle)
        boxes = {box["class"]: float(box["width"]) * float(box["height"]) for box in page.all("rect") if "x" in box}
        whole = 1000 * 420
        self.assertAlmostEqual(sum(boxes.values()) / whole, 1, delta=0.01)
        for kind in ("model", "texture"):
            self.assertAlmostEqual(boxes[kind] / whole, inspect[kind + "s"][0]["bytes"] / inspect["bytes"], delta=0.01)

    def test_names_do_not_become_markup(self):
        for extension in ("obj", "mtl", "png"):
            shutil.copy(POTTERY.with_suffix("." + extension), self.folder / f"pottery.{extension}")
        odd = self.folder / "a<script>&\"'.obj"
        shutil.move(self.folder / "pottery.obj", odd)
        bundle = self.folder / "odd.modar"
        self.assertEqual(self.modar("bake", "--model", odd, "--no-lods", "-o", bundle).returncode, 0)
        page = self.report(bundle)
        self.assertEqual(page.all("script"), [])
        self.assertEqual(page.open, [])
        self.assertIn("a<script>&\"'", "".join(page.words))

    def test_a_browser_opens_it_without_complaint(self):
        chromium = shutil.which("chromium")
        if chromium is None:
            self.skipTest("chromium is not installed")
        self.report(self.bake_demo())
        for width in (1200, 390):
            shot = self.folder / f"{width}.png"
            done = subprocess.run(
                [chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--hide-scrollbars",
                 f"--user-data-dir={self.folder}/profile", f"--window-size={width},1000", f"--screenshot={shot}",
                 f"file://{self.folder}/report.html"], capture_output=True, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(shot.exists())
            self.assertNotIn("CONSOLE", done.stderr)

    def test_mistakes(self):
        self.assert_fails(self.modar("report", self.folder / "none.modar", "-o", self.folder / "x.html"), 2, "none.modar")
        bundle = self.bake_demo()
        before = bundle.read_bytes()
        self.assert_fails(self.modar("report", bundle, "-o", bundle), 1, "out.input")
        self.assertEqual(bundle.read_bytes(), before)
        self.assert_fails(self.modar("report", bundle, "-o", "rep.png"), 1, "out.format", "the report is a page in HTML")
        self.assertFalse((self.folder / "rep.png").exists())


if __name__ == "__main__":
    unittest.main()
