"""`modar web`: the folder that it writes, what it refuses, and its server. The page itself: tests/web."""
import html
import json
import os
import re
import shutil
import signal
import ssl
import struct
import subprocess
import unittest
import urllib.request

from programs import BIN, ROOT, ProgramTest

PAGE = ROOT / "runtime" / "web"
ENGINES = ("engine-plain.js", "engine-plain.wasm", "engine-simd.js", "engine-simd.wasm")


class Web(ProgramTest):
    def setUp(self):
        super().setUp()
        self.page = self.folder / "page"
        shutil.copytree(PAGE, self.page)
        for name in ENGINES:
            (self.page / name).write_text(f"stands for {name}")

    def web(self, *words, output="site", page=True):
        return self.modar("web", *words, "-o", self.folder / output, *(["--page", self.page] if page else []))

    def read(self, name, folder="site"):
        return (self.folder / folder / name).read_bytes()

    def test_the_folder(self):
        bundle = self.bake_demo("red_vase.modar")
        texts = self.folder / "texts.json"
        texts.write_text(json.dumps({"cover": {"de": {"name": "Einband", "text": "Um 1890."}, "en": {"name": "Cover"}}}))
        done = self.web(bundle, "--title", 'A <b> & "c"', "--languages", "de,en", "--texts", texts, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        written = json.loads(done.stdout)
        on_disk = sorted(str(p.relative_to(self.folder / "site")) for p in (self.folder / "site").rglob("*") if p.is_file())
        on_disk.remove(".modar-output")  # the mark is no part of the page
        self.assertEqual(sorted(written["files"]), on_disk)
        self.assertEqual(self.read("bundles/red-vase.modar"), bundle.read_bytes())
        self.assertEqual(self.read("app.js"), (PAGE / "app.js").read_bytes())
        site = json.loads(self.read("site.json"))
        self.assertEqual((site["title"], site["languages"]), ('A <b> & "c"', ["de", "en"]))
        [pattern] = site["bundles"][0]["patterns"]
        self.assertEqual(site["bundles"][0]["title"], "red vase")
        self.assertEqual(pattern["texts"], {"de": {"name": "Einband", "text": "Um 1890."}, "en": {"name": "Cover", "text": ""}})
        hint = self.read(pattern["image"])
        self.assertEqual(hint[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", hint[16:24]), (pattern["width"], pattern["height"]))
        self.assertIn(f"<title>{html.escape(site['title'])}</title>", self.read("index.html").decode())
        self.assertEqual(json.loads(self.read("manifest.webmanifest"))["name"], 'A <b> & "c"')
        # What a visitor keeps is all that there is, but for the worker that keeps it.
        kept = re.match(r"const SITE = (\{.*?\n\})\s*;\n", self.read("sw.js").decode(), re.S)
        self.assertEqual(sorted(json.loads(kept[1])["files"]), sorted(set(on_disk) - {"sw.js"}))

    def test_same_input_same_bytes_and_a_change_is_a_new_version(self):
        bundle = self.bake_demo()
        for output, title in (("a", "One"), ("b", "One"), ("c", "Two")):
            self.assertEqual(self.web(bundle, "--title", title, output=output).returncode, 0)
        for name in json.loads(self.web(bundle, "--title", "One", "--json", output="a").stdout)["files"]:
            self.assertEqual(self.read(name, "a"), self.read(name, "b"), name)
        self.assertNotEqual(self.read("sw.js", "a"), self.read("sw.js", "c"))

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
