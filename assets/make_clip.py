#!/usr/bin/env python3
"""Renders a clip of a pattern held before a camera, as PNG frames with the true corners next to them.

The camera's focal length is the image's width, its centre the image's middle. The hand sways, tilts,
turns and comes nearer; the light changes; a hand covers a part for a while; in about an eighth of the
frames the pattern is not there. truth.csv holds frame, the pattern's four outer corners (top left,
top right, bottom right, bottom left, in pixels, where 0,0 is the middle of the first pixel) and whether
it is visible. The same arguments give the same bytes.
"""
import argparse
import math
import random
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))

from kit import noise, png  # noqa: E402
from kit.canvas import Canvas, jitter, mix, placed, ring, spline  # noqa: E402


def clutter(width, height, dice):
    """A table with books, sheets, pens, coins and plants: plenty of corners that are not the pattern's."""
    scale = width / 480
    page = Canvas(width, height, (150, 116, 84), 2)
    for k in range(int(height / (9 * scale)) + 1):
        y = k * 9 * scale
        page.box(0, y, width, y + 9 * scale, jitter(dice, (150, 112, 80), 14))
        for _ in range(7):
            x = dice.uniform(0, width)
            page.stroke([(x, y + 3 * scale), (x + dice.uniform(20, 70) * scale, y + 4 * scale)], 1.1, (112, 80, 56))
    for _ in range(46):
        x, y, turn = dice.uniform(0, width), dice.uniform(0, height), dice.uniform(0, 3.14)
        size, kind = dice.uniform(10, 44) * scale, dice.random()
        shade = tuple(int(dice.uniform(30, 235)) for _ in range(3))
        if kind < 0.5:
            sheet = [(-1, -0.7), (1, -0.7), (1, 0.7), (-1, 0.7)]
            page.polygon(placed(sheet, x + 3, y + 3, size, turn), (50, 36, 30), 0.5)
            page.polygon(placed(sheet, x, y, size, turn), shade)
            for k in range(6):
                v = -0.55 + k * 0.2
                page.stroke(placed([(-0.8, v), (dice.uniform(-0.2, 0.8), v)], x, y, size, turn), 1.6 * scale,
                            mix(shade, (20, 20, 26), 0.7))
        elif kind < 0.7:
            page.stroke(placed([(-1, 0), (1, 0)], x, y, size, turn), 5 * scale, shade)
            page.stroke(placed([(1, 0), (1.2, 0)], x, y, size, turn), 3 * scale, (30, 30, 30), 1)
        elif kind < 0.85:
            for far, tone in ((0.6, 0.4), (0.52, 0.0), (0.3, 0.25)):
                page.dot(x, y, size * far, mix(shade, (20, 20, 20), tone))
        else:
            for k in range(9):
                leaf = spline([(0, 0), (0.5, -0.2), (1, 0), (0.5, 0.2)], 4, True)
                page.polygon(placed(leaf, x, y, size, turn + k * 0.7), jitter(dice, (60, 118, 66), 24))
    return page.picture()


def pose(time, aspect, dice_phase):
    """The pattern's rotation and place at `time` (0 to 1), its larger side being 2 long."""
    a = dice_phase
    tilt = 0.42 * math.sin(2 * math.pi * (0.9 * time + a[0])) + 0.03 * math.sin(2 * math.pi * (7.1 * time + a[1]))
    pan = 0.48 * math.sin(2 * math.pi * (1.2 * time + a[2])) + 0.03 * math.sin(2 * math.pi * (6.3 * time + a[3]))
    roll = 0.5 * math.sin(2 * math.pi * (0.7 * time + a[4]))
    far = 4.0 + 1.1 * math.sin(2 * math.pi * (0.8 * time + a[5]))
    shift = (0.26 * far * 0.5 * math.sin(2 * math.pi * (1.1 * time + a[1])),
             0.16 * far * 0.5 * math.sin(2 * math.pi * (1.5 * time + a[2])) * aspect, far)
    cx, sx, cy, sy, cz, sz = (f(v) for v in (tilt, pan, roll) for f in (math.cos, math.sin))
    rotation = ((cy * cz, -cy * sz, sy),
                (sx * sy * cz + cx * sz, -sx * sy * sz + cx * cz, -sx * cy),
                (-cx * sy * cz + sx * sz, cx * sy * sz + sx * cz, cx * cy))
    return rotation, shift


def homography(rotation, shift, pattern, width, height):
    """From pattern pixels (0,0 the middle of the first) to frame pixels of the same convention."""
    half = max(pattern.width, pattern.height) / 2
    focal, cx, cy = float(width), (width - 1) / 2, (height - 1) / 2
    u, v = (pattern.width - 1) / 2, (pattern.height - 1) / 2
    rows = []
    for r, t in zip(rotation, shift):
        a, b = r[0] / half, r[1] / half
        rows.append((a, b, t - a * u - b * v))
    x, y, z = rows
    return [tuple(focal * p + cx * q for p, q in zip(x, z)), tuple(focal * p + cy * q for p, q in zip(y, z)), z]


def inverse(h):
    """The adjugate of a 3x3 matrix: enough for a homography."""
    (a, b, c), (d, e, f), (g, i, k) = h
    return ((e * k - f * i, c * i - b * k, b * f - c * e), (f * g - d * k, a * k - c * g, c * d - a * f),
            (d * i - e * g, b * g - a * i, a * e - b * d))


def project(h, x, y):
    w = h[2][0] * x + h[2][1] * y + h[2][2]
    return ((h[0][0] * x + h[0][1] * y + h[0][2]) / w, (h[1][0] * x + h[1][1] * y + h[1][2]) / w)


def halved(picture):
    """Half the size, by the mean of four: for patterns that come out smaller than they are."""
    out = png.Picture(picture.width // 2, picture.height // 2)
    stride, p = picture.width * 3, picture.pixels
    for y in range(out.height):
        for x in range(out.width):
            i = 2 * y * stride + 6 * x
            for c in range(3):
                out.pixels[(y * out.width + x) * 3 + c] = (
                    p[i + c] + p[i + 3 + c] + p[i + stride + c] + p[i + stride + 3 + c] + 2) // 4
    return out


def lay(frame, levels, h):
    """Warps the pattern into the frame, bilinearly, from its full or its half size."""
    full = levels[0]
    corners = [project(h, x, y) for x, y in outer(full)]
    low, high = max(int(min(y for _, y in corners)), 0), min(int(max(y for _, y in corners)) + 2, frame.height)
    left, right = max(int(min(x for x, _ in corners)), 0), min(int(max(x for x, _ in corners)) + 2, frame.width)
    shrink = (corners[1][0] - corners[0][0]) * (corners[3][1] - corners[0][1]) - (
        corners[1][1] - corners[0][1]) * (corners[3][0] - corners[0][0])
    level = 1 if shrink < 0.42 * full.width * full.height else 0
    warp(frame, levels[level], 1 << level, h, (left, low, right, high))


def warp(frame, image, size, h, box):
    """Draws `image`, a `size`-th of what h maps to the frame, in a box of the frame: left, top, right, bottom."""
    left, low, right, high = box
    (a, b, c), (d, e, f), (g, i, k) = inverse(h)
    wide, tall, stride, p = image.width - 1, image.height - 1, image.width * 3, image.pixels
    move = (size - 1) / 2
    for y in range(low, high):
        at, out = (y * frame.width + left) * 3, frame.pixels
        for x in range(left, right):
            w = g * x + i * y + k
            u = ((a * x + b * y + c) / w - move) / size
            v = ((d * x + e * y + f) / w - move) / size
            if -0.5 <= u <= wide + 0.5 and -0.5 <= v <= tall + 0.5:
                u = 0.0 if u < 0 else wide - 1e-6 if u >= wide else u
                v = 0.0 if v < 0 else tall - 1e-6 if v >= tall else v
                iu, iv = int(u), int(v)
                fu, fv = u - iu, v - iv
                j = iv * stride + iu * 3
                m, n, q, r = (1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv
                s = j + stride
                out[at] = int(p[j] * m + p[j + 3] * n + p[s] * q + p[s + 3] * r + 0.5)
                out[at + 1] = int(p[j + 1] * m + p[j + 4] * n + p[s + 1] * q + p[s + 4] * r + 0.5)
                out[at + 2] = int(p[j + 2] * m + p[j + 5] * n + p[s + 2] * q + p[s + 5] * r + 0.5)
            at += 3


def outer(pattern):
    """The pattern's corners: the outer edges of its corner pixels."""
    x, y = pattern.width - 0.5, pattern.height - 0.5
    return [(-0.5, -0.5), (x, -0.5), (x, y), (-0.5, y)]


def cover(frame, corners, share):
    """A thumb from below over the pattern's lower right, a share (0 to 1) of the way up."""
    (x0, y0), (x1, y1), (x2, y2) = corners[1], corners[2], corners[3]
    size = 0.34 * math.hypot(x1 - x0, y1 - y0)
    tip = (x1 + (x2 - x1) * 0.25 + (x0 - x1) * 0.5 * share, y1 + (y2 - y1) * 0.25 + (y0 - y1) * 0.5 * share)
    page = Canvas(frame.width, frame.height, (0, 0, 0), 1)
    page.lay(frame)
    foot = (tip[0] + size * 0.5, frame.height + size)
    for wide, shade in ((1.0, (172, 112, 88)), (0.86, (214, 158, 130)), (0.5, (226, 174, 146))):
        page.stroke([tip, ((tip[0] + foot[0]) / 2 + size * 0.1, (tip[1] + foot[1]) / 2), foot], size * wide, shade)
    page.polygon(ring(tip[0], tip[1] - size * 0.16, size * 0.26, 20, 0.8), (240, 206, 190))
    frame.pixels[:] = page.picture().pixels


def expose(frame, gain, drift, grain, seed):
    """Light that falls off to one side, and sensor noise, in one table a column."""
    columns = 24
    tables = []
    for k in range(columns):
        g = gain * (1 + drift * (k / (columns - 1) - 0.5))
        tables.append(bytes(min(int(v * g + 0.5), 255) for v in range(256)))
    stride = frame.width * 3
    cuts = [round(k * frame.width / columns) * 3 for k in range(columns + 1)]
    for y in range(frame.height):
        row = frame.pixels[y * stride : (y + 1) * stride]
        for k in range(columns):
            row[cuts[k] : cuts[k + 1]] = row[cuts[k] : cuts[k + 1]].translate(tables[k])
        shift = int(noise.lattice(y, seed, 7) * (len(grain) - stride - 1))
        values = map(int.__add__, row, grain[shift : shift + stride])
        frame.pixels[y * stride : (y + 1) * stride] = bytes([0 if v < 0 else 255 if v > 255 else v for v in values])


def shifted(background, dx, dy, width, height):
    """The part of the background that the camera sees."""
    out = png.Picture(width, height)
    for y in range(height):
        at = ((y + dy) * background.width + dx) * 3
        out.pixels[y * width * 3 : (y + 1) * width * 3] = background.pixels[at : at + width * 3]
    return out


def render(pattern, frames, width, height, seed, folder):
    """Writes the frames and truth.csv into `folder`."""
    dice = random.Random(seed)
    phase = [dice.random() for _ in range(6)]
    margin = width // 8
    background = clutter(width + 2 * margin, height + 2 * margin, dice)
    grain = [int(dice.gauss(0, 3.2)) for _ in range(width * 3 * 5)]
    levels = (pattern, halved(pattern))
    gone = range(int(frames * 0.55), int(frames * 0.55) + max(frames // 8, 1))
    covered = range(int(frames * 0.78), int(frames * 0.95))
    rows = ["frame,tl_x,tl_y,tr_x,tr_y,br_x,br_y,bl_x,bl_y,visible\n"]
    for k in range(frames):
        time = k / max(frames, 60)
        dx = margin + int(margin * 0.9 * math.sin(6.28 * (0.9 * time + phase[0])))
        dy = margin + int(margin * 0.9 * math.sin(6.28 * (1.1 * time + phase[1])))
        frame = shifted(background, dx, dy, width, height)
        h = homography(*pose(time, height / width, phase), pattern, width, height)
        corners = [project(h, x, y) for x, y in outer(pattern)]
        visible = k not in gone
        if visible:
            lay(frame, levels, h)
            if k in covered:
                cover(frame, corners, math.sin(math.pi * (k - covered.start + 0.5) / len(covered)))
        gain = 0.9 + 0.22 * math.sin(6.28 * (1.3 * time + phase[3]))
        expose(frame, gain, 0.3 * math.sin(6.28 * (time + phase[4])), grain, k)
        png.write(folder / f"frame_{k:05d}.png", frame, 6)
        numbers = [f"{v:.3f}" for corner in corners for v in corner] if visible else [""] * 8
        rows.append(",".join([str(k), *numbers, str(int(visible))]) + "\n")
    (folder / "truth.csv").write_text("".join(rows), encoding="ascii", newline="\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=Path, metavar="OUTDIR")
    parser.add_argument("--pattern", type=Path, required=True, metavar="P.png", help="an 8-bit PNG file")
    parser.add_argument("--frames", type=int, default=60, metavar="N")
    parser.add_argument("--size", default="480x360", metavar="WxH")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="another path, table and light")
    options = parser.parse_args()
    try:
        width, height = (int(v) for v in options.size.split("x"))
        pattern = png.read(options.pattern)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    if options.frames < 1 or not 64 <= width <= 4096 or not 64 <= height <= 4096:
        parser.error("at least 1 frame, of 64 to 4096 pixels a side")
    options.out.mkdir(parents=True, exist_ok=True)
    render(pattern, options.frames, width, height, options.seed, options.out)


if __name__ == "__main__":
    main()
