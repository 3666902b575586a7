#!/usr/bin/env python3
"""Makes assets/demo.webp, the moving picture of the README: a jar on a book that lies on a table.

Renders the book from a camera that sways about it at a slant, bakes the jar onto the book's cover, plays the bundle on
these frames with modar-play, and writes what that draws. The same programs give the same bytes. Needs FFmpeg.
"""
import argparse
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
ASSETS = Path(__file__).resolve().parent
sys.path.insert(0, str(ASSETS))

from kit import png  # noqa: E402
from kit.canvas import Canvas, jitter  # noqa: E402
from make_clip import halved, homography, lay, warp  # noqa: E402

FRAMES, RATE = 42, 14
LEAD = 3  # frames before the first: the player shows a model in the second frame that has it
WIDTH, HEIGHT = 480, 336
TABLE = 11.0  # half a side of the table, in halves of the book's longer side
DISTANCE, HEIGHT_OF_AIM = 3.7, 0.45  # of the camera from the point that it looks at, and of that above the table


def camera(time):
    """The rotation and place of the table for a camera at `time`, 0 to 1; the same at both ends."""
    turn = math.radians(38) * math.sin(2 * math.pi * time)
    rise = math.radians(35 + 5 * math.cos(4 * math.pi * time))
    ahead = (-math.sin(turn) * math.cos(rise), -math.cos(turn) * math.cos(rise), math.sin(rise))
    right = (math.cos(turn), -math.sin(turn), 0.0)
    down = (ahead[1] * right[2] - ahead[2] * right[1], ahead[2] * right[0] - ahead[0] * right[2],
            ahead[0] * right[1] - ahead[1] * right[0])
    place = [-DISTANCE * ahead[k] + (0, 0, -HEIGHT_OF_AIM)[k] for k in range(3)]
    rotation = (right, down, ahead)
    return rotation, tuple(-sum(row[k] * place[k] for k in range(3)) for row in rotation)


def table(book):
    """A light wooden table with the book's shadow, a pencil and two sheets, 64 pixels a unit."""
    dice = random.Random(5)
    side, unit = int(128 * TABLE), 64.0
    page = Canvas(side, side, (222, 199, 164), 2)
    planks = 34
    for k in range(planks):
        y = k * side / planks
        page.box(0, y, side, y + side / planks, jitter(dice, (224, 200, 164), 10))
        page.stroke([(0, y), (side, y)], 1.2, (176, 148, 112))
        for _ in range(30):
            x = dice.uniform(0, side)
            at = y + dice.uniform(3, side / planks - 3)
            page.stroke([(x, at), (x + dice.uniform(30, 140), at + dice.uniform(-1.5, 1.5))], 1.0, (206, 178, 140))

    def sheet(x, y, wide, tall, turn, colour, lines):
        c, s = math.cos(turn), math.sin(turn)

        def at(u, v):
            return side / 2 + unit * (x + c * u * wide - s * v * tall), side / 2 + unit * (y + s * u * wide + c * v * tall)

        page.polygon([(p[0] + 4, p[1] + 4) for p in (at(-1, -1), at(1, -1), at(1, 1), at(-1, 1))], (150, 124, 92), 0.6)
        page.polygon([at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)], colour)
        for k in range(lines):
            v = -0.8 + 1.6 * k / lines
            page.stroke([at(-0.8, v), at(dice.uniform(0.3, 0.85), v)], 2, (150, 160, 176))

    sheet(-2.1, -1.5, 0.7, 0.95, 0.3, (250, 248, 240), 11)
    sheet(2.0, -2.3, 0.8, 0.55, -0.2, (236, 243, 247), 6)
    sheet(1.55, 0.75, 0.04, 0.75, 0.35, (226, 120, 48), 0)
    wide, tall = book.width / max(book.width, book.height), book.height / max(book.width, book.height)
    for spread, alpha in ((0.10, 0.15), (0.07, 0.2), (0.04, 0.25)):
        sx, sy = unit * (wide + spread), unit * (tall + spread)
        page.polygon([(side / 2 + x * sx + 3, side / 2 + y * sy + 3) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))],
                     (92, 70, 48), alpha)
    return page.picture()


def render(book, folder):
    ground = table(book)
    books = (book, halved(book))
    for k in range(FRAMES + LEAD):
        rotation, shift = camera((k - LEAD) / FRAMES)
        frame = png.Picture(WIDTH, HEIGHT, bytearray(bytes((206, 214, 218)) * (WIDTH * HEIGHT)))
        over = homography(rotation, tuple(v / TABLE for v in shift), ground, WIDTH, HEIGHT)
        warp(frame, ground, 1, over, (0, 0, WIDTH, HEIGHT))
        lay(frame, books, homography(rotation, shift, book, WIDTH, HEIGHT))
        png.write(folder / f"frame_{k:05d}.png", frame, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bin", type=Path, default=ASSETS.parent / "build/release/bin", metavar="DIR",
                        help="folder of modar and modar-play")
    parser.add_argument("-o", "--output", type=Path, default=ASSETS / "demo.webp", metavar="FILE.webp")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="for the frames (default: a temporary folder)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        clip, drawn, bundle = folder / "clip", folder / "drawn", folder / "demo.modar"
        clip.mkdir(parents=True, exist_ok=True)
        cover = ASSETS / "patterns/survey.png"
        render(png.read(cover), clip)
        subprocess.run([options.bin / "modar", "bake", "--quiet", "--model", ASSETS / "models/pottery.obj",
                        "--pattern", f"{cover}:200mm", "--scene", "survey=pottery,height=180mm", "-o", bundle], check=True)
        subprocess.run([options.bin / "modar-play", bundle, "--input", clip, "--out", drawn, "--force", "--quiet"],
                       check=True)
        subprocess.run(["ffmpeg", "-v", "error", "-nostdin", "-y", "-framerate", str(RATE), "-start_number", str(LEAD),
                        "-i", drawn / "frame_%06d.png", "-c:v", "libwebp_anim", "-lossless", "0", "-q:v", "55",
                        "-compression_level", "6", "-loop", "0", "-fflags", "+bitexact", options.output], check=True)


if __name__ == "__main__":
    main()
