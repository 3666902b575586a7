"""Plots the way of the camera around a picture: trajectory.py BUNDLE VIDEO PLOT.png (needs ffmpeg and python3-matplotlib)."""
import subprocess
import sys

import matplotlib
import modar
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

bundle, video, plot = sys.argv[1:]
width, height = 480, 360
gray = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", video, "-vf", f"scale={width}:{height}", "-f", "rawvideo",
                       "-pix_fmt", "gray", "-"], check=True, capture_output=True).stdout
tracker = modar.Tracker(modar.Bundle(bundle), width, height)
places = []
for frame in np.frombuffer(gray, np.uint8).reshape(-1, height, width):
    for pose in tracker.step(frame).values():
        places.append(-pose.rotation.T @ pose.translation)  # of the camera, on the picture
places = np.array(places)
axes = pyplot.figure().add_subplot(projection="3d")
axes.plot(*places.T)
axes.set(xlabel="right", ylabel="up", zlabel="towards the viewer")
pyplot.savefig(plot)
print(f"{len(places)} places")
