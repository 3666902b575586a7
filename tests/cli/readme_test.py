"""Every command of README.md that does not say that it needs something or takes long is run, in the page's order."""
import os
import re
import shutil
import subprocess
import sys
import unittest

from programs import BIN, COVER, ROOT, ProgramTest

# A comment says it, and why: "# needs a camera", "# takes minutes: ...".
LEFT_OUT = re.compile(r"#.*?\b(needs|takes) ")


def blocks():
    return re.findall(r"^```sh\n(.*?)^```", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)


class Readme(ProgramTest):
    def prepare(self):
        """The files that the page speaks of, small: a photo and a video of our cover, a vase."""
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        cover = png.read(COVER)
        width, left = cover.width + 200, bytes((190, 180, 160) * 100)
        rows = [left + bytes(cover.pixels[3 * cover.width * y:3 * cover.width * (y + 1)]) + left
                for y in range(cover.height)]
        table = [bytes((190, 180, 160) * width)] * 80
        photo = png.Picture(width, cover.height + 160, bytearray(b"".join(table + rows + table)))
        png.write(self.folder / "photo.jpg", photo, 6)
        (self.folder / "vase.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        gray = bytes(range(256)) * 300
        (self.folder / "video.mp4").write_bytes(
            b"YUV4MPEG2 W320 H240 F30:1 Ip A1:1 C420jpeg\n" + (b"FRAME\n" + gray + bytes([128]) * 38400) * 3)
        museum = self.folder / "museum"
        museum.mkdir()
        (museum / "wall.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        # Patterns are tried in fewer views, and not scored: that is what takes the time.
        modar = self.folder / "tools" / "modar"
        modar.parent.mkdir()
        modar.write_text(f'#!/bin/sh\n[ "$1 $2" != "bake --model" ] || set -- "$@" --loop-views 4 --no-score\n'
                         f'exec {BIN}/modar "$@"\n')
        modar.chmod(0o755)

    def test_every_command_runs(self):
        self.prepare()
        ran = 0
        for block in blocks():
            lines = [line for line in block.replace("\\\n", " ").splitlines()
                     if line.strip() and not line.startswith("#") and not LEFT_OUT.search(line)]
            if not lines:
                continue
            ran += len(lines)
            done = subprocess.run(["bash", "-exc", "\n".join(lines)], cwd=self.folder, capture_output=True, text=True,
                                  env={**os.environ, "PATH": f"{self.folder}/tools:{BIN}:{os.environ['PATH']}"})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            old = self.folder / "old.modar"
            if not old.exists() and (self.folder / "vase.modar").exists():
                shutil.copy(self.folder / "vase.modar", old)
        self.assertGreater(ran, 15)
        # What the page promises of some of them.
        self.assertEqual((self.folder / "cover.corners.png").read_bytes()[:4], b"\x89PNG")
        self.assertIn("<html", (self.folder / "vase.html").read_text())
        self.assertTrue((self.folder / "vase-report/index.html").exists())
        self.assertTrue((self.folder / "museum/out/museum.modar").exists())
        self.assertTrue((self.folder / "store/vase.modar").exists())

    def test_most_commands_are_not_left_out(self):
        commands = [line for block in blocks() for line in block.splitlines() if line.strip() and line[0] != "#"]
        left_out = [line for line in commands if LEFT_OUT.search(line)]
        self.assertLess(len(left_out), len(commands) / 2, left_out)


if __name__ == "__main__":
    unittest.main()
