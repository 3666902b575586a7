"""What modar-fetch shows of a new bundle before all of it has come: made, drawn, taken away again."""
import json
import os
import re
import shutil
import subprocess
import unittest

from programs import BIN, QUICK, picture
from servers import Keeper
from ship_files import ShipTest, contents

SIDE = 96  # pixels of a drawn picture


class Preview(ShipTest):
    def begin(self):
        """A fetch that is killed when it has reported the preview: what its status says then."""
        status = self.folder / "status.json"
        status.unlink(missing_ok=True)
        server = Keeper(self.site, lambda: status.exists() and json.loads(status.read_text())["result"] == "first")
        self.addCleanup(server.stop)
        fetch = subprocess.Popen([BIN / "modar-fetch", server.url(), "--store", self.store, "--trust", self.trust, "--status", status],
                                 stderr=subprocess.PIPE, text=True)
        try:
            self.assertIn("can be shown", fetch.stderr.readline())
            return json.loads(status.read_text())
        finally:
            fetch.kill()
            fetch.communicate()

    def drawn(self, bundle):
        """A view of it, RGB."""
        out = self.folder / f"drawn-{bundle.name}"
        done = self.run_program("modar-play", bundle, "--turntable", "1", "--size", f"{SIDE}x{SIDE}", "--out", out, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        raw = subprocess.run(["ffmpeg", "-v", "error", "-i", out / "frame_000000.png", "-pix_fmt", "rgb24", "-f", "rawvideo", "-"],
                             capture_output=True, check=True).stdout
        self.assertEqual(len(raw), 3 * SIDE * SIDE)
        return raw

    def test_a_fetch_that_is_cut_off_leaves_something_to_show(self):
        picture(self.folder / "picture.png")
        bundle = self.shop.bake("seen", "--model", self.shop.two_coloured, "--pattern", self.folder / "picture.png", "--parameters",
                                "orb-2000", *QUICK)
        self.publish(bundle)
        status = self.begin()
        first = self.store / "pieces" / "museum.first"
        self.assertEqual((status["result"], status["exit_code"], status["version"]), ("first", 0, 0))
        self.assertEqual((status["first"], status["bundles"]), ([str(first)], []))
        self.assertEqual(list(self.store.rglob("*.modar")), [])
        self.assertFalse((self.store / "current").exists())
        self.assertEqual(self.run_program("modar-fetch", "--store", self.store, "--verify").returncode, 17)
        self.assertLess(first.stat().st_size, bundle.stat().st_size / 2)
        checked = self.modar("check", first)
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertIn("BUNDLE_PREVIEW", checked.stdout + checked.stderr)
        coarse, whole = self.drawn(first), self.drawn(bundle)
        self.assertNotEqual(coarse, whole)
        far = sum(abs(a - b) > 48 for a, b in zip(coarse, whole)) / len(whole)
        self.assertLess(far, 0.05, "the model is another, or not there")
        ground = whole[:3]
        model = sum(whole[i:i + 3] != ground for i in range(0, len(whole), 3))
        self.assertGreater(model, SIDE * SIDE / 8, "the whole bundle shows something")
        self.assertEqual(self.fetch_json()["bundles"], [str(self.store / "museum.modar")])
        self.assert_installed(bundle)
        self.assertEqual(os.listdir(self.store / "pieces"), [])

    def test_a_bundle_that_is_installed_has_no_preview(self):
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.staged)
        done = self.fetch()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("can be shown", done.stderr)
        self.assert_installed(self.shop.staged)

    def test_a_preview_goes_with_its_bundle(self):
        self.publish(self.shop.staged)
        self.begin()
        first, other = self.store / "pieces" / "museum.first", self.folder / "other.modar"
        made = contents(first)
        first.write_bytes(b"torn")  # it is made again
        self.begin()
        self.assertEqual(contents(first), made)
        shutil.copy(self.shop.pattern, other)
        self.publish(other, options=["--drop", "museum"])
        report = self.fetch_json()
        self.assertEqual(report["bundles"], [str(self.store / "other.modar")])
        self.assertEqual(os.listdir(self.store / "pieces"), [])

    def test_each_bundle_is_shown_as_soon_as_it_can_be(self):
        other = self.folder / "zebra.modar"
        shutil.copy(self.shop.pattern, other)
        self.publish(self.shop.staged, other)
        self.assertEqual(self.begin()["first"], [str(self.store / "pieces" / "museum.first")])
        done = self.fetch()
        self.assertEqual(re.findall(r"(\w+)\.first can be shown", done.stderr), ["museum", "zebra"])
        self.assert_installed(self.shop.staged, other)

    def test_planted_names_lead_nothing_outside(self):
        self.publish(self.shop.staged)
        pieces, outside = self.store / "pieces", self.folder / "outside"
        pieces.mkdir(parents=True)
        outside.write_bytes(b"mine")
        (pieces / "museum.first").symlink_to(outside)
        (pieces / "museum.first.part").symlink_to(outside)
        os.link(outside, pieces / "stranger.first")
        (pieces / "mine.firstly").write_bytes(b"kept")
        status = self.begin()
        self.assertEqual(status["first"], [str(pieces / "museum.first")])
        self.assertFalse((pieces / "museum.first").is_symlink())
        self.fetch_json()
        self.assertEqual((outside.read_bytes(), outside.stat().st_nlink), (b"mine", 1))
        self.assertEqual(os.listdir(pieces), ["mine.firstly"])


if __name__ == "__main__":
    unittest.main()
