"""Files that are cut short or written over while a program uses them: an error, no signal, and no output from the rest."""
import os
import pathlib
import shutil
import struct
import subprocess
import threading
import time
import unittest

from programs import BIN, COVER, QUICK, ProgramTest, needs

SIZE = (160, 120)


def write_ply(path, triangles):
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {3 * triangles}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n")
    points = b"".join(struct.pack("<9f", i, 0, 0, i + 1, 0, 0, i, 1, i % 7) for i in range(triangles))
    path.write_bytes(head.encode() + points + b"".join(struct.pack("<B3i", 3, 3 * i, 3 * i + 1, 3 * i + 2) for i in range(triangles)))


def write_stl(path, triangles):
    path.write_bytes(bytes(80) + struct.pack("<I", triangles) + b"".join(
        struct.pack("<12fH", 0, 0, 1, i, 0, 0, i + 1, 0, 0, i, 1, i % 7, 0) for i in range(triangles)))


def write_obj(path, triangles):
    path.write_text("".join(f"v {i} 0 0\nv {i + 1} 0 0\nv {i} 1 {i % 7}\nf -3 -2 -1\n" for i in range(triangles)))


class Changed(ProgramTest):
    def cut_while(self, path, *words):
        """The program, after `path` was cut short while it had it open: strace holds the program once it has mapped it, or before it reads."""
        program = subprocess.Popen(
            ["strace", "-D", "-f", "-o", "/dev/null", "-P", path, "-e", "inject=mmap:delay_exit=300000:when=1", "-e",
             "inject=pread64:delay_enter=300000:when=1", BIN / words[0], *words[1:]],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder, env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})
        self.addCleanup(program.kill)
        process = pathlib.Path(f"/proc/{program.pid}")
        mapped = not path.name.endswith(".obj")
        until = time.monotonic() + 60
        while program.poll() is None and time.monotonic() < until:
            try:
                names = (process / "maps").read_text() if mapped else [os.readlink(each) for each in (process / "fd").iterdir()]
            except OSError:
                continue
            if str(path) in names:
                time.sleep(0 if mapped else 0.1)
                os.truncate(path, 5000)
                break
        output, errors = program.communicate(timeout=60)
        if "ptrace" in errors and "not permitted" in errors:
            self.skipTest("strace may not trace here")
        return program.returncode, output, errors

    @unittest.skipIf(shutil.which("strace") is None, "no strace here")
    @needs("report")
    def test_inputs_that_are_cut_short_are_an_error(self):
        whole = self.bake_demo()
        bundle, out = self.folder / "in.modar", self.folder / "out"
        model = {".ply": write_ply, ".stl": write_stl, ".obj": write_obj}
        bake = [["modar", "bake", "--model", f"m{kind}", "-o", "out/m.modar", "--quiet", *QUICK] for kind in model]
        others = [["modar", "check", bundle], ["modar", "inspect", bundle, "--extract", "out/all"], ["modar", "report", bundle, "-o", "out/a.html"],
                  ["modar-play", bundle, "--turntable", "3", "--out", "out/pictures"]]
        for words in bake + others:
            with self.subTest(words=words):
                shutil.rmtree(out, ignore_errors=True)
                out.mkdir()
                path = self.folder / words[3] if words in bake else bundle
                model[path.suffix](path, 20000) if words in bake else shutil.copy(whole, bundle)
                code, output, errors = self.cut_while(path, *words)
                self.assertEqual(code, 2, errors)
                self.assertIn("[io.changed]", errors)
                self.assertEqual(output, "")
                self.assertEqual([each for each in out.rglob("*") if each.is_file()], [])

    def play_and(self, change, *options):
        """The player's exit code and words if `change` is done to the bundle after the first frame."""
        bundle = self.bake_demo("shown.modar")
        player = subprocess.Popen([BIN / "modar-play", bundle, "--input", f"nv21:{SIZE[0]}x{SIZE[1]}:-", "--json", *options],
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        watch = threading.Timer(60, player.kill)
        watch.start()
        frame = bytes(SIZE[0] * SIZE[1] * 3 // 2)
        player.stdin.write(frame)
        player.stdin.flush()
        self.assertTrue(player.stdout.readline())
        change(bundle)
        _, errors = player.communicate(20 * frame)
        watch.cancel()
        return player.returncode, errors.decode()

    def test_a_bundle_that_changes_while_it_is_played_ends_the_player_with_an_error(self):
        other = self.folder / "other.modar"
        done = self.modar("bake", "--pattern", COVER, "-o", other, "--quiet", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        for name, change in {"cut": lambda bundle: os.truncate(bundle, 5000), "emptied": lambda bundle: os.truncate(bundle, 0),
                             "copied over": lambda bundle: shutil.copyfile(other, bundle)}.items():
            with self.subTest(change=name):
                code, errors = self.play_and(change)
                self.assertEqual(code, 2, errors)
                self.assertIn("[io.changed]", errors)
        code, errors = self.play_and(lambda bundle: os.replace(other, bundle))
        self.assertEqual(code, 0, errors)


if __name__ == "__main__":
    unittest.main()
