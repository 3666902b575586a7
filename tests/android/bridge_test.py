"""The bridge (runtime/extensions/android/bridge.cpp) in a JVM that checks each JNI call, against modar-play."""
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import unittest

from machine import (APP, FAKES, FRAMES, HEIGHT, ROOT, SOAK, WIDTH, ProgramTest, bake_with_texts, compile_java, have, make_clip,
                     make_covered_clip, make_long_clip, nv21_of, run_java, write_fakes)

from film_project import FILM_FPS, FILM_FRAMES, bake_film, make_frames  # noqa: E402
from programs import COVERED, QUICK, READINGS, SEEN, TURNED, TURNS, picture, write_turns  # noqa: E402

BRIDGE = ["Native", "ModarException", "Poses", "Gyroscope", "Media", "VideoCopy", "Frame", "FrameHandover"]
SENSORS = ["hardware/Sensor", "hardware/SensorEvent", "hardware/SensorEventListener", "hardware/SensorManager", "os/Handler",
           "os/Looper", "os/Message", "media/MediaPlayer", "media/MediaExtractor", "media/MediaFormat", "media/MediaCodec", "media/MediaCrypto",
           "graphics/SurfaceTexture", "view/Surface", "opengl/GLES20", "opengl/GLES11Ext"]
FLOATS = 45


@unittest.skipUnless(have("javac", "java", "ffmpeg"), "no JDK or no ffmpeg")
def floats(numbers):
    """The nearest float of each double, which C and Python round alike."""
    return struct.unpack(f"={len(numbers)}f", struct.pack(f"={len(numbers)}f", *numbers))


def view_of(rotation, translation, stretch):
    """GL's view matrix, column by column, of what modar_pose holds: rotation * stretch, y up and z backward."""
    stretch = floats(stretch or (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0))
    view = []
    for column in range(4):
        products = [sum(rotation[3 * row + k] * stretch[4 * k + column] for k in range(3)) for row in range(3)]
        x, y, z = (p + t for p, t in zip(products, translation if column == 3 else (0, 0, 0)))
        view += [x, -y, -z, int(column == 3)]
    return [v + 0.0 for v in floats(view)]


class Bridge(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.shared = pathlib.Path(tempfile.mkdtemp(prefix="modar-android-"))
        cls.addClassCleanup(shutil.rmtree, cls.shared, ignore_errors=True)
        cls.classes, fakes = cls.shared / "classes", write_fakes(cls.shared / "fakes")
        compile_java(cls.classes, [*(APP / "org" / "modar" / f"{name}.java" for name in BRIDGE),
                                   *(fakes / "android" / f"{name}.java" for name in SENSORS),
                                   FAKES / "org" / "modar" / "BridgeRun.java", FAKES / "fake" / "GlContext.java"])
        cls.clip = make_clip(cls.shared / "clip")

    def bridge(self, word, bundle, *more, clip=None, size=(WIDTH, HEIGHT)):
        done = run_java([self.classes], "org.modar.BridgeRun", word, bundle, clip or self.clip, *size, *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        # -Xcheck:jni prints what it dislikes: references that stay, exceptions that nobody looked at.
        self.assertNotIn("WARNING", done.stdout + done.stderr)
        self.assertNotIn("FATAL", done.stdout + done.stderr)
        return done.stdout

    def play(self, bundle, *more, clip=None):
        return self.run_program("modar-play", bundle, "--input", f"nv21:{WIDTH}x{HEIGHT}@30:{clip or self.clip}", *more)

    def test_frames_wait_for_slow_drawing_asleep(self):
        self.bridge("handover", self.bake_demo())

    def test_poses_are_the_players_to_the_last_bit(self):
        out = self.folder / "poses"
        bundle = self.bake_demo()
        reasons = self.bridge("poses", bundle, out).splitlines()
        self.assertGreater(self.assert_poses(out, reasons, FRAMES, self.play(bundle, "--json", "--quiet")), FRAMES // 2)

    def test_turns_of_the_phone_are_the_players_in_each_cameras_axes(self):
        # Where the right and the lower side of a frame are after it was turned clockwise: SENSOR_ORIENTATION.
        after = {0: ("right", "down"), 90: ("down", "left"), 180: ("left", "up"), 270: ("up", "right")}
        # The upright picture in the axes of the sensors. A camera on the screen's side looks at the visitor, whose left is its right.
        sides = {0: {"right": (1, 0, 0), "left": (-1, 0, 0), "up": (0, 1, 0), "down": (0, -1, 0), "forward": (0, 0, -1)},
                 1: {"right": (-1, 0, 0), "left": (1, 0, 0), "up": (0, 1, 0), "down": (0, -1, 0), "forward": (0, 0, 1)}}
        cameras = [(degrees, front) for degrees in after for front in sides]
        self.assertEqual(len(cameras), COVERED)
        lines = []
        for i, turn in enumerate(TURNS):
            degrees, front = cameras[(i - SEEN) % COVERED]
            axes = [sides[front][name] for name in (*after[degrees], "forward")]
            phone = [sum(turn[k] * axes[k][axis] for k in range(3)) for axis in range(3)]
            lines.append(" ".join(map(str, [*phone, degrees, front])))
        turns, out, gyro = self.folder / "phone.txt", self.folder / "poses", self.folder / "turns.txt"
        turns.write_text("\n".join(lines))
        write_turns(gyro, TURNS)
        bundle, clip = self.bake_demo(), make_covered_clip(self.shared / "covered")
        reasons = self.bridge("poses", bundle, out, turns, clip=clip).splitlines()
        done = self.play(bundle, "--json", "--quiet", "--extended", "--gyro", gyro, clip=clip)
        self.assertGreaterEqual(done.stdout.count('"extended":true'), COVERED - 1)
        self.assert_poses(out, reasons, SEEN + COVERED, done)

    def test_readings_are_summed_between_frames_and_unknown_in_gaps(self):
        readings, spans = self.folder / "readings", self.folder / "spans"
        readings.write_text("\n".join(f"{time / 1000} {rate}" for time, rate in READINGS))
        spans.write_text("\n".join(f"{start / 1000} {end / 1000}" for start, end in TURNED))
        told = self.bridge("gyroscope", "", readings, spans).splitlines()
        self.assertEqual(len(told), len(TURNED))
        for (span, degrees), word in zip(TURNED.items(), told):
            self.assertEqual(word == "unknown", degrees is None, span)
            if degrees is not None:
                self.assertAlmostEqual(float(word), degrees, 9, span)  # in the readings' unit

    def assert_poses(self, out, reasons, count, done):
        """The bridge's floats are what modar-play says; answers in how many frames something is seen."""
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [json.loads(line) for line in done.stdout.splitlines()][:count]
        given = out.read_bytes()
        self.assertEqual(len(given), count * FLOATS * 4)
        seen = 0
        for i, line in enumerate(lines):
            pose = struct.unpack_from(f"={FLOATS}f", given, i * FLOATS * 4)
            self.assertEqual(line["reason"], reasons[i])
            self.assertEqual(bool(line["visible"]), bool(pose[0]), f"frame {i}")
            self.assertEqual(line["state"] != "hidden", bool(pose[1]), f"frame {i}")
            if not line["visible"]:
                continue
            seen += 1
            detection = line["visible"][0]
            exact = [*detection["rotation"], *detection["translation"],
                     *(value for corner in detection["corners"] for value in corner)]
            self.assertEqual(pose[4:24], floats(exact), f"frame {i}")
            self.assertEqual(pose[2], detection["inliers"])
            self.assertEqual([v + 0.0 for v in pose[24:40]], view_of(pose[4:13], pose[13:16], detection.get("stretch")), f"frame {i}")
        return seen

    def test_pictures_are_the_players(self):
        bundle = self.bake_demo()
        out = self.folder / "pictures"
        self.bridge("pictures", bundle, out)
        done = self.play(bundle, "--device", "mali400", "--out", self.folder / "frames", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        decoded = subprocess.run(["ffmpeg", "-v", "error", "-pattern_type", "glob", "-i", self.folder / "frames" / "*.png",
                                  "-pix_fmt", "rgb24", "-f", "rawvideo", "-"], capture_output=True, check=True).stdout
        self.assertEqual(len(decoded), FRAMES * WIDTH * HEIGHT * 3)
        drawn = out.read_bytes()
        for i in range(FRAMES):
            frame = drawn[i * WIDTH * HEIGHT * 4:(i + 1) * WIDTH * HEIGHT * 4]
            rows = [frame[y * WIDTH * 4:(y + 1) * WIDTH * 4] for y in reversed(range(HEIGHT))]
            upright = b"".join(rows)
            rgb = bytearray(WIDTH * HEIGHT * 3)
            for channel in range(3):
                rgb[channel::3] = upright[channel::4]
            wanted = decoded[i * WIDTH * HEIGHT * 3:(i + 1) * WIDTH * HEIGHT * 3]
            self.assertEqual(rgb, wanted, f"frame {i}: off by {max(abs(a - b) for a, b in zip(rgb, wanted))}")

    def test_scenes_act_as_the_players_do(self):
        bundle, frames, work = bake_film(self), make_frames(self.folder), self.folder / "work"
        work.mkdir()
        clip = nv21_of(frames)
        lines = [json.loads(line) for line in self.bridge("acts", bundle, work, int(1000 * FILM_FRAMES / FILM_FPS), clip=clip).splitlines()]
        wanted = [json.loads(line) for line in self.play(bundle, "--json", "--quiet", clip=clip).stdout.splitlines()][:-1]
        self.assertEqual(len(lines), len(wanted))
        words, numbers = {"play": 1, "pause": 2, "text": 6, "link": 7}, {"play": 0, "pause": 0, "text": 1, "link": -1}
        told, coloured = 0, 0
        for line, player in zip(lines, wanted):
            verbs = [each.split(" ")[0] for each in player.get("commands", [])]
            self.assertEqual(line["commands"], [[words[verb], numbers[verb]] for verb in verbs], line)
            self.assertEqual(line["told"].split(), [{"play": "start"}.get(verb, verb) for verb in verbs if verb in ("play", "pause")], line)
            self.assertEqual(line["caption"], player.get("caption", ""), line)
            told += len(verbs)
            if line["at"] > 0 and "pixel" in line:
                for got, colour in zip(line["pixel"], (int(line["at"] / 10), 200, 60)):
                    self.assertAlmostEqual(got, colour, delta=2, msg=line)
                coloured += 1
        self.assertEqual(told, 6)
        self.assertGreater(coloured, 10)

    def test_clips_play_stop_and_end(self):
        document = json.loads((ROOT / "tests/import/clips/moving.gltf").read_text())
        document["animations"] = [{**document["animations"][0], "name": name} for name in ("walk", "wave")]
        (self.folder / "m.gltf").write_text(json.dumps(document))
        picture(self.folder / "p.png")
        self.assertEqual(self.modar("bake", "m.gltf", "p.png", "-o", "m.modar", *QUICK).returncode, 0)
        self.assertEqual(self.bridge("clips", self.folder / "m.modar").strip(), "played")

    def test_texts_are_the_projects(self):
        told = [bytes.fromhex(line).decode("utf-16-be") for line in self.bridge("texts", bake_with_texts(self, "texts.modar")).split()]
        self.assertEqual({tuple(told[i:i + 3]) for i in range(0, len(told), 3)},
                         {("en", "A vase.", "A vase \U0001F3FA"), ("de", "Eine Vase.", "Eine Vase \U0001F3FA")})

    def test_the_lens_is_what_the_player_says_once_it_is_known(self):
        clip, bundle = make_long_clip(self.folder / "long", 30), self.bake_demo()
        told = [float(line) for line in self.bridge("focal", bundle, clip=clip).split()]
        cameras = [json.loads(line)["camera"] for line in self.play(bundle, "--json", "--quiet", clip=clip).stdout.splitlines()[:30]]
        wanted = [camera["focal_px"] if 0 < camera.get("sigma_px", 0) < 0.03 * camera["focal_px"] else 0 for camera in cameras]
        self.assertGreater(wanted.count(0), 10)
        self.assertGreater(wanted[-1], 0)
        for share, focal in zip(told, wanted, strict=True):
            self.assertAlmostEqual(share * WIDTH, focal, delta=0.01)

    def test_every_misuse_throws_and_crashes_nothing(self):
        bundle = self.bake_demo()
        damaged = self.folder / "damaged.modar"
        damaged.write_bytes(bundle.read_bytes()[:5000])
        self.assertIn("all thrown", self.bridge("misuse", bundle, damaged))

    def test_closing_while_other_threads_are_busy(self):
        self.assertIn("closed", self.bridge("close", self.bake_demo()))

    def test_nothing_grows(self):
        frames, size = 10000 if SOAK else 1000, (WIDTH // 2, HEIGHT // 2)
        small = self.folder / "small.nv21"  # what grows does so by the frame, not by the pixel
        subprocess.run(["ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "nv21", "-s", f"{WIDTH}x{HEIGHT}", "-i", self.clip, "-vf",
                        "scale=iw/2:ih/2:flags=area", "-pix_fmt", "nv21", "-f", "rawvideo", small], check=True)
        heap, resident, references = map(int, self.bridge("soak", self.bake_demo(), frames, clip=small, size=size).split())
        print(f"the second half of {frames} frames: heap {heap:+} bytes, resident {resident:+} kB, JNI references {references:+}")
        self.assertEqual(references, 0, "JNI references")
        self.assertLess(heap, 100_000, "bytes of Java's heap")
        if not os.environ.get("MODAR_SANITIZE"):  # ASan keeps freed memory for a while
            self.assertLess(resident, 4_000, "resident kilobytes")


class Targets(unittest.TestCase):
    """The bridge in the phone's dialect, against Android's own jni.h."""

    def test_nothing_is_named_that_older_ndks_lack(self):
        """r25, the last NDK for Android 4.4, has libc++ of April 2020."""
        lacking = re.compile(r"std::(bit_width|has_single_bit|bit_ceil|bit_floor|bit_cast|numbers|ranges|source_location|chars_format|"
                             r"format|jthread|bind_front)\b|#include <(numbers|ranges|concepts|source_location|format)>")
        rooms = ["formats", "formats/base", "formats/transport", *(f"runtime/{room}" for room in (
            "include/modar", "platform", "track", "render", "capi", "android", "fetch", "fetch/include/modar"))]
        desk = {"curl_downloader.cpp", "main.cpp"}
        files = [file for room in rooms for file in (ROOT / room).glob("*.[hc]pp") if file.name not in desk]
        self.assertGreater(len(files), 80)
        found = [f"{file.relative_to(ROOT)}: {match[0]}" for file in files
                 for match in lacking.finditer(re.sub("//.*", "", file.read_text()))]
        self.assertEqual(found, [])

    def test_it_compiles_for_every_phone(self):
        jni = pathlib.Path("/usr/include/android/nativehelper/jni.h")
        if not have("clang++-14") or not jni.exists() or not pathlib.Path("/usr/lib/llvm-14/include/c++/v1").exists():
            self.skipTest("no clang-14, libc++-14-dev or android-libnativehelper-dev")
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for file, text in {"gnu/stubs.h": "", "xlocale.h": "#include <stdlib.h>\n#include <wchar.h>\n",
                               "bits/wordsize.h": "#define __WORDSIZE (__SIZEOF_POINTER__ * 8)\n"
                                                  "#define __WORDSIZE_TIME64_COMPAT32 0\n",
                               "jni.h": f'#include "{jni}"\n'}.items():
                (folder / file).parent.mkdir(exist_ok=True)
                (folder / file).write_text(text)
            unit = folder / "unit.cpp"
            unit.write_text("".join(f'#include "{file}"\n' for file in sorted((ROOT / "runtime" / "extensions" / "android").glob("*.cpp"))))
            # glibc replaces bionic, so the compiler must not say that this is Android.
            for target in ("armv7a-linux-androideabi19", "aarch64-linux-android21", "i686-linux-android19", "x86_64-linux-android21"):
                with self.subTest(target=target):
                    done = subprocess.run(
                        ["clang++-14", f"--target={target}", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wconversion",
                         "-Werror", "-fno-exceptions", "-fno-rtti", "-nostdinc++", "-nostdlibinc", "-D__regparm__(x)=",
                         "-U__ANDROID__", "-D_GNU_SOURCE", "-I", ROOT, "-I", ROOT / "runtime" / "include",
                         "-I", ROOT / "runtime" / "fetch" / "include",
                         "-isystem", "/usr/lib/llvm-14/include/c++/v1", "-isystem", folder, "-idirafter", "/usr/include",
                         "-idirafter", "/usr/include/x86_64-linux-gnu", unit], capture_output=True, text=True)
                    self.assertEqual(done.returncode, 0, done.stderr[:4000])


if __name__ == "__main__":
    unittest.main()
