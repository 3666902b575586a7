"""Runs the commands of README.md and the guides, in the order of each page, in one folder of small inputs."""
import os
import re
import shutil
import subprocess
import sys
import unittest

from programs import BIN, COVER, ROOT, ProgramTest

PAGES = ("README.md", "bake/README.md", "formats/README.md", "runtime/README.md", "runtime/TROUBLESHOOTING.md",
         "runtime/web/README.md", "runtime/web/MOVING.md", "runtime/web/npm.md", "runtime/android/README.md", "bake/lab/README.md",
         "CONTRIBUTING.md")

# What is not run here, and why. A line of a page that matches a pattern is left out; a pattern without a line is an error.
NOT_RUN = (
    (r"^scripts/(demo|test|release|setup|sources)\.sh", "installs packages and builds; CI runs them in a bare Debian 12"),
    (r"^apt-get ", "needs root; scripts/package_try.sh"),
    (r"^(cmake|ctest) --preset ", "builds for minutes; CI"),
    (r"^cc overlay\.c ", "needs the installed library; app_test.py builds and runs it"),
    (r"^modar web |^npm install ", "needs the page's engine; web_test.py, page_test.py"),
    (r"^modar-play .* --input camera", "needs a camera; v4l2_test.cpp"),
    (r"^modar bake --watch", "runs until Ctrl-C; project_test.py"),
    (r"^modar studio ", "serves until Ctrl-C; tests/studio"),
    (r"^modar plan .*srun", "needs Slurm; scripts/slurm/try.sh, project_test.py"),
    (r"^modar-fetch http", "needs a network; ship_network_test.py"),
    (r"^modar calibrate ", "needs a filmed pattern; calibrate_test.cpp"),
    (r"^modar pattern (simulate|confusion) ", "takes a minute; pattern_test.py"),
    (r"^export ANDROID_NDK=|^scripts/apk\.sh ", "needs an NDK; apk_test.py uses a compiler in its place"),
    (r"^adb |^for phone in |^  adb |^done$", "needs a phone"),
    (r"tests/bench/media_page\.py", "takes minutes, and a browser"),
    (r"^scripts/tune\.py ", "takes minutes; tune_test.py"),
    (r"^modar-lab bench (pose|wild|extended|clutter|light|model|render|lod|etc1) ", "takes minutes; the tests of bake/lab"),
)


def blocks_of(page):
    """The commands of a page, a list for each block."""
    for block in re.findall(r"^```sh\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL):
        yield [line for line in block.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]


def reason(line):
    return next((why for pattern, why in NOT_RUN if re.search(pattern, line)), None)


class Readme(ProgramTest):
    def prepare(self):
        """The files that the pages speak of, small: a photo and a video of our cover, a vase."""
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        cover = png.read(COVER)
        width, left = cover.width + 200, bytes((190, 180, 160) * 100)
        rows = [left + bytes(cover.pixels[3 * cover.width * y:3 * cover.width * (y + 1)]) + left
                for y in range(cover.height)]
        table = [bytes((190, 180, 160) * width)] * 80
        photo = png.Picture(width, cover.height + 160, bytearray(b"".join(table + rows + table)))
        png.write(self.folder / "photo.jpg", photo, 6)
        for name in ("cover.png", "poster.jpg"):
            shutil.copy(COVER, self.folder / name)
        # Sides of the box of 120 x 180 x 40 mm, cut out of the cover.
        for name, wide, tall in (("front", 348, 522), ("right", 116, 522), ("top", 348, 116)):
            cut = b"".join(cover.pixels[3 * cover.width * y:3 * (cover.width * y + wide)] for y in range(tall))
            png.write(self.folder / f"{name}.png", png.Picture(wide, tall, bytearray(cut)), 6)
        (self.folder / "vase.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        gray = bytes(range(256)) * 300
        (self.folder / "video.mp4").write_bytes(
            b"YUV4MPEG2 W320 H240 F30:1 Ip A1:1 C420jpeg\n" + (b"FRAME\n" + gray + bytes([128]) * 38400) * 3)
        museum = self.folder / "museum"
        museum.mkdir()
        (museum / "wall.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        (self.folder / "scripts").symlink_to(ROOT / "scripts")
        # Patterns are tried in fewer views, and not scored: that is what takes the time.
        modar = self.folder / "tools" / "modar"
        modar.parent.mkdir()
        modar.write_text('#!/bin/sh\ncase "$1 $2" in\n'
                         '"bake --model" | "bake "*.glb) set -- "$@" --loop-views 4 --no-score --parameters orb-500 ;;\n'
                         f'esac\nexec {BIN}/modar "$@"\n')
        modar.chmod(0o755)
        self.run_lines(["modar bake --model vase.obj --pattern cover.png -o vase.modar", "cp vase.modar old.modar",
                        "modar inspect vase.modar --extract parts", "cp parts/vase.glb vase.glb"])

    def run_lines(self, lines):
        done = subprocess.run(["bash", "-exc", "\n".join(lines)], cwd=self.folder, capture_output=True, text=True,
                              env={**os.environ, "PATH": f"{self.folder}/tools:{BIN}:{os.environ['PATH']}"})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_every_command_runs(self):
        self.prepare()
        ran = set()
        for page in PAGES:
            for block in blocks_of(page):
                lines = [line for line in block if not reason(line)]
                # What another page has run already is not run again, but for what leads the others.
                if not [line for line in lines if line not in ran]:
                    continue
                lines = [line for line in lines if line not in ran or "museum" in line]
                if any(line.startswith("modar init museum") for line in lines):
                    (self.folder / "museum/modar.toml").unlink(missing_ok=True)
                with self.subTest(page, lines=lines):
                    self.run_lines(lines)
                ran.update(lines)
        self.assertGreater(len(ran), 20)
        # What the pages promise of some of them.
        self.assertEqual((self.folder / "cover.corners.png").read_bytes()[:4], b"\x89PNG")
        self.assertIn("<html", (self.folder / "vase.html").read_text())
        self.assertTrue((self.folder / "vase-report/index.html").exists())
        self.assertTrue((self.folder / "museum/out/museum.modar").exists())
        self.assertTrue((self.folder / "store/vase.modar").exists())

    def test_what_is_not_run_has_a_reason_that_is_needed(self):
        lines = [line for page in PAGES for block in blocks_of(page) for line in block]
        for pattern, why in NOT_RUN:
            self.assertTrue([line for line in lines if re.search(pattern, line)], f"no page has {pattern}: {why}")


if __name__ == "__main__":
    unittest.main()
