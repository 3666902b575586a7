#!/usr/bin/python3
"""Makes an app's icon of any picture: its middle square.

  scripts/android_icon.py PICTURE RES [LISTING]

RES: the folder of resources that gets mipmap-xxxhdpi/icon.png and icon_foreground.png. LISTING: the 512 x 512 PNG that stores ask for.
Launchers cut adaptive icons to a shape of their own; all of them show the inner 72 of 108 units, where the picture is.
"""
import argparse
import pathlib

from PIL import Image, ImageOps

UNIT = 4  # pixels of xxxhdpi
WHOLE, SHOWN, LEGACY, LISTING = 108 * UNIT, 72 * UNIT, 48 * UNIT, 512


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", type=pathlib.Path)
    parser.add_argument("res", type=pathlib.Path)
    parser.add_argument("listing", type=pathlib.Path, nargs="?")
    given = parser.parse_args()
    try:
        with Image.open(given.picture) as opened:
            picture = ImageOps.exif_transpose(opened).convert("RGBA")
    except OSError as error:
        raise SystemExit(f"apk.sh: icon {given.picture}: {error}; give a PNG or JPEG")
    picture = Image.alpha_composite(Image.new("RGBA", picture.size, "white"), picture).convert("RGB")

    def square(side):
        return ImageOps.fit(picture, (side, side), Image.Resampling.LANCZOS)

    folder = given.res / "mipmap-xxxhdpi"
    folder.mkdir(parents=True, exist_ok=True)
    square(LEGACY).save(folder / "icon.png", optimize=True)
    inner = square(SHOWN)
    whole = Image.new("RGB", (WHOLE, WHOLE), inner.getpixel((0, 0)))
    whole.paste(inner, ((WHOLE - SHOWN) // 2,) * 2)
    whole.save(folder / "icon_foreground.png", optimize=True)
    if given.listing:
        given.listing.parent.mkdir(parents=True, exist_ok=True)
        square(LISTING).save(given.listing, optimize=True)


if __name__ == "__main__":
    main()
