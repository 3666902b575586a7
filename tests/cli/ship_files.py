"""Keys, bundles and releases for the tests of shipping."""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile

from programs import BIN, COVER, POTTERY, ROOT, ProgramTest

BUST = ROOT / "assets" / "models" / "bust.obj"


def run(*arguments):
    done = subprocess.run([*map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{arguments}: {done.stderr}")
    return done.stdout


class Shop:
    """A key and three bundles, made once for a file of tests: `old` and `new` differ in one model."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-ship-"))
        self.key = self.folder / "test.key"
        run(BIN / "modar", "ship", "keygen", "--out", self.key)
        self.old = self.bake("old", "--model", POTTERY)
        self.new = self.bake("new", "--model", POTTERY, "--model", BUST)
        self.pattern = self.bake("pattern", "--pattern", COVER)

    def bake(self, name, *arguments):
        bundle = self.folder / name / "museum.modar"
        bundle.parent.mkdir()
        run(BIN / "modar", "bake", *arguments, "-o", bundle, "--quiet")
        return bundle

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)


class ShipTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.shop = Shop()

    @classmethod
    def tearDownClass(cls):
        cls.shop.close()

    def setUp(self):
        super().setUp()
        self.site = self.folder / "site"
        self.store = self.folder / "store"
        self.trust = pathlib.Path(f"{self.shop.key}.pub")

    def publish(self, *bundles, key=None, site=None, options=()):
        done = self.modar("ship", "publish", *bundles, "--to", site or self.site, "--key", key or self.shop.key,
                          "--json", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def fetch(self, url=None, *options, store=None, trust=None, env=None):
        return self.run_program("modar-fetch", url or self.site, "--store", store or self.store, "--trust",
                                trust or self.trust, *options, env=env)

    def fetch_json(self, *arguments, **options):
        done = self.fetch(*(arguments or (self.site,)), "--json", **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def assert_installed(self, *bundles, store=None):
        """Each bundle lies in the store as it was published."""
        for bundle in bundles:
            self.assertEqual((pathlib.Path(store or self.store) / bundle.name).read_bytes(), bundle.read_bytes())


def soak():
    return os.environ.get("MODAR_SOAK", "0") == "1"
