"""A framed painting: a harbour town at dusk, laid down in brush strokes (336 x 252)."""
import math
import random

from kit import noise
from kit.canvas import Canvas, finish, jitter, mix, pick, placed, ring, spline

WIDTH, HEIGHT = 336, 252
EDGE = 24
INK, WALL, ROOF = (38, 36, 52), (242, 222, 186), (192, 84, 56)
GOLD, DARK, SHINE = (186, 138, 62), (92, 60, 30), (250, 222, 142)
SUN = (226, 78)


def sky_at(y):
    t = min(max((y - 24) / 100, 0), 1)
    return mix(mix((58, 92, 150), (236, 150, 128), min(t * 1.6, 1)), (252, 214, 130), max(t * 2 - 1, 0))


def backdrop(page, dice):
    page.box(0, 0, WIDTH, HEIGHT, sky_at)
    page.dot(*SUN, 40, (255, 226, 150), alpha=0.35)
    page.dot(*SUN, 15, (255, 244, 200))
    for _ in range(15):
        x, y, r = dice.uniform(10, 320), dice.uniform(30, 86), dice.uniform(14, 44)
        page.dot(x, y, r, (244, 190, 160), 0.2, 0.8)
        page.dot(x + 4, y + 2.4, r * 0.8, (128, 106, 148), 0.14, 0.8)
    for base, lift, shade in ((124, 44, (120, 116, 156)), (130, 32, (92, 102, 122)),
                              (134, 24, (74, 98, 84))):
        line = [(x, base - lift * noise.fbm(x / 60, base, 11, 3)) for x in range(0, 340, 6)]
        page.polygon([(0, 150)] + line + [(336, 150)], shade)
    page.box(0, 134, WIDTH, HEIGHT, lambda y: mix((232, 178, 130), (36, 74, 110),
                                                   min((y - 134) / 70, 1)))
    for k in range(46):
        y = 136 + k * 2.2
        x = SUN[0] + dice.gauss(0, 3 + k * 0.35)
        page.dot(x, y, dice.uniform(3, 11), (255, 226, 140), 0.2)


def house(page, dice, x, y, wide, tall):
    wall = jitter(dice, pick(dice, (WALL, (222, 164, 112), (204, 130, 104), (168, 184, 190),
                                    (236, 206, 130))), 20)
    page.box(x, y - tall, x + wide, y, wall)
    page.box(x + wide * 0.68, y - tall, x + wide, y, mix(wall, INK, 0.35))
    roof = jitter(dice, ROOF, 26)
    page.polygon([(x - 2, y - tall + 1), (x + wide * 0.3, y - tall - wide * 0.42),
                  (x + wide * 0.75, y - tall - wide * 0.42), (x + wide + 2, y - tall + 1)], roof)
    for k in range(3):
        page.stroke([(x + wide * (0.2 + 0.2 * k), y - tall - 1),
                     (x + wide * (0.36 + 0.12 * k), y - tall - wide * 0.38)], 1, mix(roof, INK, 0.5))
    v = y - tall + 4
    while v < y - 6:
        u = x + 2.6
        while u < x + wide - 4:
            lit = dice.random() < 0.4
            page.box(u, v, u + 3, v + 4.4, (255, 220, 110) if lit else INK)
            u += dice.uniform(5.4, 7.4)
        v += dice.uniform(8, 10)
    if dice.random() < 0.5:
        page.box(x + wide * 0.55, y - tall - wide * 0.6, x + wide * 0.72, y - tall - 2, mix(wall, INK, 0.3))


def town(page, dice):
    for base, count, low, high in ((124, 12, 18, 34), (138, 11, 22, 42), (151, 9, 20, 36)):
        x = 14 + dice.uniform(0, 6)
        for _ in range(count):
            wide = dice.uniform(12, 21)
            house(page, dice, x, base + (x - 20) * -0.04, wide, dice.uniform(low, high))
            x += wide + dice.uniform(-2, 2)
    page.box(92, 52, 107, 126, (226, 196, 158))
    page.box(102, 52, 107, 126, (150, 112, 108))
    page.polygon([(89, 53), (99.5, 22), (110, 53)], (108, 70, 84))
    for y in (60, 78, 96):
        page.box(96.5, y, 102.5, y + 10, INK)
    page.polygon([(8, 151), (176, 146), (196, 154), (182, 160), (8, 166)], (150, 116, 96))
    for k in range(26):
        page.stroke([(10 + k * 7, 153), (9 + k * 7, 163)], 1.1, (92, 70, 70))


def boat(page, dice, x, y, size, sail):
    hull = jitter(dice, pick(dice, ((168, 52, 44), (38, 78, 112), (60, 96, 76), (230, 214, 180))), 16)
    page.polygon(placed([(-1.5, -0.3), (1.7, -0.5), (1.2, 0.5), (-1.1, 0.5)], x, y, size), hull)
    page.stroke(placed([(-1.4, -0.25), (1.6, -0.42)], x, y, size), 1.7, (250, 232, 190))
    page.polygon(placed([(-1.0, 0.6), (1.1, 0.6), (0.6, 2.2), (-0.8, 2.0)], x, y, size), INK, 0.35)
    tall = dice.uniform(2.6, 3.8)
    page.stroke(placed([(0.1, -0.3), (0.15, -tall)], x, y, size), 1.7, INK)
    page.stroke(placed([(0.15, -tall), (1.6, -0.5)], x, y, size), 0.9, INK)
    if sail:
        cloth = jitter(dice, pick(dice, ((248, 232, 200), (214, 108, 62), (236, 190, 96))), 16)
        page.polygon(placed([(0.2, -tall), (1.4, -0.6), (0.2, -0.6)], x, y, size), cloth)
        page.polygon(placed([(0.0, -tall * 0.9), (-1.2, -0.6), (0.0, -0.6)], x, y, size),
                     mix(cloth, INK, 0.2))
    else:
        page.box(x - size * 0.8, y - size * 0.9, x - size * 0.1, y - size * 0.2, WALL)
        page.box(x - size * 0.65, y - size * 0.7, x - size * 0.3, y - size * 0.45, INK)


def fleet(page, dice):
    spots = [(212, 150, 6, 1), (256, 146, 5, 1), (286, 158, 8, 1), (240, 170, 9, 0),
             (60, 182, 11, 0), (118, 176, 10, 1), (176, 192, 12, 1), (276, 198, 14, 1),
             (92, 210, 13, 0), (204, 222, 11, 0)]
    for x, y, size, sail in spots:
        boat(page, dice, x, y, size, sail)


def brushwork(scene, page, dice):
    """Lays strokes that take their colour from `scene`: broad ones first, then fine."""
    for count, long, wide, loose in ((2600, 13, 5.4, 16), (5200, 7.5, 2.9, 16), (7000, 4.6, 1.7, 12)):
        for _ in range(count):
            x, y = dice.uniform(10, WIDTH - 10), dice.uniform(10, HEIGHT - 10)
            here = scene.at(x, y)
            edge = sum(abs(a - b) for a, b in zip(here, scene.at(x + 3, y)))
            rise = sum(abs(a - b) for a, b in zip(here, scene.at(x, y + 3)))
            if wide < 5 and edge + rise < (34 if wide > 2 else 60) and dice.random() < 0.72:
                continue
            swirl = (noise.fbm(x / 46, y / 46, 23, 2) - 0.5) * 3.0 if y < 130 else 0.0
            turn = math.pi / 2 if edge > rise * 1.2 else swirl
            turn += dice.uniform(-0.25, 0.25)
            u, v = math.cos(turn) * long / 2, math.sin(turn) * long / 2
            bend = dice.uniform(-1.2, 1.2)
            page.stroke([(x - u, y - v), (x - v * 0.2 * bend, y + u * 0.2 * bend), (x + u, y + v)],
                        wide, jitter(dice, here, loose), wide * 0.5)


def frame(page, dice):
    w, h, e = WIDTH, HEIGHT, EDGE
    sides = [((0, 0), (w, 0), (w - e, e), (e, e), 1.12), ((0, 0), (e, e), (e, h - e), (0, h), 0.9),
             ((w, 0), (w, h), (w - e, h - e), (w - e, e), 0.72),
             ((0, h), (e, h - e), (w - e, h - e), (w, h), 0.62)]
    for a, b, c, d, light in sides:
        page.polygon([a, b, c, d], tuple(min(int(v * light), 255) for v in GOLD))
    for inset, width, shade in ((3, 2.4, DARK), (5.5, 1.4, SHINE), (EDGE - 5, 2.6, DARK),
                                (EDGE - 2.4, 1.8, SHINE), (EDGE - 0.4, 1.6, INK)):
        page.stroke([(inset, inset), (w - inset, inset), (w - inset, h - inset), (inset, h - inset)],
                    width, shade, closed=True)
    rail = [(x, 12) for x in range(24, w - 20, 15)] + [(x, h - 12) for x in range(24, w - 20, 15)]
    rail += [(12, y) for y in range(26, h - 20, 15)] + [(w - 12, y) for y in range(26, h - 20, 15)]
    for x, y in rail:
        turn = (0 if y in (12, h - 12) else math.pi / 2) + dice.uniform(-0.4, 0.4)
        size = dice.uniform(5, 7.4)
        for side in (-1, 1):
            curl = [(-1, side * 0.1), (-0.3, side * 0.75), (0.5, side * 0.5), (0.3, 0), (0, side * 0.2)]
            page.stroke(placed(spline(curl, 5), x + 0.8, y + 1, size, turn), 2.8, DARK, 1)
            page.stroke(placed(spline(curl, 5), x, y, size, turn), 1.9, SHINE, 0.8)
        page.dot(x, y, 1.8, jitter(dice, SHINE, 20))
    for x, y in ((14, 14), (w - 14, 14), (14, h - 14), (w - 14, h - 14)):
        page.dot(x + 1, y + 1.4, 11, DARK)
        for k in range(8):
            page.dot(x + 7 * math.cos(k * 0.785), y + 7 * math.sin(k * 0.785), 3.4, DARK)
            page.dot(x + 6.6 * math.cos(k * 0.785), y + 6.6 * math.sin(k * 0.785), 2.6,
                     jitter(dice, SHINE, 24))
        page.polygon(ring(x, y, 4, 12), GOLD)


def draw():
    """The finished picture."""
    dice = random.Random(336252)
    scene = Canvas(WIDTH, HEIGHT, INK, 2)
    backdrop(scene, dice)
    town(scene, dice)
    fleet(scene, dice)
    reference = scene.picture()
    page = Canvas(WIDTH, HEIGHT, INK, 3)
    page.lay(reference)
    brushwork(reference, page, dice)
    fine = random.Random(7)
    for x, y, size in ((262, 60, 5), (276, 52, 4), (168, 46, 5), (182, 56, 4), (150, 62, 4)):
        gull = [(-1, -0.5), (-0.5, -0.6), (0, 0), (0.5, -0.7), (1, -0.5)]
        page.stroke(placed(spline(gull, 4), x, y, size), 1.5, WALL)
    frame(page, fine)
    return finish(page.picture(), lambda x, y: (0.95 + 0.1 * noise.value(x / 2.0, y / 1.4, 31), 0))
