"""libmodar.so exports what modar.h declares, and nothing else."""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
BUILD = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin")).parent
HEADER = ROOT / "runtime" / "include" / "modar" / "modar.h"


class Exports(unittest.TestCase):
    def test_the_names_are_those_of_the_header(self):
        text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.S)
        declared = set(re.findall(r"\b(modar_\w+)\(", text))
        self.assertGreater(len(declared), 30)
        library = BUILD / "runtime" / "capi" / "libmodar.so"
        done = subprocess.run(["nm", "-D", "--defined-only", "--format=posix", library], capture_output=True,
                              text=True, check=True)
        exported = {line.split()[0].split("@")[0] for line in done.stdout.splitlines()}
        self.assertEqual(exported, declared)


if __name__ == "__main__":
    unittest.main()
