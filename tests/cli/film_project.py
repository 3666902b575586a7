"""A pattern with a film, a label and actions, and frames in which it is seen, gone for longer than a second, and seen again."""
import shutil
import subprocess

from programs import CLIP_HEIGHT, CLIP_WIDTH, COVER, demo_clip

FPS = 30
FILM_FPS, FILM_FRAMES = 10, 20
SEEN, GONE, AGAIN = 10, 40, 25  # frames with the cover, without it, and with it again
PROJECT = """[bake]
loop-views = 8
score = false
parameters = "none"
[[pattern]]
file = "cover.png"
width = "144mm"
[[scene]]
pattern = "cover"
[[scene.video]]
file = "film.mp4"
scale = 0.5
centred = true
captions.en = "film.vtt"
[[scene.label]]
name = "note"
title.en = "A note"
[[scene.action]]
on = "after 0.25s"
do = "text note"
[[scene.action]]
on = "lost"
do = "link https://museum.org/cover"
"""


def bake_film(test):
    """The bundle; film.mp4 is next to it. Each picture has one colour, no two that follow are alike."""
    shutil.copy(COVER, test.folder / "cover.png")
    (test.folder / "modar.toml").write_text(PROJECT)
    (test.folder / "film.vtt").write_text("WEBVTT\n\n00:00.100 --> 00:00.300\n<i>One</i> &amp; only\n")
    pictures = b"".join(bytes((60 + 9 * i, 200 - 8 * i, 90 + 60 * (i % 3))) * 64 * 64 for i in range(FILM_FRAMES))
    # Fit already, so that its bytes are the bundle's.
    subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "64x64", "-r", str(FILM_FPS), "-i", "-",
                    "-f", "lavfi", "-i", f"sine=f=440:r=44100:d={FILM_FRAMES / FILM_FPS}", "-c:v", "libx264", "-profile:v", "baseline",
                    "-pix_fmt", "yuv420p", "-crf", "12", "-c:a", "aac", "-movflags", "+faststart", test.folder / "film.mp4"],
                   input=pictures, check=True)
    done = test.modar("bake", "--quiet", cwd=test.folder)
    test.assertEqual(done.returncode, 0, done.stderr)
    return next((test.folder / "out").glob("*.modar"))


def make_frames(folder):
    """Links to PNG files in the order in which they are played."""
    demo_clip(folder / "clip", SEEN)
    shown = sorted((folder / "clip").glob("*.png"))
    blank = folder / "blank.png"
    subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "lavfi", "-i", f"color=gray:s={CLIP_WIDTH}x{CLIP_HEIGHT}", "-frames:v", "1", blank],
                   check=True)
    there_and_back = [*shown, *shown[-2:0:-1]]
    frames = folder / "frames"
    frames.mkdir()
    for i, path in enumerate(([*shown, *[blank] * GONE, *there_and_back * 2])[:SEEN + GONE + AGAIN]):
        (frames / f"{i:04}.png").symlink_to(path)
    return frames
