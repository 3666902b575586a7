"""The cover of a book of poems: a tower on a cliff and a hawk, as a woodcut (250 x 294)."""
import math
import random

from kit import glyphs, noise
from kit.canvas import Canvas, finish, mix, placed, ring, spline

WIDTH, HEIGHT = 250, 294
INK, PAPER = (26, 26, 30), (240, 226, 196)
RUST, SLATE, MOSS, STONE = (190, 78, 44), (72, 104, 118), (104, 112, 66), (206, 182, 142)
CLIFF = [(0, 206), (30, 192), (62, 198), (96, 184), (142, 186), (166, 204), (172, 226), (186, 240),
         (188, 262), (202, 294), (0, 294)]


def sky(page, dice):
    page.box(0, 0, WIDTH, HEIGHT, lambda y: mix((232, 190, 120), PAPER, min(y / 190, 1)))
    page.dot(190, 104, 34, RUST)
    for k in range(36):
        turn = 2 * math.pi * k / 36
        near, far = 39 + 3 * (k % 2), 50 + dice.uniform(0, 34)
        page.polygon([(190 + near * math.cos(turn - 0.05), 104 + near * math.sin(turn - 0.05)),
                      (190 + far * math.cos(turn), 104 + far * math.sin(turn)),
                      (190 + near * math.cos(turn + 0.05), 104 + near * math.sin(turn + 0.05))], RUST)
    for y in range(58, 178, 4):
        x = dice.uniform(-20, 20)
        while x < WIDTH:
            run = dice.uniform(7, 44)
            if math.hypot(x + run / 2 - 190, y - 104) > 40 + run / 2:
                w = 1.6 * (0.5 + noise.value(x / 30, y / 14, 3))
                page.polygon([(x, y), (x + run * 0.5, y - w), (x + run, y), (x + run * 0.5, y + w)],
                             SLATE if dice.random() < 0.75 else INK)
            x += run + dice.uniform(3, 30)


def cloud(page, dice, x, y, size):
    puffs = [(-1.2, 0.1, 0.5), (-0.6, -0.25, 0.62), (0.1, -0.4, 0.75), (0.8, -0.1, 0.55), (1.3, 0.15, 0.35)]
    for grow, shade in ((1.12, INK), (1.0, PAPER)):
        for u, v, r in puffs:
            page.dot(x + u * size, y + v * size, r * size * grow, shade, 0.75)
    for u, v, r in puffs:
        for _ in range(4):
            turn = dice.uniform(0.3, 2.6)
            page.stroke([(x + (u + r * t * math.cos(turn + t)) * size,
                          y + (v + 0.7 * r * t * math.sin(turn)) * size) for t in (0.3, 0.6, 0.85)],
                        1.4, SLATE, 0.6)


def sea(page, dice):
    page.box(0, 178, WIDTH, HEIGHT, SLATE)
    page.box(0, 177, WIDTH, 179, INK)
    for y in range(182, 294, 5):
        x = dice.uniform(-14, 0) + 120
        reach = 3 + (y - 180) / 16
        while x < WIDTH + 10:
            run = dice.uniform(7, 12) + reach * 1.6
            wave = spline([(x, y), (x + run * 0.3, y - reach * 0.6), (x + run * 0.55, y),
                           (x + run, y - reach * 0.2)], 4)
            page.stroke(wave, 1.0 + reach * 0.2, PAPER if dice.random() < 0.55 else INK, 0.7)
            x += run + dice.uniform(1, 9)
    for _ in range(90):
        u = dice.random()
        x, y = 168 + 36 * u + dice.gauss(4, 7), 212 + 78 * u + dice.gauss(0, 5)
        page.dot(x, y, dice.uniform(0.8, 2.8), PAPER)


def cliff(page, dice):
    page.polygon(CLIFF, INK)
    page.clip(CLIFF)
    for _ in range(190):
        x, y = dice.uniform(0, 205), dice.uniform(190, 294)
        r = dice.uniform(4, 12)
        rock = [(r * (0.6 + 0.5 * dice.random()) * math.cos(a), r * (0.4 + 0.4 * dice.random())
                 * math.sin(a)) for a in (0.2, 1.1, 2.3, 3.2, 4.2, 5.4)]
        shade = mix(STONE, (MOSS, RUST, SLATE)[int(dice.random() * 3)], dice.uniform(0.1, 0.8))
        page.polygon(placed(rock, x + 0.7, y + 1.2, 1.22), INK)
        page.polygon(placed(rock, x, y), shade)
        for k in range(3):
            page.stroke([(x + k * 2 - r * 0.3, y), (x + k * 2 + r * 0.1, y + r * 0.4)], 1, INK)
    page.clip()
    for _ in range(130):
        x = dice.uniform(0, 168)
        base = 199 - 14 * math.exp(-((x - 120) / 40) ** 2) + dice.uniform(0, 9)
        page.stroke([(x, base), (x + dice.uniform(-4, 6), base - dice.uniform(5, 13))], 1.5,
                    (MOSS, INK, RUST)[int(dice.random() * 2.4)], 0.5)


def tower(page, dice):
    page.polygon([(58, 196), (64, 66), (128, 66), (136, 196)], INK)
    y, row = 68.0, 0
    while y < 192:
        tall = dice.uniform(7, 11.5)
        left, right = 60.5 + (192 - y) * 0.044, 133 - (192 - y) * 0.05
        x = left - (0, 5)[row % 2]
        while x < right:
            run = dice.uniform(8, 17)
            a, b = max(x, left) + 0.7, min(x + run, right) - 0.7
            if b - a > 2:
                light = 1 - 0.55 * max((b - 92) / 48, 0)
                shade = mix(INK, mix(STONE, (PAPER, RUST, SLATE)[int(dice.random() * 3)],
                                     dice.uniform(0, 0.55)), light)
                page.polygon([(a, y + dice.uniform(0, 2)), (b, y + dice.uniform(0, 2)),
                              (b, y + tall - dice.uniform(0.6, 2)), (a, y + tall - dice.uniform(0.6, 2))],
                             shade)
                for k in range(int(dice.uniform(0, 4))):
                    u = a + (b - a) * (0.3 + 0.2 * k)
                    page.stroke([(u, y + 3), (u - 2, y + tall - 3)], 0.9, INK)
            x += run
        y += tall
        row += 1
    for k in range(5):
        x = 58 + k * 16.2
        page.box(x - 1.4, 52, x + 10.4, 72, INK)
        page.box(x, 53.6, x + 8.6, 69, mix(STONE, INK, 0.1 * k))
        page.stroke([(x + 2, 60), (x + 7, 58)], 1, INK)
    for x, y, w, h in ((92, 92, 11, 20), (78, 132, 9, 17), (112, 138, 9, 17), (94, 170, 15, 26)):
        arch = [(x - w / 2, y + h), (x - w / 2, y)] + [
            (x - w / 2 * math.cos(math.pi * k / 8), y - w / 2 * math.sin(math.pi * k / 8))
            for k in range(9)] + [(x + w / 2, y + h)]
        page.polygon(placed([(u - x, v - y) for u, v in arch], x, y, 1.28), PAPER)
        page.polygon(arch, INK)
    page.polygon([(88.5, 96), (95, 93), (95, 110), (88.5, 110)], (250, 200, 90))


def hawk(page, dice):
    x, y = 152, 70
    for side, reach in ((-1, 62), (1, 72)):
        for k in range(11):
            t = k / 10
            root = (x + side * (6 + 34 * t), y - 6 - 15 * t + 10 * t * t)
            tip = (root[0] + side * (2 + reach * 0.42 * t * t), root[1] + 30 - 22 * t + 6 * (k % 2))
            page.stroke([root, tip], 9.6, PAPER, 3.4)
            page.stroke([root, tip], 7.4, mix(INK, RUST, 0.25 * (k % 3)), 1.8)
            for i in (0.45, 0.65, 0.82):
                u, v = root[0] + (tip[0] - root[0]) * i, root[1] + (tip[1] - root[1]) * i
                page.stroke([(u - 2.2, v - 0.7), (u + 2.2, v + 0.7)], 1.1, PAPER)
        bone = spline([(x + side * 4, y - 4), (x + side * 24, y - 20), (x + side * 48, y - 12)], 6)
        page.stroke(bone, 8.5, INK, 4)
        for k in range(2, len(bone), 2):
            page.dot(bone[k][0], bone[k][1] + 1, 1.4, STONE)
    for k in range(-3, 4):
        page.stroke([(x, y + 14), (x + k * 4.6, y + 36 - abs(k))], 6.4, PAPER, 4)
        page.stroke([(x, y + 14), (x + k * 4.6, y + 35 - abs(k))], 4.6, mix(INK, RUST, 0.2 * (k % 3)), 3)
    page.polygon(ring(x, y + 3, 9, 24, 1.9), INK)
    page.dot(x + 1, y - 15, 6.4, INK)
    page.polygon([(x + 5, y - 18), (x + 12, y - 14), (x + 5, y - 12)], (250, 196, 80))
    page.dot(x + 3, y - 16.4, 1.5, PAPER)
    for _ in range(22):
        u, v = dice.gauss(0, 3.4), dice.uniform(-9, 14)
        page.stroke([(x + u, y + v), (x + u + 1, y + v + 2.6)], 1.1, STONE)


def titles(page):
    page.stroke([(5, 5), (245, 5), (245, 289), (5, 289)], 4, INK, closed=True)
    glyphs.centred(page, "STONE & HAWK", 125, 13, 20, INK, 3.6, 0.26)
    page.box(24, 262, 148, 283, PAPER)
    page.stroke([(24, 262), (148, 262), (148, 283), (24, 283)], 1.6, INK, closed=True)
    glyphs.centred(page, "COAST POEMS", 86, 267.5, 10.5, RUST, 2)


def draw():
    """The finished picture."""
    dice = random.Random(250294)
    page = Canvas(WIDTH, HEIGHT, PAPER, 4)
    sky(page, dice)
    cloud(page, dice, 38, 92, 20)
    cloud(page, dice, 206, 158, 14)
    sea(page, dice)
    cliff(page, dice)
    tower(page, dice)
    hawk(page, dice)
    titles(page)
    return finish(page.picture(), lambda x, y: (0.94 + 0.12 * noise.fbm(x / 3, y / 3, 5, 2), 0))
