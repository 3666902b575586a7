"""A book cover: a garden by night, an owl before the moon (348 x 717)."""
import math
import random

from kit import glyphs, noise
from kit.canvas import Canvas, finish, jitter, mix, pick, placed, ring, spline, star

WIDTH, HEIGHT = 348, 717
INK, NIGHT, DUSK = (14, 22, 38), (17, 38, 66), (38, 92, 104)
GOLD, CREAM, CORAL, ROSE = (226, 178, 84), (246, 232, 198), (226, 98, 72), (206, 132, 150)
LEAVES = [(74, 128, 84), (110, 154, 82), (52, 104, 96), (146, 168, 96), (88, 140, 122)]


def sky(page, dice):
    page.box(0, 0, WIDTH, HEIGHT, lambda y: mix(NIGHT, DUSK, min(y / 560, 1)))
    for _ in range(150):
        x, y, size = dice.uniform(20, 328), dice.uniform(20, 470), dice.uniform(1.0, 5.4)
        shade = jitter(dice, pick(dice, (CREAM, GOLD, (160, 196, 204))), 24)
        if size < 2.6:
            page.dot(x, y, size * 0.6, shade)
        else:
            page.polygon(star(x, y, size * 1.5, size * 0.5, 4 + int(dice.random() * 3),
                              dice.random()), shade)


def moon(page, dice):
    x, y = 182, 232
    for k in range(4):
        page.dot(x, y, 118 + 13 * k, CREAM, alpha=0.075)
    for k in range(64):
        far = 124 + 7 * (k % 3) + dice.uniform(0, 5)
        turn = 2 * math.pi * k / 64
        page.polygon(placed([(-4, 0), (0, -1.7), (7 + 5 * dice.random(), 0), (0, 1.7)],
                            x + far * math.cos(turn), y + far * math.sin(turn), 1, turn), GOLD)
    page.dot(x, y, 108, CREAM)
    page.clip(ring(x, y, 108, 80))
    for _ in range(46):
        u, v, r = dice.uniform(-100, 100), dice.uniform(-100, 100), dice.uniform(3, 17)
        page.dot(x + u, y + v, r, (214, 198, 160), alpha=0.55)
        page.dot(x + u + r * 0.22, y + v + r * 0.22, r * 0.76, (236, 222, 188), alpha=0.8)
    page.clip()


def owl(page, dice, x, y):
    body, dark, light = (112, 78, 54), (58, 40, 36), (222, 190, 140)
    page.polygon(spline([(x - 27, y - 66), (x - 46, y - 20), (x - 40, y + 36), (x, y + 62),
                         (x + 40, y + 36), (x + 46, y - 20), (x + 27, y - 66), (x, y - 72)],
                        8, True), body)
    for row in range(9):
        for k in range(7):
            u, v = x + (k - 3) * 9.4 + (row % 2) * 4.5, y - 22 + row * 8.2
            if abs(u - x) < 30 - abs(row - 3) * 2:
                page.polygon(placed([(-4.6, -4), (0, 6.5), (4.6, -4)], u, v, 1,
                                    dice.uniform(-0.3, 0.3)),
                             jitter(dice, pick(dice, (light, body, (170, 124, 80))), 22))
                page.stroke([(u, v - 3), (u, v + 4)], 0.9, dark)
    for side in (-1, 1):
        for k in range(8):
            root = (x + side * (34 + k % 2), y - 26 + k * 5)
            tip = (x + side * (46 - k * 3.6), y + 22 + k * 6.6)
            page.stroke([root, tip], 8, jitter(dice, dark, 16), 2.4)
            page.stroke([root, tip], 1.1, light)
        page.polygon([(x + side * 12, y - 66), (x + side * 33, y - 92), (x + side * 31, y - 54)],
                     dark)
        eye = x + side * 16
        for k in range(26):
            turn = 2 * math.pi * k / 26
            page.stroke([(eye + 11 * math.cos(turn), y - 46 + 11 * math.sin(turn)),
                         (eye + 18 * math.cos(turn), y - 46 + 18 * math.sin(turn))], 1.7,
                        light if k % 2 else dark)
        page.dot(eye, y - 46, 11.5, GOLD)
        page.dot(eye, y - 46, 6.6, INK)
        page.dot(eye - 2.5, y - 49, 2.2, CREAM)
    page.polygon([(x - 5, y - 40), (x + 5, y - 40), (x, y - 26)], (236, 150, 60))


def branch(page, dice):
    bark = (44, 32, 34)
    line = spline([(0, 322), (64, 300), (130, 304), (214, 290), (290, 300), (348, 276)], 10)
    page.stroke(line, 13, bark, 7)
    for k in range(0, len(line) - 1, 2):
        x, y = line[k]
        page.stroke([(x - 5, y - 2), (x + 7, y + dice.uniform(-3, 3))], 1.2, (120, 90, 70))
    for k in range(3, len(line) - 2, 4):
        x, y = line[k]
        if 116 < x < 236:
            continue
        for _ in range(4):
            leaf(page, dice, x, y, dice.uniform(14, 30), dice.uniform(0, 6.28),
                 pick(dice, LEAVES))
    for side in (-1, 1):
        for k in (-5, 0, 5):
            page.stroke([(176 + side * 14 + k, 286), (176 + side * 14 + k, 304)], 3.6,
                        (236, 150, 60), 2)


def leaf(page, dice, x, y, size, turn, colour):
    wide = dice.uniform(0.16, 0.3)
    shape = [(0, 0), (0.3, -wide), (0.65, -wide * 0.8), (1, 0), (0.65, wide * 0.8), (0.3, wide)]
    shade = jitter(dice, colour, 26)
    page.polygon(placed(spline(shape, 5, True), x, y, size, turn), shade)
    page.polygon(placed(spline(shape[:4], 5), x, y, size, turn), mix(shade, INK, 0.3))
    vein = mix(shade, CREAM, 0.55)
    page.stroke(placed([(0, 0), (0.92, 0)], x, y, size, turn), 1.1, vein)
    for k in range(1, 5):
        for side in (-1, 1):
            page.stroke(placed([(0.16 * k, 0), (0.16 * k + 0.13, side * wide * 0.66)],
                               x, y, size, turn), 0.8, vein)


def flower(page, dice, x, y, size):
    colour = jitter(dice, pick(dice, (CORAL, ROSE, CREAM, GOLD, (238, 142, 84), (150, 130, 196))), 18)
    petals, turn = 5 + int(dice.random() * 8), dice.random() * 3
    for ring_size, shade in ((1.0, mix(colour, INK, 0.22)), (0.82, colour)):
        for k in range(petals):
            angle = turn + 2 * math.pi * (k + (ring_size < 1) * 0.5) / petals
            wide = 2.0 / petals
            shape = [(0.1, 0), (0.5, -wide * 0.8), (0.94, -wide * 0.5), (1.02, 0),
                     (0.94, wide * 0.5), (0.5, wide * 0.8)]
            page.polygon(placed(spline(shape, 4, True), x, y, size * ring_size, angle), shade)
            page.stroke(placed([(0.25, 0), (0.8, 0)], x, y, size * ring_size, angle), 0.9,
                        mix(shade, INK, 0.45))
    page.dot(x, y, size * 0.3, mix(INK, colour, 0.2))
    for k in range(9):
        far = size * (0.08 + 0.16 * (k % 2))
        page.dot(x + far * math.cos(k * 2.4), y + far * math.sin(k * 2.4), 1.3, GOLD)


def garden(page, dice):
    for x in range(-6, 356, 11):
        page.stroke(spline([(x, 640), (x + dice.uniform(-8, 8), 590),
                            (x + dice.uniform(-22, 22), dice.uniform(500, 560))], 6), 4,
                    jitter(dice, (30, 66, 70), 14), 1)
    stems = []
    for k in range(17):
        x = 22 + k * 19.2 + dice.uniform(-6, 6)
        tall = dice.uniform(70, 215) * (0.82 if 5 < k < 11 else 1)
        top = (x + dice.uniform(-26, 26), 634 - tall)
        stems.append((tall, x, top))
    for tall, x, top in sorted(stems, reverse=True):
        line = spline([(x, 646), (x + dice.uniform(-14, 14), 646 - tall * 0.5), top], 10)
        page.stroke(line, 3.4, (70, 112, 74), 2)
        colour = pick(dice, LEAVES)
        for i in range(2, len(line) - 4, 2):
            for side in (-1, 1):
                leaf(page, dice, line[i][0], line[i][1], dice.uniform(16, 34),
                     -math.pi / 2 + side * dice.uniform(0.5, 1.25), colour)
        flower(page, dice, top[0], top[1], dice.uniform(13, 24))


def moth(page, dice, x, y, size, turn):
    shade = jitter(dice, pick(dice, (CREAM, GOLD, (170, 200, 190))), 20)
    for side in (-1, 1):
        wing = [(0, 0), (side * 0.9, -0.9), (side * 1.1, -0.2), (side * 0.5, 0.2),
                (side * 0.7, 0.8), (side * 0.2, 0.6)]
        page.polygon(placed(wing, x, y, size, turn), shade)
        page.dot(*placed([(side * 0.65, -0.4)], x, y, size, turn)[0], size * 0.2, CORAL)
        page.dot(*placed([(side * 0.65, -0.4)], x, y, size, turn)[0], size * 0.09, INK)
    page.stroke(placed([(0, -0.5), (0, 0.7)], x, y, size, turn), size * 0.2, INK)


def frame(page, dice):
    for inset, width, shade in ((3, 9, INK), (7, 2.2, GOLD), (15, 1.4, GOLD)):
        page.stroke([(inset, inset), (WIDTH - inset, inset), (WIDTH - inset, HEIGHT - inset),
                     (inset, HEIGHT - inset)], width, shade, closed=True)
    for x, y in ((15, 15), (WIDTH - 15, 15), (15, HEIGHT - 15), (WIDTH - 15, HEIGHT - 15)):
        for k in range(5):
            turn = math.atan2(HEIGHT / 2 - y, WIDTH / 2 - x) + (k - 2) * 0.42
            leaf(page, dice, x, y, 22 + 8 * (k == 2), turn, GOLD)
        page.dot(x, y, 6, CORAL)


def titles(page, dice):
    page.polygon([(24, 40), (324, 34), (318, 62), (326, 92), (22, 96), (30, 68)], CORAL)
    page.polygon([(30, 45), (318, 39), (312, 62), (319, 87), (29, 91), (36, 68)], mix(CORAL, INK, .18))
    glyphs.centred(page, "NIGHT GARDEN", 174, 52, 25, CREAM, 4.2, 0.22)
    page.polygon([(14, 642), (334, 642), (334, 703), (14, 703)], INK)
    for _ in range(60):
        page.polygon(star(dice.uniform(20, 328), dice.uniform(646, 700), dice.uniform(1.5, 4), 1,
                          4, dice.random()), mix(INK, GOLD, dice.uniform(0.2, 0.6)))
    glyphs.centred(page, "A BOOK OF OWLS", 174, 653, 17, GOLD, 2.8)
    glyphs.centred(page, "MOTHS & LATE FLOWERS", 174, 681, 11.5, CREAM, 1.9)


def draw():
    """The finished picture."""
    dice = random.Random(348717)
    page = Canvas(WIDTH, HEIGHT, NIGHT)
    sky(page, dice)
    moon(page, dice)
    branch(page, dice)
    owl(page, dice, 176, 240)
    for _ in range(9):
        moth(page, dice, dice.uniform(30, 318), dice.uniform(350, 470), dice.uniform(8, 15),
             dice.uniform(-0.8, 0.8))
    garden(page, dice)
    frame(page, dice)
    titles(page, dice)
    return finish(page.picture(), lambda x, y: (
        0.96 + 0.08 * noise.value(x / 2.1, y / 2.1, 7), 2))
