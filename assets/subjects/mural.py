"""A wall painting out of doors: letters, a fish and a crown on old brick (400 x 347)."""
import math
import random

from kit import glyphs, noise
from kit.canvas import Canvas, finish, jitter, mix, pick, placed, ring, spline, star

WIDTH, HEIGHT = 400, 347
MORTAR, INK, WHITE = (176, 164, 150), (22, 20, 30), (250, 248, 240)
BRICKS = [(164, 84, 62), (148, 72, 56), (178, 100, 70), (134, 66, 58), (170, 112, 84), (118, 62, 58)]
PINK, CYAN, YELLOW, VIOLET, LIME = (240, 70, 140), (54, 196, 220), (252, 212, 60), (112, 62, 168), (150, 214, 70)


def wall(page, dice):
    page.box(0, 0, WIDTH, HEIGHT, MORTAR)
    y = -3.0
    while y < HEIGHT:
        x = -dice.uniform(0, 24)
        tall = dice.uniform(9.2, 11.2)
        while x < WIDTH:
            run = dice.uniform(20, 27) if dice.random() < 0.8 else dice.uniform(9, 14)
            shade = jitter(dice, pick(dice, BRICKS), 20)
            corners = [(x + dice.uniform(0, 1.2), y + dice.uniform(0, 1)),
                       (x + run - dice.uniform(0, 1.2), y + dice.uniform(0, 1)),
                       (x + run - dice.uniform(0, 1.4), y + tall - dice.uniform(0, 1)),
                       (x + dice.uniform(0, 1.4), y + tall - dice.uniform(0, 1))]
            page.polygon(corners, shade)
            for _ in range(4):
                page.dot(x + dice.uniform(2, run - 2), y + dice.uniform(2, tall - 2),
                         dice.uniform(0.5, 1.8), mix(shade, pick(dice, (INK, MORTAR)), 0.45))
            x += run + 1.9
        y += tall + 1.9


def splash(page, dice, x, y, size, colour):
    """A burst of paint: a blob with arms and drops around it."""
    edge = []
    for k in range(26):
        far = size * (0.72 + 0.5 * dice.random() ** 3)
        edge.append((x + far * math.cos(k * 0.2417), y + far * math.sin(k * 0.2417)))
    page.polygon(spline(edge, 4, True), colour)
    for _ in range(26):
        turn, far = dice.uniform(0, 6.28), size * dice.uniform(1.05, 1.75)
        page.dot(x + far * math.cos(turn), y + far * math.sin(turn), dice.uniform(0.8, 3.2), colour)


def drip(page, dice, x, y, colour, width=2.6):
    run = dice.uniform(10, 46)
    page.stroke([(x, y), (x + dice.uniform(-0.6, 0.6), y + run)], width, colour, width * 0.7)
    page.dot(x, y + run, width * 0.75, colour)


def cloud(page, dice):
    puffs = []
    for k in range(40):
        turn = 2 * math.pi * k / 40
        puffs.append((200 + 172 * math.cos(turn) + dice.uniform(-12, 12),
                      170 + 74 * math.sin(turn) + dice.uniform(-9, 9), dice.uniform(20, 36)))
    for grow, shade in ((4.5, INK), (0, (44, 92, 170)), (-6, (70, 134, 208)), (-14, (120, 190, 232))):
        for x, y, r in puffs:
            page.dot(x, y, r + grow, shade)
        page.polygon(ring(200, 170, 176 + grow, 40, 0.44), shade)
    for _ in range(90):
        x, y = dice.uniform(40, 360), dice.uniform(96, 246)
        page.dot(x, y, dice.uniform(1, 5), pick(dice, (WHITE, CYAN, (70, 134, 208), PINK)))


LETTERS = {
    "K": [[(0, 0), (-0.06, 1)], [(0.72, -0.05), (0.08, 0.52), (0.8, 1.05)]],
    "O": [[(0.38, 0.02), (0.02, 0.34), (0.06, 0.8), (0.42, 1.0), (0.76, 0.72), (0.72, 0.24), (0.38, 0.02)]],
    "I": [[(0.22, 0.3), (0.18, 1.02)], [(0.24, -0.03), (0.26, 0.0)]],
    "R": [[(0.02, 0.0), (0.0, 1.0)], [(0.02, 0.06), (0.6, 0.08), (0.62, 0.44), (0.08, 0.52), (0.72, 1.04)]],
    "A": [[(0.0, 1.04), (0.36, -0.04), (0.76, 1.0)], [(0.14, 0.66), (0.64, 0.62)]],
}
WORD = [("K", 44, 118, 92, -0.08), ("O", 122, 108, 96, 0.05), ("I", 202, 124, 92, -0.04),
        ("R", 246, 110, 96, 0.07), ("A", 316, 112, 98, 0.1)]


def strokes_of(letter, x, y, size, turn):
    return [spline(placed(line, x, y, size, turn), 8) for line in LETTERS[letter]]


def word(page, dice):
    fills = [(PINK, YELLOW), ((255, 120, 60), PINK), (YELLOW, LIME), (LIME, CYAN), (CYAN, VIOLET)]
    for depth in range(11, 0, -1):
        for letter, x, y, size, turn in WORD:
            for line in strokes_of(letter, x - depth * 0.9, y + depth, size, turn):
                page.stroke(line, 33, INK if depth > 9 else mix(VIOLET, INK, 0.2 + 0.05 * depth))
    for width, shade in ((35, WHITE), (31, INK)):
        for item in WORD:
            for line in strokes_of(*item):
                page.stroke(line, width, shade)
    for item, (top, low) in zip(WORD, fills):
        x, y, size = item[1:4]
        for line in strokes_of(*item):
            page.stroke(line, 23, lambda v, a=top, b=low, y=y, s=size: mix(
                a, b, min(max((v - y + 8) / s, 0), 1)))
        for line in strokes_of(*item):
            page.stroke([(u - 5, v - 6) for u, v in line[: max(len(line) // 2, 3)]], 3.2, WHITE, 1)
        for _ in range(15):
            line = pick(dice, strokes_of(*item))
            u, v = line[int(dice.random() * len(line))]
            u, v = u + dice.uniform(-8, 8), v + dice.uniform(-8, 8)
            page.dot(u, v, dice.uniform(1.4, 4.4), mix(low, pick(dice, (WHITE, INK, top)), 0.75))
        u = x + size * 0.36
        page.stroke([(u - 16, y + size * 0.62), (u - 4, y + size * 0.5), (u + 3, y + size * 0.68)],
                    1.9, INK)


def crown(page, x, y, size):
    shape = [(-1, 0.5), (-1.15, -0.5), (-0.5, 0), (0, -0.85), (0.5, 0), (1.15, -0.5), (1, 0.5)]
    page.stroke(placed(shape, x, y, size), 9, INK, closed=True)
    page.polygon(placed(shape, x, y, size), YELLOW)
    page.stroke(placed([(-0.94, 0.22), (0.94, 0.22)], x, y, size), 2, INK)
    for u, v in ((-1.15, -0.5), (0, -0.85), (1.15, -0.5)):
        page.dot(*placed([(u, v)], x, y, size)[0], 5, INK)
        page.dot(*placed([(u, v)], x, y, size)[0], 3.2, PINK)
    page.stroke(placed([(-0.8, 0.0), (-0.7, -0.12)], x, y, size), 2.4, WHITE)


def fish(page, dice, x, y, size):
    body = spline([(-1.5, 0), (-0.7, -0.62), (0.3, -0.66), (1.2, -0.1), (1.25, 0.12), (0.3, 0.66),
                   (-0.7, 0.52)], 8, True)
    tail = [(-1.3, 0), (-2.1, -0.7), (-1.85, 0), (-2.1, 0.66)]
    fin = spline([(-0.5, -0.5), (-0.2, -1.05), (0.5, -0.98), (0.4, -0.55)], 6)
    for grow, shade in ((6, INK), (0, (255, 128, 60))):
        for part in (tail, fin, body):
            if grow:
                page.stroke(placed(part, x, y, size), grow, shade, closed=True)
            page.polygon(placed(part, x, y, size), shade)
    page.clip(placed(body, x, y, size))
    for row in range(9):
        for k in range(6):
            u, v = -1.25 + row * 0.2, -0.6 + k * 0.23 + (row % 2) * 0.115
            page.dot(x + u * size, y + v * size, size * 0.135, INK)
            page.dot(x + u * size - 0.9, y + v * size, size * 0.115,
                     jitter(dice, pick(dice, (YELLOW, PINK, (255, 150, 70))), 24))
    page.clip()
    page.dot(x + 0.78 * size, y - 0.16 * size, size * 0.27, INK)
    page.dot(x + 0.78 * size, y - 0.16 * size, size * 0.22, WHITE)
    page.dot(x + 0.84 * size, y - 0.14 * size, size * 0.11, INK)
    page.stroke(placed([(1.24, 0.1), (1.0, 0.22), (0.8, 0.2)], x, y, size), 2.2, INK)
    for k, r in enumerate((4, 6, 3, 5)):
        page.dot(x + size * 1.6 + k * 7, y - 8 - k * 8, r, INK)
        page.dot(x + size * 1.6 + k * 7, y - 8 - k * 8, r - 1.6, CYAN)


def tags(page, dice):
    for _ in range(7):
        x, y = dice.uniform(10, 330), pick(dice, (22, 40, 296, 318, 62))
        shade, u, v = pick(dice, (INK, WHITE, VIOLET, CYAN, LIME)), 0.0, 0.0
        line = [(x, y)]
        for _ in range(11):
            u, v = u + dice.uniform(1, 9), dice.uniform(-11, 11)
            line.append((x + u + dice.uniform(-5, 3), y + v))
        page.stroke(spline(line, 7), 2.4, shade)
    arrow = spline([(18, 254), (60, 288), (128, 286), (168, 262)], 8)
    for width, shade in ((13, INK), (8, LIME)):
        page.stroke(arrow, width, shade)
        page.polygon(placed([(-0.6, -1), (1.1, 0), (-0.6, 1)], 174, 258, 8 + width * 0.75, -0.56), shade)
    for _ in range(20):
        x, y, size = dice.uniform(8, 392), pick(dice, (18, 52, 82, 262, 304, 332)), dice.uniform(5, 11)
        points = star(x, y, size, size * 0.42, 5, dice.random())
        page.stroke(points, 3, INK, closed=True)
        page.polygon(points, pick(dice, (YELLOW, WHITE, PINK, CYAN)))
    glyphs.write(page, "TIDE CREW 27", 226, 322, 14, INK, 5)
    glyphs.write(page, "TIDE CREW 27", 226, 322, 14, WHITE, 2.4)


def draw():
    """The finished picture."""
    dice = random.Random(400347)
    page = Canvas(WIDTH, HEIGHT, MORTAR, 3)
    wall(page, dice)
    for x, y, size, shade in ((52, 50, 30, VIOLET), (352, 58, 34, LIME), (330, 286, 36, PINK),
                              (60, 300, 30, CYAN), (206, 40, 24, YELLOW), (198, 306, 22, (255, 120, 60))):
        splash(page, dice, x, y, size, shade)
        for _ in range(5):
            drip(page, dice, x + dice.uniform(-0.7, 0.7) * size, y + size * 0.5, shade)
    cloud(page, dice)
    for _ in range(26):
        drip(page, dice, dice.uniform(40, 366), dice.uniform(236, 256), pick(dice, (INK, (44, 92, 170))))
    tags(page, dice)
    word(page, dice)
    crown(page, 158, 76, 27)
    fish(page, dice, 286, 288, 29)
    return finish(page.picture(), lambda x, y: (
        0.88 + 0.24 * noise.fbm(x / 9, y / 9, 51, 3), 5 * noise.value(x / 1.7, y / 1.7, 52) - 2))
