#!/usr/bin/env python3
"""Seconds until a first visitor sees something, on slow lines, by Chromium's network throttle.

    first_visit.py BUNDLE VIDEO.y4m [--runs N] [--page FOLDER] [--raw-only]

Makes the page of `modar web`, serves it as hosts do (scripts gzipped, one connection a file), and opens it with the camera showing
VIDEO, which is to show the bundle's picture, on two lines: 1.6 Mbit/s and 400 kbit/s, both with 300 ms. The visitor presses the start
button as soon as it appears. Prints JSON: seconds until the tracker recognises (seen), models are drawn on the pattern (shown), and all is
there (whole); bytes of the bundle; memory of all of the browser's processes at the end. Once with the raw bundle, once with the
packed one.

Needs modar on the path, chromium, and the page's engine (preset `web`).
"""
import argparse
import functools
import gzip
import http.server
import json
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "web"))
from browser import Browser, Quiet  # noqa: E402

LINES = {"1.6 Mbit/s": 1.6e6, "400 kbit/s": 0.4e6}
LATENCY_MS = 300
MARKS = """Object.fromEntries(performance.getEntriesByType('mark').filter(({ name }) => name.startsWith('modar: '))
  .map(({ name, startTime }) => [name.slice(7), startTime / 1000]))"""
# As soon as a visitor could.
PRESS = """setInterval(() => { const start = document.getElementById('start');
  if (start?.textContent && !start.disabled && !globalThis.pressed) { globalThis.pressed = true; start.click(); } }, 20)"""


class Zipped(Quiet):
    """What hosts compress is compressed."""

    def do_GET(self):
        path = pathlib.Path(self.translate_path(self.path))
        path = path / "index.html" if path.is_dir() else path
        if path.suffix not in (".html", ".js", ".wasm", ".json", ".css", ".svg") or not path.is_file():
            return self.part(path) if path.is_file() else super().do_GET()
        body = zipped(path)
        self.server.sent += len(body)
        self.send_response(200)
        for name, value in (("Content-Type", self.guess_type(path)), ("Content-Encoding", "gzip"), ("Content-Length", str(len(body))),
                            ("Cache-Control", "max-age=600")):
            self.send_header(name, value)
        self.end_headers()
        try:
            self.wfile.write(body)
        except OSError:
            pass  # the visit has ended


    def part(self, path):
        """A file by ranges."""
        whole, asked = path.read_bytes(), re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range") or "")
        first, last = (int(asked[1]), int(asked[2] or len(whole) - 1)) if asked else (0, len(whole) - 1)
        body = whole[first:last + 1]
        self.server.sent += len(body)
        self.send_response(206 if asked else 200)
        for name, value in (("Content-Type", self.guess_type(path)), ("Content-Length", str(len(body))), ("Cache-Control", "max-age=600"),
                            ("ETag", f'"{zlib.crc32(whole)}"'), ("Accept-Ranges", "bytes"),
                            *((("Content-Range", f"bytes {first}-{first + len(body) - 1}/{len(whole)}"),) if asked else ())):
            self.send_header(name, value)
        self.end_headers()
        try:
            self.wfile.write(body)
        except OSError:
            pass


@functools.cache
def zipped(path):
    return gzip.compress(path.read_bytes(), 9)


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Zipped, directory=str(folder)))
    server.sent = 0
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def resident_bytes(process):
    """Of a browser's processes, each page counted by its share."""
    children = subprocess.run(["ps", "-o", "pid=,ppid=", "-e"], capture_output=True, text=True).stdout.split("\n")
    parents = {int(pid): int(parent) for pid, parent in (line.split() for line in children if line)}
    ours = {process}
    while more := {pid for pid, parent in parents.items() if parent in ours} - ours:
        ours |= more
    total = 0
    for pid in ours:
        try:
            rollup = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
        except OSError:
            continue
        total += 1024 * int(next(line for line in rollup.splitlines() if line.startswith("Pss:")).split()[1])
    return total


def visit(site, video, bits, last, waits):
    """One first visit: marks, and bytes resident at its end. last: the marks that end it."""
    server = serve(site)
    folder = tempfile.mkdtemp(prefix="modar-visit-")
    browser = Browser(folder, video)
    try:
        browser.camera("granted")
        if bits:
            browser.throttle(bits / 8, LATENCY_MS)
        browser.call("Page.addScriptToEvaluateOnNewDocument", source=PRESS)
        browser.call("Page.navigate", url=f"http://localhost:{server.server_port}/")
        end = time.monotonic() + waits
        marks = {}
        while not last <= marks.keys() and time.monotonic() < end:
            time.sleep(0.05)
            marks = browser.run(MARKS)
        if "seen" in marks:
            marks["shown"] = max(marks["seen"], marks.get("coarse", 0))
            marks["sent_kb"] = server.sent / 1000
        time.sleep(2)  # garbage is collected
        browser.call("HeapProfiler.collectGarbage")
        return marks, resident_bytes(browser.process.pid)
    finally:
        browser.close()
        server.shutdown()
        server.server_close()
        shutil.rmtree(folder, ignore_errors=True)


def make_site(folder, bundle, page, raw):
    subprocess.run(["modar", "web", bundle, "-o", folder, "--languages", "en", "--quiet", *(["--page", page] if page else [])], check=True)
    description = folder / "site.json"
    site = json.loads(description.read_text())
    if raw:
        name = re.sub("&first=[0-9]+", "", site["bundles"][0]["file"]).replace(".packed", ".modar")
        site["bundles"][0]["file"] = name
        description.write_text(json.dumps(site))
    return (folder / site["bundles"][0]["file"].split("?")[0]).stat().st_size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=pathlib.Path)
    parser.add_argument("video", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--page", help="of another build")
    parser.add_argument("--raw-only", action="store_true", help="for pages that know no packed bundles")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="modar-visits-") as base:
        for kind in ("raw",) if options.raw_only else ("raw", "packed"):
            site = pathlib.Path(base) / kind
            size = make_site(site, options.bundle, options.page, kind == "raw")
            for line, bits in LINES.items():
                runs = [visit(site, options.video, bits, {"seen"} if options.raw_only else {"seen", "whole"}, 180) for _ in range(options.runs)]
                marks = {name: round(statistics.median(run[name] for run, _ in runs if name in run), 2)
                         for name in sorted({name for run, _ in runs for name in run})}
                print(json.dumps({"bundle": kind, "bytes": size, "line": line, **marks,
                                  "resident_mb": round(statistics.median(bytes for _, bytes in runs) / 1e6, 1)}), flush=True)


if __name__ == "__main__":
    main()
