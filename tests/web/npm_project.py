"""A folder with the page's npm package and others installed, as a web project has them."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from programs import ROOT

PAGE = ROOT / "build" / "web" / "web"


def install(case, tools):
    """The folder, which goes with the class `case`, and the tarball's name. tools: versions by package. Skips without npm or a network."""
    npm = shutil.which("npm")
    if npm is None:
        raise unittest.SkipTest("no npm")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-npm-"))
    case.addClassCleanup(shutil.rmtree, folder, ignore_errors=True)
    run = lambda *words: subprocess.run([npm, *words], cwd=folder, capture_output=True, text=True)
    packed = run("pack", "--silent", PAGE)
    if packed.returncode != 0:
        raise AssertionError(packed.stderr)
    tarball = packed.stdout.strip().splitlines()[-1]
    (folder / "package.json").write_text(json.dumps(
        {"name": "museum", "private": True, "type": "module", "dependencies": {**tools, "modar": "file:" + tarball}}))
    installed = run("install", "--no-audit", "--no-fund", "--loglevel=error")
    if installed.returncode != 0:
        raise unittest.SkipTest("npm cannot fetch the tools: " + installed.stderr[-200:])
    return folder, tarball
