"""A textbook's cover: a theodolite over a contour map with its triangulation (310 x 450)."""
import math
import random

from kit import glyphs, noise
from kit.canvas import Canvas, finish, mix, ring, spline

WIDTH, HEIGHT = 310, 450
PAPER, INK, RED = (240, 228, 196), (36, 40, 48), (190, 52, 44)
BRASS, BLUE, GREEN = (206, 156, 64), (64, 122, 158), (66, 96, 72)
TINTS = [(126, 172, 186), (172, 198, 150), (206, 212, 154), (232, 214, 150), (226, 184, 120),
         (202, 146, 98), (176, 116, 86), (222, 208, 196)]
MAP = (16, 76, 294, 434)


def height(x, y):
    """The land's height in contour steps."""
    hill = 7.5 * math.exp(-((x - 210) ** 2 + (y - 190) ** 2) / 9000.0)
    ridge = 4.5 * math.exp(-((x - 70) ** 2 + (y - 340) ** 2) / 7000.0)
    return hill + ridge + 10.5 * noise.fbm(x / 82, y / 82, 41, 4) - 2.2


def relief(picture):
    """Lays hypsometric tints, hill shading and contour lines over the map's field."""
    x0, y0, x1, y1 = MAP
    field = [[height(x, y) for x in range(x0, x1 + 1)] for y in range(y0, y1 + 1)]
    for y in range(y0, y1):
        for x in range(x0, x1):
            h = field[y - y0][x - x0]
            dx = field[y - y0][x - x0 + 1] - h
            dy = field[y - y0 + 1][x - x0] - h
            tint = TINTS[min(max(int(h / 1.6), 0), len(TINTS) - 1)]
            shade = 1.0 + max(min((dx + dy) * 0.9, 0.24), -0.3)
            slope = math.hypot(dx, dy) + 1e-6
            away = abs(h - round(h)) / slope
            heavy = 1.1 if round(h) % 4 == 0 else 0.62
            line = min(max(heavy + 0.5 - away, 0.0), 1.0) * (0.95 if heavy > 1 else 0.7)
            at = (y * picture.width + x) * 3
            for c in range(3):
                v = min(tint[c] * shade, 255)
                ink = (112, 66, 36)[c]
                picture.pixels[at + c] = int(v + (ink - v) * line + 0.5)
    return picture


def river(page):
    course = spline([(16, 150), (60, 176), (96, 160), (128, 214), (150, 262), (200, 290),
                     (232, 336), (294, 352)], 10)
    page.stroke(course, 8.5, mix(BLUE, INK, 0.45), 11)
    page.stroke(course, 6.4, (126, 182, 208), 9)
    for k in range(6, len(course) - 3, 7):
        page.stroke(course[k : k + 3], 1.1, (230, 244, 248))


def settlements(page, dice):
    road = spline([(40, 434), (88, 352), (150, 262), (186, 190), (174, 132), (212, 76)], 10)
    page.stroke(road, 5.4, INK)
    page.stroke(road, 3.4, (250, 240, 200))
    for cx, cy, count in ((158, 236, 22), (74, 386, 14), (196, 120, 12), (256, 362, 12)):
        for _ in range(count):
            x, y, turn = cx + dice.gauss(0, 13), cy + dice.gauss(0, 11), dice.uniform(0, 1.5)
            page.polygon(ring(x, y, dice.uniform(2.6, 4.8), 4, dice.uniform(0.6, 1), turn),
                         (58, 44, 48))
    for _ in range(85):
        x, y = dice.uniform(22, 288), dice.uniform(92, 426)
        if height(x, y) % 3 < 1.1:
            page.dot(x, y, 3.1, (44, 92, 62))
            page.dot(x - 0.8, y - 0.9, 1.5, (128, 176, 104))
    for _ in range(30):
        x, y = dice.uniform(28, 270), dice.uniform(96, 420)
        glyphs.write(page, str(int(120 + 25 * height(x, y))), x, y, 6.4, (70, 40, 28), 1.1)


def triangulation(page):
    nodes = [(42, 118), (112, 96), (236, 104), (268, 196), (214, 226), (106, 196), (38, 258),
             (120, 318), (262, 292), (196, 396), (52, 408), (270, 410)]
    sides = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 2), (4, 1), (4, 5), (5, 1), (5, 0), (5, 6), (6, 0),
             (6, 7), (7, 5), (7, 4), (4, 8), (8, 3), (7, 9), (9, 8), (7, 10), (10, 6), (10, 9),
             (9, 11), (11, 8)]
    for a, b in sides:
        page.stroke([nodes[a], nodes[b]], 1.7, RED)
    for k, (x, y) in enumerate(nodes):
        page.polygon(ring(x, y, 8.6, 3, 1, -math.pi / 2), INK)
        page.polygon(ring(x, y, 6.2, 3, 1, -math.pi / 2), PAPER)
        page.dot(x, y, 1.7, RED)
        glyphs.write(page, "ABCDEFGHKLMN"[k], x + 8, y - 8, 7.6, INK, 1.5)


def tripod(page):
    wood, dark = (168, 110, 58), (84, 52, 34)
    for foot, width in (((150, 428), 9), ((76, 440), 11), ((226, 440), 11)):
        top = (152 + (foot[0] - 150) * 0.16, 308)
        page.stroke([top, foot], width + 3, dark, 6)
        page.stroke([top, foot], width, wood, 3.6)
        mid = ((top[0] + foot[0]) / 2, (top[1] + foot[1]) / 2)
        page.stroke([(mid[0] - 6, mid[1]), (mid[0] + 6, mid[1])], 5, INK)
        for k in range(9):
            t = 0.1 + k * 0.09
            x, y = top[0] + (foot[0] - top[0]) * t, top[1] + (foot[1] - top[1]) * t
            page.stroke([(x - 3, y - 2), (x + 2, y + 4)], 1, dark)
    page.polygon([(112, 296), (192, 296), (184, 314), (120, 314)], dark)
    page.box(110, 291, 194, 298, BRASS)


def theodolite(page):
    dark, light = mix(BRASS, INK, 0.55), (252, 224, 150)
    for u in (-26, 0, 26):
        page.box(152 + u - 5, 278, 152 + u + 5, 292, dark)
        for k in range(-4, 5, 2):
            page.box(152 + u + k - 0.5, 279, 152 + u + k + 0.5, 291, light)
    page.polygon([(116, 266), (188, 266), (182, 280), (122, 280)], BRASS)
    page.dot(152, 262, 47, INK, 0.24)
    page.dot(152, 260, 46, PAPER, 0.19)
    for k in range(60):
        turn = math.pi * 2 * k / 60
        near = 0.80 if k % 5 == 0 else 0.9
        page.stroke([(152 + 45 * near * math.cos(turn), 260 + 8.6 * near * math.sin(turn)),
                     (152 + 45 * math.cos(turn), 260 + 8.6 * math.sin(turn))], 1.0, INK)
    for side in (-1, 1):
        page.polygon([(152 + side * 12, 260), (152 + side * 40, 260), (152 + side * 36, 214),
                      (152 + side * 24, 168), (152 + side * 15, 168), (152 + side * 22, 220)], dark)
        page.polygon([(152 + side * 17, 256), (152 + side * 36, 256), (152 + side * 32, 214),
                      (152 + side * 22, 172), (152 + side * 18, 172), (152 + side * 26, 220)], BRASS)
        page.stroke([(152 + side * 20, 176), (152 + side * 29, 214), (152 + side * 29, 250)], 1.6,
                    light)
    page.dot(152, 192, 41, INK)
    page.dot(152, 192, 39, BRASS)
    page.dot(152, 192, 33, PAPER)
    for k in range(72):
        turn = math.pi * 2 * k / 72
        near = 25 if k % 6 == 0 else 29
        page.stroke([(152 + near * math.cos(turn), 192 + near * math.sin(turn)),
                     (152 + 32.6 * math.cos(turn), 192 + 32.6 * math.sin(turn))], 1.1, INK)
    for k in range(6):
        turn = math.pi * k / 3 + 0.4
        page.stroke([(152, 192), (152 + 23 * math.cos(turn), 192 + 23 * math.sin(turn))], 3.4, dark)
    page.dot(152, 192, 8, dark)
    page.dot(152, 192, 4.4, light)


def telescope(page):
    dark, light = mix(BRASS, INK, 0.6), (252, 228, 160)
    c, s = math.cos(-0.24), math.sin(-0.24)

    def at(u, v):
        return (152 + u * c - v * s, 186 + u * s + v * c)

    for a, b, r, shade in ((-62, 54, 12, BRASS), (-76, -56, 8.5, dark), (-84, -74, 11, INK),
                           (46, 74, 15.5, dark), (70, 80, 18, BRASS), (-20, -10, 14, dark),
                           (14, 24, 14, dark)):
        page.polygon([at(a, -r - 1.6), at(b, -r - 1.6), at(b, r + 1.6), at(a, r + 1.6)], INK)
        page.polygon([at(a, -r), at(b, -r), at(b, r), at(a, r)], shade)
        page.polygon([at(a, -r * 0.62), at(b, -r * 0.62), at(b, -r * 0.3), at(a, -r * 0.3)], light)
        page.polygon([at(a, r * 0.5), at(b, r * 0.5), at(b, r), at(a, r)], INK, 0.35)
    page.polygon([at(-34, -24), at(34, -24), at(34, -17), at(-34, -17)], INK)
    page.polygon([at(-31, -22.6), at(31, -22.6), at(31, -18.4), at(-31, -18.4)], (170, 214, 140))
    page.polygon([at(-6, -22.6), at(8, -22.6), at(8, -18.4), at(-6, -18.4)], (236, 250, 220))
    for k in range(-5, 6):
        page.stroke([at(k * 5.4, -22.4), at(k * 5.4, -18.6)], 0.9, INK)


def margins(page):
    x0, y0, x1, y1 = MAP
    for box in ((0, 0, WIDTH, y0), (0, y1, WIDTH, HEIGHT), (0, 0, x0, HEIGHT), (x1, 0, WIDTH, HEIGHT)):
        page.box(*box, GREEN)
    page.stroke([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], 3, INK, closed=True)
    for k in range(20):
        a, b = y0 + (y1 - y0) * k / 20, y0 + (y1 - y0) * (k + 1) / 20
        page.box(x0 - 7, a, x0 - 3, b, (PAPER, INK)[k % 2])
        page.box(x1 + 3, a, x1 + 7, b, (INK, PAPER)[k % 2])
    glyphs.centred(page, "LEVEL & CHAIN", 155, 16, 23, PAPER, 3.8, 0.2)
    glyphs.centred(page, "A FIELD BOOK OF SURVEYING", 155, 52, 10.5, (240, 200, 110), 1.9)
    page.box(24, 420, 104, 430, PAPER)
    for k in range(7):
        page.box(28 + k * 10, 425, 38 + k * 10, 429, (INK, PAPER)[k % 2])
    for u, way in ((274, -1), (274, 1)):
        page.polygon([(u, 88), (u + way * 9, 122), (u, 114)], INK if way > 0 else PAPER)
    glyphs.centred(page, "N", 274, 124, 9, INK, 1.8)


def draw():
    """The finished picture."""
    dice = random.Random(310450)
    page = Canvas(WIDTH, HEIGHT, PAPER, 3)
    page.lay(relief(page.picture()))
    river(page)
    settlements(page, dice)
    triangulation(page)
    tripod(page)
    theodolite(page)
    telescope(page)
    margins(page)
    return finish(page.picture(), lambda x, y: (0.95 + 0.1 * noise.value(x / 2.3, y / 2.3, 9), 0))
