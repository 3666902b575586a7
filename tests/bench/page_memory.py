#!/usr/bin/env python3
"""Memory that a visit takes for a bundle, in Chromium: of all of its processes, next to what a blank page takes.

    page_memory.py BUNDLE [--raw | --packed] [--page FOLDER] [--small BUNDLE] [--mbit N]

Makes the page of `modar web`, opens a blank page of the same host, then the bundle's, and looks around without a camera until all is
there. Prints JSON, in MB: resident memory (each page of memory counted by its share) of the blank page and of the visit, its greatest
value on the way, by process (renderer: the page and its workers; gpu-process: what WebGL holds, in memory here since SwiftShader draws),
and bytes a byte of the bundle. --small: a small bundle of the same page, whose visit is taken off as well: what page and engine take.

Needs modar on the path, chromium, and the page's engine (preset `web`). Run it on a quiet machine with 2 GB free for a bundle of 80 MB.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from first_visit import Browser, make_site, serve  # noqa: E402

WHOLE = "performance.getEntriesByName('modar: whole').length > 0"
PRESS = """setInterval(() => { const look = document.getElementById('look');
  if (look?.textContent && !look.disabled && !globalThis.pressed) { globalThis.pressed = true; look.click(); } }, 20)"""


def resident_by_process(root):
    """Bytes of a process and all that it started, by the kind of process that Chromium names."""
    children = subprocess.run(["ps", "-o", "pid=,ppid=", "-e"], capture_output=True, text=True).stdout.split("\n")
    parents = {int(pid): int(parent) for pid, parent in (line.split() for line in children if line)}
    ours = {root}
    while more := {pid for pid, parent in parents.items() if parent in ours} - ours:
        ours |= more
    kinds = {}
    for pid in ours:
        try:
            rollup = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
            words = pathlib.Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").split()
        except OSError:
            continue
        kind = next((word[7:] for word in words if word.startswith("--type=")), "browser")
        share = next(line for line in rollup.splitlines() if line.startswith("Pss:"))
        kinds[kind] = kinds.get(kind, 0) + 1024 * int(share.split()[1])
    return kinds


def settle(browser, seconds=3):
    """Garbage is collected."""
    for _ in range(2):
        time.sleep(seconds / 2)
        browser.call("HeapProfiler.collectGarbage")
    return resident_by_process(browser.process.pid)


def visit(site, mbit, waits=200):
    """Resident bytes by process: of a blank page, at the end of a visit, and where their sum was greatest meanwhile. mbit: of the line, or None."""
    server, folder = serve(site), tempfile.mkdtemp(prefix="modar-memory-")
    browser = Browser(folder, "none.y4m")
    try:
        (site / "blank.html").write_text("<!doctype html><title>blank</title>")
        browser.open(f"http://localhost:{server.server_port}/blank.html")
        blank = settle(browser)
        if mbit:
            browser.throttle(1e6 * mbit / 8, 50)
        browser.call("Page.addScriptToEvaluateOnNewDocument", source=PRESS)
        browser.call("Page.navigate", url=f"http://localhost:{server.server_port}/")
        most, end = blank, time.monotonic() + waits
        while not browser.run(WHOLE):
            if time.monotonic() > end:
                raise RuntimeError(f"the bundle is not there after {waits} s: {browser.errors}")
            most = max(most, resident_by_process(browser.process.pid), key=lambda kinds: sum(kinds.values()))
            time.sleep(0.5)
        browser.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")
        done = settle(browser)
        return blank, done, max(most, done, key=lambda kinds: sum(kinds.values()))
    finally:
        browser.close()
        server.shutdown()
        server.server_close()
        shutil.rmtree(folder, ignore_errors=True)


def measure(bundle, page, raw, mbit):
    with tempfile.TemporaryDirectory(prefix="modar-memory-site-") as name:
        site = pathlib.Path(name) / "site"
        make_site(site, bundle, page, raw)
        return visit(site, mbit)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=pathlib.Path)
    parser.add_argument("--raw", action="store_true", help="the raw bundle alone")
    parser.add_argument("--packed", action="store_true", help="the packed bundle alone")
    parser.add_argument("--page", help="of another build")
    parser.add_argument("--small", type=pathlib.Path, help="a small bundle")
    parser.add_argument("--mbit", type=float, help="of the line; without, as fast as this machine sends")
    options = parser.parse_args()
    size = options.bundle.stat().st_size
    for raw in [True] * (not options.packed) + [False] * (not options.raw):
        rest = 0
        if options.small:
            blank, done, _ = measure(options.small, options.page, raw, options.mbit)
            rest = sum(done.values()) - sum(blank.values()) - options.small.stat().st_size
        blank, done, most = measure(options.bundle, options.page, raw, options.mbit)
        base = sum(blank.values()) + rest
        print(json.dumps({"bundle": "raw" if raw else "packed", "bundle_mb": round(size / 1e6, 1), "blank_mb": round(sum(blank.values()) / 1e6, 1),
                          "page_mb": round(rest / 1e6, 1), "visit_mb": round(sum(done.values()) / 1e6, 1), "most_mb": round(sum(most.values()) / 1e6, 1),
                          "grown_mb": {kind: round((bytes_ - blank.get(kind, 0)) / 1e6, 1) for kind, bytes_ in sorted(done.items())},
                          "most_grown_mb": {kind: round((bytes_ - blank.get(kind, 0)) / 1e6, 1) for kind, bytes_ in sorted(most.items())},
                          "a_byte": round((sum(done.values()) - base) / size, 2), "most_a_byte": round((sum(most.values()) - base) / size, 2)}), flush=True)


if __name__ == "__main__":
    main()
