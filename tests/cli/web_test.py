"""`modar web`: the folder that it writes, what it refuses, and its server. The page itself: tests/web."""
import html
import http.client
import json
import os
import re
import shutil
import signal
import socket
import ssl
import struct
import subprocess
import sys
import unittest
import urllib.error
import urllib.request

from programs import BIN, COVER, POTTERY, QUICK, ROOT, STATUE, ProgramTest, picture

PAGE = ROOT / "runtime" / "extensions" / "web"
# What an accessibility statement says of the tests, and the tests that show it.
PROOFS = {
    "axe": ("page_test.py", "test_axe_core_finds_nothing"), "names": ("page_test.py", "test_everything_has_a_name"),
    "keys": ("page_test.py", "test_keys_turn_and_resize"), "handles": ("page_test.py", "test_a_look_without_a_camera"),
    "alone": ("page_test.py", "test_a_look_without_a_camera"), "languages": ("page_test.py", "test_a_language_is_chosen_and_kept"),
    "reflow": ("page_test.py", "test_small_screens_scroll_one_way")}
ENGINES = tuple(f"engine-{name}.{kind}" for name in ("plain", "record-plain", "record-simd", "simd") for kind in ("js", "wasm"))


class From(urllib.request.HTTPSHandler):
    """Opens connections from another of this machine's addresses."""

    def __init__(self, address, context):
        super().__init__(context=context)
        self.address = address

    def https_open(self, request):
        return self.do_open(lambda host, **words: http.client.HTTPSConnection(host, source_address=(self.address, 0), context=self._context,
                                                                              **words), request)


# Modules that the page's app.js contains.
MODULES = ("arrival.js", "bundle.js", "camera.js", "gyroscope.js", "modar-view.js", "modar-viewer.js", "modar-worker.js", "modar.js", "recorder.js",
           "storage.js", "turntable.js", "viewer-parts.js")


class Web(ProgramTest):
    def setUp(self):
        super().setUp()
        self.page = self.folder / "page"
        shutil.copytree(PAGE, self.page)
        for name in ENGINES:
            (self.page / name).write_text(f"fake {name}")

    def test_what_a_killed_run_leaves_the_next_one_takes(self):
        bundle = self.bake_demo()
        commands = {"web": ("web", bundle, "--page", self.page, "-o"), "extract": ("inspect", bundle, "--extract")}
        for name, words in commands.items():
            for which in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
                with self.subTest(name=name, signal=which):
                    output = self.folder / f"{name}-{which.name}"
                    process = subprocess.Popen([BIN / "modar", *words, output], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                    while process.poll() is None and not list(output.glob(".modar-[0-9]*/*")):
                        pass
                    process.send_signal(which)
                    self.assertEqual(process.wait(), -which)
                    self.assertEqual(output.exists(), which == signal.SIGKILL, "no other signal leaves anything")
                    again = self.modar(*words, output)
                    self.assertEqual(again.returncode, 0, again.stderr)
                    self.assertEqual([file.name for file in output.iterdir() if file.name.startswith(".modar-")], [".modar-output"])
        # A folder of somebody else's stays refused, and one that cannot be filled is not left behind.
        foreign = self.folder / "foreign"
        foreign.mkdir()
        (foreign / "index.html").write_text("a web server's root")
        self.assert_fails(self.web(bundle, output="foreign"), 1, "foreign", "not written")
        self.assertEqual([file.name for file in foreign.iterdir()], ["index.html"])

    def web(self, *words, output="site", page=True):
        return self.modar("web", *words, "-o", self.folder / output, *(["--page", self.page] if page else []))

    def read(self, name, folder="site"):
        return (self.folder / folder / name).read_bytes()

    def test_the_folder(self):
        bundle = self.bake_demo("red_vase.modar")
        texts = self.folder / "texts.json"
        texts.write_text(json.dumps({"cover": {"de": {"name": "Einband", "text": "Um 1890.", "alt": "Eine Vase"}, "en": {"name": "Cover"}}}))
        done = self.web(bundle, "--title", 'A <b> & "c"', "--languages", "de,en", "--texts", texts, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        written = json.loads(done.stdout)
        on_disk = sorted(str(p.relative_to(self.folder / "site")) for p in (self.folder / "site").rglob("*") if p.is_file())
        on_disk.remove(".modar-output")  # the mark is no part of the page
        self.assertEqual(sorted(written["files"]), on_disk)
        shown = self.read("bundles/red-vase.modar")
        self.assertEqual(len(bundle.read_bytes()) - len(shown), written["trimmed_bytes"])
        self.assertGreater(written["trimmed_bytes"], 0)
        self.assertEqual(self.modar_json("inspect", self.folder / "site/bundles/red-vase.modar")["patterns"][0]["keypoints"], {})
        app = self.folder / "app.modar"  # as scripts/apk.sh puts it into an app
        subprocess.run([sys.executable, ROOT / "scripts/trim_bundle.py", bundle, app], check=True)
        self.assertEqual(app.read_bytes(), shown)
        self.assertEqual(written["ranged_bytes"], 0, "small bundles are downloaded whole")
        self.assertEqual(self.modar("check", self.folder / "site/bundles/red-vase.modar").returncode, 0)
        for script in ("app.js", "engine.js", "viewer-parts.js"):
            self.assertEqual(self.read(script), (self.page / script).read_bytes(), script)
        site = json.loads(self.read("site.json"))
        self.assertEqual((site["title"], site["languages"]), ('A <b> & "c"', ["de", "en"]))
        [pattern] = site["bundles"][0]["patterns"]
        self.assertEqual(site["bundles"][0]["title"], "red vase")
        self.assertEqual(pattern["texts"], {"de": {"name": "Einband", "text": "Um 1890.", "alt": "Eine Vase"}, "en": {"name": "Cover", "text": ""}})
        hint = self.read(pattern["image"])
        self.assertEqual((hint[:4], hint[8:12]), (b"RIFF", b"WEBP"))
        self.assertLess(len(hint), 15_001)
        width, height = self.assert_like_the_cover(self.folder / "site" / pattern["image"])
        self.assertGreater(max(width, height), 300)
        self.assertAlmostEqual(width / height, pattern["width"] / pattern["height"], delta=0.01)
        self.assertIn(f"<title>{html.escape(site['title'])}</title>", self.read("index.html").decode())
        self.assertEqual(json.loads(self.read("manifest.webmanifest"))["name"], 'A <b> & "c"')
        # What a visitor keeps is all that there is, but for the worker that keeps it and files for other pages.
        kept = re.match(r"const SITE = (\{.*?\n\})\s*;\n", self.read("sw.js").decode(), re.S)
        files = json.loads(kept[1])["files"]
        self.assertEqual(sorted(file.split("?")[0] for file in files), sorted(set(on_disk) - {"sw.js", "bundles/red-vase.modar", *MODULES}))
        # The page asks for a bundle under the address that the worker keeps it under: it travels once.
        self.assertIn(site["bundles"][0]["file"], files)
        self.assertIn("?v=", site["bundles"][0]["file"])

    def test_what_was_asked_for_stays_and_what_is_never_shown_is_named(self):
        picture(self.folder / "small.png")
        bake = lambda out, *words: self.modar("bake", "--pattern", "small.png", "-o", out, *QUICK, "--quiet", *words)
        self.assertEqual(bake("asked.modar", "--parameters", "orb-500").returncode, 0)
        done = self.web("asked.modar", "--json")
        self.assertEqual((json.loads(done.stdout)["trimmed_bytes"], json.loads(done.stdout)["warnings"]), (0, []), done.stderr)
        self.assertEqual(self.read("bundles/asked.modar"), (self.folder / "asked.modar").read_bytes())
        app = self.folder / "app.modar"
        subprocess.run([sys.executable, ROOT / "scripts/trim_bundle.py", self.folder / "asked.modar", app], check=True)
        self.assertEqual(app.read_bytes(), (self.folder / "asked.modar").read_bytes())
        (self.folder / "modar.toml").write_text(
            f'[project]\nname = "two"\n[bake]\nloop-views = 8\nscore = false\nlods = 1\n[[model]]\nfile = ["{POTTERY}", "{STATUE}"]\n'
            '[[pattern]]\nfile = "small.png"\n[[scene]]\npattern = "small"\nmodel = "pottery"\n'
            '[[bundle]]\nname = "two"\nmodels = "*"\npatterns = "*"\n')
        self.assertEqual(self.modar("bake", "--outside", "--quiet").returncode, 0)
        done = self.web("out/two.modar", output="two")
        self.assertIn("model 'statue': no pattern shows it", done.stderr)
        self.assertNotIn("pottery", done.stderr)
        self.assertIn("NEVER_SHOWN", self.modar("check", "out/two.modar").stdout)

    def test_files_for_the_visitors_room(self):
        done = self.web(self.bake_demo(), "--room", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        [pattern] = json.loads(self.read("site.json"))["bundles"][0]["patterns"]
        usdz, glb = self.read(pattern["usdz"]), self.read(pattern["glb"])
        self.assertEqual((usdz[:4], glb[:4]), (b"PK\x03\x04", b"glTF"))
        # Both in metres, y up: the model's places in the one are those in the other.
        length = struct.unpack_from("<I", glb, 12)[0]
        document = json.loads(glb[20:20 + length])
        [node] = document["nodes"]
        matrix = node["matrix"]
        corners = [document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]][end] for end in ("min", "max")]
        places = [[sum(matrix[4 * k + row] * corner[k] for k in range(3)) + matrix[12 + row] for row in range(3)] for corner in corners]
        text = re.search(rb"point3f\[\] points = \[(.*?)\]", usdz)[1].decode()
        points = [tuple(map(float, v.split(","))) for v in re.findall(r"\(([^()]*)\)", text)]
        for axis in range(3):
            low, high = sorted(place[axis] for place in places)
            self.assertAlmostEqual(low, min(p[axis] for p in points), delta=1e-5)
            self.assertAlmostEqual(high, max(p[axis] for p in points), delta=1e-5)
        # A page without a network cannot open them: they are not kept.
        files = json.loads(re.match(r"const SITE = (\{.*?\n\})\s*;\n", self.read("sw.js").decode(), re.S)[1])["files"]
        self.assertNotIn(pattern["usdz"], files)
        self.assertNotIn(pattern["glb"], files)

    def test_same_input_same_bytes_and_a_change_is_a_new_version(self):
        bundle = self.bake_demo()
        for output, title in (("a", "One"), ("b", "One"), ("c", "Two")):
            self.assertEqual(self.web(bundle, "--title", title, output=output).returncode, 0)
        for name in json.loads(self.web(bundle, "--title", "One", "--json", output="a").stdout)["files"]:
            self.assertEqual(self.read(name, "a"), self.read(name, "b"), name)
        self.assertNotEqual(self.read("sw.js", "a"), self.read("sw.js", "c"))

    def assert_like_the_cover(self, hint):
        """Its colours are within 7 of 255 on average; those of the gray picture with 16 x 16 colours were 14 away. Answers its size."""
        def small(path):
            return subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-vf", "scale=48:64:flags=area", "-pix_fmt", "rgb24", "-f", "rawvideo", "-"],
                                  capture_output=True, check=True).stdout
        ours, truth = small(hint), small(COVER)
        self.assertLess(sum(abs(a - b) for a, b in zip(ours, truth)) / len(truth), 7)
        size = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=width,height", "-of", "csv=p=0", hint], capture_output=True, text=True).stdout
        return tuple(map(int, size.strip().split(",")))

    def test_every_kind_of_pattern_has_its_picture(self):
        """A target of 8th Wall whose picture is on its side, a label on a bottle, and a picture that was cut out of a photo."""
        run = lambda *words: subprocess.run(["ffmpeg", "-v", "error", *words], check=True, cwd=self.folder)
        run("-i", COVER, "-vf", "transpose=clock", "turned.png")
        run("-i", COVER, "-vf", "pad=iw+200:ih+200:100:100:white", "photo.png")
        (self.folder / "wall.json").write_text(json.dumps({"name": "wall", "type": "PLANAR", "imagePath": "turned.png", "properties": {"isRotated": True}}))
        width, height = map(int, subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=width,height", "-of", "csv=p=0", COVER],
                                                capture_output=True, text=True).stdout.split(","))
        corners = f"100:100:{100 + width}:100:{100 + width}:{100 + height}:100:{100 + height}"
        for what in ("wall.json", f"{COVER}:shape=cylinder,diameter=66mm,arc=120", f"photo.png:shape=flat,corners={corners}"):
            with self.subTest(what):
                done = self.modar("bake", "--pattern", what, "-o", "one.modar", "--quiet", *QUICK)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(self.web(self.folder / "one.modar", "--quiet").returncode, 0)
                self.assert_like_the_cover(self.folder / "site" / "patterns" / "one-0.webp")

    def test_languages_are_complete_and_more_can_be_added(self):
        bundle = self.bake_demo()
        english = json.loads((PAGE / "words" / "en.json").read_text())
        shown = lambda text: sorted(re.findall(r"\{\w+\}", text))
        for file in (PAGE / "words").glob("*.json"):
            twice = []  # of two members with one name the last one is read
            words = json.loads(file.read_text(), object_pairs_hook=lambda pairs: twice.extend(
                {key for key, _ in pairs if [k for k, _ in pairs].count(key) > 1}) or dict(pairs))
            self.assertEqual(twice, [], file.name)
            self.assertEqual(list(words), list(english), file.name)
            self.assertEqual(list(words["errors"]), list(english["errors"]), file.name)
            for key, text in english.items():
                if key != "errors":
                    self.assertEqual(shown(words[key]), shown(text), f"{file.name}, {key}")
        more = self.folder / "more"
        more.mkdir()
        (more / "cs.json").write_text(json.dumps({**english, "start": "Spustit fotoaparát"}))
        self.assertEqual(self.web(bundle, "--words", more, "--languages", "cs,pl", "--link", "Imprint=imprint.html").returncode, 0)
        self.assertIn("Spustit", self.read("words/cs.json").decode())
        site = json.loads(self.read("site.json"))
        self.assertEqual((site["languages"], site["links"]), (["cs", "pl"], [{"text": "Imprint", "url": "imprint.html"}]))
        for without, said in (({**english, "start": ""}, "start"),
                              ({**english, "errors": {**english["errors"], "busy": ["only one"]}}, "errors/busy")):
            (more / "cs.json").write_text(json.dumps(without))
            self.assert_fails(self.web(bundle, "--words", more), 3, "cs.json", said)
        self.assert_fails(self.web(bundle, "--words", self.folder / "none"), 2, "none")
        for link in ("Imprint", "=https://example.org", "Bad=javascript:alert(1)", "Bad=/etc/passwd", "Bad=https://museum.org@evil.example", "Bad=https://museum.org/\u202egpj"):
            self.assert_fails(self.web(bundle, "--link", link), 1, "--link 'Imprint=")

    def test_an_accessibility_statement(self):
        texts = self.folder / "texts.json"
        texts.write_text(json.dumps({"cover": {"de": {"name": "Einband", "alt": "Eine Vase"}, "en": {"name": "The <cover>"}}}))
        publisher = {"publisher": "Museum <of> X", "date": "2026-11-26", "feedback": "mailto:access@example.org", "enforcement": "https://example.org/?a=1&b"}
        file = self.folder / "statement.json"
        file.write_text(json.dumps(publisher))
        words = ["--title", "Pots & pans", "--statement", file, "--texts", texts, "--words", self.folder / "more", "--languages", "de,en,cs"]
        (self.folder / "more").mkdir()
        shutil.copy(PAGE / "words" / "en.json", self.folder / "more" / "cs.json")
        bundle = self.bake_demo()
        self.assertEqual(self.web(bundle, *words).returncode, 0)
        german, english, czech = (self.read(f"accessibility-{language}.html").decode() for language in ("de", "en", "cs"))
        for page, said in ((german, "Stand der Vereinbarkeit mit den Anforderungen"), (english, "Compliance status"),
                           (english, "The &lt;cover&gt;"), (english, "Museum &lt;of&gt; X is committed"), (english, "<time>2026-11-26</time>"),
                           (english, '<a href="mailto:access@example.org">access@example.org</a>'),
                           (english, '<a href="https://example.org/?a=1&amp;b">'), (english, '<a href="./?lang=en">Pots &amp; pans</a>'),
                           (german, '<html lang="de">'), (czech, '<html lang="en">')):
            self.assertIn(said, page)
        self.assertNotIn("Einband", german)  # it has a description
        self.assertNotRegex(german + english, r"\{\w+\}|<p></p>|<li></li>|<h2></h2>")
        site = json.loads(self.read("site.json"))
        self.assertEqual(site["statements"]["de"], {"text": "Erklärung zur Barrierefreiheit", "url": "accessibility-de.html", "lang": "de"})
        self.assertEqual(site["statements"]["cs"]["lang"], "en")
        self.assertIn("accessibility-de.html", self.read("sw.js").decode())
        for part, bad in (("publisher", ""), ("date", "today"), ("feedback", "javascript:alert(1)"), ("enforcement", "/etc/passwd")):
            file.write_text(json.dumps({**publisher, part: bad}))
            self.assert_fails(self.web(bundle, *words), 3, "statement.json", f"'{part}'")
        file.write_text("[]")
        self.assert_fails(self.web(bundle, *words), 3, "'publisher'")

    def test_statements_are_complete_and_say_what_tests_show(self):
        def texts(value, path=""):
            return {path: value} if isinstance(value, str) else {k: v for key in value for k, v in texts(value[key], f"{path}/{key}").items()}
        english = texts(json.loads((PAGE / "statements" / "en.json").read_text()))
        languages = {file.name for file in (PAGE / "words").glob("*.json")}
        self.assertEqual({file.name for file in (PAGE / "statements").glob("*.json")}, languages)
        for name in languages:
            own = texts(json.loads((PAGE / "statements" / name).read_text()))
            self.assertEqual(list(own), list(english), name)
            for key, text in english.items():
                self.assertEqual(sorted(re.findall(r"\{\w+\}", own[key])), sorted(re.findall(r"\{\w+\}", text)), f"{name}, {key}")
        said = {key.rpartition("/")[2] for key in english if key.startswith("/preparation/")} - {"heading", "date", "method", "untested"}
        self.assertEqual(said, set(PROOFS))
        for file, test in PROOFS.values():
            self.assertIn(f"def {test}(self)", (ROOT / "tests" / "web" / file).read_text())

    def test_what_it_refuses(self):
        bundle = self.bake_demo()
        self.assert_fails(self.web(bundle, "--languages", "xx"), 1, "xx", "en, de")
        self.assert_fails(self.web(bundle, bundle), 1, "rename")
        self.assert_fails(self.web("none.modar"), 2, "none.modar")
        rotten = self.folder / "rotten.modar"
        data = bytearray(bundle.read_bytes())
        data[-1] ^= 1
        rotten.write_bytes(data)
        self.assert_fails(self.web(rotten), 3, "rotten.modar")
        texts = self.folder / "texts.json"
        for text, word in (("[]", "object"), ('{"poster": {"en": {"name": "x"}}}', "pattern"), ('{"cover": {"en": {}}}', "name")):
            texts.write_text(text)
            self.assert_fails(self.web(bundle, "--texts", texts), 3, word)
        (self.page / "engine-simd.wasm").unlink()
        self.assert_fails(self.web(bundle), 2, "engine-simd.wasm")

    def serve(self, *words):
        """The folder's server: its process, its port, and a context that trusts its certificate."""
        words = [str(BIN / "modar"), "web", str(self.bake_demo()), "-o", str(self.folder / "site"), "--page", str(self.page), "--serve",
                 "--port", "0", "--quiet", *words]
        server = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(server.stdout.close)
        self.addCleanup(server.wait)
        self.addCleanup(os.kill, server.pid, signal.SIGINT)
        self.urls = []
        while not self.urls or "localhost" not in self.urls[-1]:
            self.urls.append(server.stdout.readline().strip())
        port = int(self.urls[-1].rstrip("/").rsplit(":", 1)[1])
        return port, ssl.create_default_context(cadata=ssl.get_server_certificate(("127.0.0.1", port)))

    def get(self, port, context, path):
        try:
            with urllib.request.urlopen(f"https://127.0.0.1:{port}{path}", context=context, timeout=20) as answer:
                return answer.status, answer.read(), answer.headers
        except urllib.error.HTTPError as error:
            with error:
                return error.code, b"", error.headers

    def test_its_server_stays_in_the_folder(self):
        port, context = self.serve("--bind", "127.0.0.1")
        self.assertEqual(self.urls, [f"https://localhost:{port}/"])
        secret = self.folder / "secret.txt"
        secret.write_text("secret")
        site = self.folder / "site"
        (site / "link.txt").symlink_to(secret)
        (site / "linked").symlink_to(self.folder)
        (site / "inner.txt").symlink_to(site / "site.json")
        os.mkfifo(site / "pipe")
        for path in ("/link.txt", "/linked/secret.txt", "/../secret.txt", "/%2e%2e/secret.txt", "/.modar-output", "/pipe", "/none"):
            self.assertEqual(self.get(port, context, path)[0], 404, path)
        self.assertEqual(self.get(port, context, "/inner.txt")[1], self.read("site.json"))
        for path in ("/", "/index.html", "/app.js", "/none"):
            headers = self.get(port, context, path)[2]
            policy = headers["Content-Security-Policy"]
            for part in ("base-uri 'none'", "object-src 'none'", "'wasm-unsafe-eval'"):
                self.assertIn(part, policy)
            self.assertNotIn("'unsafe-eval'", policy)
            self.assertEqual((headers["X-Content-Type-Options"], headers["Referrer-Policy"]), ("nosniff", "no-referrer"))
        page = self.read("index.html").decode()
        self.assertNotIn("'unsafe-eval'", page)
        self.assertIn("base-uri 'none'; object-src 'none'", page)

    def test_slow_connections_do_not_stop_its_server(self):
        port, context = self.serve()
        slow = []
        for host in ("127.0.0.1", "127.0.0.2", "127.0.0.3"):  # other addresses of this machine are other clients
            for _ in range(30):
                guest = socket.socket()
                guest.bind((host, 0))
                guest.connect(("127.0.0.1", port))
                slow.append(guest)
        for one in slow:
            self.addCleanup(one.close)
            try:
                one.sendall(b"\x16")  # a handshake that begins, and then nothing
            except OSError:
                pass  # closed at once: one too many of that address
        guest = urllib.request.build_opener(From("127.0.0.9", context))
        with guest.open(f"https://127.0.0.1:{port}/", timeout=20) as answer:
            self.assertEqual(answer.status, 200)
        # Those that only wait are closed: the address that had too many is served again.
        for one in slow:
            one.settimeout(30)
            try:
                self.assertIn(one.recv(1), (b"", b"\x15"))
            except ConnectionError:
                pass
        self.assertEqual(self.get(port, context, "/")[0], 200)
        self.assert_fails(self.modar("web", self.bake_demo(), "-o", self.folder / "other", "--page", self.folder), 2, "contains no page", "web.page")
        self.assert_fails(self.modar("web", self.bake_demo(), "-o", self.folder / "site", "--page", self.page, "--serve", "--bind", "here",
                                     "--quiet"), 1, "web.bind")

    def test_it_serves_by_https_with_a_certificate_of_its_own(self):
        bundle = self.bake_demo()
        words = [str(BIN / "modar"), "web", str(bundle), "-o", str(self.folder / "site"), "--page", str(self.page), "--serve", "--port", "0"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
            try:
                url = ""
                while "localhost" not in url:
                    url = server.stdout.readline().strip()
                    self.assertTrue(url.startswith("https://"), url)
                port = int(url.rstrip("/").rsplit(":", 1)[1])
                # Trusting this certificate alone: its names have to fit.
                trust = ssl.create_default_context(cadata=ssl.get_server_certificate(("127.0.0.1", port)))
                for host in ("localhost", "127.0.0.1"):
                    with urllib.request.urlopen(f"https://{host}:{port}/", context=trust) as page:
                        self.assertEqual(page.read(), self.read("index.html"))
                with urllib.request.urlopen(f"{url}engine-simd.wasm", context=trust) as engine:
                    self.assertEqual(engine.headers["Content-Type"], "application/wasm")
            finally:
                os.kill(server.pid, signal.SIGINT)
            self.assertIn("\u2588", server.communicate()[1])


if __name__ == "__main__":
    unittest.main()
