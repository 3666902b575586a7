#!/usr/bin/env python3
"""How fast `modar studio` answers, in Chromium with real mouse events: what a person waits for.

    studio.py [--models N] [--pictures N] [--runs N]

Prints JSON, medians in ms: first_page (an empty folder, until its first screen is drawn), blank_page (the same of a page without anything to do: the
browser's own share), open (a baked project of 200 models and 100
pictures, until its cards are there), scroll_frame (while that list is scrolled from end to end, and its models are drawn), corner (a
dragged corner, until the rectified preview is drawn) and handle (a dragged handle, until the model is drawn: the event's own time);
corner_worst and handle_worst are the worst. changed: from a model that is written outside the page until the stage draws it, less the bake's own time as its event tells it.

Needs a release build's modar in MODAR_BIN_DIR (default: build/release/bin), chromium, and the page's engine (preset `web`).
"""
import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("MODAR_BIN_DIR", str(ROOT / "build" / "release" / "bin"))
sys.path[:0] = [str(ROOT / "tests" / room) for room in ("studio", "cli", "web")]
from hand import Hand  # noqa: E402
from programs import POTTERY, picture  # noqa: E402
from studio import Studio  # noqa: E402
from studio_test import WATCH, wall  # noqa: E402

# A bake in seconds: the page shows what there is, whatever it took.
QUICK = '[bake]\nloop-views = 8\nscore = false\nlods = 1\nparameters = "none"\n\n'
# When the awaited state was drawn: looked at in the page, at each of its frames.
PAINTED = """(() => {{
  const look = () => requestAnimationFrame(() => {{
    if ({ready}) setTimeout(() => {{ globalThis.paintedBy = performance.now(); }});
    else look();
  }});
  look();
}})()"""
SCROLL = """(async () => {
  const box = [...document.querySelectorAll('*')].find((e) => e.scrollHeight > e.clientHeight + 400 && /auto|scroll/.test(getComputedStyle(e).overflowY));
  const times = [];
  for (let i = 0, last = performance.now(); i < 90; ++i) {
    box.scrollTop = box.scrollHeight * i / 90;
    const now = await new Promise(requestAnimationFrame);
    times.push(now - last);
    last = now;
  }
  return times.sort((a, b) => a - b)[45];
})()"""


def opened(folder, project, ready, page="?lang=en"):
    """A studio of a project, a browser that shows it, and the ms that the page took from its navigation."""
    studio = Studio(project)
    hand = Hand(folder / f"profile-{project.name}", (1280, 720))
    hand.call("Page.addScriptToEvaluateOnNewDocument", source=PAINTED.format(ready=ready))
    hand.open(studio.address + page)
    hand.wait("globalThis.paintedBy", "the first screen")
    return studio, hand, hand.run("paintedBy")


def first_pages(folder, runs):
    """Medians of the first screen, and of its words alone, a text that the browser shows without processing; in turns."""
    taken = []
    for i in range(2 * runs):
        ready, page = ("document.querySelector('.welcome')", "?lang=en") if i % 2 else ("document.body", "words/en.json")
        studio, hand, ms = opened(folder, folder / f"empty-{i}", ready, page)
        hand.close()
        studio.end()
        taken.append(ms)
    return statistics.median(taken[1::2]), statistics.median(taken[::2])


def large(folder, models, pictures):
    project = folder / "large"
    project.mkdir()
    for i in range(models):
        shutil.copy(POTTERY, project / f"m{i}.obj")
    shutil.copy(POTTERY.with_suffix(".mtl"), project)
    picture(project / "p0.png")
    for i in range(1, pictures):
        shutil.copy(project / "p0.png", project / f"p{i}.png")
    scenes = "".join(f'[[scene]]\npattern = "p{i % pictures}"\nmodel = "m{i}"\n\n' for i in range(models))
    (project / "modar.toml").write_text(f'{QUICK}[[model]]\nfile = "*.obj"\n\n[[pattern]]\nfile = "p*.png"\n\n{scenes}')
    subprocess.run([pathlib.Path(os.environ["MODAR_BIN_DIR"]) / "modar", "bake", "--quiet"], cwd=project, check=True)
    studio, hand, ms = opened(folder, project, f"document.querySelectorAll('.cards li').length === {models + pictures}")
    hand.run("document.querySelector('main').scrollTop = 9e9")  # to the models
    hand.wait("document.querySelector('.thumb[data-model] img')", "a model's picture")
    frame = hand.run(SCROLL)
    print(f"{hand.run('''document.querySelectorAll('.thumb[data-model] img').length''')} of {models} models are drawn after scrolling", file=sys.stderr)
    hand.close()
    studio.end()
    return ms, frame


def corner(hand, runs):
    """A corner goes to and fro; each time the preview is waited for."""
    hand.run("location.hash = '#/picture/wall'")
    hand.wait("document.querySelector('canvas[data-shown]')", "the preview")
    x, y = hand.place(".corner", 1)
    waits = []

    def move():
        for i in range(runs):
            hand._mouse("mouseMoved", (x - 10 - 3 * (i % 2), y + 10))
            hand.wait("seen.shown.at(-1) > seen.moves.at(-1)", "the preview")
            waits.append(hand.run("seen.shown.find((time) => time > seen.moves.at(-1)) - seen.moves.at(-1)"))

    hand.drag((x, y), [(x - 5, y + 5)], move)
    return waits[1:]


def handle(hand):
    hand.run("location.hash = '#/scene/wall'")
    hand.wait("document.querySelector('.layers canvas')", "the stage")
    hand.settle()
    x, y = hand.place("[data-handle=turn]")
    hand.run("seen.drawn.length = 0")
    hand.drag((x, y), [(x + 3 * i, y - i) for i in range(1, 30)])
    return [ms for ms, _ in hand.run("seen.drawn")][2:]


FOLLOW = """(() => {
  globalThis.bakes = [];
  const events = new EventSource('api/events');
  events.addEventListener('baked', ({ data }) => bakes.push(JSON.parse(data).seconds));
  globalThis.drawnBy = 0;
  new MutationObserver((changes) => {
    if (changes.some(({ removedNodes }) => [...removedNodes].some(({ nodeName }) => nodeName === 'CANVAS'))) drawnBy = Date.now();
  }).observe(document.querySelector('.layers'), { childList: true });
})()"""


def changed(hand, model, runs):
    """A model is written again; the stage shows the bake of it once its old layers go."""
    hand.settle()
    hand.run(FOLLOW)
    waits = []
    for i in range(runs):
        hand.run("drawnBy = 0")
        start = time.time()
        with model.open("a") as file:
            file.write(f"# {i}\nv {i} 0 0\n")
        hand.wait("drawnBy && bakes.length", "the bake on the stage")
        waits.append(hand.run("drawnBy") - 1000 * start - 1000 * hand.run("bakes.pop()"))
        hand.settle()
    return waits


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=int, default=200)
    parser.add_argument("--pictures", type=int, default=100)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    figures = {}
    with tempfile.TemporaryDirectory(prefix="modar-studio-", ignore_cleanup_errors=True) as temporary:
        folder = pathlib.Path(temporary)
        figures["first_page"], figures["blank_page"] = first_pages(folder, options.runs)
        figures["open"], figures["scroll_frame"] = large(folder, options.models, options.pictures)
        project = folder / "one"
        project.mkdir()
        wall(project / "wall.jpg")
        for name in ("pottery.obj", "pottery.mtl", "pottery.png"):
            shutil.copy(POTTERY.with_name(name), project)
        (project / "modar.toml").write_text('[[model]]\nfile = "pottery.obj"\n\n[[pattern]]\nfile = "wall.jpg"\nwidth = "297mm"\n'
                                            'corners = [[300, 160], [1350, 160], [1350, 1000], [300, 1000]]\n\n[[scene]]\npattern = "wall"\nmodel = "pottery"\n')
        studio, hand, _ = opened(folder, project, "document.querySelectorAll('.cards li').length === 2")
        hand.run(WATCH)
        waits = corner(hand, 4 * options.runs)
        drawn = handle(hand)
        followed = changed(hand, project / "pottery.obj", options.runs)
        hand.close()
        studio.end()
    figures |= {"corner": statistics.median(waits), "corner_worst": max(waits), "handle": statistics.median(drawn), "handle_worst": max(drawn),
                "changed": statistics.median(followed)}
    print(json.dumps({key: round(value, 1) for key, value in figures.items()}, indent=1))


if __name__ == "__main__":
    main()
