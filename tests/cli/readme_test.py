"""Runs the commands of README.md and the guides, in the order of each page, in one folder of small inputs."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import unittest

from programs import BIN, COVER, ROOT, ProgramTest
from web_test import ENGINES

PAGES = ("README.md", "bake/README.md", "formats/README.md", "runtime/README.md", "runtime/TROUBLESHOOTING.md", "runtime/OUTDOORS.md",
         "runtime/extensions/web/README.md", "runtime/extensions/web/MOVING.md", "runtime/extensions/web/npm.md", "runtime/extensions/android/README.md", "bake/extensions/lab/README.md",
         "CONTRIBUTING.md")

# What no test can run: a camera, a phone, the network of others.
NOT_RUN = (
    (r"^modar-play .* --input camera", "camera"),
    (r"^modar calibrate ", "camera"),
    (r"^adb |^for phone in |^  adb |^done$", "phone"),
    (r"^modar-fetch http|^npm install modar|^tests/bench/three_pictures\.py ", "network"),
    (r"^export ANDROID_NDK=|^scripts/apk\.sh ", "network"),  # of Google, for the NDK; apk_test.py makes the app without it
)
# What another gate of scripts/test.sh runs: the file, and its words for it.
RUN_ELSEWHERE = (
    (r"^scripts/demo\.sh", "scripts/newcomer.sh", "\nscripts/demo.sh"),
    (r"^scripts/release\.sh", "scripts/newcomer.sh", "\nscripts/release.sh"),
    (r"^scripts/test\.sh", ".ci/run", "scripts/test.sh"),
    (r"^apt-get install \./out/release", "scripts/newcomer.sh", "block 'apt-get install'"),
    (r"^cc overlay\.c ", "scripts/newcomer.sh", "./overlay vase.modar"),
    (r"^apt-get install aapt ", "scripts/test.sh", "packages=(quick test web browser android)"),
    (r"^scripts/setup\.sh (web|test)", "scripts/test.sh", "scripts/setup.sh"),
    (r"^scripts/sources\.sh --libraries", "scripts/release.sh", "scripts/sources.sh --libraries"),
    (r"^cmake --preset web &&", "scripts/demo.sh", "cmake --preset web"),
    (r"^cmake --preset d(ev|evice) &&", "scripts/test.sh", "cmake --preset device"),
    (r"^ctest --preset dev ", "scripts/test.sh", "ctest --preset dev"),
    (r"^npm install \./build/web/web", "tests/web/package_test.py", "npm"),
    (r"^npx modar ", "tests/wasm/node_test.py", "bake"),
    (r"^modar studio ", "tests/studio/server_test.py", '"studio"'),
    (r"^modar bake --watch", "tests/cli/project_test.py", '"--watch"'),
    (r"^modar plan .*srun", "tests/cli/project_test.py", '"plan", "--ninja", "--cache"'),
    (r"^modar pattern simulate ", "tests/cli/pattern_test.py", '"pattern", "simulate"'),
    (r"^modar pattern confusion ", "tests/cli/pattern_test.py", '"pattern", "confusion"'),
    (r"^scripts/tune\.py ", "tests/house/tune_test.py", "tune.py"),
    (r"^modar-lab bench pose ", "tests/cli/pattern_test.py", '"bench", "pose"'),
    (r"^modar-lab bench render ", "tests/cli/play_test.py", '"bench", "render"'),
    (r"^modar-lab bench lod ", "tests/cli/bake_test.py", '"bench", "lod"'),
    (r"^modar-lab bench light ", "scripts/demo.sh", "bench light"),
    (r"^modar-lab bench etc1 ", "tests/lab/tables_test.cpp", "bench_etc1"),
    (r"^modar-lab bench wild ", "tests/lab/wild_bench_test.cpp", "bench"),
)
# Measurements that take minutes: no gate runs them.
LONG_BENCHES = (
    (r"^modar-lab bench (extended|clutter|model) ", "minutes"),
    (r"tests/bench/media_page\.py|cluster_levels\.mjs", "minutes"),
)
# They run until Ctrl-C.
SERVES = re.compile(r"^modar web .*--serve\b")


def blocks_of(page):
    """The commands of a page, a list for each block."""
    for block in re.findall(r"^```sh\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL):
        yield [line for line in block.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]


def reason(line):
    return next((row[1] for row in NOT_RUN + RUN_ELSEWHERE + LONG_BENCHES if re.search(row[0], line)), None)


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
        (self.folder / "assets").symlink_to(ROOT / "assets")
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
        # The page, with empty engines.
        shutil.copytree(ROOT / "runtime/extensions/web", self.folder / "page")
        for name in ENGINES:
            (self.folder / "page" / name).write_text(name)
        (self.folder / "texts.json").write_text('{"cover": {"en": {"name": "The cover"}}}')
        (self.folder / "scripts").symlink_to(ROOT / "scripts")
        # Patterns are tried in fewer views, and not scored: that is what takes the time.
        modar = self.folder / "tools" / "modar"
        modar.parent.mkdir()
        modar.write_text('#!/bin/sh\ncase "$1 $2" in\n'
                         '"bake --model" | "bake "*.glb) set -- "$@" --loop-views 4 --no-score --parameters orb-500 ;;\n'
                         f'"web "*) set -- "$@" --page {self.folder}/page ;;\n'
                         f'esac\nexec {BIN}/modar "$@"\n')
        modar.chmod(0o755)
        self.run_lines(["modar bake --model vase.obj --pattern cover.png -o vase.modar", "cp vase.modar old.modar",
                        "modar inspect vase.modar --extract parts", "cp parts/vase.glb vase.glb"])

    def run_lines(self, lines):
        environment = {**os.environ, "PATH": f"{self.folder}/tools:{BIN}:{os.environ['PATH']}"}
        done = subprocess.run(["bash", "-exc", "\n".join(line for line in lines if not SERVES.search(line))], cwd=self.folder, capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for line in filter(SERVES.search, lines):
            with subprocess.Popen(["bash", "-c", f"exec {line}"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, env=environment) as process:
                said = ""
                while "https://" not in said and (more := process.stdout.readline()):
                    said += more
                process.send_signal(signal.SIGINT)
                said += process.stdout.read()
            self.assertIn("https://", said)
            self.assertIn(process.returncode, (0, -signal.SIGINT), said)

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

    def test_what_is_not_run_needs_a_camera_a_phone_or_a_network_or_has_another_gate(self):
        lines = [line for page in PAGES for block in blocks_of(page) for line in block]
        for pattern, *why in NOT_RUN + RUN_ELSEWHERE + LONG_BENCHES:
            self.assertTrue([line for line in lines if re.search(pattern, line)], f"no page has {pattern}: {why}")
        self.assertLessEqual({why for _, why in NOT_RUN}, {"camera", "phone", "network"})
        for _, gate, words in RUN_ELSEWHERE:
            self.assertIn(words, (ROOT / gate).read_text(), gate)
            # The gate is one itself: a test of CTest's, or a script that scripts/test.sh or that calls.
            gates = [*(ROOT / "tests").rglob("CMakeLists.txt"), *(ROOT / "scripts" / name for name in ("test.sh", "newcomer.sh"))]
            name = pathlib.PurePath(gate).stem.removesuffix("_test")
            self.assertTrue(gate.startswith((".ci", "scripts/test.sh")) or any(name in file.read_text() for file in gates), gate)


if __name__ == "__main__":
    unittest.main()
