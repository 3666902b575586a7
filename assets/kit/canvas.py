"""A canvas for polygons, strokes and dots, anti-aliased by supersampling."""
import math

from kit.png import Picture


def mix(a, b, t):
    """The colour a fraction t of the way from a to b."""
    return tuple(int(p + (q - p) * t + 0.5) for p, q in zip(a, b))


def jitter(dice, colour, amount):
    """A colour near `colour`, by at most `amount` a channel and more in common than apart."""
    common = dice.uniform(-amount, amount)
    return tuple(
        min(max(int(c + common + dice.uniform(-amount, amount) * 0.35), 0), 255) for c in colour
    )


def pick(dice, items):
    """One of `items`."""
    return items[int(dice.random() * len(items))]


def spline(points, steps=8, closed=False):
    """A Catmull-Rom curve through `points`."""
    n, out = len(points), []
    for i in range(n if closed else n - 1):
        if closed:
            p, a, b, q = (points[(i + k) % n] for k in (-1, 0, 1, 2))
        else:
            p, a = points[max(i - 1, 0)], points[i]
            b, q = points[i + 1], points[min(i + 2, n - 1)]
        for k in range(steps):
            t = k / steps
            out.append(tuple(
                0.5 * (2 * v + (w - u) * t + (2 * u - 5 * v + 4 * w - z) * t * t
                       + (3 * v - u - 3 * w + z) * t * t * t)
                for u, v, w, z in zip(p, a, b, q)))
    if not closed:
        out.append(tuple(points[-1]))
    return out


def ring(x, y, radius, count, flat=1.0, turn=0.0):
    """The corners of a regular polygon, or of an ellipse with `flat` below or above 1."""
    return [
        (x + radius * math.cos(turn + 2 * math.pi * k / count),
         y + flat * radius * math.sin(turn + 2 * math.pi * k / count))
        for k in range(count)
    ]


def star(x, y, outer, inner, count, turn=0.0):
    """The corners of a star."""
    return [
        (x + r * math.sin(turn + math.pi * k / count), y - r * math.cos(turn + math.pi * k / count))
        for k in range(2 * count) for r in ((outer, inner)[k % 2],)
    ]


def placed(points, x, y, size=1.0, turn=0.0):
    """`points` scaled, turned (radians) and moved."""
    c, s = math.cos(turn) * size, math.sin(turn) * size
    return [(x + c * u - s * v, y + s * u + c * v) for u, v in points]


class Canvas:
    """Coordinates are pixels with y down; a colour is (r, g, b) or a function of y in pixels."""

    def __init__(self, width, height, paper, scale=3):
        self.width, self.height, self.scale = width, height, scale
        self._rows = [bytearray(bytes(paper) * (width * scale)) for _ in range(height * scale)]
        self._clip = None

    def _spans(self, points):
        """Row -> (from, to) sample spans of a polygon, by the non-zero winding rule."""
        s, top = self.scale, len(self._rows)
        crossings = {}
        for i, (x0, y0) in enumerate(points):
            x1, y1 = points[i - 1]
            if y0 == y1:
                continue
            way = 1
            if y0 > y1:
                x0, y0, x1, y1, way = x1, y1, x0, y0, -1
            first = max(math.ceil(y0 * s - 0.5), 0)
            last = min(math.ceil(y1 * s - 0.5), top)
            slope = (x1 - x0) / (y1 - y0)
            x, step = (x0 + ((first + 0.5) / s - y0) * slope) * s, slope
            for row in range(first, last):
                crossings.setdefault(row, []).append((x, way))
                x += step
        wide = self.width * s
        for row, hits in crossings.items():
            hits.sort()
            winding = 0
            for k, (x, way) in enumerate(hits):
                if winding:
                    a = max(math.ceil(hits[k - 1][0] - 0.5), 0)
                    b = min(math.ceil(x - 0.5), wide)
                    if a < b:
                        yield row, a, b
                winding += way

    def clip(self, points=None):
        """Holds what follows inside the polygon; without one, sets it free again."""
        self._clip = None
        if points is None:
            return
        clip = {}
        for row, a, b in self._spans(points):
            clip.setdefault(row, []).append((a, b))
        self._clip = clip

    def _clipped(self, points):
        for row, a, b in self._spans(points):
            if self._clip is None:
                yield row, a, b
                continue
            for c, d in self._clip.get(row, ()):
                if max(a, c) < min(b, d):
                    yield row, max(a, c), min(b, d)

    def polygon(self, points, colour, alpha=1.0):
        """Fills a polygon; below an alpha of 1 it is blended over the present colour."""
        shade = colour if callable(colour) else None
        tables = None
        for row, a, b in self._clipped(points):
            if shade:
                colour, tables = shade(row / self.scale), None
            line = self._rows[row]
            if alpha >= 1.0:
                line[3 * a : 3 * b] = bytes(colour) * (b - a)
                continue
            if tables is None:
                tables = [bytes(int(v + (c - v) * alpha + 0.5) for v in range(256)) for c in colour]
            for k in range(3):
                line[3 * a + k : 3 * b : 3] = line[3 * a + k : 3 * b : 3].translate(tables[k])

    def box(self, x0, y0, x1, y1, colour, alpha=1.0):
        """An upright rectangle."""
        self.polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], colour, alpha)

    def dot(self, x, y, radius, colour, flat=1.0, alpha=1.0):
        """A disc, or an ellipse with `flat`."""
        self.polygon(ring(x, y, radius, 8 + int(radius * 2), flat), colour, alpha)

    def stroke(self, points, width, colour, end=None, closed=False):
        """A line of round joints, `width` pixels wide, narrowing to `end` where that is given."""
        if closed:
            points = list(points) + [points[0]]
        n = max(len(points) - 1, 1)
        end = width if end is None else end
        for k, (x, y) in enumerate(points):
            w = (width + (end - width) * k / n) / 2
            if w > 0.4:
                self.polygon(ring(x, y, w, 8 if w < 3 else 16), colour)
            if k == 0:
                continue
            px, py = points[k - 1]
            pw = (width + (end - width) * (k - 1) / n) / 2
            length = math.hypot(x - px, y - py)
            if length > 0:
                nx, ny = (py - y) / length, (x - px) / length
                self.polygon([(px + nx * pw, py + ny * pw), (x + nx * w, y + ny * w),
                              (x - nx * w, y - ny * w), (px - nx * pw, py - ny * pw)], colour)

    def lay(self, picture):
        """Covers the canvas with a picture of its own size."""
        s = self.scale
        for y in range(self.height):
            line = picture.pixels[y * self.width * 3 : (y + 1) * self.width * 3]
            wide = bytearray(len(line) * s)
            for c in range(3):
                for k in range(s):
                    wide[c + 3 * k :: 3 * s] = line[c::3]
            for k in range(s):
                self._rows[y * s + k] = bytearray(wide)

    def picture(self):
        """The canvas at its own size, each pixel the mean of its samples."""
        s = self.scale
        count, half = s * s, s * s // 2
        out = Picture(self.width, self.height)
        for y in range(self.height):
            rows = self._rows[y * s : (y + 1) * s]
            line = memoryview(out.pixels)[y * self.width * 3 : (y + 1) * self.width * 3]
            for c in range(3):
                columns = [r[c + 3 * k :: 3 * s] for r in rows for k in range(s)]
                line[c::3] = bytes([(v + half) // count for v in map(sum, zip(*columns))])
        return out


def finish(picture, change):
    """Applies change(x, y) -> (factor, offset) to each pixel: paper grain, wear, shading."""
    at, pixels = 0, picture.pixels
    for y in range(picture.height):
        for x in range(picture.width):
            factor, offset = change(x, y)
            for k in (at, at + 1, at + 2):
                v = int(pixels[k] * factor + offset + 0.5)
                pixels[k] = 0 if v < 0 else 255 if v > 255 else v
            at += 3
    return picture
