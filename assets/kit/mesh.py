"""Triangle meshes: rings and their stitches, exact counts by splitting edges, OBJ files."""
import math


class Mesh:
    """Positions (x, y, z), texture points (u, v), colours, and faces of three corners.

    A corner is (position, texture point); the texture index is None where a mesh has none.
    """

    def __init__(self):
        self.points, self.uvs, self.colours, self.faces = [], [], [], []

    def band(self, low, high, low_uv=None, high_uv=None):
        """Two triangles for each step along two closed rings of equal length.

        A ring of n points may have n + 1 texture points, where a seam parts first from last.
        Faces wind counter-clockwise as seen from where `low` runs to the right under `high`.
        """
        n = len(low)
        for j in range(n):
            k = (j + 1) % n
            a, b, c, d = low[j], low[k], high[k], high[j]
            if low_uv is None:
                ta = tb = tc = td = None
            else:
                ta, tb, tc, td = low_uv[j], low_uv[j + 1], high_uv[j + 1], high_uv[j]
            if self._shorter(a, c, b, d):
                self.faces += [((a, ta), (b, tb), (c, tc)), ((a, ta), (c, tc), (d, td))]
            else:
                self.faces += [((a, ta), (b, tb), (d, td)), ((b, tb), (c, tc), (d, td))]

    def _shorter(self, a, c, b, d):
        p = self.points
        return round(math.dist(p[a], p[c]), 9) <= round(math.dist(p[b], p[d]), 9)

    def doubling(self, low, high, low_uv=None, high_uv=None):
        """Three triangles for each step of `high`; `low` has twice as many points."""
        n = len(high)
        for j in range(n):
            k = (j + 1) % n
            a, m, b = low[2 * j], low[2 * j + 1], low[(2 * j + 2) % len(low)]
            if low_uv is None:
                ta = tm = tb = tc = td = None
            else:
                ta, tm, tb = low_uv[2 * j : 2 * j + 3]
                tc, td = high_uv[j + 1], high_uv[j]
            c, d = high[k], high[j]
            self.faces += [((a, ta), (m, tm), (d, td)), ((m, tm), (c, tc), (d, td)),
                           ((m, tm), (b, tb), (c, tc))]

    def cap(self, ring, pole, ring_uv=None, pole_uv=None):
        """A fan from `ring` to the point `pole`."""
        for j, a in enumerate(ring):
            b = ring[(j + 1) % len(ring)]
            if ring_uv is None:
                self.faces.append(((a, None), (b, None), (pole, None)))
            else:
                self.faces.append(((a, ring_uv[j]), (b, ring_uv[j + 1]), (pole, pole_uv[j])))

    def _middle(self, one, two):
        def mean(p, q):
            return tuple((s + t) / 2 for s, t in zip(p, q))
        self.points.append(mean(self.points[one[0]], self.points[two[0]]))
        if self.colours:
            self.colours.append(mean(self.colours[one[0]], self.colours[two[0]]))
        if one[1] is None:
            return len(self.points) - 1, None
        self.uvs.append(mean(self.uvs[one[1]], self.uvs[two[1]]))
        return len(self.points) - 1, len(self.uvs) - 1

    def split(self, count, on_border):
        """Splits the `count` longest edges inside (or on the border), no two of one face."""
        sides = {}
        for f, face in enumerate(self.faces):
            for i in range(3):
                a, b = face[i], face[(i + 1) % 3]
                sides.setdefault((min(a[0], b[0]), max(a[0], b[0])), []).append((f, i))
        lengths = []
        for (a, b), uses in sides.items():
            if len(uses) != (1 if on_border else 2):
                continue
            corners = [{self.faces[f][i], self.faces[f][(i + 1) % 3]} for f, i in uses]
            if corners[0] == corners[-1]:  # an edge of the seam would need two texture points
                lengths.append((-round(math.dist(self.points[a], self.points[b]), 9), a, b, uses))
        touched, done = set(), 0
        for _, _, _, uses in sorted(lengths):
            if done == count:
                break
            if any(f in touched for f, _ in uses):
                continue
            f, i = uses[0]
            middle = self._middle(self.faces[f][i], self.faces[f][(i + 1) % 3])
            for f, i in uses:
                a, b, c = (self.faces[f][(i + k) % 3] for k in range(3))
                self.faces[f] = (a, middle, c)
                self.faces.append((middle, b, c))
                touched.add(f)
            done += 1
        if done != count:
            raise ValueError(f"only {done} of {count} edges could be split")

    def normals(self):
        """A unit normal a point, the mean of its faces' by area."""
        sums = [[0.0, 0.0, 0.0] for _ in self.points]
        for face in self.faces:
            n = cross_of(*(self.points[corner[0]] for corner in face))
            for index, _ in face:
                for k in range(3):
                    sums[index][k] += n[k]
        return [unit(n) for n in sums]


def cross_of(a, b, c):
    """Twice the area of a triangle as a vector."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)


def unit(v):
    """v at length 1."""
    length = math.sqrt(sum(x * x for x in v)) or 1.0
    return tuple(x / length for x in v)


def number(value, places):
    """A decimal without needless noughts, and never a minus nought."""
    text = f"{value:.{places}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def write_obj(path, mesh, comment, places, material=None, with_normals=False):
    """Writes an OBJ file; `material` is (library, name)."""
    def row(kind, values, decimals):
        return kind + " " + " ".join(number(v, decimals) for v in values) + "\n"

    with open(path, "w", encoding="ascii", newline="\n") as file:
        for line in comment.splitlines():
            file.write("# " + line + "\n")
        if material:
            file.write(f"mtllib {material[0]}\n")
        for i, point in enumerate(mesh.points):
            line = row("v", point, places)
            if mesh.colours:
                line = line[:-1] + row("", mesh.colours[i], 2)
            file.write(line)
        for uv in mesh.uvs:
            file.write(row("vt", uv, 4))
        if with_normals:
            for normal in mesh.normals():
                file.write(row("vn", normal, 3))
        if material:
            file.write(f"usemtl {material[1]}\n")
        for face in mesh.faces:
            corners = []
            for p, t in face:
                corner = f"{p + 1}" if t is None else f"{p + 1}/{t + 1}"
                corners.append(corner + (f"/{p + 1}" if with_normals else ""))
            file.write("f " + " ".join(corners) + "\n")


def write_mtl(path, name, picture):
    """Writes a library of one material, whose colour is a picture."""
    with open(path, "w", encoding="ascii", newline="\n") as file:
        file.write(f"newmtl {name}\nKa 0.2 0.2 0.2\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {picture}\n")
