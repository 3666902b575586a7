#!/usr/bin/env python3
"""Makes the three models that ship with the project, into assets/models. The same bytes each time."""
import argparse
import importlib
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from kit import mesh as meshes  # noqa: E402
from kit import png  # noqa: E402

# Name -> (vertices, faces, decimals of a coordinate, with normals, unit). Each is an open disc but
# for the jar, whose handles are two tunnels more.
MODELS = {
    "pottery": (1661, 3296, 2, True, "millimetres"),
    "bust": (4555, 8767, 4, False, "metres"),
    "statue": (21453, 42712, 1, False, "millimetres"),
}


def make(name, folder):
    """Writes the model's OBJ file, and its material and texture where it has them."""
    vertices, faces, places, with_normals, unit = MODELS[name]
    subject = importlib.import_module("subjects." + name)
    mesh = subject.build()
    if (len(mesh.points), len(mesh.faces)) != (vertices, faces):
        raise SystemExit(f"{name}: {len(mesh.points)} vertices, {len(mesh.faces)} faces")
    material = None
    if mesh.uvs:
        material = (name + ".mtl", name)
        meshes.write_mtl(folder / (name + ".mtl"), name, name + ".png")
        png.write(folder / (name + ".png"), subject.texture())
    comment = f"{subject.__doc__}\nUnit: {unit}, Z up. CC0. Made by assets/make_models.py."
    meshes.write_obj(folder / (name + ".obj"), mesh, comment, places, material, with_normals)
    print(f"{name}.obj: {vertices} vertices, {faces} faces", file=sys.stderr)


def main():
    here = pathlib.Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of " + ", ".join(MODELS) + " (all)")
    parser.add_argument("--out", type=pathlib.Path, default=here / "models", metavar="DIR",
                        help="the folder to write to (assets/models)")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in MODELS]
    if unknown:
        parser.error("no such model: " + ", ".join(unknown))
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names or MODELS:
        make(name, options.out)


if __name__ == "__main__":
    main()
