"""Add-on of Blender: exports a scene to a ModAR project, bakes it, and opens its page.

blender -b scene.blend --python modar_export.py -- FOLDER does the same without a window.
"""
import pathlib
import shutil
import subprocess
import sys

import bpy
from bpy.props import BoolProperty, StringProperty
from mathutils import Vector

bl_info = {"name": "ModAR project", "author": "The ModAR maintainers", "version": (0, 1, 0), "blender": (3, 4, 0),
           "location": "File > Export > ModAR project", "category": "Import-Export"}
TOML = """# Exported by Blender: the scene is in metres, the pattern in its true size.
[bake]
unit = "m"

[[model]]
file = "scene.glb"

[[pattern]]
file = "{picture}"
name = "pattern"
width = "{width:.6f}mm"

[[scene]]
pattern = "pattern"
model = "scene"
scale = {scale:.12g}
up = "y"
centred = true
offset = [{offset[0]:.6f}, {offset[1]:.6f}, {offset[2]:.6f}]
"""


def image_of(thing):
    """The picture on a plane: that of the first image texture of its material."""
    for slot in thing.material_slots:
        for node in slot.material.node_tree.nodes if slot.material and slot.material.use_nodes else ():
            if node.type == "TEX_IMAGE" and node.image:
                return node.image
    return None


def pattern_of(scene):
    """The plane that represents the pattern: the mesh named "pattern" or, without one, the only flat rectangle with a picture."""
    meshes = [each for each in scene.objects if each.type == "MESH"]
    named = [each for each in meshes if each.name.lower() == "pattern"]
    flat = [each for each in meshes if len(each.data.vertices) == 4 and each.dimensions.z < 1e-6 and image_of(each)]
    found = named or flat
    if len(found) != 1 or not image_of(found[0]):
        raise RuntimeError('name the plane that has the printed picture as its texture "pattern"')
    return found[0]


def frame_of(plane):
    """Pattern space in metres to the world: the plane's middle, x right, y up, z towards the viewer; and its width and height."""
    corners = [Vector(corner) for corner in plane.bound_box]
    middle = sum(corners, Vector()) / 8
    place, turn, scale = plane.matrix_world.decompose()
    frame = turn.to_matrix().to_4x4()
    frame.translation = plane.matrix_world @ middle
    sides = [abs(scale[i]) * (max(c[i] for c in corners) - min(c[i] for c in corners)) for i in range(2)]
    return frame, sides


def box_of(things, to_pattern):
    """The least and greatest corner of all their vertices in pattern space, with modifiers, in this frame."""
    graph, points = bpy.context.evaluated_depsgraph_get(), []
    for thing in things:
        drawn = thing.evaluated_get(graph)
        mesh = drawn.to_mesh()
        matrix = to_pattern @ drawn.matrix_world
        points += [matrix @ vertex.co for vertex in mesh.vertices]
        drawn.to_mesh_clear()
    if not points:
        raise RuntimeError("the scene has nothing but the pattern")
    return [Vector([side(point[i] for point in points) for i in range(3)]) for side in (min, max)]


def export_models(things, to_pattern, path):
    """All objects but the pattern in one GLB, moved to pattern space by a parent; animated ones move in it."""
    parent = bpy.data.objects.new("modar", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.matrix_world = to_pattern
    roots = [(each, each.matrix_parent_inverse.copy()) for each in things if each.parent is None or each.parent not in things]
    before = [(each, each.parent) for each, _ in roots]
    try:
        for each, _ in roots:
            world = each.matrix_world.copy()
            each.parent = parent
            each.matrix_parent_inverse.identity()
            if not each.animation_data:
                each.matrix_basis = world
        bpy.ops.object.select_all(action="DESELECT")
        for each in [parent, *things]:
            each.select_set(True)
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_selection=True, export_animations=True, export_yup=True,
                                  export_apply=True)
    finally:
        for (each, inverse), (_, own) in zip(roots, before):
            world = to_pattern.inverted() @ each.matrix_world
            each.parent, each.matrix_parent_inverse = own, inverse
            if not each.animation_data:
                each.matrix_world = world
        bpy.data.objects.remove(parent)


def save_picture(image, folder):
    path = pathlib.Path(bpy.path.abspath(image.filepath))
    if image.packed_file is None and path.suffix.lower() in (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff") and path.is_file():
        target = folder / f"pattern{path.suffix.lower()}"
        shutil.copyfile(path, target)
    else:
        target = folder / "pattern.png"
        image.save_render(str(target))
    return target.name


def export(folder):
    """Writes scene.glb, the picture and modar.toml. Returns the path of modar.toml."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    plane = pattern_of(bpy.context.scene)
    frame, (width, height) = frame_of(plane)
    to_pattern = frame.inverted()
    things = [each for each in bpy.context.scene.objects if each.type == "MESH" and each != plane and each.visible_get()]
    low, high = box_of(things, to_pattern)
    export_models(things, to_pattern, folder / "scene.glb")
    project = folder / "modar.toml"
    project.write_text(TOML.format(picture=save_picture(image_of(plane), folder), width=1000 * width,
                                   scale=max(high - low) / max(width, height), offset=500 * (low + high)))
    return project


class ExportModar(bpy.types.Operator):
    """Exports the scene on its pattern as a ModAR project"""
    bl_idname, bl_label = "export_scene.modar", "Export ModAR project"
    directory: StringProperty(subtype="DIR_PATH")
    bake: BoolProperty(name="Bake", default=True, description="Run `modar bake`")
    page: BoolProperty(name="Open the page", default=False, description="Serve the page with `modar web` and open it")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            project = export(self.directory)
            if self.bake or self.page:
                subprocess.run(["modar", "bake", "--project", project, "--quiet"], check=True, capture_output=True, text=True)
            if self.page:
                bundle = next((project.parent / "out").glob("*.modar"))
                subprocess.Popen(["modar", "web", bundle, "-o", project.parent / "site", "--serve", "--quiet"])
                bpy.ops.wm.url_open(url="https://localhost:8443/")
        except (RuntimeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except subprocess.CalledProcessError as error:
            self.report({"ERROR"}, error.stderr.strip())
            return {"CANCELLED"}
        return {"FINISHED"}


def menu(self, context):
    self.layout.operator(ExportModar.bl_idname, text="ModAR project")


def register():
    bpy.utils.register_class(ExportModar)
    bpy.types.TOPBAR_MT_file_export.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(menu)
    bpy.utils.unregister_class(ExportModar)


if __name__ == "__main__" and "--" in sys.argv:
    print(export(sys.argv[sys.argv.index("--") + 1]))
