#!/usr/bin/env python3
"""Announcements of a screen reader on a page: the tree of AT-SPI, as Orca reads it, of the cover and of the turntable, in WebKitGTK and Firefox.

    screen_reader.py BUNDLE     makes a page of the bundle; prints a line for each thing: role, name, description, states
Needs MODAR_BIN (build/release/bin by default) and a bus of its own: `dbus-run-session -- tests/bench/screen_reader.py BUNDLE`. Debian's packages
at-spi2-core, python3-pyatspi, xvfb, and webkit2gtk-driver or firefox-esr. WebKitGTK 2.50 tells nothing of a modal dialog in a shadow root, which
the turntable is; Firefox tells all of it.
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import pyatspi

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/web")]
from browser import Server, engines  # noqa: E402

BIN = pathlib.Path(os.environ.get("MODAR_BIN", ROOT / "build/release/bin"))
STATES = {pyatspi.STATE_FOCUSABLE: "focusable", pyatspi.STATE_CHECKED: "checked", pyatspi.STATE_PRESSED: "pressed", pyatspi.STATE_MODAL: "modal"}
# Without a camera; after a while the page continues to the turntable.
GO_ON = "setTimeout(() => document.getElementById('look').click(), 15000);"


class Folder:
    """What engines() asks for of a test."""

    def __init__(self, folder):
        self.folder, self.cleanups = folder, []

    def addCleanup(self, what, *arguments):
        self.cleanups.append((what, arguments))


def documents(node, depth=0):
    """Web pages below a node of the tree."""
    if node is None or depth > 25:
        return
    if node.getRole() == pyatspi.ROLE_DOCUMENT_WEB:
        yield node
        return
    for child in node:
        yield from documents(child, depth + 1)


def lines_of(node, depth=0):
    if node is None:
        return
    states = node.getState()
    role = node.getRoleName()
    if not states.contains(pyatspi.STATE_SHOWING) and depth > 0:
        return
    told = [word for state, word in STATES.items() if states.contains(state)]
    name = node.name
    if not name and role in ("paragraph", "static", "text", "label", "heading", "description value"):
        try:
            name = node.queryText().getText(0, -1).replace("\ufffc", "").strip()
        except NotImplementedError:
            name = ""
    if name or told or role not in ("section", "panel", "filler"):
        yield f"{'  ' * depth}{role}: {name!r}{' (' + node.description + ')' if node.description else ''} {' '.join(told)}".rstrip()
    for child in node:
        yield from lines_of(child, depth + 1)


def page():
    return next((each for app in pyatspi.Registry.getDesktop(0) if app is not None for each in documents(app)), None)


def main():
    with tempfile.TemporaryDirectory(prefix="modar-reader-") as name:
        folder = pathlib.Path(name)
        subprocess.run([BIN / "modar", "web", sys.argv[1], "-o", folder / "site", "--quiet"], check=True)
        index = folder / "site/index.html"
        index.write_text(index.read_text().replace("</body>", '<script src="go_on.js"></script></body>'))
        (folder / "site/go_on.js").write_text(GO_ON)
        server = Server(folder / "site")
        test = Folder(folder)
        os.environ.update(GNOME_ACCESSIBILITY="1", NO_AT_BRIDGE="0", GTK_MODULES="gail:atk-bridge")
        try:
            for engine, start in engines(test):
                if engine == "chromium":  # without a screen it has no bus
                    continue
                process = start(server.url)
                for wait, part in ((12, "the cover"), (14, "the turntable")):
                    time.sleep(wait)
                    found = page()
                    print(f"== {engine}: {part}")
                    print("\n".join(lines_of(found)) if found else "no page is in the tree")
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        finally:
            server.close()
            for what, arguments in reversed(test.cleanups):
                what(*arguments)


if __name__ == "__main__":
    main()
