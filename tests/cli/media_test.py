"""Videos and sounds in the player: its log of commands, pixels against FFmpeg's own decoder, and the sound."""
import array
import json
import math
import os
import subprocess
import unittest

from film_project import AGAIN, FILM_FPS, FILM_FRAMES, FPS, GONE, SEEN, bake_film, make_frames
from programs import CLIP_HEIGHT, CLIP_WIDTH, ProgramTest


def frames_of(path):
    """The middle pixel of each picture, by FFmpeg."""
    raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", path, "-vf", "crop=2:2", "-pix_fmt", "rgb24", "-f", "rawvideo", "-"],
                         capture_output=True, check=True).stdout
    return [tuple(raw[i:i + 3]) for i in range(0, len(raw), 12)]


class Media(ProgramTest):
    def setUp(self):
        super().setUp()
        self.bundle = bake_film(self)
        self.frames = make_frames(self.folder)

    def play(self, *words, **options):
        done = self.run_program("modar-play", self.bundle, "--input", self.frames, "--json", *words, **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()][:-1], done.stderr

    def test_commands_pixels_and_captions_are_those_of_the_frames_times(self):
        lines, told = self.play("--out", self.folder / "out" / "pictures", "--no-light-estimate")
        self.assertEqual(len(lines), SEEN + GONE + AGAIN)
        present = [line["state"] != "hidden" for line in lines]
        first = present.index(True)
        self.assertLess(first, 3)
        again = present.index(True, SEEN + 5)
        last = max(i for i in range(again) if present[i])
        lost = next(i for i in range(last, again) if (i - last) / FPS > 1)
        log = {first: ["play film"], first + 8: ["text note"], lost: ["link https://museum.org/cover", "pause film"],
               again: ["play film"], again + 8: ["text note"]}
        self.assertEqual({i: line["commands"] for i, line in enumerate(lines) if "commands" in line}, log)
        # Where the film is: it continues for the second of grace, waits while the cover is gone, and stays at its end.
        length = FILM_FRAMES / FILM_FPS
        at = [min(length, (min(i, lost) - first) / FPS + max(0, i - again) / FPS) for i in range(len(lines))]
        self.assertEqual(at[-1], length)
        decoded = frames_of(self.folder / "film.mp4")
        self.assertEqual(len(decoded), FILM_FRAMES)
        shown = set()
        for i, line in enumerate(lines):
            self.assertEqual(line.get("caption"), "One & only" if first <= i < again and 0.1 <= at[i] + 1e-9 < 0.3 else None, i)
            if not line["visible"] or not present[i]:
                continue
            x, y, z = line["visible"][0]["translation"]
            focal = line["camera"]["focal_px"]
            pixel = int(CLIP_WIDTH / 2 + focal * x / z), int(CLIP_HEIGHT / 2 + focal * y / z)
            raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", self.folder / "out" / "pictures" / f"frame_{i:06}.png", "-vf",
                                  f"crop=1:1:{pixel[0]}:{pixel[1]}", "-pix_fmt", "rgb24", "-f", "rawvideo", "-"], capture_output=True).stdout
            wanted = min(FILM_FRAMES - 1, math.floor(at[i] * FILM_FPS + 1e-6))
            shown.add(wanted)
            for got, channel in zip(raw, decoded[wanted]):
                self.assertAlmostEqual(got, channel, delta=2, msg=(i, wanted, tuple(raw), decoded[wanted]))
        self.assertGreater(len(shown), 8)
        self.assertIn("modar-play: One & only\n", told)
        self.assertIn("link: https://museum.org/cover", told)
        # It ends where it ends: what comes then is a picture that stands.
        self.assertEqual(self.play("--quiet")[0][-1].get("commands"), None)

    def heard(self, *words):
        """Seconds that are not silent, and the pitch of these."""
        file = self.folder / "heard.raw"
        file.unlink(missing_ok=True)
        env = {"SDL_AUDIODRIVER": "disk", "SDL_DISKAUDIOFILE": str(file)}
        told = self.play("--realtime", "--quiet", *words, env={**os.environ, **env})[1]
        if not file.exists():
            return 0, 0
        samples = array.array("f", file.read_bytes())[::2]
        loud = [a for a in samples if abs(a) > 0.001]
        crossings = sum(a < 0 <= b for a, b in zip(samples, samples[1:]))
        return len(loud) / 44100, crossings / max(1, len(loud)) * 44100

    def test_it_is_heard_when_asked_for(self):
        self.assertEqual(self.heard(), (0, 0))
        seconds, pitch = self.heard("--sound")
        # Less than it lasts where the machine has no time to draw.
        self.assertGreater(seconds, 0.3)
        self.assertLess(seconds, FILM_FRAMES / FILM_FPS + 0.2)
        self.assertAlmostEqual(pitch, 440, delta=12)
        done = self.run_program("modar-play", self.bundle, "--input", self.frames, "--sound")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("with --realtime only", done.stderr)


if __name__ == "__main__":
    unittest.main()
