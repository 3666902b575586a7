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
import zlib

from machine import COVER, FAKES, HEIGHT, ROOT, WIDTH, ProgramTest, bake_with_texts, compile_java, have, make_clip, make_covered_clip, nv21_of, run_java, write_fakes

from film_project import bake_film, make_frames  # noqa: E402
from programs import POTTERY, QUICK  # noqa: E402
from servers import NGINX, Keeper, Nginx  # noqa: E402

TOOLS = ("javac", "aapt", "aapt2", "zipalign", "apksigner", "jarsigner", "dexdump", "keytool", "proguard")
GOLDEN = ROOT / "tests" / "golden" / "v1_0.modar"
# 37,000 before the look without the camera, photos, texts by language; 46,000 before videos and sounds; 54,000 before marks of labels;
# 56,400 before recordings; 64,600 before the menu and pictures of visitors' own; 75,000 before lists
MAX_DEX = 77_000


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def png(width, height, colour):
    """A picture of one colour."""
    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
    rows = (b"\0" + bytes(colour) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def pixels(file):
    """Red, green, blue of the middle of an image, by ffmpeg."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", "-", "-vf", "crop=1:1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], input=file,
                          capture_output=True, check=True)
    return done.stdout


# Of a stored photo by its orientation: whether its rows are the scene's columns, and whether its first row and its first column
# are at the scene's far side (JEITA CP-3451, orientation).
EXIF_ORIGIN = {1: (False, False, False), 2: (False, False, True), 3: (False, True, True), 4: (False, True, False),
               5: (True, False, False), 6: (True, True, False), 7: (True, True, True), 8: (True, False, True)}


def turned_photo(orientation, width=160, height=96):
    """A JPEG of a scene that is red at the top left, green at the top right, blue below."""
    columns, far_row, far_column = EXIF_ORIGIN[orientation]
    stored = (height, width) if columns else (width, height)
    pixels = bytearray()
    for row in range(stored[1]):
        for column in range(stored[0]):
            down, along = (stored[1] - 1 - row if far_row else row), (stored[0] - 1 - column if far_column else column)
            x, y = (down, along) if columns else (along, down)
            pixels += bytes((0, 0, 255) if y >= height / 2 else (255, 0, 0) if x < width / 2 else (0, 255, 0))
    jpeg = subprocess.run(["ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{stored[0]}x{stored[1]}", "-i", "-", "-q:v", "2",
                           "-f", "mjpeg", "-"], input=bytes(pixels), capture_output=True, check=True).stdout
    tiff = b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 0x112, 3, 1, orientation, 0, 0)
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", 8 + len(tiff)) + b"Exif\0\0" + tiff + jpeg[2:]


@unittest.skipUnless(have(*TOOLS) and pathlib.Path("/usr/share/android-framework-res/framework-res.apk").exists(),
                     "no aapt, zipalign, apksigner, dexdump, android-framework-res or JDK")
class Apk(ProgramTest):
    def make(self, *words, abis="none", ndk=None):
        """Without the native library, which the bridge's tests build for this machine."""
        environment = {key: value for key, value in os.environ.items() if key != "ANDROID_NDK"}
        environment |= {"ANDROID_ABIS": abis} | ({"ANDROID_NDK": str(ndk)} if ndk else {})
        return run(ROOT / "scripts" / "apk.sh", *words, env=environment)

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

    def test_no_app_without_an_ndk(self):
        out = self.folder / "vases.apk"
        old = self.folder / "r24"
        old.mkdir()
        (old / "source.properties").write_text("Pkg.Desc = Android NDK\nPkg.Revision = 24.0.8215888\n")
        for ndk, cause, cure in ((None, "ANDROID_NDK is not set", "https://developer.android.com/ndk"), (old, "r25 or newer", "'24'"),
                                 (self.folder, "r25 or newer", "source.properties")):
            done = self.make(GOLDEN, "--out", out, abis="", ndk=ndk)
            self.assertEqual((done.returncode, done.stdout), (5, ""), done.stderr)
            self.assertIn(cause, done.stderr)
            self.assertIn(cure, done.stderr)
            self.assertFalse(out.exists())

    def test_a_phone_is_tried_by_one_command(self):
        """scripts/phone_try.sh with an adb that lists its calls and answers as a phone does."""
        adb, asked, apk, out = self.folder / "bin" / "adb", self.folder / "asked", self.folder / "trial.apk", self.folder / "phone"
        adb.parent.mkdir()
        with zipfile.ZipFile(apk, "w") as archive:
            archive.writestr("classes.dex", bytes(1000))
            archive.writestr("lib/armeabi-v7a/libmodar_jni.so", os.urandom(3000))
        adb.write_text(f"""#!/bin/sh
echo "$*" >> {asked}
case "$*" in
  devices) printf 'List of devices attached\\n'; printf "$PHONES" ;;
  *meminfo*) echo '        TOTAL    41234' ;;
  *screencap*) printf 'a picture' ;;
  "logcat -d") echo 'a line of the log' ;;
  pull*) [ -z "$SILENT" ] && echo 'frames: 812, 29.4 a second' > "$3" ;;
esac
""")
        adb.chmod(0o755)

        def tries(*words, phones="ace2\\tdevice\\n", **more):
            environment = {**os.environ, "PATH": f"{adb.parent}:{os.environ['PATH']}", "PHONES": phones, **more}
            return run(ROOT / "scripts/phone_try.sh", *words, "--out", out, env=environment)

        done = tries(GOLDEN, "--apk", apk, "--seconds", "11")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("29.4 a second", done.stdout)
        self.assertIn("TOTAL    41234", done.stdout)
        calls = asked.read_text().splitlines()
        started = calls.index("shell am start -W -n org.modar.trial/org.modar.MainActivity")
        self.assertLess(calls.index(f"install -r {apk}"), started)
        self.assertEqual(calls[-3:], ["shell input keyevent KEYCODE_HOME", "logcat -d",
                                      f"pull /sdcard/Android/data/org.modar.trial/files/diagnostics.txt {out}/diagnostics.txt"])
        self.assertEqual(sorted(path.name for path in out.iterdir()),
                         ["apk.txt", "diagnostics.txt", "log.txt", "memory.txt", "screen25.png", "screen50.png", "screen90.png"])
        self.assertRegex((out / "apk.txt").read_text(), r"bytes: the app\n3\d\d\d lib/armeabi-v7a/libmodar_jni.so\n1000 classes.dex")
        for words, more, code, told in (((), {}, 1, "name a bundle"), ((GOLDEN, "--seconds", "0"), {}, 1, "'0' is no number"),
                                        ((self.folder / "none.modar",), {}, 2, "cannot be read"),
                                        ((GOLDEN, "--apk", apk), {"phones": ""}, 5, "0 phones are ready"),
                                        ((GOLDEN, "--apk", apk), {"phones": "a\\tdevice\\nb\\tdevice\\n"}, 5, "2 phones are ready"),
                                        ((GOLDEN, "--apk", apk, "--seconds", "1"), {"SILENT": "1"}, 4, "wrote no diagnostics.txt")):
            with self.subTest(told):
                done = tries(*words, **more)
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(told, done.stderr)

    def test_what_androids_tools_say(self):
        bundle = self.folder / "vase.modar"
        bundle.write_bytes(GOLDEN.read_bytes())
        (self.folder / "vase.properties").write_text("cover=Found in 1922.\n")
        icon = self.folder / "vase.png"
        icon.write_bytes(COVER.read_bytes())
        store = self.folder / "store"
        apk, _ = self.made("vases", bundle, "--title", "Vase's & more", "--id", "org.museum.vases", "--version-code", "7",
                              "--version-name", "2026 <b>", "--store", store)
        signed = run("apksigner", "verify", "--verbose", "--min-sdk-version", "19", apk)
        self.assertEqual(signed.returncode, 0, signed.stderr)
        for scheme in ("v1 scheme (JAR signing)", "v2 scheme (APK Signature Scheme v2)", "v3 scheme (APK Signature Scheme v3)"):
            self.assertIn(f"Verified using {scheme}: true", signed.stdout)
        self.assertEqual(run("zipalign", "-c", "-p", "8", apk).returncode, 0)
        self.assertEqual(self.offset(apk, "assets/bundles/vase.modar") % 8, 0)
        badging = run("aapt", "dump", "badging", apk).stdout
        for line in ("package: name='org.museum.vases'", "sdkVersion:'19'", "targetSdkVersion:'36'",
                     "versionCode='7' versionName='2026 <b>'", "application-icon-640:'res/mipmap-anydpi-v26/icon.xml'",
                     "launchable-activity: name='org.modar.MainActivity'", 'application-label:'):
            self.assertIn(line, badging)
        self.assertIn("Vase's & more", badging)
        self.assertEqual(re.findall(r"uses-permission: name='(.*?)'(.*)", badging),
                         [("android.permission.CAMERA", ""), ("android.permission.WRITE_EXTERNAL_STORAGE", " maxSdkVersion='20'"),
                          ("android.permission.READ_EXTERNAL_STORAGE", " maxSdkVersion='20'")])  # writing implies it
        self.check_store(store, apk, badging)
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
        # The phone's version is queried of the phone, not of the stubs.
        self.assertIn("Landroid/os/Build$VERSION;.SDK_INT", dumped.stdout)
        # Nothing of the stubs and nothing of anybody else's.
        self.assertEqual([c for c in classes if not c.startswith("Lorg/modar/")], [])

    def check_store(self, store, apk, badging):
        """The app bundle is the APK in another form: Android's own tool turns it back into one that says the same."""
        bundle = store / "vases.aab"
        self.assertEqual(run("jarsigner", "-verify", bundle).returncode, 0)
        with zipfile.ZipFile(bundle) as file, zipfile.ZipFile(apk) as whole:
            files = {name: file.read(name) for name in file.namelist() if not name.startswith("META-INF/")}
            for name in ("classes.dex", "assets/bundles/vase.modar", "assets/words.properties", "assets/words-de.properties"):
                folder = "base/dex/" if name.endswith(".dex") else "base/"
                self.assertEqual(files.pop(folder + name), whole.read(name), name)
        self.assertEqual(files["BundleConfig.pb"], b"\x0a\x08\x12\x061.17.0\x12\x06\x12\x04\x08\x01\x10\x02\x1a\x18\x0a\x16assets/bundles/*.modar")
        self.assertEqual(files["base/assets.pb"], b"\x0a\x0a\x0a\x06assets\x12\x00\x0a\x12\x0a\x0eassets/bundles\x12\x00")
        with zipfile.ZipFile(store / "proto.apk", "w") as proto:
            for name, content in files.items():
                if name.startswith(("base/res/", "base/resources.pb", "base/manifest/")):
                    proto.writestr(name.removeprefix("base/").removeprefix("manifest/"), content)
        done = run("aapt2", "convert", "--output-format", "binary", "-o", store / "again.apk", store / "proto.apk")
        self.assertEqual(done.returncode, 0, done.stderr)
        again = run("aapt", "dump", "badging", store / "again.apk").stdout
        about = re.compile(r"^(package: name='\S+' version\S+ versionName='.*?'|sdkVersion.*|targetSdk.*|uses-permission.*|application-label:.*)", re.M)
        self.assertEqual(about.findall(again), about.findall(badging))
        self.assertGreater(len(about.findall(again)), 4)
        # The numbers of resources are in the code.
        resources = [re.findall(r"resource (0x\w+) (\w+[:/]\w+/?\w*)", run("aapt2", "dump", "resources", each).stdout)
                     for each in (apk, store / "again.apk")]
        numbers = [{name.split(":")[-1]: number for number, name in found} for found in resources]
        self.assertEqual(numbers[0], numbers[1])
        self.assertIn("id/around", numbers[0])
        listing = store / "fastlane/metadata/android/en-US"
        self.assertEqual((listing / "title.txt").read_text(), "Vase's & more\n")
        self.assertEqual(struct.unpack(">II", (listing / "images/icon.png").read_bytes()[16:24]), (512, 512))
        privacy = (store / "privacy.html").read_text()
        self.assertIn("Vase&#x27;s &amp; more", privacy)
        self.assertIn("no permission to use the network", privacy)
        self.assertIn("CurrentVersionCode: 7", (store / "metadata/org.museum.vases.yml").read_text())

    def test_the_icon_is_the_bundles_picture(self):
        bundle = self.folder / "vase.modar"
        bundle.write_bytes(GOLDEN.read_bytes())
        red = self.folder / "red.png"
        red.write_bytes(png(40, 20, (200, 10, 30)))
        ours = (ROOT / "runtime/extensions/android/res/mipmap-xxxhdpi/icon.png").read_bytes()
        for words, wanted in ((["--icon", red], bytes((200, 10, 30))), ([], pixels(ours))):
            apk, _ = self.made("vases", bundle, *words)
            with zipfile.ZipFile(apk) as file:
                icon = file.read("res/mipmap-xxxhdpi-v4/icon.png")
            self.assertEqual(struct.unpack(">II", icon[16:24]), (192, 192))
            self.assertEqual(pixels(icon), wanted)

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
                        ROOT / "runtime" / "extensions" / "android" / "res" / "layout" / "main.xml", *more)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("the day is over", done.stdout)
        self.assertNotIn("WARNING", done.stdout + done.stderr)
        return (home / "diagnostics.txt").read_text()

    def test_a_day_of_the_app_in_a_jvm(self):
        """The APK's own class files and assets, on a fake phone."""
        bundle = bake_with_texts(self, "vase.modar")
        (self.folder / "vase.properties").write_text("cover=Found in 1922.\n")
        key, home = self.folder / "museum.key", self.folder / "home"
        home.mkdir()
        for words in (["keygen", "--out", key], ["publish", bundle, "--to", home / "release", "--key", key]):
            done = self.modar("ship", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
        apk, _ = self.made("vases", bundle, "--release", "https://museum.example/ar", "--trust", f"{key}.pub")
        badging = run("aapt", "dump", "badging", apk).stdout
        self.assertEqual(sorted(re.findall(r"uses-permission: name='(.*?)'", badging)),
                         ["android.permission.CAMERA", "android.permission.INTERNET", "android.permission.READ_EXTERNAL_STORAGE",
                          "android.permission.WRITE_EXTERNAL_STORAGE"])
        words = "assets/words.properties"
        with zipfile.ZipFile(f"{apk}.empty", "w") as empty, zipfile.ZipFile(apk) as whole:
            empty.writestr(words, whole.read(words))
        clip = make_clip(self.folder / "clip")
        told = self.run_app(apk, clip, home, make_covered_clip(self.folder / "covered"))
        for word in ("phone: fake phone", "bundle: vase (app)", "store.damaged"):
            self.assertIn(word, told)
        if os.environ.get("MODAR_KEEP"):
            for each in ("last.rgba", "last.rgba.around"):
                shutil.copy(self.folder / each, os.environ["MODAR_KEEP"])

    def test_a_scene_acts_on_the_screen(self):
        bundle, frames, home = bake_film(self), make_frames(self.folder), self.folder / "home"
        home.mkdir()
        apk, _ = self.made("film", bundle)
        self.run_app(apk, nv21_of(frames), home, "scene")

    def test_a_picture_of_ones_own_gets_the_model(self):
        """The bundle knows our cover; the clip shows another print, on a plain table."""
        bundle, home = self.folder / "vase.modar", self.folder / "home"
        home.mkdir()
        done = self.modar("bake", "--model", POTTERY, "--model", ROOT / "assets/models/bust.obj", "--pattern", COVER, "--scene", "cover=pottery,scale=0.5",
                          "--scene", "cover=bust,scale=0.8", "-o", bundle, "--quiet", "--no-lods", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        other = next(path for path in sorted((ROOT / "assets/patterns").glob("*.png")) if path != COVER)
        print_of = "[1]scale=210:300[print];[0][print]overlay=x='135+2*n':y=30"  # as AppRun has it
        (self.folder / "table").mkdir()
        subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", f"color=0x6a9a70:s={WIDTH}x{HEIGHT}:r=10:d=1", "-i", other, "-filter_complex",
                        print_of, self.folder / "table" / "%03d.png"], check=True)
        wall = self.folder / "wall.png"
        wall.write_bytes(png(1200, 900, (120, 120, 118)))
        for orientation in EXIF_ORIGIN:
            (self.folder / f"turned{orientation}.jpg").write_bytes(turned_photo(orientation))
        apk, _ = self.made("vases", bundle)
        self.run_app(apk, nv21_of(self.folder / "table"), home, "own", wall)

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

    def test_the_preview_of_a_release_is_shown(self):
        """An app without bundles; the server keeps back what comes after the preview."""
        bundle, key, home, steps, release = (self.folder / name for name in ("vase.modar", "museum.key", "home", "steps", "release"))
        done = self.modar("bake", "--model", POTTERY, "--pattern", COVER, "-o", bundle, "--quiet", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        for words in (["keygen", "--out", key], ["publish", bundle, shutil.copy(bundle, self.folder / "urn.modar"), "--to", release, "--key", key]):
            done = self.modar("ship", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
        home.mkdir()
        steps.mkdir()

        def held():
            kept = (home / "store/pieces/vase.first").exists() and not (steps / "rest").exists()
            if (steps / "rest").exists():
                (steps / "rest.done").touch()
            return kept

        server = Keeper(release, held)
        self.addCleanup(server.stop)
        whole, _ = self.made("vases", bundle, "--release", server.url(), "--trust", f"{key}.pub")
        apk = self.folder / "none.apk"
        with zipfile.ZipFile(whole) as all_files, zipfile.ZipFile(apk, "w") as few:
            for name in ("words.properties", "release.txt", "release.pub"):
                few.writestr(f"assets/{name}", all_files.read(f"assets/{name}"))
        self.assertIn("bundle: urn (release)", self.run_app(apk, make_clip(self.folder / "clip"), home, "first", steps))

    def test_each_language_has_all_words(self):
        def words(file):
            lines = [line for line in file.read_text(encoding="utf-8").replace("\\\n", "").splitlines() if not line.startswith("#")]
            return {key: re.findall("%[^ %]", text) for key, text in (re.split(r"(?<!\\)=", line, maxsplit=1) for line in lines)}

        assets = ROOT / "runtime" / "extensions" / "android" / "assets"
        wanted = words(assets / "words.properties")
        del wanted["diagnostics"]
        files = sorted(assets.glob("words-*.properties"))
        self.assertEqual([file.stem[6:] for file in files], "de el es fr it nl pl".split())
        for file in files:
            self.assertEqual(words(file), wanted, file.name)

    def test_wrong_words(self):
        for words, code, text in (([], 1, "name a bundle"), (["x.modar", "--id", "vases"], 1, "application id"),
                                  (["none.modar"], 2, "none.modar"), (["--frob"], 1, "--frob"),
                                  ([GOLDEN, "--release", "http://x"], 1, "--trust"), ([GOLDEN, "--version-code", "0"], 1, "2100000000"),
                                  ([GOLDEN, "--icon", "none.png"], 2, "none.png")):
            done = self.make(*words)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(text, done.stderr)


if __name__ == "__main__":
    unittest.main()
