#!/usr/bin/env python3
"""Draws the six patterns that ship with the project, into assets/patterns. The same bytes each time."""
import argparse
import importlib
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from kit import png  # noqa: E402

NAMES = ("cover", "game", "survey", "poems", "painting", "mural")


def main():
    here = pathlib.Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of " + ", ".join(NAMES) + " (all)")
    parser.add_argument("--out", type=pathlib.Path, default=here / "patterns", metavar="DIR",
                        help="the folder to write to (assets/patterns)")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in NAMES]
    if unknown:
        parser.error("no such pattern: " + ", ".join(unknown))
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names or NAMES:
        picture = importlib.import_module("subjects." + name).draw()
        png.write(options.out / (name + ".png"), picture)
        print(f"{name}.png {picture.width}x{picture.height}", file=sys.stderr)


if __name__ == "__main__":
    main()
