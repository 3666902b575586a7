"""Bakes and renders, once for all tests, what many of them play: demo_files.py FOLDER."""
import pathlib
import shutil
import sys

from programs import make_demo_files

folder = pathlib.Path(sys.argv[1])
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)
make_demo_files(folder)
