#!/usr/bin/env python3
"""Packs an Android App Bundle, unsigned, as bundletool lays it out.

  scripts/android_bundle.py PROTO_APK TREE OUT

PROTO_APK: what `aapt2 link --proto-format` made. TREE: classes.dex, assets/ and lib/ABI/ of the app.
Messages: bundletool's config.proto, files.proto and targeting.proto.
"""
import pathlib
import sys
import zipfile

# Abi.AbiAlias
ABIS = {"armeabi-v7a": 2, "arm64-v8a": 3, "x86": 4, "x86_64": 5}
# UncompressNativeLibraries.PageAlignment
PAGE_ALIGNMENT_16K = 2
# The format as of this version of bundletool, the first that aligns to 16 KB by default; later ones read it.
BUNDLETOOL = "1.17.0"
EPOCH = (1980, 1, 1, 0, 0, 0)


def varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def message(number, payload):
    """A field that holds bytes, a string or a message."""
    payload = payload.encode() if isinstance(payload, str) else payload
    return varint(number << 3 | 2) + varint(len(payload)) + payload


def number(field, value):
    return varint(field << 3) + varint(value)


def config():
    """BundleConfig: the version of bundletool; libraries uncompressed and aligned to 16 KB; bundles uncompressed, to be mapped."""
    libraries = message(2, number(1, 1) + number(2, PAGE_ALIGNMENT_16K))
    return message(1, message(2, BUNDLETOOL)) + message(2, libraries) + message(3, message(1, "assets/bundles/*.modar"))


def asset_folders(names):
    """Assets: each folder that has files, for all devices."""
    folders = sorted({name.rpartition("/")[0] for name in names if name.startswith("assets/")})
    return b"".join(message(1, message(1, folder) + message(2, b"")) for folder in folders)


def libraries(names):
    """NativeLibraries: each folder of libraries with its processor."""
    abis = sorted({name.split("/")[1] for name in names if name.startswith("lib/")})
    return b"".join(message(1, message(1, f"lib/{abi}") + message(2, message(1, number(1, ABIS[abi])))) for abi in abis)


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    linked, tree, out = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    files = {"BundleConfig.pb": config()}
    with zipfile.ZipFile(linked) as archive:
        for name in archive.namelist():
            folder = "manifest/" if name == "AndroidManifest.xml" else ""
            files[f"base/{folder}{name}"] = archive.read(name)
    names = sorted(file.relative_to(tree).as_posix() for file in tree.rglob("*") if file.is_file())
    for name in names:
        folder = "dex/" if name.endswith(".dex") else ""
        files[f"base/{folder}{name}"] = (tree / name).read_bytes()
    files["base/assets.pb"] = asset_folders(names)
    if libraries(names):
        files["base/native.pb"] = libraries(names)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as bundle:
        for name in sorted(files):
            bundle.writestr(zipfile.ZipInfo(name, EPOCH), files[name], zipfile.ZIP_DEFLATED)


if __name__ == "__main__":
    main()
