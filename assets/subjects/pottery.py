"""A two-handled jar in the marine style: 1,661 vertices, 3,296 triangles, a painted texture."""
import math
import random

from kit import mesh as meshes
from kit import noise
from kit.canvas import Canvas, finish, mix, pick, placed, spline, star

SEGMENTS, RINGS, HANDLE_RINGS = 32, 46, 12
TEXTURE = 512
CLAY, DARK, RED, PALE = (222, 176, 120), (58, 36, 30), (150, 62, 38), (240, 212, 162)
# The texture's rows (v upwards): handles, the inside, the outside.
HANDLE_V, INSIDE_V, OUTSIDE_V = (0.01, 0.11), (0.13, 0.24), (0.26, 0.99)
# Radius and height in millimetres: from the bottom inside, over the lip, to the foot.
INSIDE = [(14, 16), (40, 22), (66, 60), (86, 120), (82, 180), (52, 232), (36, 262), (36, 292), (47, 314)]
OUTSIDE = [(52, 318), (55, 314), (52, 308), (43, 296), (40.5, 280), (41, 262), (47, 246), (66, 226),
           (86, 198), (94, 160), (91, 120), (78, 78), (58, 42), (44, 24), (40, 17), (47, 10), (50, 4), (49, 0)]


def even(points, count):
    """`count` points along a smooth curve, equally far apart."""
    line = spline(points, 40)
    far = [0.0]
    for a, b in zip(line, line[1:]):
        far.append(far[-1] + math.dist(a, b))
    out, at = [], 0
    for k in range(count):
        goal = far[-1] * k / (count - 1)
        while at < len(far) - 2 and far[at + 1] < goal:
            at += 1
        t = (goal - far[at]) / (far[at + 1] - far[at])
        out.append(tuple(p + (q - p) * t for p, q in zip(line[at], line[at + 1])))
    return out


def handle(jar, upper, lower, side):
    """A bow from the hole whose rim is `upper` to that of `lower`; rims start at (-1, -1)."""
    def centre(rim):
        return tuple(sum(jar.points[i][k] for i in rim) / len(rim) for k in range(3))

    (ux, _, uz), (lx, _, lz) = centre(upper), centre(lower)
    ux, lx = ux * side, lx * side
    path = even([(ux, uz), (ux + 24, uz + 11), (ux + 49, uz + 4), (lx + 27, lz + 44), (lx + 20, lz + 17),
                 (lx, lz)], HANDLE_RINGS + 2)
    square = [(-1, -1), (0, -1.1), (1, -1), (1.15, 0), (1, 1), (0, 1.1), (-1, 1), (-1.15, 0)]
    rings = []
    for k, (r, z) in enumerate(path[1:-1], 1):
        (r0, z0), (r1, z1) = path[k - 1], path[k + 1]
        length = math.hypot(r1 - r0, z1 - z0)
        tr, tz = (r1 - r0) / length, (z1 - z0) / length
        near = max(0.0, 1 - min(k, HANDLE_RINGS + 1 - k) / 2.6)
        wide, thick = 7.2 + 2.0 * near, 5.0 + 3.2 * near
        ring = []
        for u, w in square:
            # The normal of the path is -t turned by a right angle: up where it leaves the neck.
            pr, pz = r - tz * thick * w * 0.82, z + tr * thick * w * 0.82
            ring.append(len(jar.points))
            jar.points.append((side * pr, side * wide * u * 0.86, pz))
        rings.append(ring)
    rings = [upper] + rings + [lower]
    first = len(jar.uvs)
    for k in range(len(rings)):
        for j in range(9):
            jar.uvs.append((0.02 + 0.46 * k / (len(rings) - 1) + (0.5 if side > 0 else 0),
                            HANDLE_V[0] + (HANDLE_V[1] - HANDLE_V[0]) * j / 8))
    rows = [list(range(first + 9 * k, first + 9 * k + 9)) for k in range(len(rings))]
    for k in range(len(rings) - 1):
        jar.band(rings[k], rings[k + 1], rows[k], rows[k + 1])


def build():
    """The mesh, Z up, in millimetres."""
    inside, outside = even(INSIDE, 14), even(OUTSIDE, RINGS - 14)
    jar = meshes.Mesh()
    jar.points.append((0.0, 0.0, 15.0))
    rings, rows = [], []
    for i, (r, z) in enumerate(inside + outside):
        low, high, n, k = (*INSIDE_V, 13, i) if i < 14 else (*OUTSIDE_V, RINGS - 15, i - 14)
        v = low + (high - low) * k / n if i < 14 else high - (high - low) * k / n
        rings.append(list(range(len(jar.points), len(jar.points) + SEGMENTS)))
        rows.append(list(range(len(jar.uvs), len(jar.uvs) + SEGMENTS + 1)))
        for j in range(SEGMENTS):
            turn = 2 * math.pi * j / SEGMENTS
            jar.points.append((r * math.cos(turn), r * math.sin(turn), z))
        jar.uvs += [(j / SEGMENTS, v) for j in range(SEGMENTS + 1)]
    # The lip joins the two halves of the texture: its ring needs a second row of texture points.
    lip_row = list(range(len(jar.uvs), len(jar.uvs) + SEGMENTS + 1))
    jar.uvs += [(j / SEGMENTS, INSIDE_V[1]) for j in range(SEGMENTS + 1)]
    pole = list(range(len(jar.uvs), len(jar.uvs) + SEGMENTS))
    jar.uvs += [((j + 0.5) / SEGMENTS, INSIDE_V[0] - 0.008) for j in range(SEGMENTS)]
    holes = []
    for ring in (nearest(outside, 277) + 14, nearest(outside, 208) + 14):
        holes += [(ring, 0), (ring, SEGMENTS // 2)]
    stitch(jar, rings, rows, lip_row, pole, holes)
    for k in (0, 1):
        rims = [rim_of(rings, ring, segment) for ring, segment in holes[k::2]]
        # The lower rim starts at its other side: the bow turns upside down on its way.
        handle(jar, rims[0], [rims[1][i] for i in (6, 5, 4, 3, 2, 1, 0, 7)], 1 - 2 * k)
    drop_unused(jar, {rings[ring][segment] for ring, segment in holes})
    return jar


def nearest(outside, z):
    return min(range(len(outside)), key=lambda i: abs(outside[i][1] - z) + 500 * (i < 4))


def rim_of(rings, ring, segment):
    """The eight points around (ring, segment), from the left below, counter-clockwise."""
    around = [(1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1)]
    return [rings[ring + i][(segment + j) % SEGMENTS] for i, j in around]


def stitch(jar, rings, rows, lip_row, pole, holes):
    """The faces of the wall, less those around the middles of the holes."""
    jar.cap(rings[0], 0, rows[0], pole)
    for i in range(RINGS - 1):
        upper_row = lip_row if i == 13 else rows[i + 1]
        first = len(jar.faces)
        jar.band(rings[i + 1], rings[i], upper_row, rows[i])
        cut = []
        for f in range(first, len(jar.faces)):
            j = (f - first) // 2
            for ring, segment in holes:
                if ring - 1 <= i <= ring and (segment - j) % SEGMENTS in (0, 1):
                    cut.append(f)
        jar.faces = [face for f, face in enumerate(jar.faces) if f not in cut]


def drop_unused(jar, unused):
    """Takes points away that no face uses."""
    place, kept = {}, []
    for i, point in enumerate(jar.points):
        if i not in unused:
            place[i] = len(kept)
            kept.append(point)
    jar.points = kept
    jar.faces = [tuple((place[p], t) for p, t in face) for face in jar.faces]


def around(page, draw, x, *rest):
    """Draws at x, and once more beyond the seam."""
    for shift in (-TEXTURE, 0, TEXTURE):
        if -140 < x + shift < TEXTURE + 140:
            draw(page, x + shift, *rest)


def row(v):
    """The texture's pixel row for v."""
    return (1 - v) * TEXTURE


def octopus(page, x, y, size, dice_seed):
    dice = random.Random(dice_seed)
    for k in range(8):
        side = -1 if k < 4 else 1
        lift = (k % 4) - 1.3
        line = [(side * 0.22, 0.18)]
        for i in range(1, 6):
            line.append((side * (0.22 + 0.36 * i * (1 - 0.08 * abs(lift))),
                         0.18 + lift * 0.21 * i ** 0.9 + 0.13 * math.sin(i * 1.7 + k)))
        end = line[-1]
        for i in range(9):
            r, a = 0.3 * (1 - i / 10), i * 0.85 * side + (0.3 if side > 0 else math.pi)
            line.append((end[0] + side * 0.18 - r * math.cos(a) * side * 0.8, end[1] - 0.1 + r * math.sin(a)))
        curve = placed(spline(line, 7), x, y, size)
        page.stroke(curve, size * 0.2, DARK, size * 0.045)
        for i in range(2, len(curve) - 12, 4):
            page.dot(curve[i][0], curve[i][1], max(size * 0.05 * (1 - i / len(curve)), 1.1), PALE)
    page.polygon(placed(spline([(-0.3, 0.24), (-0.5, -0.3), (-0.3, -0.82), (0, -0.95), (0.3, -0.82),
                                (0.5, -0.3), (0.3, 0.24), (0, 0.36)], 8, True), x, y, size), DARK)
    for side in (-1, 1):
        page.dot(x + side * size * 0.2, y - size * 0.02, size * 0.17, PALE)
        page.dot(x + side * size * 0.2, y - size * 0.02, size * 0.105, DARK)
        page.dot(x + side * size * 0.2, y - size * 0.02, size * 0.04, PALE)
    for _ in range(9):
        page.dot(x + dice.uniform(-0.24, 0.24) * size, y - dice.uniform(0.3, 0.75) * size, size * 0.035, PALE)


def fish(page, x, y, size, way):
    body = [(-1, 0), (-0.3, -0.42), (0.6, -0.3), (1, 0), (0.6, 0.3), (-0.3, 0.42)]
    page.polygon(placed([(u * way, v) for u, v in spline(body, 6, True)], x, y, size), RED)
    page.polygon(placed([(-0.9 * way, 0), (-1.5 * way, -0.45), (-1.3 * way, 0), (-1.5 * way, 0.45)],
                        x, y, size), DARK)
    for k in range(4):
        page.stroke(placed([((0.25 - 0.3 * k) * way, -0.28), ((0.15 - 0.3 * k) * way, 0.28)], x, y, size),
                    1.6, DARK)
    page.dot(x + 0.62 * size * way, y - size * 0.06, size * 0.11, PALE)


def weed(page, x, y, size, turn):
    for k in range(5):
        bend = turn + (k - 2) * 0.42
        line = placed(spline([(0, 0), (0.5, 0.16 * (k - 2)), (1, -0.1)], 6), x, y, size, bend)
        page.stroke(line, 2.2, DARK, 0.9)
        for i in range(3, len(line), 2):
            page.dot(line[i][0], line[i][1], 2.0, DARK)


def shell(page, x, y, size):
    page.polygon(star(x, y, size, size * 0.5, 9), RED)
    page.dot(x, y, size * 0.38, PALE)
    page.dot(x, y, size * 0.2, DARK)


def borders(page):
    def band(v, height, shade):
        page.box(0, row(v), TEXTURE, row(v) + height, shade)

    band(0.99, 26, DARK)
    band(0.935, 3, RED)
    for k in range(40):
        x = k * 12.8
        page.polygon([(x + 1, row(0.925)), (x + 11.8, row(0.925)), (x + 6.4, row(0.885))], DARK)
    band(0.875, 4, DARK)
    for k in range(20):
        x, y = k * 25.6, row(0.845)
        curl = [(0, 8), (6, 8), (12, 6), (16, 0), (13, -5), (8, -4), (8, 1), (11, 2)]
        around(page, lambda p, u: p.stroke(spline([(u + a, y + b) for a, b in curl], 6), 3, RED), x)
    band(0.818, 4, DARK)
    band(0.43, 5, DARK)
    band(0.415, 2.4, RED)
    for k in range(32):
        x = k * 16.0
        page.polygon([(x, row(0.30)), (x + 8, row(0.40)), (x + 16, row(0.30))], DARK)
        page.polygon([(x + 5, row(0.30)), (x + 8, row(0.345)), (x + 11, row(0.30))], CLAY)
    band(0.302, 6, DARK)
    band(0.285, 14, RED)


def texture():
    """The picture that the jar wears."""
    dice = random.Random(1661)
    page = Canvas(TEXTURE, TEXTURE, CLAY, 3)
    page.box(0, row(0.25), TEXTURE, TEXTURE, mix(CLAY, RED, 0.25))
    page.box(0, row(0.12), TEXTURE, TEXTURE, DARK)
    for k in range(46):
        page.stroke([(k * 11.2, row(0.1)), (k * 11.2 + 5, row(0.02))], 2.0, RED)
    borders(page)
    for k in range(70):
        around(page, lambda p, x, y, r: p.dot(x, y, r, DARK), dice.uniform(0, 512),
               dice.uniform(row(0.80), row(0.45)), dice.uniform(0.8, 2.2))
    # Segment 0 and 16 carry the handles; the octopuses look out between them.
    for x, y, size, seed in ((128, 186, 64, 3), (384, 192, 64, 5)):
        page.clip([(0, row(0.815)), (TEXTURE, row(0.815)), (TEXTURE, row(0.432)), (0, row(0.432))])
        around(page, octopus, x, y, size, seed)
        page.clip()
    for x, y, size, way in ((8, 222, 19, 1), (30, 262, 13, -1), (248, 232, 18, -1), (272, 262, 13, 1),
                            (214, 116, 12, 1), (300, 110, 12, -1), (56, 112, 12, -1), (462, 112, 12, 1)):
        around(page, fish, x, y, size, way)
    for x, y, size, turn in ((0, 288, 42, -1.57), (256, 288, 42, -1.57), (128, 292, 30, -1.57),
                             (384, 292, 30, -1.57), (190, 290, 26, -1.3), (66, 290, 26, -1.9)):
        around(page, weed, x, y, size, turn)
    for _ in range(12):
        around(page, shell, dice.uniform(0, 512), pick(dice, (108, 280, 266)), dice.uniform(4, 8))
    return finish(page.picture(), lambda x, y: (
        (0.84 + 0.26 * noise.fbm(x / 32, y / 32, 61, 4, 16))
        * (0.8 if noise.value(x / 4, y / 4, 66, 128) > 0.9 and y < 380 else 1.0), 2))
