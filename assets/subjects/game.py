"""The lid of a board game: an island of hexagonal tiles in a sea of ships (300 x 245)."""
import math
import random

from kit import glyphs, noise
from kit.canvas import Canvas, finish, jitter, mix, pick, placed, ring, spline, star

WIDTH, HEIGHT = 300, 245
SEA, DEEP, FOAM = (42, 122, 150), (18, 62, 98), (202, 232, 228)
INK, PAPER, RED, SAND = (30, 28, 36), (250, 236, 204), (196, 58, 48), (226, 196, 132)
SIZE = 25


def sea(page, dice):
    page.box(0, 0, WIDTH, HEIGHT, lambda y: mix(SEA, DEEP, y / HEIGHT))
    for _ in range(210):
        x, y, r = dice.uniform(0, 300), dice.uniform(40, 245), dice.uniform(3, 7)
        wave = [(-1.4, 0.1), (-0.7, -0.5), (0, 0.1), (0.7, -0.5), (1.4, 0.1)]
        page.stroke(placed(spline(wave, 5), x, y, r, dice.uniform(-0.2, 0.2)), 1.3,
                    mix(SEA, FOAM, dice.uniform(0.15, 0.8)))


def mountain(page, dice, x, y):
    for u, v, r in ((-8, 2, 9), (7, 3, 10), (-1, 5, 13)):
        grey = jitter(dice, (128, 120, 118), 14)
        peak, wide = (x + u, y + v - r * 1.35), r * 0.95
        page.polygon([(x + u - wide, y + v + r * 0.5), peak, (x + u + wide, y + v + r * 0.5)], grey)
        page.polygon([peak, (x + u + wide, y + v + r * 0.5), (x + u + 1, y + v + r * 0.5)],
                     mix(grey, INK, 0.5))
        page.polygon([peak, (peak[0] + 4, peak[1] + 6), (peak[0] + 1, peak[1] + 4.6),
                      (peak[0] - 1.6, peak[1] + 7), (peak[0] - 4, peak[1] + 6)], (250, 250, 250))


def forest(page, dice, x, y):
    spots = sorted((dice.uniform(-9, 13), dice.uniform(-13, 13)) for _ in range(13))
    for v, u in spots:
        dark = jitter(dice, (30, 82, 58), 16)
        page.stroke([(x + u, y + v), (x + u, y + v + 3)], 1.6, (70, 48, 36))
        for k in range(3):
            page.polygon([(x + u - 5 + k, y + v - 3 * k), (x + u, y + v - 6 - 3 * k),
                          (x + u + 5 - k, y + v - 3 * k)], mix(dark, (150, 190, 90), 0.22 * k))


def wheat(page, dice, x, y):
    for _ in range(14):
        u, v = dice.uniform(-15, 15), dice.uniform(-4, 15)
        lean = dice.uniform(-2, 2)
        page.stroke([(x + u, y + v), (x + u + lean, y + v - 12)], 1.0, (150, 104, 40))
        for i in range(4):
            for side in (-1, 1):
                page.dot(x + u + lean * (1 - i / 5) + side * 1.5, y + v - 12 + i * 2, 1.2,
                         jitter(dice, (250, 206, 84), 20))


def castle(page, dice, x, y):
    wall = jitter(dice, (196, 186, 176), 10)
    page.box(x - 12, y - 4, x + 12, y + 11, wall)
    for u in (-14, -3.5, 7):
        page.box(x + u, y - 10 - (u == -3.5) * 5, x + u + 7, y + 11, mix(wall, INK, 0.12))
        for k in range(3):
            page.box(x + u - 0.6 + k * 3, y - 13 - (u == -3.5) * 5, x + u + 1.4 + k * 3,
                     y - 9 - (u == -3.5) * 5, wall)
        page.box(x + u + 2.6, y - 6, x + u + 4.4, y - 1, INK)
    for _ in range(12):
        u, v = dice.uniform(-12, 9), dice.uniform(-2, 9)
        page.box(x + u, y + v, x + u + 3, y + v + 1.2, mix(wall, INK, 0.4))
    page.polygon([(x - 3, y + 11), (x - 3, y + 5), (x, y + 2.6), (x + 3, y + 5), (x + 3, y + 11)], INK)
    page.polygon([(x, y - 24), (x + 9, y - 21), (x, y - 18)], RED)
    page.stroke([(x, y - 24), (x, y - 14)], 1.1, INK)


def village(page, dice, x, y):
    for u, v in ((-10, -6), (4, -9), (-5, 4), (8, 6)):
        u, v = u + dice.uniform(-2, 2), v + dice.uniform(-2, 2)
        page.box(x + u - 4.6, y + v - 1, x + u + 4.6, y + v + 7, jitter(dice, PAPER, 12))
        page.polygon([(x + u - 6.4, y + v - 0.6), (x + u - 3, y + v - 7), (x + u + 3.4, y + v - 7),
                      (x + u + 6.4, y + v - 0.6)], jitter(dice, RED, 26))
        page.box(x + u - 3, y + v + 2, x + u - 0.6, y + v + 7, INK)
        page.box(x + u + 1.4, y + v + 1.4, x + u + 3.4, y + v + 3.6, (60, 90, 120))


def pasture(page, dice, x, y):
    for _ in range(26):
        u, v = dice.uniform(-16, 16), dice.uniform(-15, 15)
        page.stroke([(x + u, y + v), (x + u + 1, y + v - 3)], 0.9, (60, 110, 50))
    for u, v in ((-8, -6), (6, -2), (-3, 9)):
        for k in range(6):
            page.dot(x + u + 3.6 * math.cos(k), y + v + 2.4 * math.sin(k), 2.6, (250, 248, 238))
        page.dot(x + u + 5.6, y + v - 1, 2.2, INK)
        for k in (-2, 2):
            page.stroke([(x + u + k, y + v + 3), (x + u + k, y + v + 6.4)], 1.2, INK)


def tile(page, dice, x, y, ground, art):
    page.polygon(ring(x, y + 2.4, SIZE * 0.99, 6, 1, math.pi / 6), INK, 0.55)
    page.polygon(ring(x, y, SIZE * 0.99, 6, 1, math.pi / 6), PAPER)
    hexagon = ring(x, y, SIZE * 0.89, 6, 1, math.pi / 6)
    page.polygon(hexagon, ground)
    page.clip(hexagon)
    for _ in range(18):
        page.dot(x + dice.uniform(-22, 22), y + dice.uniform(-22, 22), dice.uniform(1, 4),
                 jitter(dice, ground, 26), alpha=0.8)
    art(page, dice, x, y)
    page.clip()


def island(page, dice):
    kinds = [((150, 142, 120), mountain), ((84, 140, 78), forest), ((222, 176, 84), wheat),
             ((128, 160, 96), castle), ((190, 164, 110), village), ((138, 182, 84), pasture)]
    order = [1, 0, 4, 2, 5, 3, 1, 0, 2, 4, 5, 1, 3, 2, 0]
    places = []
    for row, count in enumerate((4, 5, 4)):
        for k in range(count):
            places.append((150 + (k - (count - 1) / 2) * SIZE * 1.76, 100 + row * SIZE * 1.52))
    shore = [(x, y) for x, y in ring(150, 139, 124, 34, 0.56)]
    for grow, shade in ((1.08, mix(SEA, FOAM, 0.4)), (1.0, SAND)):
        page.polygon(spline([(150 + (x - 150) * grow * (0.95 + 0.09 * noise.lattice(i, 3, 5)),
                              139 + (y - 139) * grow * (0.95 + 0.09 * noise.lattice(i, 4, 5)))
                             for i, (x, y) in enumerate(shore)], 4, True), shade)
    for (x, y), kind in zip(places, order):
        ground, art = kinds[kind]
        tile(page, dice, x, y, jitter(dice, ground, 14), art)
    for k, (x, y) in enumerate(places):
        if k % 3 == 1:
            page.dot(x + 13, y + 12, 7.6, INK)
            page.dot(x + 13, y + 12, 6.6, PAPER)
            glyphs.centred(page, "3859624"[k // 3 % 7], x + 13, y + 8.3, 7.4, RED, 1.5)


def ship(page, x, y, size, way, sail):
    hull = [(-1.3, 0), (1.4, -0.1), (1.0, 0.7), (-0.9, 0.7)]
    flip = [(u * way, v) for u, v in hull]
    page.polygon(placed(flip, x, y, size), (92, 56, 38))
    page.stroke(placed([(-1.1 * way, 0.3), (1.1 * way, 0.3)], x, y, size), 1.2, SAND)
    for u, tall in ((-0.5, 1.7), (0.45, 2.1)):
        page.stroke(placed([(u * way, 0), (u * way, -tall)], x, y, size), 1.3, INK)
        cloth = [(u * way - 0.5, -tall * 0.92), (u * way + 0.5, -tall * 0.92),
                 (u * way + 0.72, -0.3), (u * way - 0.3, -0.3)]
        page.polygon(placed(cloth, x, y, size), sail)
        page.stroke(placed([(u * way, -tall * 0.8), (u * way + 0.2, -0.5)], x, y, size), 1.8, RED)
        page.polygon(placed([(u * way, -tall), (u * way + 0.6 * way, -tall - 0.2),
                             (u * way, -tall - 0.4)], x, y, size), RED)


def die(page, x, y, size, turn, pips):
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    page.polygon(placed(corners, x + 2, y + 3, size, turn), INK, 0.5)
    page.polygon(placed(corners, x, y, size, turn), PAPER)
    page.stroke(placed(corners, x, y, size, turn), 1.4, INK, closed=True)
    for u, v in pips:
        page.dot(*placed([(u * 0.55, v * 0.55)], x, y, size, turn)[0], size * 0.19, RED)


def compass(page, x, y, size):
    page.dot(x, y, size * 1.04, INK, alpha=0.5)
    for k in range(8):
        turn = math.pi * k / 4 + 0.2
        far = size if k % 2 == 0 else size * 0.6
        page.polygon(placed([(0, -0.24), (1, 0), (0, 0)], x, y, far, turn), PAPER)
        page.polygon(placed([(0, 0.24), (1, 0), (0, 0)], x, y, far, turn), RED if k == 6 else INK)


def banner(page):
    page.polygon([(6, 12), (34, 8), (34, 46), (4, 50), (14, 31)], mix(RED, INK, 0.45))
    page.polygon([(294, 14), (266, 8), (266, 46), (297, 52), (286, 33)], mix(RED, INK, 0.45))
    page.polygon(spline([(24, 6), (90, 4), (150, 3), (210, 4), (276, 6)], 5)
                 + spline([(276, 54), (210, 50), (150, 49), (90, 50), (24, 54)], 5), RED)
    page.stroke(spline([(28, 10), (90, 8), (150, 7), (210, 8), (272, 10)], 5), 1.4, SAND)
    page.stroke(spline([(28, 49.5), (90, 46), (150, 45), (210, 46), (272, 49.5)], 5), 1.4, SAND)
    text, size = "TIDEHOLM", 25
    x = 151 - glyphs.width_of(text, size, 0.3) / 2
    glyphs.write(page, text, x + 1.6, 16.5, size, INK, 6, 0.3)
    glyphs.write(page, text, x, 14.5, size, PAPER, 4.6, 0.3)
    for u in (38, 263):
        page.polygon(star(u, 28, 8, 3.4, 5), SAND)
    page.polygon([(54, 216), (246, 216), (252, 227), (246, 238), (54, 238), (48, 227)], INK)
    glyphs.centred(page, "2-5 PLAYERS. 60 MIN", 150, 221.5, 11, SAND, 1.9)


def draw():
    """The finished picture."""
    dice = random.Random(300245)
    page = Canvas(WIDTH, HEIGHT, SEA, 4)
    sea(page, dice)
    island(page, dice)
    for x, y, size, way in ((30, 86, 10, 1), (268, 96, 9, -1), (26, 186, 9, 1), (255, 196, 8, -1)):
        ship(page, x, y, size, way, jitter(dice, PAPER, 10))
    compass(page, 272, 142, 19)
    die(page, 24, 138, 10, 0.3, ((-1, -1), (1, 1), (0, 0), (1, -1), (-1, 1)))
    die(page, 22, 216, 9, -0.4, ((-1, -1), (1, 1), (0, 0)))
    die(page, 276, 220, 10, 0.2, ((-1, -1), (1, 1), (-1, 1), (1, -1)))
    banner(page)
    for _ in range(7):
        gull = [(-1, -0.4), (-0.5, -0.7), (0, 0), (0.5, -0.7), (1, -0.4)]
        page.stroke(placed(spline(gull, 4), dice.uniform(10, 290), pick(dice, (64, 70, 76)), 6), 1.6,
                    PAPER)
    return finish(page.picture(), lambda x, y: (0.95 + 0.1 * noise.value(x / 2.3, y / 2.3, 3), 1))
