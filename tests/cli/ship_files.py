"""Keys, bundles and releases for the tests of shipping."""
import atexit
import functools
import json
import math
import os
import pathlib
import shutil
import subprocess
import tempfile

from programs import BIN, QUICK, ProgramTest, picture


def sheet(path, side, wave):
    """A wavy, rough sheet of 2 * side * side triangles, as OBJ: roughness travels at some ten bytes a vertex."""
    lines = [f"v {x} {y} {3 * math.sin(x * wave) * math.cos(y * 0.3) + (x * 73856093 ^ y * 19349663) % 997 / 2000}"
             for y in range(side + 1) for x in range(side + 1)]
    for y in range(side):
        for x in range(side):
            a = y * (side + 1) + x + 1
            lines.append(f"f {a} {a + 1} {a + side + 2} {a + side + 1}")
    path.write_text("\n".join(lines) + "\n")
    return path


def run(*arguments):
    done = subprocess.run([*map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{arguments}: {done.stderr}")
    return done.stdout


def contents(path):
    """What a file or folder holds; a folder that is missing holds nothing."""
    if path.is_file():
        return path.read_bytes()
    return tuple((str(p.relative_to(path)), p.read_bytes()) for p in sorted(path.rglob("*")) if p.is_file())


class Shop:
    """A key and three bundles, made once for a file of tests: `old` and `new` differ in one model."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-ship-"))
        self.published = {}  # what publish() has made of a folder before
        self.key = self.folder / "test.key"
        run(BIN / "modar", "ship", "keygen", "--out", self.key)
        first = sheet(self.folder / "first.obj", 60, 0.4)
        second = sheet(self.folder / "second.obj", 45, 0.7)
        self.old = self.bake("old", "--model", first)
        self.new = self.bake("new", "--model", first, "--model", second)

    @functools.cached_property
    def pattern(self):
        picture(self.folder / "picture.png")
        return self.bake("pattern", "--pattern", self.folder / "picture.png", *QUICK, "--parameters", "all")

    @functools.cached_property
    def staged(self):
        """Of two colours and so of two chunks, which have proxies: the preview is coarser. Patterns take long to unpack."""
        return self.bake("staged", "--model", self.two_coloured)

    @functools.cached_property
    def two_coloured(self):
        model = sheet(self.folder / "staged.obj", 100, 0.2)
        lines = model.read_text().splitlines()
        faces = [i for i, line in enumerate(lines) if line.startswith("f")]
        for place, colour in ((faces[len(faces) // 2], "blue"), (faces[0], "red")):
            lines.insert(place, f"usemtl {colour}")
        model.write_text("mtllib staged.mtl\n" + "\n".join(lines) + "\n")
        (self.folder / "staged.mtl").write_text("newmtl red\nKd 0.8 0.2 0.2\nnewmtl blue\nKd 0.2 0.3 0.8\n")
        return model

    def bake(self, name, *arguments):
        bundle = self.folder / name / "museum.modar"
        bundle.parent.mkdir()
        run(BIN / "modar", "bake", *arguments, "-o", bundle, "--quiet")
        return bundle

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)


@functools.cache
def the_shop():
    shop = Shop()
    atexit.register(shop.close)
    return shop


class ShipTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.shop = the_shop()

    def setUp(self):
        super().setUp()
        self.site = self.folder / "site"
        self.store = self.folder / "store"
        self.trust = pathlib.Path(f"{self.shop.key}.pub")

    def publish(self, *bundles, key=None, site=None, options=()):
        """Publishes, or copies what the same command made of the same folder for an earlier test of this file."""
        site, key = site or self.site, key or self.shop.key
        given = (contents(site), contents(key), tuple(options), *((b.name, contents(b)) for b in bundles))
        if given not in self.shop.published:
            done = self.modar("ship", "publish", *bundles, "--to", site, "--key", key, "--json", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            kept = self.shop.folder / f"published-{len(self.shop.published)}"
            shutil.copytree(site, kept)
            self.shop.published[given] = kept, done.stdout
        else:
            shutil.rmtree(site, ignore_errors=True)
            shutil.copytree(self.shop.published[given][0], site)
        return json.loads(self.shop.published[given][1])

    def fetch(self, url=None, *options, store=None, trust=None, env=None):
        return self.run_program("modar-fetch", url or self.site, "--store", store or self.store, "--trust",
                                trust or self.trust, *options, env=env)

    def fetch_json(self, *arguments, **options):
        done = self.fetch(*(arguments or (self.site,)), "--json", **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def assert_installed(self, *bundles, store=None):
        """Each bundle is in the store as published."""
        for bundle in bundles:
            self.assertEqual((pathlib.Path(store or self.store) / bundle.name).read_bytes(), bundle.read_bytes())


def soak():
    return os.environ.get("MODAR_SOAK", "0") != "0"
