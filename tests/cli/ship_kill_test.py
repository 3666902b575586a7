"""Kills modar-fetch at the system calls that touch the store: the old or the new release stays whole."""
import collections
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from programs import BIN
from ship_files import ShipTest, soak

CALLS = ["openat", "mkdir", "mkdirat", "unlinkat", "renameat", "symlinkat", "pwrite64", "write", "ftruncate", "fsync", "close",
         "newfstatat", "fstat", "readlinkat", "getdents64", "fstatfs", "flock", "mmap", "read"]
CHANGE = CALLS[1:CALLS.index("close")]  # the store; openat does where it creates


def strace_works():
    if not shutil.which("strace"):
        return False
    return subprocess.run(["strace", "-o", "/dev/null", "true"], capture_output=True).returncode == 0


@unittest.skipUnless(strace_works(), "strace cannot trace here")
class Kill(ShipTest):
    def setUp(self):
        super().setUp()
        self.publish(self.shop.old)
        self.fetch_json()
        self.extra = self.folder / "extra.modar"  # has a preview
        shutil.copy(self.shop.staged, self.extra)
        self.publish(self.shop.new, self.extra)
        self.before = self.folder / "before"
        shutil.copytree(self.store, self.before, symlinks=True)

    def restore(self):
        shutil.rmtree(self.store)
        shutil.copytree(self.before, self.store, symlinks=True)

    def traced(self, *options):
        return subprocess.run(["strace", "-f", "-qq", *options, BIN / "modar-fetch", self.site, "--store", self.store,
                               "--trust", self.trust, "--quiet"], capture_output=True, text=True,
                              env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})

    def points(self):
        """
        Occurrences of calls that touch the store: (call, number among the calls of that name). All of them with --soak, else
        those that change it and the next one each: what other calls find and leave is the same.
        """
        log = self.folder / "strace.log"
        done = self.traced("-y", "-o", log, "-e", "trace=" + ",".join(CALLS))
        self.assertEqual(done.returncode, 0, done.stderr)
        counts = collections.Counter()
        points, changed = [], True
        for line in log.read_text().splitlines():
            found = re.search(r"\b(\w+)\(", line)
            if not found or found.group(1) not in CALLS:
                continue
            counts[found.group(1)] += 1
            if str(self.store) in line:
                changes = found.group(1) in CHANGE or "O_CREAT" in line or "O_TRUNC" in line
                if changes or changed or os.environ.get("MODAR_SOAK") == "full":
                    points.append((found.group(1), counts[found.group(1)]))
                changed = changes
        return points

    def assert_whole(self, point):
        """The release in use opens, verifies, and is the old or the new release."""
        done = subprocess.run([BIN / "modar-fetch", "--store", self.store, "--verify", "--json"], capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, f"{point}: {done.stderr}")
        self.assertIn('"fell_back": false', done.stdout, point)
        data = (self.store / "museum.modar").read_bytes()
        self.assertIn(data, (self.shop.old.read_bytes(), self.shop.new.read_bytes()), point)
        extra = self.store / "current" / "extra.modar"
        self.assertEqual(extra.exists(), data == self.shop.new.read_bytes(), point)
        if extra.exists():
            self.assertEqual(extra.read_bytes(), self.extra.read_bytes(), point)
        return extra.exists()

    def left(self):
        """What the store is: every name with its mode and contents, but for what fetch never reads, the times."""
        names = sorted(self.store.rglob("*"))
        return tuple((str(p), p.lstat().st_mode, os.readlink(p) if p.is_symlink() else p.read_bytes() if p.is_file() else None) for p in names)

    def test_killed_at_every_call_the_store_stays_whole(self):
        points = self.points()
        self.assertGreater(len(points), 200)
        if not soak():
            # Each kind of call, and every eighth point with --quick; else all.
            kinds = {call: i for i, (call, _) in reversed(list(enumerate(points)))}
            points = [p for i, p in enumerate(points) if i % 8 == 0 or i in kinds.values() or i >= len(points) - 8]
        installed, seen = 0, {}
        for call, number in points:
            self.restore()
            done = self.traced("-o", "/dev/null", "-e", f"inject={call}:signal=KILL:when={number}")
            self.assertNotEqual(done.returncode, 0, (call, number))
            left = self.left()
            if left not in seen:  # most calls read only: what the kill before left was looked at
                seen[left] = self.assert_whole((call, number))
                report = self.fetch_json()
                self.assertEqual(report["version"], 2)
                self.assert_installed(self.shop.new, self.extra)
                self.assertEqual(os.listdir(self.store / "pieces"), [], (call, number))
            installed += seen[left]
        self.assertLess(installed, len(points), "every kill came after the switch")
        self.assertGreater(len(seen), 20)
        print(f"{len(points)} points, {len(seen)} stores, {installed} after the switch")


@unittest.skipUnless(strace_works(), "strace cannot trace here")
class Durable(ShipTest):
    """What a power cut right after the decisive rename would take: names whose folder was not synced since."""

    def unsynced(self, decisive, passed_over, *command):
        log = self.folder / "strace.log"
        done = subprocess.run(["strace", "-f", "-qq", "-y", "-o", log, "-e", "trace=mkdir,mkdirat,rename,renameat,openat,fsync", *command],
                              capture_output=True, text=True, cwd=self.folder, env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"})
        self.assertEqual(done.returncode, 0, done.stderr)
        pending = {}
        for line in log.read_text().splitlines():
            call = re.search(r"\b(\w+)\((.*)\)\s+= \d", line)
            if not call:
                continue
            name, words = call.groups()
            synced = re.match(r"\d+<(.*)>", words)
            if name == "fsync":
                pending.pop(synced.group(1), None)
                continue
            if name == "openat" and "O_CREAT" not in words:
                continue
            base, made = re.findall(r'(?:(?:\d+|AT_FDCWD)<([^>]*)>, )?"([^"]*)"', words)[-1]
            path = pathlib.Path(os.path.normpath(os.path.join(base or self.folder, made)))
            if path == decisive:
                return pending
            if self.folder in path.parents and not passed_over(path) and path.suffix != ".tmp":
                pending[str(path.parent)] = line
        self.fail("the decisive rename did not come")

    def test_a_release_is_named_when_all_of_it_would_survive_a_power_cut(self):
        pending = self.unsynced(self.site / "latest", lambda path: path.name == ".lock", BIN / "modar", "ship", "publish", self.shop.old,
                                "--to", "site", "--key", self.shop.key)
        self.assertEqual(pending, {})
        self.assertGreater(len(list((self.site / "objects").iterdir())), 2)

    def test_a_release_is_in_use_when_all_of_it_would_survive_a_power_cut(self):
        self.publish(self.shop.old)
        # Pieces are checked before they are used again.
        pending = self.unsynced(self.store / "current", lambda path: "pieces" in path.parts, BIN / "modar-fetch", self.site, "--store",
                                self.store, "--trust", self.trust, "--quiet")
        self.assertEqual(pending, {})


if __name__ == "__main__":
    unittest.main()
