#!/usr/bin/env python3
"""Compares the assets with their promises, and their generators against their output.

Sizes and counts are the article's; borders and handles follow from Euler's formula for the shapes meant.
"""
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
ASSETS = ROOT / "assets"
PATTERNS = {"cover": (348, 717), "game": (300, 245), "survey": (310, 450), "poems": (250, 294),
            "painting": (336, 252), "mural": (400, 347)}
# Vertices, faces, edges on the border, handles.
MODELS = {"pottery": (1661, 3296, 32, 2), "bust": (4555, 8767, 341, 0), "statue": (21453, 42712, 192, 0)}


def run(script, *arguments):
    """Runs a generator; returns its exit code and what it said."""
    done = subprocess.run([sys.executable, str(ASSETS / script), *map(str, arguments)],
                          capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def chunks(path):
    """The chunks of a PNG file, as (kind, body)."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at = 8
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        (check,) = struct.unpack(">I", data[at + 8 + size : at + 12 + size])
        assert check == zlib.crc32(kind + body), path
        yield kind, body
        at += 12 + size


def inflated(path):
    """A PNG file with its data inflated: equal whatever zlib deflated it."""
    return [(kind, zlib.decompress(body) if kind == b"IDAT" else body) for kind, body in chunks(path)]


def size_of(path):
    kind, body = next(chunks(path))
    assert kind == b"IHDR"
    return struct.unpack(">II", body[:8])


class Obj:
    """What the tests need of an OBJ file."""

    def __init__(self, path):
        self.vertices, self.uvs, self.normals, self.faces, self.others = [], [], [], [], {}
        for line in path.read_text(encoding="ascii").splitlines():
            kind, _, rest = line.partition(" ")
            if kind == "f":
                self.faces.append([[int(n) for n in corner.split("/")] for corner in rest.split()])
            elif kind in ("v", "vt", "vn"):
                values = [float(n) for n in rest.split()]
                {"v": self.vertices, "vt": self.uvs, "vn": self.normals}[kind].append(values)
            else:
                self.others[kind] = rest

    def edges(self):
        """(edges, of these on the border, directed edges that occur twice)."""
        directed, twice = set(), 0
        for face in self.faces:
            for i in range(3):
                edge = (face[i][0], face[(i + 1) % 3][0])
                twice += edge in directed
                directed.add(edge)
        border = sum((b, a) not in directed for a, b in directed)
        return (len(directed) + border) // 2, border, twice

    def volume(self):
        """Signed, about the first vertex's foot: positive where faces look outwards."""
        total = 0.0
        ox, oy, _ = self.vertices[0][:3]
        for face in self.faces:
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (
                (x - ox, y - oy, z) for x, y, z in (self.vertices[c[0] - 1][:3] for c in face))
            total += ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
        return total / 6


class Patterns(unittest.TestCase):
    def test_sizes(self):
        for name, size in PATTERNS.items():
            path = ASSETS / "patterns" / (name + ".png")
            self.assertEqual(size_of(path), size, name)
            self.assertLess(path.stat().st_size, 1 << 20, name)

    def test_no_flat_ground(self):
        """Hardly any 16-pixel cell without contrast: there is something to recognise everywhere."""
        sys.dont_write_bytecode = True
        sys.path.insert(0, str(ASSETS))
        from kit import png
        for name, (width, height) in PATTERNS.items():
            picture = png.read(ASSETS / "patterns" / (name + ".png"))
            flat = cells = 0
            for top in range(0, height - 15, 16):
                for left in range(0, width - 15, 16):
                    greens = [picture.pixels[(y * width + x) * 3 + 1]
                              for y in range(top, top + 16) for x in range(left, left + 16)]
                    cells += 1
                    flat += max(greens) - min(greens) < 24
            self.assertLess(flat, 0.22 * cells, name)

    def test_same_again(self):
        with tempfile.TemporaryDirectory() as folder:
            code, words = run("make_patterns.py", "poems", "--out", folder)
            self.assertEqual(code, 0, words)
            self.assertEqual(inflated(pathlib.Path(folder) / "poems.png"),
                             inflated(ASSETS / "patterns" / "poems.png"))


class Models(unittest.TestCase):
    def test_shapes(self):
        for name, (vertices, faces, border, handles) in MODELS.items():
            with self.subTest(name):
                model = Obj(ASSETS / "models" / (name + ".obj"))
                self.assertEqual((len(model.vertices), len(model.faces)), (vertices, faces))
                edges, on_border, twice = model.edges()
                self.assertEqual((on_border, twice), (border, 0))
                self.assertEqual(vertices - edges + faces, 1 - 2 * handles)
                used = {corner[0] for face in model.faces for corner in face}
                self.assertEqual(used, set(range(1, vertices + 1)))
                self.assertGreater(model.volume(), 0)
                heights = [v[2] for v in model.vertices]
                self.assertEqual(min(heights), 0)
                self.assertGreater(max(heights), max(v[0] for v in model.vertices))

    def test_attributes(self):
        for name, normals in (("pottery", True), ("bust", False)):
            model = Obj(ASSETS / "models" / (name + ".obj"))
            self.assertEqual(bool(model.normals), normals)
            for face in model.faces:
                for corner in face:
                    self.assertEqual(len(corner), 3 if normals else 2)
                    self.assertTrue(1 <= corner[1] <= len(model.uvs))
            self.assertTrue(all(0 <= u <= 1 and 0 <= v <= 1 for u, v in model.uvs))
            self.assertTrue(all(abs(math.hypot(*n) - 1) < 0.002 for n in model.normals))
            library = (ASSETS / "models" / model.others["mtllib"]).read_text(encoding="ascii")
            picture = library.split("map_Kd ")[1].split()[0]
            self.assertEqual(size_of(ASSETS / "models" / picture), (512, 512))
            self.assertIn("newmtl " + model.others["usemtl"] + "\n", library)
        statue = Obj(ASSETS / "models" / "statue.obj")
        self.assertTrue(all(len(v) == 6 and all(0 <= c <= 1 for c in v[3:]) for v in statue.vertices))
        self.assertFalse(statue.uvs)

    def test_same_again(self):
        with tempfile.TemporaryDirectory() as folder:
            code, words = run("make_models.py", "pottery", "--out", folder)
            self.assertEqual(code, 0, words)
            made, kept = pathlib.Path(folder), ASSETS / "models"
            for name in ("pottery.obj", "pottery.mtl"):
                self.assertEqual((made / name).read_bytes(), (kept / name).read_bytes(), name)
            self.assertEqual(inflated(made / "pottery.png"), inflated(kept / "pottery.png"))


class Church(unittest.TestCase):
    def make(self, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "church.obj"
            code, words = run("make_church.py", path, *arguments)
            self.assertEqual(code, 0, words)
            return Obj(path)

    def test_exact_counts(self):
        church = self.make("--vertices", 5000, "--faces", 9377)
        self.assertEqual((len(church.vertices), len(church.faces)), (5000, 9377))
        edges, border, twice = church.edges()
        self.assertEqual(twice, 0)
        # Nine open discs: 2 V - F = B + 2 * 9.
        self.assertEqual(border, 2 * 5000 - 9377 - 18)
        self.assertEqual(5000 - edges + 9377, 9)
        self.assertGreater(church.volume(), 0)

    def test_any_size_and_place(self):
        church = self.make("--vertices", 1777, "--utm", "--no-colours")
        self.assertEqual(len(church.vertices), 1777)
        self.assertTrue(all(len(v) == 3 and v[1] > 4e6 and v[0] > 5e5 for v in church.vertices))

    def test_refuses(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "church.obj"
            code, words = run("make_church.py", path, "--vertices", 5000, "--faces", 5000)
            self.assertEqual(code, 2)
            self.assertIn("do not go together", words)
            self.assertFalse(path.exists())


class Clip(unittest.TestCase):
    WIDTH, HEIGHT, FRAMES = 160, 120, 16

    def render(self, folder):
        green = pathlib.Path(folder) / "green.png"
        rows = (b"\x00" + b"\x00\xff\x00" * 60) * 80
        with open(green, "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
            for kind, body in ((b"IHDR", struct.pack(">IIBBBBB", 60, 80, 8, 2, 0, 0, 0)),
                               (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
                file.write(struct.pack(">I", len(body)) + kind + body)
                file.write(struct.pack(">I", zlib.crc32(kind + body)))
        out = pathlib.Path(folder) / "clip"
        code, words = run("make_clip.py", "--pattern", green, "--frames", self.FRAMES, "--size",
                          f"{self.WIDTH}x{self.HEIGHT}", out)
        self.assertEqual(code, 0, words)
        return out

    def green_pixels(self, path):
        from kit import png
        picture = png.read(path)
        self.assertEqual((picture.width, picture.height), (self.WIDTH, self.HEIGHT))
        found = []
        for i in range(self.WIDTH * self.HEIGHT):
            r, g, b = picture.pixels[3 * i : 3 * i + 3]
            if g > 110 and r < 30 and b < 30:
                found.append((i % self.WIDTH, i // self.WIDTH))
        return found

    def test_truth(self):
        """A green sheet: the frame's green pixels have the area and the middle that the truth tells."""
        sys.path.insert(0, str(ASSETS))
        with tempfile.TemporaryDirectory() as folder:
            out = self.render(folder)
            lines = (out / "truth.csv").read_text(encoding="ascii").splitlines()[1:]
            self.assertEqual(len(lines), self.FRAMES)
            checked = gone = 0
            for line in lines[:12]:
                values = line.split(",")
                found = self.green_pixels(out / f"frame_{int(values[0]):05d}.png")
                if values[-1] == "0":
                    gone += 1
                    self.assertLess(len(found), 20)
                    continue
                n = [float(v) for v in values[1:9]]
                quad = list(zip(n[0::2], n[1::2]))
                if not all(0 < x < self.WIDTH - 1 and 0 < y < self.HEIGHT - 1 for x, y in quad):
                    continue
                crosses = [(a[0] * b[1] - b[0] * a[1], a, b) for a, b in zip(quad, quad[1:] + quad[:1])]
                area = sum(c for c, _, _ in crosses) / 2
                self.assertGreater(area, 0)
                middle = [sum(c * (a[k] + b[k]) for c, a, b in crosses) / (6 * area) for k in (0, 1)]
                self.assertLess(abs(len(found) - area) / area, 0.03, line)
                for k in (0, 1):
                    mean = sum(p[k] for p in found) / len(found)
                    self.assertLess(abs(mean - middle[k]), 0.35, line)
                checked += 1
            self.assertGreater(checked, 4)
            self.assertGreater(gone, 0)


class Commands(unittest.TestCase):
    def test_help(self):
        for script in ("make_patterns.py", "make_models.py", "make_church.py", "make_clip.py"):
            code, words = run(script, "--help")
            self.assertEqual(code, 0, words)
            self.assertIn("usage: " + script, words)

    def test_unknown_names(self):
        self.assertEqual(run("make_patterns.py", "nothing")[0], 2)
        self.assertEqual(run("make_models.py", "nothing")[0], 2)


if __name__ == "__main__":
    unittest.main()
