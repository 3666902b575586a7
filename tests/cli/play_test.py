"""The player from the outside: what it prints, writes and answers."""
import json
import math
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import unittest

from film_project import PROJECT, bake_film
from programs import BIN, COVER, QUICK, ROOT, ProgramTest, demo_clip, needs

BUST = ROOT / "assets" / "models" / "bust.obj"


def lines_of(done):
    return [json.loads(line) for line in done.stdout.splitlines()]


class Play(ProgramTest):
    def play(self, *arguments, **options):
        return self.run_program("modar-play", *arguments, **options)

    def clip(self, frames=12):
        """Our cover before a made-up background."""
        return demo_clip(self.folder / "clip", frames)

    def test_help_and_version_go_to_standard_output(self):
        done = self.play("--help")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("Example:", done.stdout)
        self.assertRegex(self.play("--version").stdout, r"^modar-play \d+\.\d+\.\d+\n$")

    def test_mistakes_are_told_with_their_exit_codes(self):
        bundle = self.bake_demo()
        self.assert_fails(self.play(), 1, "--help")
        self.assert_fails(self.play("none.modar", "--input", COVER), 2, "none.modar")
        self.assert_fails(self.play(COVER, "--input", COVER), 1, str(COVER), "this is a picture (PNG), not a bundle; bake it first")
        self.assert_fails(self.play(bundle, "--input", "none.mp4"), 2, "none.mp4")
        rotten = self.folder / "rotten.modar"
        data = bytearray(bundle.read_bytes())
        data[-100] ^= 1  # of a picture: opening looks at tables only
        rotten.write_bytes(data)
        self.assertEqual(self.play(rotten, "--input", COVER, "--quiet").returncode, 0)
        self.assertEqual(self.play(bundle, "--input", COVER, "--quiet", "--verify").returncode, 0)
        self.assert_fails(self.play(rotten, "--input", COVER, "--verify"), 3, "rotten.modar", "section.hash")
        self.assert_fails(self.play(bundle, "--input", bundle), 3, bundle.name)
        self.assert_fails(self.play(bundle, "--input", COVER, "--parameters", "x"), 1, "orb-2000")
        self.assert_fails(self.play(bundle, "--input", COVER, "--device", "x"), 1, "mali400")
        self.assert_fails(self.play(bundle, "--input", COVER, "--window", env={"SDL_VIDEODRIVER": "none"}), 5,
                          "--window")
        self.assertIn("no picture is kept; --out, --report or --window", self.play(bundle, "--input", COVER).stderr)
        (self.folder / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.modar("bake", "bare.obj", "-o", "bare.modar")
        self.assert_fails(self.play("bare.modar", "--input", COVER), 3, "it has no pattern that a camera could find; bake it with --pattern")
        if os.path.exists("/dev/full"):
            with open("/dev/full", "w") as full:
                done = subprocess.run([BIN / "modar-play", bundle, "--input", COVER, "--json"], stdout=full,
                                      stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)

    @needs("paper")
    def test_the_camera_is_reported_with_its_source(self):
        bundle, clip = self.bake_demo(), self.clip()
        (self.folder / "camera.yml").write_text(
            "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
            "   dt: d\n   data: [ 700., 0., 320., 0., 700., 240., 0., 0., 1. ]\n")
        for given in ([], ["--camera", self.folder / "camera.yml"], ["--method", "paper"]):
            done = self.play(bundle, "--input", clip, "--json", *given)
            lines = [json.loads(line) for line in done.stdout.splitlines()]
            for camera in (lines[0]["camera"], lines[-1]["summary"]["camera"]):
                self.assertEqual(camera["source"], "given" if "--camera" in given else "assumed" if given else "estimated")
                self.assertEqual("sigma_px" in camera, not given)
                if "--camera" in given:
                    self.assertEqual(camera["focal_px"], 525)  # of 640 pixels, in frames of 480

    def test_a_run_with_every_output_and_its_replay(self):
        bundle, clip = self.bake_demo(), self.clip()
        # A gyroscope that stays, as our clip's camera hardly turns; a pattern that is seen is seen all the same.
        (self.folder / "turns.txt").write_text("0 0 0\n" * 12)
        done = self.play(bundle, "--input", clip, "--json", "--homography", "--outline", "--osd", "--out", "pictures",
                         "--report", "report", "--record", "kept", "--qos", "trial.jsonl", "--extended", "--gyro", "turns.txt")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "", "no progress bar without a terminal")
        *frames, summary = lines_of(done)
        self.assertEqual([frame["frame"] for frame in frames], list(range(12)))
        self.assertEqual(summary["summary"]["frames"], 12)
        self.assertGreater(summary["summary"]["visible"], 8, "our own cover is found")
        seen = next(frame["visible"][0] for frame in frames if frame["visible"])
        self.assertEqual(seen["pattern"], "cover")
        self.assertEqual([len(seen["rotation"]), len(seen["translation"]), len(seen["homography"])], [9, 3, 9])
        for (u, v), corner in zip([(0, 0), (1, 0), (1, 1), (0, 1)], seen["corners"]):
            x, y, w = (u * a + v * b + c for a, b, c in zip(*[iter(seen["homography"])] * 3))
            self.assertLess(math.hypot(x / w - corner[0], y / w - corner[1]), 1e-6, seen)
        self.assertTrue(0.5 < seen["agreeing"] <= 1 and 0.5 < seen["likeness"] <= 1 and 0 < seen["fit"] <= 1, seen)
        self.assertEqual(len(list((self.folder / "pictures").glob("frame_*.png"))), 12)
        self.assertEqual({path.name for path in (self.folder / "report").iterdir()},
                         {"overlay.mp4", "poster.png", "contact_sheet.png", "frames.jsonl", "index.html"})
        self.assertIn('"event":"found"', (self.folder / "trial.jsonl").read_text())

        same = self.play(bundle, "--golden", "kept", "--quiet")
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        self.assertEqual(json.loads(same.stdout)["golden"]["worst_px"], 0.0)
        other = self.play(bundle, "--golden", "kept", "--quiet", "--parameters", "orb-2000", "--tolerance", "0")
        self.assertEqual(other.returncode, 10, other.stdout + other.stderr)

    def test_a_pattern_with_nothing_on_it_is_outlined(self):
        done = self.modar("bake", "--pattern", COVER, "-o", "bare.modar", "--quiet", "--parameters", "none", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.play("bare.modar", "--input", self.clip(3), "--json", "--out", "pictures")
        self.assertEqual(done.returncode, 0, done.stderr)
        *_, last, _ = lines_of(done)
        corners = last["visible"][0]["corners"]
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        picture = png.read(self.folder / "pictures" / f"frame_{last['frame']:06}.png")
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
            at = 3 * (round((ay + by) / 2) * picture.width + round((ax + bx) / 2))
            red, green, blue = picture.pixels[at:at + 3]
            self.assertGreater(green, 80 + max(red, blue), f"the middle of a side, {corners}")

    def test_copies_of_a_print_are_reported_and_tracked(self):
        for name, copies in ("bare.modar", ""), ("three.modar", ":copies=3"):
            done = self.modar("bake", "--pattern", f"{COVER}{copies}", "-o", name, "--quiet", "--parameters", "none", *QUICK)
            self.assertEqual(done.returncode, 0, done.stderr)
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        cover = png.read(COVER)
        wide, high, channels = 3 * cover.width, 2 * cover.height, len(cover.pixels) // (cover.width * cover.height)
        pixels = bytearray(b"\x80" * (wide * high * channels))
        lefts = (cover.width // 4, 7 * cover.width // 4)
        for left in lefts:
            for row in range(cover.height):
                to = ((row + cover.height // 2) * wide + left) * channels
                line = cover.width * channels
                pixels[to:to + line] = cover.pixels[row * line:(row + 1) * line]
        png.write(self.folder / "two.png", png.Picture(wide, high, bytes(pixels)))
        one = self.play("bare.modar", "--input", "two.png", "--json")
        self.assertEqual(len(lines_of(one)[0]["visible"]), 1)
        self.assertEqual(one.stderr.count("more copies of 'cover' are in view"), 1, one.stderr)
        for bundle, *options in ("bare.modar", "--copies", "3"), ("three.modar",):
            two = self.play(bundle, "--input", "two.png", "--json", *options)
            self.assertNotIn("in view", two.stderr)
            seen = lines_of(two)[0]["visible"]
            self.assertEqual([each["copy"] for each in seen], [0, 1])
            for left, x in zip(lefts, sorted(each["corners"][0][0] for each in seen)):
                self.assertAlmostEqual(x, left, delta=2)
        one = self.play("three.modar", "--input", "two.png", "--json", "--record", "r.modar-frames")
        self.assertEqual(len(lines_of(one)[0]["visible"]), 1)
        self.assertEqual(self.modar("check", "three.modar", "--source", COVER).returncode, 0)

    def test_a_bundle_that_is_replaced_is_played_on(self):
        bundle = self.bake_demo()
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        picture = png.read(COVER)
        gray = bytes(picture.pixels[1::3])
        with subprocess.Popen([BIN / "modar-play", bundle, "--input", f"grey:{picture.width}x{picture.height}@30:-",
                               "--json", "--live"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as player:
            def play(count):
                frames = []
                for _ in range(count):
                    player.stdin.write(gray)
                    player.stdin.flush()
                    frames.append(json.loads(player.stdout.readline()))
                return frames
            for _ in range(500):  # a pipe is live: the search works apart
                time.sleep(0.02)
                if play(1)[0]["visible"]:
                    break
            other = self.folder / "other.modar"
            done = self.modar("bake", "--model", BUST, "--pattern", COVER, "-o", other, "--quiet", "--no-lods",
                              "--parameters", "none", *QUICK)
            self.assertEqual(done.returncode, 0, done.stderr)
            other.replace(bundle)
            time.sleep(0.4)
            after = play(20)
            self.assertTrue(all(frame["visible"] for frame in after), "the pose is never lost")
            self.assertEqual([frame["state"] for frame in after], ["shown"] * 20)
            (self.folder / "new.modar").write_bytes(b"no bundle")
            (self.folder / "new.modar").replace(bundle)
            time.sleep(0.4)
            self.assertTrue(all(frame["visible"] for frame in play(2)), "a bad file is reported, and the old one plays on")
            player.stdin.close()
            said = player.stderr.read().decode()
            player.stdout.read()
        self.assertEqual(player.returncode, 0, said)
        self.assertEqual(said.count("the bundle was replaced"), 1, said)
        self.assertIn("demo.modar", said)
        self.assert_fails(self.play(bundle, "--input", COVER, "--live", "--record", "r"), 1, "--live")

    def test_a_video_is_played_beside_the_article_s_table_9(self):
        bundle, clip = self.bake_demo(), self.clip()
        done = self.lab("bench", "render", bundle, "--video", clip, "--json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        rows = {row["measure"]: row for row in json.loads(done.stdout)}
        article = {"recognition_fps": (25, 30), "display_fps": (17, 23), "display_s": (18, 12), "stutters": (0, 0)}
        for figure, values in article.items():
            for device, value in zip(("low_end", "mid_range"), values):
                self.assertEqual(rows[f"pottery table9_{figure}_{device}"]["reference"], value)
        self.assertAlmostEqual(rows["pottery pictures"]["ours"] + rows["pottery dropped_frames"]["ours"], 12)
        self.assertGreater(rows["pottery table9_cpu_percent"]["ours"], 1)
        heap = [rows[f"pottery heap_bytes {name}"]["ours"] for name in ("BundleView", "PoseLoop", "PoseLoop searching")]
        if any(heap):  # the sanitizers' allocator does not count
            self.assertLess(heap[0], 10000, "the bundle is mapped")
            self.assertGreater(heap[2], heap[1], "a search takes an index")
        done = self.lab("bench", "render", bundle, "--video", "none.mp4")
        self.assert_fails(done, 2, "modar-play")
        self.assertIn("none.mp4", done.stderr)

    def test_two_runs_give_the_same_poses_and_pictures(self):
        bundle, clip = self.bake_demo(), self.clip(4)
        runs = []
        for name in ("a", "b"):
            done = self.play(bundle, "--input", clip, "--json", "--out", name)
            self.assertEqual(done.returncode, 0, done.stderr)
            frames = [{**frame, "ms": None} for frame in lines_of(done)[:-1]]
            runs.append((frames, [path.read_bytes() for path in sorted((self.folder / name).iterdir())]))
        self.assertEqual(runs[0], runs[1])

    def still(self, name, left, top, scale, shade):
        """A photo of the cover, which is `scale` of its size, on a plain table with a lamp on one side."""
        graph = (f"color={shade}:s=640x480,format=rgb24,drawbox=x={640 - 2 * left}:y=0:w=200:h=480:color=white:t=fill[table];"
                 f"[0]scale=iw*{scale}:-1:flags=area[cover];[table][cover]overlay={left}:{top}")
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        subprocess.run(["ffmpeg", "-v", "error", "-i", COVER, "-filter_complex", graph, "-frames:v", "1", path], check=True)
        return path

    def drawn(self, path):
        """Whether pixels of a written picture differ much from its input."""
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        before, after = (png.read(each) for each in path)
        return sum(abs(a - b) > 40 for a, b in zip(before.pixels, after.pixels)) > 3000

    def test_a_still_shows_what_was_found(self):
        bundle = self.bake_demo()
        self.still("stills/a.png", 40, 60, 0.5, "gray")
        self.still("stills/c.png", 260, 20, 0.7, "black")
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "gradients=s=640x480:seed=3:n=4", "-frames:v", "1",
                        self.folder / "stills" / "d.png"], check=True)
        for name in ("a", "c"):
            done = self.play(bundle, "--input", f"stills/{name}.png", "--json", "--out", f"out-{name}")
            frame, _ = lines_of(done)
            self.assertEqual((len(frame["visible"]), frame["state"]), (1, "shown"), done.stderr)
            self.assertTrue(self.drawn((self.folder / "stills" / f"{name}.png", self.folder / f"out-{name}" / "frame_000000.png")))
        # A folder of photos that have nothing to do with each other: each shows what it would show alone.
        done = self.play(bundle, "--input", "stills", "--json", "--out", "all", "--record", "kept")
        *frames, _ = lines_of(done)
        self.assertEqual([(len(f["visible"]), f["state"]) for f in frames], [(1, "shown"), (1, "shown"), (0, "hidden")])
        self.assertEqual([self.drawn((self.folder / "stills" / f"{name}.png", self.folder / "all" / f"frame_{i:06}.png"))
                          for i, name in enumerate("acd")], [True, True, False])
        same = self.play(bundle, "--golden", "kept", "--quiet")
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        # In a video the first frame shows nothing yet.
        video = self.folder / "still.mp4"
        subprocess.run(["ffmpeg", "-v", "error", "-loop", "1", "-i", self.folder / "stills" / "a.png", "-frames:v", "3", "-pix_fmt",
                        "yuv420p", video], check=True)
        *frames, _ = lines_of(self.play(bundle, "--input", video, "--json"))
        self.assertEqual([f["state"] for f in frames], ["hidden", "shown", "shown"])

    def test_a_video_that_is_to_be_turned_is_turned_as_ffmpeg_does(self):
        bundle = self.bake_demo()
        sys.path.insert(0, str(ROOT / "assets"))
        from kit import png
        for turn, (a, b) in ((0, (1, 0)), (90, (0, 1)), (180, (-1, 0)), (270, (0, -1))):
            video, wanted = self.folder / f"{turn}.mp4", self.folder / f"{turn}.png"
            subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "testsrc2=s=160x96:r=10", "-frames:v", "2", "-pix_fmt",
                            "yuv420p", video], check=True)
            # A phone writes the turn into the track's header, as the matrix (a, b, -b, a).
            film = bytearray(video.read_bytes())
            at = film.index(b"tkhd") + 44
            film[at:at + 20] = struct.pack(">5i", a << 16, b << 16, 0, -b << 16, a << 16)
            video.write_bytes(film)
            subprocess.run(["ffmpeg", "-v", "error", "-i", video, "-frames:v", "1", wanted], check=True)
            done = self.play(bundle, "--input", video, "--quiet", "--out", f"out{turn}")
            self.assertEqual(done.returncode, 0, done.stderr)
            ours, theirs = png.read(self.folder / f"out{turn}" / "frame_000000.png"), png.read(wanted)
            self.assertEqual((ours.width, ours.height), (theirs.width, theirs.height))
            self.assertEqual((ours.width, ours.height), (96, 160) if turn % 180 else (160, 96))
            far = sum(abs(a - b) for a, b in zip(ours.pixels, theirs.pixels)) / len(ours.pixels)
            self.assertLess(far, 8, turn)

    def test_the_movie_plays_in_a_browser(self):
        if shutil.which("ffprobe") is None:
            self.skipTest("no ffprobe here")
        bundle, clip = self.bake_demo(), self.clip(4)
        self.assertEqual(self.play(bundle, "--input", clip, "--out", "a.mp4").returncode, 0)
        probe = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", "a.mp4"],
                               cwd=self.folder, capture_output=True, text=True, check=True)
        stream = json.loads(probe.stdout)["streams"][0]
        self.assertEqual((stream["codec_name"], stream["pix_fmt"], stream["nb_read_frames"]),
                         ("h264", "yuv420p", "4"))

    def test_raw_frames_come_over_a_pipe(self):
        bundle = self.bake_demo()
        grey = bytes(range(256)) * (160 * 120 // 256)
        y4m = b"YUV4MPEG2 W160 H120 F30:1 Cmono\n" + 3 * (b"FRAME\n" + grey)
        done = subprocess.run([BIN / "modar-play", bundle, "--input", "-", "--json"], input=y4m, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), 4)

    def test_a_pipe_that_falls_silent_does_not_hang_the_end(self):
        bundle = self.bake_demo()
        process = subprocess.Popen([BIN / "modar-play", bundle, "--input", "nv21:160x120:-", "--realtime", "--json", "--report",
                                    self.folder / "kept"],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        watch = threading.Timer(60, process.kill)
        watch.start()
        process.stdin.write(bytes(160 * 120 * 3 // 2))
        process.stdin.flush()
        self.assertTrue(process.stdout.readline(), "the first frame is played while the pipe is open")
        process.terminate()
        self.assertEqual(process.wait(), 2)
        watch.cancel()
        self.assertIn(b"interrupted after frame 1", process.stderr.read())
        self.assertEqual(json.loads(process.stdout.read())["summary"]["frames"], 1)
        self.assertEqual(len((self.folder / "kept" / "frames.jsonl").read_text().splitlines()), 2)
        self.assertTrue((self.folder / "kept" / "index.html").exists(), "the played part is kept")
        for stream in (process.stdin, process.stdout, process.stderr):
            stream.close()

    def test_a_window_shows_the_frames_with_the_display(self):
        # SDL unloads the driver before leaks are looked for: what Mesa keeps has no name then to suppress.
        done = self.play(self.bake_demo(), "--input", self.clip(4), "--window", "--outline", "--json", "--out", "seen",
                         env={"SDL_VIDEODRIVER": "offscreen", "ASAN_OPTIONS": "detect_leaks=0"})
        if "no window can be opened" in done.stderr:
            self.skipTest("SDL2 has no window without a display here")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(lines_of(done)), 5)
        self.assertEqual(len(list((self.folder / "seen").iterdir())), 4)

    def test_models_turn_without_any_pattern(self):
        bundle = self.bake_demo()
        done = self.play(bundle, "--turntable", "3", "--out", "turn", "--size", "96x64", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([line["angle_deg"] for line in lines_of(done)], [0.0, 120.0, 240.0])
        pictures = [path.read_bytes() for path in sorted((self.folder / "turn").iterdir())]
        self.assertEqual(len(set(pictures)), 3)

    def test_an_interrupted_turntable_leaves_nothing(self):
        bundle = self.bake_demo()
        out = self.folder / "movie"
        out.mkdir()
        words = [BIN / "modar-play", bundle, "--turntable", "99999", "--size", "96x64", "--json", "--out", out / "t.mp4"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            process.stdout.readline()
            self.assertNotEqual(list(out.iterdir()), [])
            process.send_signal(signal.SIGINT)
            process.stdout.read()
            self.assertIn(b"interrupted after", process.stderr.read())
        self.assertEqual(list(out.iterdir()), [])
        self.assert_fails(self.play(bundle, "--turntable", "2", "--out", "x.txt"), 1, "FILE.mp4, or a folder", "x.txt/")
        self.assertFalse((self.folder / "x.txt").exists())
        os.mkfifo(self.folder / "pipe.mp4")  # nobody writes to it
        self.assert_fails(self.play(bundle, "--input", "pipe.mp4", "--out", "piped"), 1, "it is a pipe", "y4m:pipe.mp4")
        (self.folder / "cut.nv21").write_bytes(bytes(99))
        self.assert_fails(self.play(bundle, "--input", "nv21:64x48:cut.nv21", "--out", "cut"), 3, "ends after 99 of 4608 bytes")
        self.assertFalse((self.folder / "cut").exists())

    def test_a_film_alone_turns_with_its_poster(self):
        done = self.play(bake_film(self), "--turntable", "3", "--out", "turn", "--size", "96x64", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([(line["pattern"], line["angle_deg"]) for line in lines_of(done)], [("cover", 0.0), ("cover", 120.0), ("cover", 240.0)])
        for path in sorted((self.folder / "turn").iterdir()):
            middle = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-vf", "crop=1:1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
                                    capture_output=True, check=True).stdout
            for got, wanted in zip(middle, (60, 200, 90), strict=True):  # the film's first picture
                self.assertAlmostEqual(got, wanted, delta=12, msg=path.name)
        # A label alone shows nothing that could turn.
        (self.folder / "modar.toml").write_text(re.sub(r"\[\[scene.video\]\].*?(?=\[\[scene.label)", "", PROJECT, flags=re.S))
        shutil.rmtree(self.folder / "out")
        self.assertEqual(self.modar("bake", "--quiet", cwd=self.folder).returncode, 0)
        self.assert_fails(self.play(next((self.folder / "out").glob("*.modar")), "--turntable", "3", "--out", "none"), 3, "play.no-models")


if __name__ == "__main__":
    unittest.main()
