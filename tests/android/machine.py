"""The Java machine of these tests: how it is compiled for and run, and the frames that it is fed."""
import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(ROOT / "tests" / "cli"))

from programs import BIN, CLIP_HEIGHT, CLIP_WIDTH, COVER, POTTERY, ProgramTest, covered_clip, demo_clip  # noqa: E402, F401

JNI = os.environ.get("MODAR_JNI", str(BIN.parent / "runtime" / "extensions" / "android"))
FAKE_GL = os.environ.get("MODAR_FAKE_GL", str(BIN.parent / "tests" / "android"))
APP = ROOT / "runtime" / "extensions" / "android" / "java"
FAKES = pathlib.Path(__file__).resolve().parent / "java"
SOAK = os.environ.get("MODAR_SOAK") == "full"
WIDTH, HEIGHT, FRAMES = CLIP_WIDTH, CLIP_HEIGHT, 10


def compile_java(out, files, classpath=(), release="11"):
    out.mkdir(parents=True, exist_ok=True)
    words = ["javac", "-J-XX:TieredStopAtLevel=1", "-proc:none", "--release", release, "-Xlint:-options", "-d", out,
             *(["-cp", os.pathsep.join(map(str, classpath))] if classpath else []), *files]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def run_java(classpath, *words, timeout=1800 if SOAK else 300):
    """A JVM that checks each JNI call; with sanitizers in the libraries, their runtime comes first."""
    env = {**os.environ}
    if os.environ.get("MODAR_SANITIZE"):
        names = ["libasan.so", "libubsan.so"]
        found = [subprocess.run(["gcc", f"-print-file-name={n}"], capture_output=True, text=True).stdout.strip() for n in names]
        env["LD_PRELOAD"] = " ".join(found)
        # The JVM handles faults of its own and frees nothing at its end.
        env["ASAN_OPTIONS"] = "handle_segv=0:detect_leaks=0:allow_user_segv_handler=1"
    line = ["java", "-Xcheck:jni", "-XX:TieredStopAtLevel=1", "-Xmx256m", "--add-opens=java.base/java.io=ALL-UNNAMED",
            f"-Djava.library.path={JNI}:{FAKE_GL}", "-cp", os.pathsep.join(map(str, classpath)), *words]
    return subprocess.run(list(map(str, line)), capture_output=True, text=True, env=env, timeout=timeout)


def make_clip(folder, frames=FRAMES):
    """NV21 as a phone's camera gives it, one file: our cover before clutter, held in a hand."""
    demo_clip(folder, frames)
    return nv21_of(folder)


def make_long_clip(folder, frames):
    """The same for longer than the demo's clip, from other directions."""
    subprocess.run([sys.executable, ROOT / "assets" / "make_clip.py", "--pattern", COVER, "--frames", str(frames), "--size",
                    f"{WIDTH}x{HEIGHT}", folder], check=True)
    return nv21_of(folder)


def nv21_of(folder):
    file = folder / "clip.nv21"
    subprocess.run(["ffmpeg", "-v", "error", "-pattern_type", "glob", "-i", str(folder / "*.png"), "-vf", "scale=out_range=full",
                    "-pix_fmt", "nv21", "-f", "rawvideo", str(file)], check=True)
    return file


def make_covered_clip(folder):
    """covered_clip() in NV21."""
    folder.mkdir(exist_ok=True)
    gray, file = folder / "covered.gray", folder / "covered.nv21"
    covered_clip(gray, WIDTH, HEIGHT)
    size, luma = WIDTH * HEIGHT, gray.read_bytes()
    file.write_bytes(b"".join(luma[at:at + size] + b"\x80" * (size // 2) for at in range(0, len(luma), size)))
    return file


def bake_with_texts(test, name):
    """Pottery on the cover, as bake_demo() has it, with texts in two languages."""
    project = test.folder / "project"
    project.mkdir()
    (project / "models").symlink_to(POTTERY.parent)
    (project / "cover.png").symlink_to(COVER)
    text = {"en": "A vase.", "de": "Eine Vase."}
    (project / "modar.toml").write_text(
        '[project]\nname = "vase"\n[bake]\nup = "z"\nlods = 1\nloop-views = 8\nscore = false\n[[model]]\nfile = "models/pottery.obj"\n'
        '[[pattern]]\nfile = "cover.png"\n[[scene]]\npattern = "cover"\nmodel = "pottery"\nscale = 0.5\n' +
        "".join(f'text.{language} = "{each}"\nalt.{language} = "{each[:-1]} \U0001F3FA"\n' for language, each in text.items()))
    done = test.modar("bake", "--outside", "--quiet", cwd=project)
    test.assertEqual(done.returncode, 0, done.stderr)
    return pathlib.Path(shutil.copyfile(project / "out" / "vase.modar", test.folder / name))


def write_fakes(folder):
    """Android's classes as the tests have them, a Java file each."""
    for part in (FAKES.parent / "fake_android.txt").read_text().split("\n== ")[1:]:
        name, _, text = part.partition("\n")
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def have(*programs):
    return all(shutil.which(each) for each in programs)
