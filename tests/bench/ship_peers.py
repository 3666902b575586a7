#!/usr/bin/env python3
"""Bytes on the way next to other programs, in one run.

    ship_peers.py size MODEL.obj...      a first download, against gltfpack -cc and the same ETC1 under zstd-19
    ship_peers.py delta OLD.modar NEW.modar   an update, against casync and zchunk

Needs modar on the path and, from Debian, gltfpack, zstd, casync and zchunk. Prints JSON.
"""
import json
import pathlib
import subprocess
import sys
import tempfile


def run(*arguments, cwd=None):
    return subprocess.run([*map(str, arguments)], check=True, capture_output=True, text=True, cwd=cwd).stdout


def zstd_bytes(path):
    return len(subprocess.run(["zstd", "-19", "-q", "-c", str(path)], check=True, capture_output=True).stdout)


def published_bytes(bundle, folder):
    """Everything that a device downloads: document, signature, recipe, pieces."""
    key = folder / "key"
    if not key.exists():
        run("modar", "ship", "keygen", "--out", key)
    site = folder / f"site-{bundle.stem}"
    run("modar", "ship", "publish", bundle, "--to", site, "--key", key, "--quiet")
    return sum(p.stat().st_size for p in site.rglob("*") if p.is_file())


def compare_sizes(models):
    rows = []
    for model in map(pathlib.Path, models):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            bundle = folder / "model.modar"
            run("modar", "bake", "--model", model, "-o", bundle, "--quiet")
            run("modar", "inspect", bundle, "--extract", folder / "out")
            glb = folder / "model.glb"
            # Positions at 14 bits, its default; uv at 16, ours; names and materials as it keeps them.
            run("gltfpack", "-i", model, "-o", glb, "-cc", "-vt", "16")
            textures = sum(zstd_bytes(p) for p in (folder / "out").glob("*.pkm"))
            ours = published_bytes(bundle, folder)
            theirs = zstd_bytes(glb) + textures
            rows.append({"model": model.stem, "ours": ours, "gltfpack_cc": zstd_bytes(glb), "etc1_zstd": textures,
                         "ratio": round(ours / theirs, 4)})
    return rows


def casync_delta(old, new, folder):
    """Bytes of the chunks that the new one needs and the old one has not, and of its index."""
    before, store = folder / "old.castr", folder / "new.castr"
    run("casync", "make", f"--store={before}", folder / "old.caibx", old)
    run("casync", "make", f"--store={store}", folder / "new.caibx", new)
    known = {p.name for p in before.rglob("*.cacnk")}
    fresh = sum(p.stat().st_size for p in store.rglob("*.cacnk") if p.name not in known)
    return fresh + (folder / "new.caibx").stat().st_size


def zchunk_delta(old, new, folder):
    """Chunks by their digests, as zck_read_header tells them, and the header."""
    def chunks(path, name):
        out = folder / name
        run("zck", "-o", out, path, cwd=folder)
        lines = run("zck_read_header", "-c", out).splitlines()
        header = int(next(line.split(":")[1] for line in lines if line.startswith("Header size")))
        table = {}
        for line in lines:
            words = line.split()
            if len(words) >= 5 and words[0].isdigit():
                table[words[1]] = int(words[3])
        return header, table
    _, before = chunks(old, "old.zck")
    header, after = chunks(new, "new.zck")
    return header + sum(size for digest, size in after.items() if digest not in before)


def compare_deltas(old, new):
    old, new = pathlib.Path(old).resolve(), pathlib.Path(new).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        ours = json.loads(run("modar", "ship", "plan", old, new, "--json"))["update_bytes"]
        casync = casync_delta(old, new, folder)
        zchunk = zchunk_delta(old, new, folder)
        return {"ours": ours, "casync": casync, "zchunk": zchunk, "ratio": round(ours / min(casync, zchunk), 4)}


if __name__ == "__main__":
    if len(sys.argv) > 2 and sys.argv[1] == "size":
        print(json.dumps(compare_sizes(sys.argv[2:]), indent=2))
    elif len(sys.argv) == 4 and sys.argv[1] == "delta":
        print(json.dumps(compare_deltas(sys.argv[2], sys.argv[3]), indent=2))
    else:
        sys.exit(__doc__)
