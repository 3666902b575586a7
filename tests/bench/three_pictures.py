#!/usr/bin/env python3
"""Models as a default bake shows them next to three.js r170 in the same light, in Chromium.

    three_pictures.py MODEL... [--pictures FOLDER] [--three FOLDER] [-- OPTION...]

MODEL is a glTF, GLB, OBJ, PLY or STL file; each is baked with the options after --, without occlusion, which three.js has no rays for.
Prints JSON: for each model the mean CIEDE2000 over the pixels that both show, over 12 views, that of the worst view, and the share of the
model's pixels that only one shows. Exit code 1 if the mean of all is above 3 or one is above 6. --pictures writes the worst view of
each: ours, three.js'. --three: an unpacked package of three 0.170.0, else it is fetched by npm. The light is that of `neutral_room()`;
glTF is lit by an environment whose irradiance it is, other files by a light probe. Needs chromium, and MODAR_BIN (build/release/bin by
default).
"""
import argparse
import base64
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/web"))
from browser import Browser, Quiet, Server  # noqa: E402

BIN = pathlib.Path(os.environ.get("MODAR_BIN", ROOT / "build/release/bin"))
VIEWS, SIDE = 12, 480
MOST_MEAN, MOST_ONE = 3, 6
PAGE = """<!DOCTYPE html><meta charset="utf-8"><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "jsm/": "/three/examples/jsm/"}}</script>
<script type="module" src="/pictures.js"></script>"""


def run(*words):
    done = subprocess.run([*map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip()[-300:])
    return done.stdout


def drawn(model, folder, options):
    """Our pictures of a model, and where its centre, its size and the eye are."""
    bundle = folder / "model.modar"
    run(BIN / "modar", "bake", "--model", model, "-o", bundle, "--quiet", "--no-occlusion", *options)
    run(BIN / "modar-play", bundle, "--turntable", VIEWS, "--size", f"{SIDE}x{SIDE}", "--out", folder / "ours", "--force", "--quiet")
    content = json.loads(run(sys.executable, ROOT / "scripts/read_bundle.py", bundle, "--json"))
    record = content["models"][0]
    chunks = content["chunks"][:record["chunk_count"]]
    radius = max(math.hypot(*(max(abs(low), abs(high)) for low, high in zip(c["bounds_min"], c["bounds_max"]))) for c in chunks)
    return {"centre": record["center"], "scale": record["scale"], "distance": 1.05 * radius / math.sin(math.atan(0.5))}


class Files(Quiet):
    """The page, three.js, our pictures; and everything else of the machine, for models' own files."""

    def translate_path(self, path):
        name = urllib.parse.unquote(urllib.parse.urlsplit(path).path)
        for place, folder in (("/three/", self.three), ("/ours/", self.ours)):
            if name.startswith(place):
                return str(folder / name[len(place):])
        if name == "/pictures.js":
            return str(pathlib.Path(__file__).with_suffix(".js"))
        return name

    def do_GET(self):
        if self.path != "/":
            return super().do_GET()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(PAGE.encode())


def package_of_three(folder):
    (folder / "package.json").write_text('{"private": true}')
    npm = shutil.which("npm")
    if npm is None:
        sys.exit("three_pictures: npm is not installed; name an unpacked three 0.170.0 with --three")
    subprocess.run([npm, "install", "--no-audit", "--no-fund", "--loglevel=error", "three@0.170.0"], cwd=folder, check=True)
    return folder / "node_modules/three"


def compare(browser, model, folder, options, pictures):
    place = drawn(model, folder, options)
    order = {**place, "url": urllib.parse.quote(str(model.resolve())), "ending": model.suffix[1:].lower(), "views": VIEWS, "side": SIDE}
    row = browser.run(f"globalThis.compare({json.dumps(order)})")
    picture = base64.b64decode(row.pop("picture").split(",")[1])
    if pictures:
        (pictures / f"{model.stem}.png").write_bytes(picture)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("--three", type=pathlib.Path)
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    given, options = parser.parse_args(words[:at]), words[at + 1:]
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        Files.ours = folder / "ours"
        Files.three = given.three.resolve() if given.three else package_of_three(folder)
        server = Server("/", Files)
        browser = Browser(folder / "profile", "")
        try:
            browser.open(server.url)
            browser.wait("Boolean(globalThis.compare)", "three.js starting")
            for model in given.models:
                try:
                    rows.append({"model": model.stem, **compare(browser, model, folder, options, given.pictures)})
                except RuntimeError as error:
                    rows.append({"model": model.stem, "error": str(error)})
                print(json.dumps(rows[-1]), flush=True)
        finally:
            browser.close()
            server.close()
    measured = [row["delta_e"] for row in rows if "delta_e" in row]
    mean = statistics.fmean(measured) if measured else math.nan
    print(json.dumps({"models": len(measured), "mean": round(mean, 2), "worst": max(measured, default=math.nan)}))
    return 0 if len(measured) == len(rows) and mean <= MOST_MEAN and max(measured) <= MOST_ONE else 1


if __name__ == "__main__":
    sys.exit(main())
