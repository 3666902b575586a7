"""`modar inspect`: the documented keys, and files that other tools read."""
import json
import re
import shutil
import struct
import subprocess
import unittest
import zipfile

from programs import COVER, POTTERY, QUICK, ROOT, ProgramTest

KEYS = {
    "models": {"name", "vertices", "triangles", "chunks", "lods", "materials", "bytes", "bytes_per_triangle", "layout",
               "diagonal", "position_error_max", "position_error_rms", "normal_error_max_deg", "uv_error_max_texels"},
    "textures": {"name", "width", "height", "levels", "bytes", "psnr_db", "alpha"},
    "patterns": {"name", "width", "height", "width_mm", "score", "keypoints"},
    "scenes": {"pattern", "model", "scale"},
}


class Inspect(ProgramTest):
    def test_the_keys_are_a_contract(self):
        report = self.modar_json("inspect", self.bake_demo())
        self.assertEqual(report["format"], {"major": 1, "minor": 3})
        for table, keys in KEYS.items():
            self.assertEqual(len(report[table]), 1, table)
            self.assertLessEqual(keys, set(report[table][0]), table)
        self.assertEqual(set(report["patterns"][0]["keypoints"]), {"orb-2000"})

    def test_the_error_is_that_of_half_floats(self):
        # Half floats in [-1,1] have steps of at most 2^-11: an error of at most 2^-12 an axis and side.
        model = self.modar_json("inspect", self.bake_demo())["models"][0]
        bound = model["scale"] * 2 ** -12 * 3 ** 0.5
        self.assertGreater(model["position_error_max"], 0)
        self.assertLessEqual(model["position_error_max"], bound * (1 + 1e-9))
        self.assertLess(model["position_error_rms"], model["position_error_max"])

    def test_the_second_reader_agrees(self):
        bundle = self.bake_demo()
        ours = self.modar_json("inspect", bundle)
        done = subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", bundle, "--json"], capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        theirs = json.loads(done.stdout)
        self.assertEqual([m["name"] for m in theirs["models"]], [m["name"] for m in ours["models"]])
        self.assertEqual([m["vertex_count"] for m in theirs["models"]], [m["vertices"] for m in ours["models"]])


    def test_a_folder_of_other_files_is_left_alone(self):
        bundle = self.bake_demo()
        out = self.folder / "www"
        out.mkdir()
        (out / "pottery.glb").write_text("mine")
        self.assert_fails(self.modar("inspect", bundle, "--extract", out), 1, "out.foreign-folder", "--force")
        self.assertEqual([(file.name, file.read_text()) for file in out.iterdir()], [("pottery.glb", "mine")])
        for words in (["--force"], []):  # then it is a folder of modar's
            self.assertEqual(self.modar("inspect", bundle, "--extract", out, *words).returncode, 0)
        self.assertTrue((out / "pottery.glb").read_bytes().startswith(b"glTF"))

    def test_the_second_reader_warns_of_grids(self):
        done = subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", ROOT / "tests/corrupt/CHUNK_GRID.modar"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("warning: CHUNK_GRID", done.stderr)


class Extract(ProgramTest):
    def setUp(self):
        super().setUp()
        self.out = self.folder / "extracted"
        done = self.modar("inspect", self.bake_demo(), "--extract", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_model_is_a_glb(self):
        data = (self.out / "pottery.glb").read_bytes()
        magic, version, length, json_length, json_magic = struct.unpack_from("<4sIII4s", data)
        self.assertEqual((magic, version, length, json_magic), (b"glTF", 2, len(data), b"JSON"))
        document = json.loads(data[20:20 + json_length])
        triangles = sum(document["accessors"][p["indices"]]["count"] // 3
                        for m in document["meshes"] for p in m["primitives"])
        self.assertEqual(triangles, 3296)  # Table 3 of the article: POTTERY
        self.assertEqual(len(document["images"]), 1)

    def test_what_stands_on_a_picture_is_a_usdz(self):
        bundle, out = self.folder / "tall.modar", self.folder / "tall"
        self.modar_json("bake", "--model", POTTERY, "--pattern", f"{COVER}:210mm", "--scene", "cover=pottery,height=120mm,offset=0:30mm:5mm",
                        "-o", bundle, *QUICK)
        self.assertEqual(self.modar("inspect", bundle, "--extract", out).returncode, 0)
        path = out / "cover.usdz"
        with zipfile.ZipFile(path) as archive:
            self.assertIsNone(archive.testzip())
            names = archive.namelist()
            self.assertEqual(names, ["Model.usda", "textures/0.jpg"])
            for entry in archive.infolist():  # stored, each file at a multiple of 64 bytes: the USDZ specification
                name, extra = struct.unpack_from("<HH", path.read_bytes(), entry.header_offset + 26)
                self.assertEqual((entry.compress_type, (entry.header_offset + 30 + name + extra) % 64), (zipfile.ZIP_STORED, 0))
            usda, picture = archive.read(names[0]).decode(), archive.read(names[1])
        self.assertIn("metersPerUnit = 1\n    upAxis = \"Y\"", usda)
        self.assertTrue(picture.startswith(b"\xff\xd8") and picture.endswith(b"\xff\xd9"))

        def values(what):
            return [tuple(map(float, v.split(","))) for text in re.findall(what + r" = \[(.*?)\]", usda)
                    for v in re.findall(r"\(([^()]*)\)", text)]

        points, normals, uvs = values(r"point3f\[\] points"), values(r"normal3f\[\] normals"), values(r"primvars:st")
        counts = [len(text.split(",")) for text in re.findall(r"faceVertexIndices = \[(.*?)\]", usda)]
        self.assertEqual(sum(counts) // 3, 3296)
        self.assertEqual(len(points), len(normals))
        self.assertEqual(len(points), len(uvs))
        low, high = [min(p[i] for p in points) for i in range(3)], [max(p[i] for p in points) for i in range(3)]
        # 120 mm high, 5 mm above the ground, 30 mm towards the picture's top, which is away from who looks.
        for got, wanted in ((low[1], 0.005), (high[1], 0.125), ((low[0] + high[0]) / 2, 0), ((low[2] + high[2]) / 2, -0.03)):
            self.assertAlmostEqual(got, wanted, delta=0.0005)
        for normal in normals[::50]:
            self.assertAlmostEqual(sum(n * n for n in normal), 1, delta=1e-4)
        # The same surface: corners of each triangle turn around its normals.
        indices = [int(i) for i in re.search(r"faceVertexIndices = \[(.*?)\]", usda)[1].split(",")]
        turned = 0
        for a, b, c in zip(indices[::3], indices[1::3], indices[2::3]):
            u, v = ([points[k][i] - points[a][i] for i in range(3)] for k in (b, c))
            cross = [u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3] for i in range(3)]
            turned += sum(x * n for x, n in zip(cross, normals[a])) > 0
        self.assertGreater(turned / (len(indices) // 3), 0.99)

    def test_the_glb_bakes_to_the_same_model(self):
        source = self.modar_json("inspect", self.bake_demo())["models"][0]
        out = self.folder / "again.modar"
        report = self.modar_json("bake", "--model", self.out / "pottery.glb", "--no-lods", "--max-texture", "16", "-o",
                                 out)
        again = report["bundle"]["models"][0]
        for key in ("triangles", "vertices", "chunks", "layout"):
            self.assertEqual(again[key], source[key], key)
        # Twice rounded to halves, floats between.
        bound = 2.1 * source["position_error_max"]
        self.assertAlmostEqual(again["diagonal"], source["diagonal"], delta=2 * bound)
        self.assertAlmostEqual(again["scale"], source["scale"], delta=bound)
        for a, b in zip(again["center"], source["center"]):
            self.assertAlmostEqual(a, b, delta=bound)

        def points(model, bundle):
            done = subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", bundle, "--json", "--full"],
                                  capture_output=True, text=True, check=True)
            values = json.loads(done.stdout)["levels"][0]["positions_values"]
            return [[c + model["scale"] * v for c, v in zip(model["center"], p)] for p in values]

        theirs = points(again, out)
        cells = {}
        for p in theirs:
            cells.setdefault(tuple(round(x / (4 * bound)) for x in p), []).append(p)
        for p in points(source, self.bake_demo("source.modar"))[::7]:
            cell = tuple(round(x / (4 * bound)) for x in p)
            near = [q for dx in (-1, 0, 1) for dy in (-1, 0, 1) for dz in (-1, 0, 1)
                    for q in cells.get((cell[0] + dx, cell[1] + dy, cell[2] + dz), [])]
            self.assertTrue(any(sum((a - b) ** 2 for a, b in zip(p, q)) <= bound ** 2 for q in near), p)

    def test_etc1tool_reads_the_textures(self):
        if shutil.which("etc1tool") is None:
            self.skipTest("no etc1tool here")
        files = sorted(self.out.glob("*.pkm"))
        self.assertGreater(len(files), 5)
        for file in files[:3]:
            png = self.folder / "decoded.png"
            subprocess.run(["etc1tool", file, "--decode", "-o", png], check=True, capture_output=True)
            width, height = struct.unpack(">II", png.read_bytes()[16:24])
            self.assertEqual((width, height), struct.unpack(">HH", file.read_bytes()[12:16]))

    def test_the_features_are_opencv_yml(self):
        names = sorted(file.name for file in self.out.glob("*.yml"))
        self.assertEqual(names, ["cover.orb-2000.yml"])
        text = (self.out / "cover.orb-2000.yml").read_text()
        self.assertTrue(text.startswith("%YAML:1.0"))
        self.assertIn("keypoints:", text)
        self.assertIn("descriptors: !!opencv-matrix", text)


if __name__ == "__main__":
    unittest.main()
