"""A reading of UsdSkel, for tests: where the animated meshes of a USDZ file are, from the specification and not from the writer."""
import re
import zipfile


def numbers(text):
    return [float(each) for each in re.findall(r"-?[\d.]+(?:e[-+]?\d+)?", text)]


def tuples(text):
    return [numbers(each) for each in re.findall(r"\(([^()]*)\)", text)]


def value(text, name):
    return re.search(re.escape(name) + r" = \[(.*?)\]\s", text, re.S)[1]


def mixed(a, b, share):
    return [x + share * (y - x) for x, y in zip(a, b)]


def turned(scale, turn, way, p):
    """Scaled, turned by a quaternion (w, x, y, z), moved."""
    norm = sum(q * q for q in turn) ** 0.5
    w, v = turn[0] / norm, [q / norm for q in turn[1:]]
    p = [s * x for s, x in zip(scale, p)]
    cross = [v[i - 2] * p[i - 1] - v[i - 1] * p[i - 2] for i in range(3)]
    again = [v[i - 2] * cross[i - 1] - v[i - 1] * cross[i - 2] for i in range(3)]
    return [x + 2 * (w * c + a) + t for x, c, a, t in zip(p, cross, again, way)]


def rows(text):
    """Of USD's matrices, points being rows in front of them."""
    return tuples(text)


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(m):
    wide = [[*row, *(float(i == j) for j in range(4))] for i, row in enumerate(m)]
    for i in range(4):
        best = max(range(i, 4), key=lambda k: abs(wide[k][i]))
        wide[i], wide[best] = wide[best], wide[i]
        wide[i] = [x / wide[i][i] for x in wide[i]]
        for k in range(4):
            if k != i:
                wide[k] = [x - wide[k][i] * y for x, y in zip(wide[k], wide[i])]
    return [row[4:] for row in wide]


class Skeleton:
    def __init__(self, path):
        with zipfile.ZipFile(path) as archive:
            text = archive.read("Model.usda").decode()
        self.rate = float(re.search(r"timeCodesPerSecond = (\S+)", text)[1])
        self.end = float(re.search(r"endTimeCode = (\S+)", text)[1])
        joints, shapes = (re.findall(r'"([\w/]+)"', value(text, name)) for name in ("uniform token[] joints", "uniform token[] blendShapes"))
        self.shape = {name: i for i, name in enumerate(shapes)}
        self.samples = {name: [body for _, body in re.findall(r"(\d+): \[(.*?)\],\n", re.search(re.escape(name) + r"\.timeSamples = {(.*?)}", text, re.S)[1])]
                        for name in ("translations", "rotations", "scales", "blendShapeWeights")}
        self.parents = [joints.index(path.rpartition("/")[0]) if "/" in path else None for path in joints]
        self.unbound = [inverse(rows(each)) for each in re.findall(r"\((\(.*?\))\)", value(text, "bindTransforms"))]
        self.meshes = []
        for mesh in re.findall(r'def Mesh "\w+".*?subdivisionScheme', text, re.S):
            named = re.search(r"skel:blendShapes = \[(.*?)\]", mesh)
            self.meshes.append((tuples(value(mesh, "point3f[] points")), [int(i) for i in numbers(value(mesh, "skel:jointIndices"))],
                                numbers(value(mesh, "skel:jointWeights")),
                                list(zip(re.findall(r'"(\w+)"', named[1]) if named else [], map(tuples, re.findall(r"offsets = \[(.*?)\]\s", mesh, re.S))))))

    def at(self, seconds):
        """Points of all meshes, in the space of the skeleton."""
        frame = seconds * self.rate
        first = min(int(frame), int(self.end) - 1)

        def sample(name, read):
            low, high = (read(self.samples[name][k]) for k in (first, first + 1))
            return low, high
        ways, turns, scales = ([mixed(a, b, frame - first) for a, b in zip(*sample(name, tuples))] for name in ("translations", "rotations", "scales"))
        weights = mixed(*sample("blendShapeWeights", numbers), frame - first)
        world = []
        for parent, way, turn, scale in zip(self.parents, ways, turns, scales):
            zero = [0, 0, 0]
            own = [[*turned(scale, turn, zero, [float(i == k) for i in range(3)]), 0] for k in range(3)] + [[*way, 1]]
            world.append(own if parent is None else product(own, world[parent]))
        skin = [product(unbound, each) for unbound, each in zip(self.unbound, world)]
        points = []
        for rest, joints, shares, shapes in self.meshes:
            for v, point in enumerate(rest):
                p = [x + sum(weights[self.shape[name]] * offsets[v][i] for name, offsets in shapes) for i, x in enumerate(point)]
                points.append([sum(share * sum(x * skin[j][k][i] for k, x in enumerate((*p, 1)))
                                   for j, share in zip(joints[4 * v:4 * v + 4], shares[4 * v:4 * v + 4]) if share) for i in range(3)])
        return points
