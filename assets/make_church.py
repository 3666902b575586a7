#!/usr/bin/env python3
"""Writes a church of any size as an OBJ file: nave, aisles, transept, apse, tower and porch.

Its walls have windows, courses of stone and tiled roofs in relief, its vertices have colours. Each part
is a surface of rings, open below, so that the counts come out exactly: a part of S points a ring
adds 2 V - F = S + 2, and the missing ones are made by splitting faces and border edges.
Nothing but one ring of a part is held in memory. The same bytes each time.
"""
import argparse
import math
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))

from kit import noise  # noqa: E402

VERTICES, FACES = 7335148, 14645744
UTM = (512345.25, 4401234.5, 187.75)  # easting, northing, height
STONE, TILE, GLASS, TRIM = (0.74, 0.67, 0.55), (0.62, 0.32, 0.22), (0.16, 0.22, 0.32), (0.84, 0.78, 0.68)

# Each part, in metres: centre x and y, length (x), width (y), eaves, ridge, turned by a quarter,
# shape ("gable", "spire" or "round"), window spacing, window's sill and head, width of a window.
PARTS = (
    (0.0, 0.0, 44.0, 12.0, 18.0, 26.5, False, "gable", 5.5, 10.5, 15.5, 1.7),
    (1.0, -8.2, 36.0, 5.2, 8.0, 10.5, False, "gable", 5.5, 2.6, 6.4, 1.5),
    (1.0, 8.2, 36.0, 5.2, 8.0, 10.5, False, "gable", 5.5, 2.6, 6.4, 1.5),
    (9.0, 0.0, 32.0, 10.0, 17.5, 25.0, True, "gable", 4.6, 5.0, 14.5, 1.9),
    (22.0, 0.0, 12.0, 12.0, 14.0, 19.5, False, "round", 4.2, 4.0, 11.5, 1.5),
    (-24.0, 0.0, 9.5, 9.5, 34.0, 58.0, False, "spire", 3.1, 25.0, 31.5, 1.2),
    (-30.0, 0.0, 4.4, 5.4, 4.6, 7.6, False, "gable", 2.6, 1.2, 3.6, 1.2),
    (15.5, -10.5, 3.2, 3.2, 19.0, 27.0, False, "spire", 1.6, 12.0, 17.0, 0.5),
    (15.5, 10.5, 3.2, 3.2, 19.0, 27.0, False, "spire", 1.6, 12.0, 17.0, 0.5),
)
SMALLEST = 8 * len(PARTS)


def weights():
    """How much of the whole each part is: by its perimeter, and by the length of its profile."""
    around = [math.pi * p[2] if p[7] == "round" else 2 * (p[2] + p[3]) for p in PARTS]
    return around, [p[4] + math.hypot(p[5] - p[4], p[3] / 2) for p in PARTS]


def plan(vertices, faces):
    """Points a ring and rings of each part, then the splits of borders and of faces still due."""
    around, up = weights()
    rest = 2 * vertices - faces - 2 * len(PARTS)
    # About half of the border comes from splits: the course above the ground is twice as fine.
    whole = rest * 0.52
    segments = [max(8, int(whole * a / sum(around)) // 4 * 4) for a in around]
    while 2 * sum(segments) < rest:
        segments[segments.index(max(segments))] += 4
    border = rest - sum(segments)
    area = sum(s * u for s, u in zip(segments, up))
    free = vertices - border
    rings = [max(3, int(free * u / area)) for u in up]
    left = free - sum(s * r for s, r in zip(segments, rings))
    while left < 0 and max(rings) > 3:
        k = max(range(len(PARTS)), key=lambda i: rings[i])
        rings[k] -= 1
        left += segments[k]
    for k in sorted(range(len(PARTS)), key=lambda i: -segments[i]):
        more = max(left, 0) // segments[k]
        rings[k] += more
        left -= more * segments[k]
    if not (0 <= border <= sum(segments) and 0 <= left <= sum(segments)):
        return None
    return segments, rings, border, left


def footprint(part, u):
    """The point at u in [0, 1) around the wall, as (x, y, outward x, outward y, way along the side)."""
    length, width = part[2], part[3]
    if part[7] == "round":
        turn = 2 * math.pi * u
        c, s = math.cos(turn), math.sin(turn)
        return length / 2 * c, width / 2 * s, c, s, turn * length / 2
    d = u * 2 * (length + width)
    for side, (run, nx, ny) in enumerate(((length, 0, -1), (width, 1, 0), (length, 0, 1), (width, -1, 0))):
        if d < run or side == 3:
            break
        d -= run
    t = d - run / 2
    x, y = ((t, -width / 2), (length / 2, t), (-t, width / 2), (-length / 2, -t))[side]
    return x, y, nx, ny, t


def window(part, along, z):
    """The depth of a wall's point in a window: (depth in metres, is glass)."""
    spacing, sill, head, wide = part[8:12]
    half = part[3 if abs(along) <= part[3] / 2 else 2] / 2
    if part[7] != "round" and half - abs(along) < wide:
        return 0.0, False
    a = abs((along / spacing + 0.5) % 1.0 - 0.5) * spacing
    arch = head - 0.9 * wide * (a / wide * 2) ** 2 if a < wide else head
    if not sill < z < arch or a > wide / 2:
        near = min(abs(a - wide / 2), abs(z - sill) if a < wide / 2 else 9.0)
        return (-0.08, False) if sill - 0.2 < z < arch + 0.4 and near < 0.16 else (0.0, False)
    edge = min((wide / 2 - a) / 0.18, (z - sill) / 0.18, (arch - z) / 0.25, 1.0)
    bar = a < 0.06 or (z * 1.25) % 1.0 < 0.08
    return (0.42 if not bar else 0.3) * edge, edge >= 1.0 and not bar


def wall(part, along, z):
    """Relief (outwards, metres) and colour of the wall."""
    depth, glass = window(part, along, z)
    if glass:
        tint = noise.lattice(int(along * 5), int(z * 5), 3)
        return -depth, (GLASS[0] + 0.3 * tint, GLASS[1] + 0.12 * tint, GLASS[2] + 0.2 * (1 - tint))
    if depth:
        return -depth, TRIM
    course = int(z / 0.42)
    x = along / 0.86 + 0.5 * (course % 2) + 0.2 * noise.lattice(course, 7, 11)
    block = int(math.floor(x))
    joint = min((z / 0.42) % 1.0 * 0.42, (x - block) * 0.86)
    tone = 0.86 + 0.22 * noise.lattice(block, course, 21)
    rough = 0.02 * noise.value(along * 7.0, z * 7.0, 31)
    band = 0.16 if z < 0.8 or abs(z - part[4] + 0.5) < 0.35 else 0.0
    if joint < 0.035 and not band:
        tone, rough = tone * 0.72, -0.025
    return rough + band, tuple(min(c * tone, 1.0) for c in (TRIM if band else STONE))


def roof(along, t, slope):
    """Relief and colour of the roof at a way t (metres) up its slope."""
    row = t / 0.45
    x = along / 0.32 + 0.5 * (int(row) % 2)
    bulge = 0.05 * (1 - row % 1.0) + 0.035 * abs(math.sin(math.pi * x))
    tone = 0.78 + 0.34 * noise.lattice(int(math.floor(x)), int(row), 41)
    if t > slope - 0.4:
        return 0.08, TRIM
    return bulge, tuple(min(c * tone, 1.0) for c in TILE)


def place(part, u, v):
    """The point at u around and v up (0 foot, 1 ridge), in metres, and its colour."""
    x, y, nx, ny, along = footprint(part, u)
    eaves, ridge = part[4], part[5]
    rise = ridge - eaves
    slope = math.hypot(rise, part[3] / 2)
    way = v * (eaves + slope)
    if way <= eaves:
        z = way
        relief, colour = wall(part, along, z)
        x, y = x + nx * relief, y + ny * relief
    else:
        t = min((way - eaves) / slope, 1.0)
        z = eaves + rise * t
        keep = max(1.0 - t, 0.012 if part[7] == "gable" else 0.04)
        gable = part[7] == "gable" and nx != 0
        relief, colour = wall(part, along, z) if gable else roof(along, t * slope, slope)
        lift = relief * part[3] / 2 / slope if not gable else 0.0
        out = relief if gable else relief * rise / slope
        y *= keep
        if part[7] != "gable":
            x *= keep
        x, y, z = x + nx * out, y + ny * out * (0.0 if gable else 1.0), z + lift
        if not gable and t < 0.06:
            x, y = x + nx * 0.3 * (1 - t / 0.06), y + ny * 0.3 * (1 - t / 0.06)
    if part[6]:
        x, y = -y, x
    return x + part[0], y + part[1], z, colour


class Writer:
    """Writes vertices with their offset and their decimals."""

    def __init__(self, file, offset, colours):
        self._file, self._offset, self._colours = file, offset, colours

    def vertices(self, points):
        ox, oy, oz = self._offset
        if self._colours:
            self._file.writelines(f"v {x + ox:.3f} {y + oy:.3f} {z + oz:.3f} {c[0]:.2f} {c[1]:.2f} {c[2]:.2f}\n"
                                  for x, y, z, c in points)
        else:
            self._file.writelines(f"v {x + ox:.3f} {y + oy:.3f} {z + oz:.3f}\n" for x, y, z, _ in points)

    def faces(self, faces):
        self._file.writelines(f"f {a} {b} {c}\n" for a, b, c in faces)


def mean(*points):
    """The middle of points, with the first one's colour."""
    return (*(sum(p[k] for p in points) / len(points) for k in range(3)), points[0][3])


def write_part(out, part, first, segments, rings, border, inner):
    """One part, its first vertex being number `first`; returns the number after its last.

    Of the lowest band's quads, `border` have the triangle on the border split and `inner` the other.
    """
    low = None
    added = []
    for i in range(rings):
        ring = [place(part, j / segments, i / (rings - 1)) for j in range(segments)]
        out.vertices(ring)
        if i == 0:
            low = ring
            added += [mean(low[j], low[(j + 1) % segments]) for j in range(border)]
        elif i == 1:
            added += [mean(low[(j + 1) % segments], ring[(j + 1) % segments], ring[j]) for j in range(inner)]
    out.vertices(added)
    extra = first + segments * rings
    for i in range(rings - 1):
        out.faces(band(first + i * segments, segments, extra, *((border, inner) if i == 0 else (0, 0))))
    # The ridge: the last ring is closed by a strip from end to end, without a vertex of its own.
    a, b, top = 0, segments - 1, first + (rings - 1) * segments
    strip = []
    while a + 1 < b:
        strip.append((top + a, top + a + 1, top + b))
        a += 1
        if a + 1 < b:
            strip.append((top + a, top + b - 1, top + b))
            b -= 1
    out.faces(strip)
    return extra + len(added)


def band(base, segments, extra, border, inner):
    """The triangles between two rings."""
    for j in range(segments):
        k = (j + 1) % segments
        a, b, c, d = base + j, base + k, base + segments + k, base + segments + j
        if j < border:
            yield from ((a, extra + j, d), (extra + j, b, d))
        else:
            yield (a, b, d)
        if j < inner:
            m = extra + border + j
            yield from ((b, c, m), (c, d, m), (d, b, m))
        else:
            yield (b, c, d)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", metavar="OUT.obj")
    parser.add_argument("--vertices", type=int, default=VERTICES, metavar="N")
    parser.add_argument("--faces", type=int, metavar="N", help="default: 14645744, or what suits N vertices")
    parser.add_argument("--utm", action="store_true", help="georeferenced coordinates, large ones")
    parser.add_argument("--no-colours", action="store_true", help="vertices of three numbers")
    options = parser.parse_args()
    vertices = options.vertices
    faces = options.faces
    if faces is None:
        whole = 2 * VERTICES - FACES
        faces = 2 * vertices - max(int(whole * math.sqrt(vertices / VERTICES)), 2 * SMALLEST + 40)
    made = plan(vertices, faces)
    if made is None:
        parser.error(f"{vertices} vertices and {faces} faces do not go together: 2 V - F is the length of the "
                     "border and wants to be about 9 times the root of V, V at least 400")
    segments, rings, border, inner = made
    with open(options.out, "w", encoding="ascii", newline="\n", buffering=1 << 20) as file:
        file.write(f"# A church in metres, Z up: {vertices} vertices, {faces} faces. CC0. By make_church.py.\n")
        out = Writer(file, UTM if options.utm else (0.0, 0.0, 0.0), not options.no_colours)
        first = 1
        for part, s, r in zip(PARTS, segments, rings):
            b, n = min(border, s), min(inner, s)
            first = write_part(out, part, first, s, r, b, n)
            border, inner = border - b, inner - n


if __name__ == "__main__":
    main()
