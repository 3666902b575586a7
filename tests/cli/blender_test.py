"""The add-on of Blender: a scene exported and baked is where Blender has it."""
import json
import os
import shutil
import subprocess
import sys
import unittest

from programs import BIN, ROOT, ProgramTest, picture

sys.path.insert(0, str(ROOT / "scripts"))
from bundle_bytes import Bundle  # noqa: E402
from bundle_models import check_layout, decode_level  # noqa: E402

ADDON = ROOT / "bake" / "extensions" / "blender" / "modar_export.py"
# Blender's Python finds its modules by PATH: Debian's.
ENVIRONMENT = {**os.environ, "PATH": f"{BIN}:/usr/bin:/bin"}
# A picture 0.2 x 0.15 m, turned and moved; a wedge and an animated cube on it. Prints the vertices in millimetres on the pattern,
# by matrices of its own, and the matrices of all objects before and after the export.
SCENE = """
import json, math, runpy, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
addon, folder, image = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.mesh.primitive_plane_add(size=1, location=(0.3, -0.2, 0.1), rotation=(0.4, 0.2, 1.1), scale=(0.2, 0.15, 1))
plane = bpy.context.object
plane.scale = (0.2, 0.15, 1)
plane.name = "pattern"
material = bpy.data.materials.new("print")
material.use_nodes = True
texture = material.node_tree.nodes.new("ShaderNodeTexImage")
texture.image = bpy.data.images.load(image)
plane.data.materials.append(material)
mesh = bpy.data.meshes.new("wedge")
mesh.from_pydata([(0, 0, 0), (0.11, 0.01, 0), (0.02, 0.07, 0), (0.03, 0.02, 0.09)], [], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
wedge = bpy.data.objects.new("wedge", mesh)
bpy.context.scene.collection.objects.link(wedge)
wedge.location, wedge.rotation_euler, wedge.scale = (0.31, -0.16, 0.15), (0.3, 0.1, -0.7), (1, 1.2, 0.8)
bpy.ops.mesh.primitive_cube_add(size=0.03, location=(0.25, -0.25, 0.14))
cube = bpy.context.object
cube.keyframe_insert("location", frame=1)
cube.location.z += 0.05
cube.keyframe_insert("location", frame=20)
bpy.context.scene.frame_set(1)
bpy.context.view_layer.update()
matrices = lambda: {each.name: [list(row) for row in each.matrix_world] for each in bpy.data.objects}
before = matrices()
place, turn, scale = plane.matrix_world.decompose()
points = []
for each in (wedge, cube):
    for vertex in each.data.vertices:
        world = each.matrix_world @ vertex.co
        points.append([1000 * x for x in turn.inverted() @ (world - place)])
module = runpy.run_path(addon, run_name="addon")
module["register"]()
assert bpy.ops.export_scene.modar(directory=folder, bake=True) == {"FINISHED"}
bpy.context.view_layer.update()
module["unregister"]()
print("TOLD " + json.dumps({"points": points, "before": before, "after": matrices()}))
"""


@unittest.skipUnless(shutil.which("blender"), "blender is not installed")
class Blender(ProgramTest):
    def test_a_scene_is_where_blender_has_it(self):
        picture(self.folder / "print.png")
        (self.folder / "scene.py").write_text(SCENE)
        project = self.folder / "project"
        done = subprocess.run(["blender", "-b", "--python-exit-code", "9", "--python", self.folder / "scene.py", "--", ADDON, project, self.folder / "print.png"],
                              capture_output=True, text=True, env=ENVIRONMENT)
        self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-2000:])
        told = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("TOLD "))[5:])
        for name, matrix in told["before"].items():
            for got, wanted in zip(sum(told["after"][name], []), sum(matrix, []), strict=True):
                self.assertAlmostEqual(got, wanted, delta=1e-6, msg=name)
        self.assertNotIn("modar", told["after"])
        bundle = Bundle(next((project / "out").glob("*.modar")).read_bytes())
        tables = bundle.tables
        pattern, model, scene = (tables[kind][0] for kind in ("patterns", "models", "scenes"))
        self.assertAlmostEqual(pattern["width_mm"], 200, 3)
        for row in tables["layouts"]:
            check_layout(bundle, row)
        layout = tables["layouts"][model["layout"]]
        x, y, z, w = scene["rotation"]
        placed = []
        for chunk in tables["chunks"]:
            level = decode_level(bundle, layout, chunk, tables["levels"][chunk["first_level"]], True)
            for p in level["used"]:
                t = [2 * (y * p[2] - z * p[1]), 2 * (z * p[0] - x * p[2]), 2 * (x * p[1] - y * p[0])]
                turned = [p[0] + w * t[0] + y * t[2] - z * t[1], p[1] + w * t[1] + z * t[0] - x * t[2], p[2] + w * t[2] + x * t[1] - y * t[0]]
                placed.append([(scene["scale"] * a + b) * pattern["width_mm"] / 2 / pattern["half_width"] for a, b in zip(turned, scene["offset"])])
        for point in told["points"]:
            self.assertLess(min(max(abs(a - b) for a, b in zip(point, each)) for each in placed), 0.1, point)
        self.assertIn(b"animations", (project / "scene.glb").read_bytes())

    def test_a_scene_without_a_pattern(self):
        done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "9", "--python", ADDON, "--", self.folder / "none"],
                              capture_output=True, text=True, env=ENVIRONMENT)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn('name the plane', done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
