"""Solids as signed distances, and the wrapping of a mesh around one by rays from its axis."""
import math

from kit.mesh import Mesh


def sphere(p, c, r):
    return math.sqrt((p[0] - c[0]) ** 2 + (p[1] - c[1]) ** 2 + (p[2] - c[2]) ** 2) - r


def ellipsoid(p, c, r):
    """About the distance to an ellipsoid of half axes r."""
    x, y, z = (p[0] - c[0]) / r[0], (p[1] - c[1]) / r[1], (p[2] - c[2]) / r[2]
    k = math.sqrt(x * x + y * y + z * z)
    if k < 1e-6:
        return -min(r)
    x, y, z = x / r[0], y / r[1], z / r[2]
    return k * (k - 1.0) / math.sqrt(x * x + y * y + z * z)


def capsule(p, a, b, ra, rb):
    """A rod from a to b whose radius goes from ra to rb."""
    bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    px, py, pz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    t = (px * bx + py * by + pz * bz) / (bx * bx + by * by + bz * bz)
    t = 0.0 if t < 0 else 1.0 if t > 1 else t
    px, py, pz = px - t * bx, py - t * by, pz - t * bz
    return math.sqrt(px * px + py * py + pz * pz) - (ra + (rb - ra) * t)


def box(p, c, h, r):
    """A box of half sides h, its edges rounded by r."""
    x, y, z = abs(p[0] - c[0]) - h[0] + r, abs(p[1] - c[1]) - h[1] + r, abs(p[2] - c[2]) - h[2] + r
    out = math.sqrt(max(x, 0.0) ** 2 + max(y, 0.0) ** 2 + max(z, 0.0) ** 2)
    return out + min(max(x, y, z), 0.0) - r


def blend(a, b, k):
    """The union of two solids, their seam filled over a width k."""
    h = k - abs(a - b)
    if h <= 0:
        return a if a < b else b
    return (a if a < b else b) - h * h / (4.0 * k)


def carve(a, b, k):
    """a without b, the edge rounded over k."""
    return -blend(-a, b, k)


def step(low, high, x):
    """0 below `low`, 1 above `high`, smooth between."""
    t = (x - low) / (high - low)
    t = 0.0 if t < 0 else 1.0 if t > 1 else t
    return t * t * (3 - 2 * t)


class Axis:
    """Where rays start and how steeply they leave, along keys of (height, elevation in degrees)."""

    def __init__(self, keys):
        self._keys = keys

    def at(self, t):
        """For t from 0 (top) to 1 (foot): the height and the elevation in radians."""
        x = t * (len(self._keys) - 1)
        i = min(int(x), len(self._keys) - 2)
        (h0, e0), (h1, e1) = self._keys[i], self._keys[i + 1]
        f = x - i
        return h0 + (h1 - h0) * f, math.radians(e0 + (e1 - e0) * f)


def hit(solid, origin, way, reach, near=1e-4):
    """The outermost point of a solid on a ray, met from `reach` inwards."""
    far = reach
    for _ in range(60):
        p = (origin[0] + way[0] * far, origin[1] + way[1] * far, origin[2] + way[2] * far)
        d = solid(p)
        if d < near or far <= 0.0:
            break
        far -= d * 0.8
    far = max(far, near)
    return (origin[0] + way[0] * far, origin[1] + way[1] * far, origin[2] + way[2] * far)


def ray(axis, t, turn):
    """Origin and direction of the ray at t, turned about Z."""
    height, lift = axis.at(t)
    flat = math.cos(lift)
    return (0.0, 0.0, height), (flat * math.cos(turn), flat * math.sin(turn), math.sin(lift))


def spread(solid, axis, count, reach, turns, weight=None):
    """`count` values of t whose hits are equally far apart, as seen along `turns`.

    weight(t) asks for more rings where it is large.
    """
    fine = 6 * count
    marks = [[hit(solid, *ray(axis, k / fine, turn), reach) for turn in turns] for k in range(fine + 1)]
    far = [0.0]
    for k in range(fine):
        gap = sum(math.dist(a, b) for a, b in zip(marks[k], marks[k + 1])) / len(turns)
        far.append(far[-1] + gap * (weight(k / fine) if weight else 1.0))
    out, at = [], 0
    for k in range(1, count + 1):
        goal = far[-1] * k / count
        while at < fine - 1 and far[at + 1] < goal:
            at += 1
        span = far[at + 1] - far[at]
        out.append(round((at + (goal - far[at]) / span if span > 0 else at) / fine, 9))
    return out


def wrap(solid, axis, heights, turns, reach, doublings):
    """The points of a mesh around `solid`: a pole, and a ring for each of `heights`.

    Each of the last `doublings` rings has twice as many points as the ring above it. Returns the
    mesh, still without faces, and the rings as lists of point numbers; the pole is point 0.
    """
    mesh, rings, around = Mesh(), [], list(turns)
    mesh.points.append(hit(solid, (0.0, 0.0, axis.at(0.0)[0]), (0.0, 0.0, 1.0), reach))
    for k, t in enumerate(heights):
        if k >= len(heights) - doublings:
            closed = around + [around[0] + 2 * math.pi]
            around = [v for a, b in zip(closed, closed[1:]) for v in (a, (a + b) / 2)]
        rings.append(list(range(len(mesh.points), len(mesh.points) + len(around))))
        mesh.points += [hit(solid, *ray(axis, t, turn), reach) for turn in around]
    return mesh, rings


def stitch(mesh, rings, rows=None, pole_row=None):
    """The faces between the pole (point 0) and the rings; `rows` are the rings' texture points."""
    rows = rows or [None] * len(rings)
    mesh.cap(rings[0], 0, rows[0], pole_row)
    for above, ring, above_row, row in zip(rings, rings[1:], rows, rows[1:]):
        join = mesh.doubling if len(ring) > len(above) else mesh.band
        join(ring, above, row, above_row)


def slope(solid, p, d):
    """The outward normal of a solid at p, from differences over d."""
    x, y, z = p
    n = (solid((x + d, y, z)) - solid((x - d, y, z)), solid((x, y + d, z)) - solid((x, y - d, z)),
         solid((x, y, z + d)) - solid((x, y, z - d)))
    length = math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2) or 1.0
    return (n[0] / length, n[1] / length, n[2] / length)


def openness(solid, p, n, size):
    """How much of the sky a point sees, 0 to 1: the distance field sampled along its normal."""
    dark, weight = 0.0, 1.0
    for k in (1, 2, 4):
        far = size * k
        d = solid((p[0] + n[0] * far, p[1] + n[1] * far, p[2] + n[2] * far))
        dark += weight * max(far - d, 0.0) / far
        weight *= 0.6
    return max(1.0 - dark / 1.3, 0.0)
