#!/usr/bin/env python3
"""Writes three projects that act, for `modar bake`: a painting that speaks, a poster that plays, a machine whose parts say
what they are.

Pictures, models, films and tunes are made here; FFmpeg encodes the film and, where the program espeak-ng is there, it speaks
the painting's words: a tune of as many syllables replaces them otherwise. The same bytes each time, of one FFmpeg.
"""
import argparse
import array
import math
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from kit import png  # noqa: E402
from kit.canvas import Canvas, mix, ring, star  # noqa: E402

RATE = 22050  # samples a second
BAKE = "[bake]\nparameters = \"none\"\n"

WORDS = {
    "en": ("In nineteen twenty-two this painting hung above a kitchen stove.",
           "Under the soot we found a window that nobody had seen for a hundred years."),
    "de": ("1922 hing dieses Bild über einem Küchenherd.",
           "Unter dem Ruß fanden wir ein Fenster, das hundert Jahre lang niemand gesehen hatte."),
}
PAINTING = BAKE + """
[[pattern]]
file = "painting.png"
width = "200mm"
[[scene]]
pattern = "painting"
text.en = "A painting that speaks. Touch 1 to hear its restorer."
text.de = "Ein Gemälde, das spricht. Berühren Sie 1, um die Restauratorin zu hören."
alt.en = "A painting with two numbered points"
[[scene.sound]]
file = "voice.wav"
play = false
captions.en = "voice.vtt"
captions.de = "voice-de.vtt"
[[scene.label]]
name = "restorer"
offset = [-60, 40, 4]
title.en = "The restorer"
title.de = "Die Restauratorin"
text.en = "She cleaned it for two winters."
text.de = "Zwei Winter lang hat sie es gereinigt."
[[scene.label]]
name = "window"
offset = [55, 25, 4]
hidden = true
title.en = "The window"
title.de = "Das Fenster"
text.en = "Painted over by the artist himself."
text.de = "Der Maler selbst hat es übermalt."
[[scene.action]]
on = "tap restorer"
do = "play voice"
[[scene.action]]
on = "tap restorer"
do = "text restorer"
[[scene.action]]
on = "tap restorer"
do = "show window"
"""

POSTER = BAKE + """
[[pattern]]
file = "poster.png"
width = "300mm"
[[scene]]
pattern = "poster"
text.en = "A poster that plays. Touch the film to pause it, the star for tickets."
alt.en = "A film on a poster"
[[scene.video]]
file = "trailer.mp4"
width = "220mm"
offset = [0, 30, 3]
loop = true
alt.en = "A comet crosses a night sky"
captions.en = "trailer.vtt"
[[scene.picture]]
name = "tickets"
file = "star.png"
width = "60mm"
offset = [0, -85, 6]
alt.en = "A star"
[[scene.label]]
name = "director"
offset = [-110, -85, 6]
mark = "i"
title.en = "Comet"
text.en = "A film of four seconds, drawn by a program."
[[scene.action]]
on = "tap trailer"
do = "pause trailer"
[[scene.action]]
on = "tap director"
do = "play trailer"
[[scene.action]]
on = "tap director"
do = "text director"
[[scene.action]]
on = "tap tickets"
do = "link https://museum.example/tickets"
"""

MACHINE = BAKE + """
[[model]]
file = "engine.obj"
[[model]]
file = "wheel.obj"
[[pattern]]
file = "drawing.png"
width = "160mm"
[[scene]]
pattern = "drawing"
model = "engine"
up = "z"
height = "70mm"
text.en = "A steam engine. Touch a part, or the wheel to turn it."
alt.en = "A small steam engine on its drawing"
[[scene.label]]
name = "boiler"
offset = [2, 0, 50]
title.en = "Boiler"
text.en = "Water becomes steam here, at 165 degrees and seven times the pressure of the air."
[[scene.label]]
name = "chimney"
offset = [-38, 0, 71]
title.en = "Chimney"
text.en = "The smoke draws fresh air through the fire."
[[scene.label]]
name = "cylinder"
offset = [30, 0, 44]
title.en = "Cylinder"
text.en = "Steam pushes the piston to and fro, twice a turn."
[[scene.label]]
name = "flywheel"
offset = [34, -38, 54]
title.en = "Flywheel"
text.en = "Its weight carries the piston over the ends of its way."
[[scene.action]]
on = "tap wheel"
do = "turn wheel by 360 about y in 3s"
[[scene.action]]
on = "tap flywheel"
do = "turn wheel by 360 about y in 3s"
[[scene.action]]
on = "tap flywheel"
do = "text flywheel"
[[scene.action]]
on = "tap engine"
part = "brass"
do = "text boiler"
[[scene]]
pattern = "drawing"
model = "wheel"
up = "z"
height = "52mm"
centred = true
offset = [34, -38, 28]
"""


def write_wav(path, samples):
    """16 bits, one channel. samples: -1 to 1."""
    body = array.array("h", (int(max(-1.0, min(1.0, s)) * 32000) for s in samples))
    if sys.byteorder == "big":
        body.byteswap()
    data = body.tobytes()
    head = b"RIFF" + (36 + len(data)).to_bytes(4, "little") + b"WAVEfmt " + (16).to_bytes(4, "little")
    head += b"".join(n.to_bytes(size, "little") for n, size in ((1, 2), (1, 2), (RATE, 4), (2 * RATE, 4), (2, 2), (16, 2)))
    path.write_bytes(head + b"data" + len(data).to_bytes(4, "little") + data)


def tune(notes, seconds):
    """Plucked tones, one after the other. notes: half tones from the A of 220 Hz; None: a rest."""
    out = []
    for note in notes:
        step = 0.0 if note is None else 2 * math.pi * 220 * 2 ** (note / 12) / RATE
        for i in range(int(seconds * RATE)):
            fade = math.exp(-4.0 * i / (seconds * RATE)) * min(1.0, i / 80)
            out.append(0.5 * fade * (math.sin(step * i) + 0.3 * math.sin(2 * step * i)))
    return out


def stamp(seconds):
    return f"{int(seconds // 60):02}:{seconds % 60:06.3f}"


def write_captions(path, lines, length):
    """Each line for a share of the time by its letters."""
    text, at, letters = "WEBVTT\n", 0.0, sum(map(len, lines))
    for line in lines:
        end = at + length * len(line) / letters
        text += f"\n{stamp(at)} --> {stamp(end)}\n{line}\n"
        at = end
    path.write_text(text, encoding="utf-8")


def speak(path, words):
    """Answers its seconds."""
    if shutil.which("espeak-ng"):
        subprocess.run(["espeak-ng", "-v", "en", "-s", "150", "-w", path, words], check=True)
        head = path.read_bytes()[:44]
        return (path.stat().st_size - 44) / int.from_bytes(head[28:32], "little")
    syllables = sum(1 for a, b in zip(" " + words.lower(), words.lower()) if b in "aeiouy" and a not in "aeiouy")
    melody = [(0, 2, 4, 2, 5, 4, 0, -3)[i % 8] for i in range(syllables)]
    write_wav(path, tune(melody, 0.18))
    return syllables * 0.18


def make_painting(folder):
    shutil.copy(HERE / "patterns/painting.png", folder)
    length = speak(folder / "voice.wav", " ".join(WORDS["en"]))
    write_captions(folder / "voice.vtt", WORDS["en"], length)
    write_captions(folder / "voice-de.vtt", WORDS["de"], length)
    return PAINTING


def film_frame(time, width=320, height=180):
    """A comet on its way over hills."""
    page = Canvas(width, height, (14, 18, 46), 1)
    page.box(0, 0, width, height, lambda y: mix((10, 12, 40), (96, 52, 120), min(1.0, y / height)))
    for i in range(60):
        x, y = (i * 97) % width, (i * 53) % (height - 50)
        page.dot(x, y, 0.6 + (i % 3) * 0.4, (230, 230, 255), alpha=0.4 + 0.5 * ((i * 7) % 10) / 10)
    head = (-40 + time * (width + 120), 110 - 80 * math.sin(math.pi * time))
    for k in range(24, 0, -1):
        page.dot(head[0] - 4 * k, head[1] + 1.4 * k * (time - 0.3), 9 - k * 0.33, (255, 220 - 4 * k, 150), alpha=0.28)
    page.polygon(star(head[0], head[1], 13, 6, 5, time * 6), (255, 244, 200))
    hills = [(x, height - 26 - 16 * math.sin(x / 37 + 1) - 7 * math.sin(x / 13)) for x in range(0, width + 8, 8)]
    page.polygon([(0, height), *hills, (width, height)], (22, 40, 36))
    return page.picture()


def make_poster(folder):
    shutil.copy(HERE / "patterns/mural.png", folder / "poster.png")
    seconds, rate = 4, 15
    frames = b"".join(bytes(film_frame(i / (seconds * rate)).pixels) for i in range(seconds * rate))
    write_wav(folder / "tune.wav", tune([0, 4, 7, 12, 11, 7, 4, 5, 9, 12, 16, 12, 7, 4, 2, 0], seconds / 16))
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "320x180", "-r", str(rate), "-i", "-",
                    "-i", folder / "tune.wav", "-c:v", "libx264", "-crf", "24", "-pix_fmt", "yuv420p", "-c:a", "aac", "-shortest",
                    "-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-flags:a", "+bitexact", folder / "trailer.mp4"],
                   input=frames, check=True)
    (folder / "tune.wav").unlink()
    write_captions(folder / "trailer.vtt", ["[a bright tune, rising]", "[it falls, and ends where it began]"], seconds)
    page = Canvas(120, 120, (60, 20, 90), 3)
    page.polygon(star(60, 62, 56, 24, 5), (255, 214, 64))
    page.polygon(star(60, 62, 40, 17, 5), (255, 238, 160))
    png.write(folder / "star.png", page.picture())
    return POSTER


class Parts:
    """An OBJ file of closed prisms, each of one material."""

    def __init__(self):
        self.lines, self.count = [], 0

    def prism(self, material, low, high):
        """Two rings of as many points, counter-clockwise as seen from the side of `high`."""
        n, first = len(low), self.count + 1
        self.lines += ["v %.3f %.3f %.3f" % point for point in [*low, *high]]
        self.lines.append(f"usemtl {material}")
        for i in range(n):
            j = (i + 1) % n
            self.lines.append(f"f {first + i} {first + j} {first + n + j} {first + n + i}")
        self.lines.append("f " + " ".join(str(first + i) for i in reversed(range(n))))
        self.lines.append("f " + " ".join(str(first + n + i) for i in range(n)))
        self.count += 2 * n

    def box(self, material, a, b):
        corners = [(a[0], a[1]), (b[0], a[1]), (b[0], b[1]), (a[0], b[1])]
        self.prism(material, [(*c, a[2]) for c in corners], [(*c, b[2]) for c in corners])

    def rod(self, material, centre, radius, length, axis, sides=28):
        """Round, about an axis ("x", "y", "z") through its middle."""
        turned = {"x": lambda u, v, w: (w, u, v), "y": lambda u, v, w: (v, w, u), "z": lambda u, v, w: (u, v, w)}[axis]
        ends = ([tuple(c + d for c, d in zip(centre, turned(u, v, w))) for u, v in ring(0, 0, radius, sides)] for w in (-length / 2, length / 2))
        self.prism(material, *ends)

    def write(self, path, materials):
        path.write_text("mtllib machine.mtl\n" + "\n".join(self.lines) + "\n")
        (path.parent / "machine.mtl").write_text("".join("newmtl %s\nKd %.2f %.2f %.2f\n" % (name, *colour) for name, colour in materials.items()))


def make_machine(folder):
    shutil.copy(HERE / "patterns/survey.png", folder / "drawing.png")
    colours = {"iron": (0.16, 0.17, 0.19), "brass": (0.80, 0.58, 0.22), "green": (0.12, 0.36, 0.24), "red": (0.70, 0.14, 0.12),
               "steel": (0.62, 0.64, 0.68)}
    engine = Parts()
    engine.box("green", (-54, -30, 0), (54, 30, 6))
    engine.box("iron", (-46, -14, 6), (-8, 14, 16))
    engine.rod("brass", (-22, 0, 32), 17, 56, "x")
    for x in (-46, -22, 2):
        engine.rod("iron", (x, 0, 32), 17.8, 3, "x")
    engine.rod("iron", (-38, 0, 58), 5, 22, "z")
    engine.rod("brass", (-38, 0, 69), 7, 2, "z")
    engine.box("iron", (20, -9, 6), (40, 9, 28))
    engine.rod("steel", (30, 0, 36), 8, 26, "x")
    engine.rod("steel", (34, -24, 28), 3, 34, "y")
    engine.write(folder / "engine.obj", colours)
    wheel = Parts()
    sides = 40
    for i in range(sides):  # a rim of blocks
        a, b = (2 * math.pi * k / sides for k in (i, i + 1))
        low, high = ([(r * math.cos(t), y, r * math.sin(t)) for r, t in ((20, a), (26, a), (26, b), (20, b))] for y in (3.5, -3.5))
        wheel.prism("red", low, high)
    for i in range(3):
        c, s = math.cos(math.pi * i / 3), math.sin(math.pi * i / 3)
        low, high = ([(u * c - v * s, y, u * s + v * c) for u, v in ((-21, -2), (21, -2), (21, 2), (-21, 2))] for y in (2, -2))
        wheel.prism("red", low, high)
    wheel.rod("steel", (0, 0, 0), 5, 12, "y")
    wheel.write(folder / "wheel.obj", colours)
    return MACHINE


PROJECTS = {"speaking-painting": make_painting, "playing-poster": make_poster, "labelled-machine": make_machine}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path, help="the folder for the projects, one of each name: " + ", ".join(PROJECTS))
    options = parser.parse_args()
    for name, make in PROJECTS.items():
        folder = options.out / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "modar.toml").write_text(make(folder), encoding="utf-8")
        print(folder, file=sys.stderr)


if __name__ == "__main__":
    main()
