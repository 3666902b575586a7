"""scripts/apk.sh: an APK with Debian's tools alone, and what Android's own tools say of it."""
import os
import pathlib
import re
import shutil
import struct
import subprocess
import threading
import time
import unittest
import zipfile

from machine import COVER, FAKES, HEIGHT, ROOT, WIDTH, ProgramTest, compile_java, have, make_clip, make_covered_clip, run_java, write_fakes

from programs import POTTERY, QUICK  # noqa: E402
from servers import NGINX, Nginx  # noqa: E402

TOOLS = ("javac", "aapt", "zipalign", "apksigner", "dexdump", "keytool", "proguard")
GOLDEN = ROOT / "tests" / "golden" / "v1_0.modar"
MAX_DEX = 37_000


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


@unittest.skipUnless(have(*TOOLS) and pathlib.Path("/usr/share/android-framework-res/framework-res.apk").exists(),
                     "no aapt, zipalign, apksigner, dexdump, android-framework-res or JDK")
class Apk(ProgramTest):
    def make(self, *words):
        return run(ROOT / "scripts" / "apk.sh", *words)

    def made(self, name, *words):
        out = self.folder / f"{name}.apk"
        done = self.make(*words, "--out", out)
        if done.returncode == 2 and "cannot be fetched" in done.stderr:
            self.skipTest("no network for Debian's source packages (dx, api/current.txt)")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, f"{out}\n")
        return out, done.stderr

    def offset(self, apk, entry):
        """Where an entry's bytes begin, by its local header."""
        with zipfile.ZipFile(apk) as file:
            info = file.getinfo(entry)
        self.assertEqual(info.compress_type, zipfile.ZIP_STORED, entry)
        name, extra = struct.unpack_from("<HH", apk.read_bytes(), info.header_offset + 26)
        return info.header_offset + 30 + name + extra

    def test_what_androids_tools_say(self):
        bundle = self.folder / "vase.modar"
        bundle.write_bytes(GOLDEN.read_bytes())
        (self.folder / "vase.properties").write_text("cover=Found in 1922.\n")
        apk, said = self.made("vases", bundle, "--title", "Vase's & more", "--id", "org.museum.vases")
        self.assertIn("ANDROID_NDK is not set", said)
        signed = run("apksigner", "verify", "--verbose", "--min-sdk-version", "19", apk)
        self.assertEqual(signed.returncode, 0, signed.stderr)
        for scheme in ("v1 scheme (JAR signing)", "v2 scheme (APK Signature Scheme v2)", "v3 scheme (APK Signature Scheme v3)"):
            self.assertIn(f"Verified using {scheme}: true", signed.stdout)
        self.assertEqual(run("zipalign", "-c", "-p", "8", apk).returncode, 0)
        self.assertEqual(self.offset(apk, "assets/bundles/vase.modar") % 8, 0)
        badging = run("aapt", "dump", "badging", apk).stdout
        for line in ("package: name='org.museum.vases'", "sdkVersion:'19'", "targetSdkVersion:'29'",
                     "launchable-activity: name='org.modar.MainActivity'", 'application-label:'):
            self.assertIn(line, badging)
        self.assertIn("Vase's & more", badging)
        self.assertEqual(re.findall(r"uses-permission: name='(.*?)'", badging), ["android.permission.CAMERA"])
        with zipfile.ZipFile(apk) as file:
            dex = file.read("classes.dex")
            self.assertEqual(file.read("assets/bundles/vase.modar"), GOLDEN.read_bytes())
            self.assertEqual(file.read("assets/bundles/vase.properties"), b"cover=Found in 1922.\n")
            self.assertLessEqual(len(dex), MAX_DEX)
        (self.folder / "classes.dex").write_bytes(dex)
        dumped = run("dexdump", "-d", self.folder / "classes.dex")
        self.assertEqual(dumped.returncode, 0, dumped.stderr)
        classes = re.findall(r"Class descriptor\s*: '(L[^']+;)'", dumped.stdout)
        self.assertIn("Lorg/modar/MainActivity;", classes)
        # The phone's version is asked of the phone, not of the stubs.
        self.assertIn("Landroid/os/Build$VERSION;.SDK_INT", dumped.stdout)
        # Nothing of the stubs and nothing of anybody else's.
        self.assertEqual([c for c in classes if not c.startswith("Lorg/modar/")], [])

    def fakes(self):
        """Compiled fakes of Android's classes, and the driver."""
        fakes = write_fakes(self.folder / "fakes")
        code = ROOT / "build" / "android" / "code"
        classes, app = self.folder / "fake-classes", code / "classes"
        compile_java(classes, [*fakes.rglob("*.java"), FAKES / "fake" / "GlContext.java",
                               FAKES / "org" / "modar" / "AppRun.java", code / "names" / "org" / "modar" / "R.java"], [app])
        return [classes, app, code / "stub-classes"]  # Camera2, which is named but not there

    def run_app(self, apk, clip, home, *more):
        done = run_java(self.fakes(), "org.modar.AppRun", apk, clip, WIDTH, HEIGHT, home, self.folder / "last.rgba",
                        ROOT / "runtime" / "android" / "res" / "layout" / "main.xml", *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("the day is over", done.stdout)
        self.assertNotIn("WARNING", done.stdout + done.stderr)
        return (home / "diagnostics.txt").read_text()

    def test_a_day_of_the_app_in_a_jvm(self):
        """The APK's own class files and assets, on a fake phone."""
        bundle = self.bake_demo("vase.modar")
        (self.folder / "vase.properties").write_text("cover=Found in 1922.\n")
        key, home = self.folder / "museum.key", self.folder / "home"
        home.mkdir()
        for words in (["keygen", "--out", key], ["publish", bundle, "--to", home / "release", "--key", key]):
            done = self.modar("ship", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
        apk, _ = self.made("vases", bundle, "--release", "https://museum.example/ar", "--trust", f"{key}.pub")
        badging = run("aapt", "dump", "badging", apk).stdout
        self.assertEqual(sorted(re.findall(r"uses-permission: name='(.*?)'", badging)),
                         ["android.permission.CAMERA", "android.permission.INTERNET"])
        words = "assets/words.properties"
        with zipfile.ZipFile(f"{apk}.empty", "w") as empty, zipfile.ZipFile(apk) as whole:
            empty.writestr(words, whole.read(words))
        clip = make_clip(self.folder / "clip")
        told = self.run_app(apk, clip, home, make_covered_clip(self.folder / "covered"))
        for word in ("phone: fake phone", "bundle: vase (app)", "store.damaged"):
            self.assertIn(word, told)
        if os.environ.get("MODAR_KEEP"):
            shutil.copy(self.folder / "last.rgba", os.environ["MODAR_KEEP"])

    def fill(self, store):
        """A store that takes a few files and is full then, in the middle of a release; None where the machine gives none."""
        store.mkdir()
        if run("mount", "-t", "tmpfs", "-o", "size=64m,nr_inodes=8", "tmpfs", store).returncode != 0:
            print("no right to mount a small file system: the full storage is left out")
            return None
        self.addCleanup(run, "umount", store)
        return store

    @unittest.skipUnless(NGINX, "no nginx")
    def test_releases_from_a_web_server_while_the_app_runs(self):
        bundle = self.bake_demo("vase.modar")
        other = self.folder / "other" / "vase.modar"
        other.parent.mkdir()
        done = self.modar("bake", "--model", POTTERY, "--pattern", COVER, "--scene", "cover=pottery,scale=0.7", "-o", other,
                          "--quiet", "--no-lods", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        key, home, steps, release = (self.folder / name for name in ("museum.key", "home", "steps", "release"))
        home.mkdir()
        steps.mkdir()
        full = self.fill(home / "store")
        if full:
            (steps / "full").touch()
        ship = lambda *words: self.assertEqual(self.modar("ship", *words).returncode, 0)
        ship("keygen", "--out", key)
        ship("publish", bundle, "--to", release, "--key", key)
        server = Nginx(release, self.folder / "nginx")
        self.addCleanup(server.stop)
        apk, _ = self.made("vases", bundle, "--release", server.url(), "--trust", f"{key}.pub")
        clip = make_clip(self.folder / "clip")

        def forge():
            ship("publish", bundle, "--to", release, "--key", key)
            document = release / "releases" / "3.json"
            document.write_bytes(document.read_bytes().replace(b"vase", b"vasa"))

        def serve():
            actions = {"freed": lambda: self.assertEqual(run("mount", "-o", "remount,nr_inodes=0", full).returncode, 0),
                       "second": lambda: ship("publish", other, "--to", release, "--key", key), "forged": forge, "gone": server.stop}
            for name, action in actions.items():
                if name == "freed" and not full:
                    continue
                while not (steps / name).exists():
                    time.sleep(0.05)
                action()
                (steps / f"{name}.done").touch()

        threading.Thread(target=serve, daemon=True).start()
        told = self.run_app(apk, clip, home, "", steps)
        for word in ("signature.bad", "fetch.network", "bundle: vase (release)", *(["No space left"] if full else [])):
            self.assertIn(word, told)

    def test_wrong_words(self):
        for words, code, text in (([], 1, "name a bundle"), (["x.modar", "--id", "vases"], 1, "application id"),
                                  (["none.modar"], 2, "none.modar"), (["--frob"], 1, "--frob"),
                                  ([GOLDEN, "--release", "http://x"], 1, "--trust")):
            done = self.make(*words)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(text, done.stderr)


if __name__ == "__main__":
    unittest.main()
