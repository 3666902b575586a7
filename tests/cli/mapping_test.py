"""The player maps the bundle and reads none of it: strace shows the calls."""
import re
import shutil
import subprocess
import unittest

from programs import BIN, COVER, ProgramTest, needs

CALLS = "openat,open,mmap,read,pread64,readv,preadv,preadv2,sendfile,copy_file_range,close"


class Mapping(ProgramTest):
    @needs("paper")
    def test_the_bundle_is_mapped_and_not_read(self):
        if shutil.which("strace") is None:
            self.skipTest("no strace here")
        bundle = self.bake_demo()
        log = self.folder / "strace.log"
        # Leak checking and strace both want to be the tracer.
        done = subprocess.run(["strace", "-f", "-y", "-o", log, "-e", f"trace={CALLS}", BIN / "modar-play", bundle,
                               "--input", COVER, "--method", "paper", "--json"], capture_output=True, text=True,
                              env={"ASAN_OPTIONS": "detect_leaks=0", "PATH": "/usr/bin:/bin"}, cwd=self.folder)
        if "ptrace" in done.stderr and "not permitted" in done.stderr:
            self.skipTest("strace may not trace here")
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [line for line in log.read_text(errors="replace").splitlines() if bundle.name in line]
        calls = [re.search(r"(\w+)\(", line).group(1) for line in lines]
        self.assertIn("openat", calls)
        maps = [line for line in lines if "mmap(" in line]
        self.assertEqual(len(maps), 1, lines)
        self.assertIn("PROT_READ", maps[0])
        self.assertNotIn("PROT_WRITE", maps[0])
        self.assertEqual(set(calls) - {"openat", "mmap", "close"}, set(), lines)


if __name__ == "__main__":
    unittest.main()
