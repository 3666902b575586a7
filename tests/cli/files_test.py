"""What people trust the programs with: no input is overwritten, nothing is lost on the way, mistakes are answered."""
import json
import os
import shutil
import struct
import subprocess
import unittest

from programs import BIN, COVER, POTTERY, ROOT, STATUE, ProgramTest, picture, needs

GAME = COVER.parent / "game.png"


class Inputs(ProgramTest):
    """An output that is an input: by its path, a symbolic link, a hard link."""

    def aliases(self, original):
        path = self.folder / original.name
        shutil.copy(original, path)
        soft, hard = self.folder / "soft", self.folder / "hard"
        for link in (soft, hard):
            link.unlink(missing_ok=True)
        soft.symlink_to(path)
        os.link(path, hard)
        return path, [path, f"./{path.name}", soft, hard]

    def assert_kept(self, path, done):
        self.assert_fails(done, 1, "overwrite", "name another")
        self.assertNotIn("\n", done.stderr.strip(), "work was begun")
        original = {p.name: p for p in (COVER, POTTERY)}[path.name]
        self.assertEqual(path.read_bytes(), original.read_bytes())

    def test_bake(self):
        for original, option in ((COVER, "--pattern"), (POTTERY, "--model")):
            path, outputs = self.aliases(original)
            for output in outputs:
                self.assert_kept(path, self.modar("bake", option, path, "-o", output))

    def test_files_that_a_model_names(self):
        (self.folder / "m.obj").write_text("mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        materials = self.folder / "m.mtl"
        materials.write_text("newmtl a\nmap_Kd skin.png\n")
        shutil.copy(COVER, self.folder / "skin.png")
        for path in (materials, self.folder / "skin.png"):
            before = path.read_bytes()
            self.assert_fails(self.modar("bake", "--model", "m.obj", "-o", path), 1, path.name, "not a bundle")
            self.assertEqual(path.read_bytes(), before)

    def test_rectify_and_calibrate(self):
        path, outputs = self.aliases(COVER)
        for output in outputs:
            self.assert_kept(path, self.modar("pattern", "rectify", path, "--corners", "10,10,300,40,310,600,20,650",
                                              "-o", output))
            self.assert_kept(path, self.modar("calibrate", path, "--board", "9x6", "-o", output))

    @needs("report")
    def test_files_of_other_kinds_stay(self):
        bundle = self.bake_demo()
        (self.folder / "modar.toml").write_text(f"[[model]]\nfile = \"m.obj\"\n[bake]\nlods = 1\nocclusion = false\n")
        (self.folder / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        share = self.folder / "share"
        thesis = "My thesis.\nall: paper.pdf\n"
        for name, words in (("page.html", ["report", bundle, "-o"]), ("deps.d", ["bake", "--depfile"]), ("camera.yml", ["calibrate", COVER, "--board", "9x6", "-o"]),
                            ("share/man/man1/modar-bake.1", ["document", "-o"]),
                            ("share/bash-completion/completions/modar", ["document", "-o"])):
            with self.subTest(name):
                path = self.folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(thesis)
                output = share if words[0] == "document" else path
                done = self.modar(*words, output)
                self.assert_fails(done, 1, "out.foreign", str(path))
                self.assertEqual(path.read_text(), thesis)
                path.write_text("")  # nothing is lost
                if words[0] != "calibrate":
                    for _ in range(2):
                        done = self.modar(*words, output)
                        self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertNotEqual(path.read_text(), "")
        status = self.folder / "status.json"
        status.write_text(thesis)
        done = self.run_program("modar-fetch", "--store", self.folder / "store", "--verify", "--status", status)
        self.assert_fails(done, 1, "out.foreign", "status.json")
        self.assertEqual(status.read_text(), thesis)
        self.assert_fails(self.modar("inspect", bundle, "--extract", status), 2, "Not a directory")

    def test_a_bundle_has_no_name_of_another_format(self):
        for name in ("d.png", "d.JPG", "d.heic", "d.obj", "d.glb", "d.mtl"):
            done = self.modar("bake", COVER, "-o", self.folder / name)
            self.assert_fails(done, 1, "out.name", "write -o " + str(self.folder / "d.modar"))
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_an_empty_name_is_said(self):
        for words in (["--model", ""], ["--pattern", ""], [""]):
            self.assert_fails(self.modar("bake", *words, "-o", self.folder / "o.modar"), 2, "the name of a file is empty")

    def test_pictures_beside_patterns(self):
        path, _ = self.aliases(COVER)
        self.assert_kept(path, self.modar("pattern", "score", path, "--overlay", "."))
        self.assert_kept(path, self.modar("pattern", "simulate", path, "--picture", self.folder, "--quiet"))
        for words in (("simulate", path, "--picture", "new.png"), ("score", path, "--overlay", "new.txt")):
            self.assert_fails(self.modar("pattern", *words), 1, "out.folder", "a folder is written, and this names a file")
        bundle = self.folder / "b.modar"
        model = self.folder / "cover.obj"
        model.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.assertEqual(self.modar("bake", "--model", model, "-o", bundle).returncode, 0)
        self.assert_kept(path, self.modar("check", bundle, "--source", model, path, "--visual", "."))


class Player(ProgramTest):
    def play(self, *arguments, **options):
        return self.run_program("modar-play", self.bundle, *arguments, "--quiet", **options)

    def setUp(self):
        super().setUp()
        self.bundle = self.bake_demo()

    def test_no_input_is_overwritten(self):
        movie = self.folder / "v.mp4"
        self.assertEqual(self.play("--input", COVER, "--out", movie).returncode, 0)
        before = movie.read_bytes()
        soft, hard = self.folder / "soft.mp4", self.folder / "hard.mp4"
        soft.symlink_to(movie)
        os.link(movie, hard)
        for output in (movie, soft, hard):
            self.assert_fails(self.play("--input", movie, "--out", output), 1, "overwrite")
        self.assert_fails(self.play("--input", COVER, "--qos", self.bundle), 1, "overwrite")
        report = self.folder / "report"
        report.mkdir()
        shutil.copy(movie, report / "overlay.mp4")
        self.assert_fails(self.play("--input", report / "overlay.mp4", "--report", report), 1, "overwrite")
        self.assertEqual(movie.read_bytes(), before)

    def test_a_folder_with_other_files_is_refused(self):
        photos = self.folder / "photos"
        photos.mkdir()
        (photos / "holiday.txt").write_text("mine")
        for option in ("--out", "--report"):
            self.assert_fails(self.play("--input", COVER, option, photos), 1, "holiday.txt", "--force")
            self.assertEqual([p.name for p in photos.iterdir()], ["holiday.txt"])
        self.assertEqual(self.play("--input", COVER, "--out", photos, "--force").returncode, 0)
        self.assertEqual(sorted(p.name for p in photos.iterdir()), ["frame_000000.png", "holiday.txt"])

    def test_frames_of_an_earlier_run_go(self):
        out = self.folder / "out"
        two = self.folder / "two"
        two.mkdir()
        for name in ("a.png", "b.png"):
            shutil.copy(COVER, two / name)
        self.assertEqual(self.play("--input", two, "--out", out).returncode, 0)
        self.assertEqual(len(list(out.iterdir())), 2)
        self.assertEqual(self.play("--input", COVER, "--out", out).returncode, 0)
        self.assertEqual([p.name for p in out.iterdir()], ["frame_000000.png"])

    def test_a_window_needs_a_display(self):
        none = {name: "" for name in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = self.play("--input", COVER, "--window", env=none)
        self.assert_fails(done, 5, "--window")

    def test_the_nearest_option_is_suggested(self):
        self.assert_fails(self.play("--imput", COVER), 1, "--imput", "did you mean --input?")
        self.assert_fails(self.run_program("modar-fetch", "--stroe", "x"), 1, "did you mean --store?")


class Outputs(ProgramTest):
    def test_the_folder_is_tried_before_the_work(self):
        for output in ("no/such/folder/out.modar", "notes.txt/out.modar", "."):
            (self.folder / "notes.txt").write_text("no folder")
            done = self.modar("bake", "--model", "none.obj", "-o", output)
            self.assert_fails(done, 2, output)
            self.assertNotIn("none.obj", done.stderr)  # which is missing: it was not looked for
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["notes.txt"])

    def test_a_full_disk_names_the_file_and_leaves_the_earlier_one(self):
        bundle = self.folder / "out.modar"
        earlier = self.bake_demo("earlier.modar").read_bytes()
        bundle.write_bytes(earlier)
        (self.folder / "earlier.modar").unlink()
        self.assert_fails(self.on_full_disk(40, "bake", "--model", POTTERY, "--no-lods", "-o", bundle, "--quiet"), 2, "out.modar")
        self.assertEqual(bundle.read_bytes(), earlier)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["out.modar"])

    @needs("web")
    def test_a_full_disk_leaves_no_part_of_a_folder(self):
        bundle = self.bake_demo()
        out = self.folder / "out"
        blocks = 200  # of 512 bytes: less than the largest file
        for words in (["inspect", bundle, "--extract", out], ["web", bundle, "-o", out, "--page", ROOT / "runtime/extensions/web"]):
            self.assert_fails(self.on_full_disk(blocks, *words), 2, "out/")
            self.assertFalse(out.exists(), words)
        self.assertEqual(self.modar("inspect", bundle, "--extract", out).returncode, 0)
        self.assertGreater(max(p.stat().st_size for p in out.iterdir()), 512 * blocks)
        before = {p.name: p.stat().st_mtime_ns for p in out.iterdir()}
        self.assert_fails(self.on_full_disk(blocks, "inspect", bundle, "--extract", out), 2, "out/")
        self.assertEqual({p.name: p.stat().st_mtime_ns for p in out.iterdir()}, before)

    def on_full_disk(self, blocks, *words):
        """A limit on the size of files, with its signal ignored: writes beyond it fail as on a full disk."""
        return subprocess.run(["sh", "-c", f'trap "" XFSZ; ulimit -f {blocks}; exec "$@"', "sh", str(BIN / "modar"), *map(str, words)],
                              capture_output=True, text=True)

    def test_rectify_writes_png_only(self):
        done = self.modar("pattern", "rectify", COVER, "--corners", "10,10,300,40,310,600,20,650", "-o", "x.jpg")
        self.assert_fails(done, 1, "x.jpg", ".png")
        self.assertFalse((self.folder / "x.jpg").exists())


class OtherFiles(ProgramTest):
    """Files other than models, pictures and bundles are named by their kind, and nothing is written."""

    def test_pictures_that_are_not_read_name_what_converts_them(self):
        for name, start, tool in (("photo.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "heif-convert"),
                                  ("photo.jpg", b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic", "heif-convert"),
                                  ("flag.gif", b"GIF89a", "ffmpeg"), ("poster.pdf", b"%PDF-1.7\n", "pdftoppm"),
                                  ("logo.svg", b"<svg xmlns='http://www.w3.org/2000/svg'/>", "rsvg-convert")):
            (self.folder / name).write_bytes(start + bytes(99))
            for words in (["bake", name], ["bake", "--pattern", name], ["pattern", "rectify", name, "--corners", "0,0,9,0,9,9,0,9"]):
                done = self.modar(*words, "-o", "out.png" if words[0] == "pattern" else "out.modar")
                self.assert_fails(done, 5, name, tool, "image.format")

    def test_folders_are_called_so(self):
        (self.folder / "spot").mkdir()
        for flag in ("--model", "--pattern"):
            self.assert_fails(self.modar("bake", flag, "spot", "-o", "out.modar"), 2, "spot", "folder")

    @needs("web")
    def test_files_that_are_no_bundle_are_named_and_leave_no_page(self):
        (self.folder / "text.modar").write_text(9 * "no bundle ")
        for words in (["web", "text.modar", "-o", "site", "--page", ROOT / "runtime/extensions/web"], ["report", "text.modar", "-o", "page.html"], ["inspect", "text.modar"]):
            self.assert_fails(self.modar(*words), 3, "text.modar", "bundle.magic")
        self.assertEqual([path.name for path in self.folder.iterdir()], ["text.modar"])


class NeverShown(ProgramTest):
    def test_the_line_to_add_is_printed(self):
        two = ("--model", POTTERY, STATUE)
        for words, line in (((*two, "--pattern", COVER), "--scene cover=pottery --scene cover=statue"),
                            ((*two, "--pattern", COVER, "--scene", "cover=statue"), "--scene cover=pottery"),
                            (("--model", POTTERY, "--pattern", COVER, GAME, "--scene", "cover=pottery"),
                             "--scene game=pottery"),
                            ((*two, "--pattern", COVER, GAME), "--scene cover=pottery --scene game=statue")):
            done = self.modar("bake", *words, "-o", "out.modar")
            self.assert_fails(done, 1, f"add {line} [bake.never-shown]")
            self.assertFalse((self.folder / "out.modar").exists())


class EachFile(ProgramTest):
    """One bad picture fails that picture; the others' results stand."""

    def setUp(self):
        super().setUp()
        self.project = self.folder / "project"
        self.project.mkdir()
        (self.project / "a_bad.png").write_text("no picture")
        picture(self.project / "game.png", 144, 108)

    def run_json(self, *words):
        done = self.modar("pattern", *words, "--json")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("a_bad.png", done.stderr)
        return json.loads(done.stdout)

    def test_score(self):
        bad, good = self.run_json("score", self.project)
        self.assertEqual((bad["name"], good["name"]), ("a_bad", "game"))
        self.assertIn("a_bad.png", bad["error"])
        self.assertGreater(good["score"], 0)
        words = self.modar("pattern", "score", self.project)
        self.assertEqual(words.returncode, 3)
        self.assertIn("game: ", words.stdout)

    def test_simulate(self):
        bad, good = self.run_json("simulate", self.project, "--views", "1")
        self.assertIn("error", bad)
        self.assertEqual(len(good["bands"]), 7)

    def test_confusion(self):
        found = self.run_json("confusion", self.project, "--views", "1")
        self.assertEqual([pattern["name"] for pattern in found["patterns"]], ["game"])


class Words(ProgramTest):
    def test_the_nearest_name_is_suggested(self):
        for words, wrong, meant in ((["bak"], "bak", "bake"), (["bake", "--patern", "x"], "--patern", "--pattern"),
                                    (["bake", "--modle=x.obj"], "--modle", "--model"),
                                    (["pattern", "scroe", "x.png"], "scroe", "score"),
                                    (["check", "x.modar", "--devise", "ace2"], "--devise", "--device")):
            self.assert_fails(self.modar(*words), 1, wrong, f"did you mean {meant}?")
        for wrong, key in (("--hieght", "height"), ("--turn", "turn"), ("--widht", "width")):
            self.assert_fails(self.modar("bake", wrong, "1"), 1, wrong, f"write it in --scene, as in --scene PATTERN=MODEL,{key}=...")
        done = self.modar("zzzzzzzz")
        self.assert_fails(done, 1, "zzzzzzzz", "--help")
        self.assertNotIn("did you mean", done.stderr)
        self.assert_fails(self.modar("ship", "publish", "--zzzzzzzz"), 1, "--zzzzzzzz", "see `modar ship publish --help`")

    def test_help_says_ranges_and_exclusions_in_words(self):
        for words in (["bake"], ["check"], ["pattern", "rectify"], ["ship", "publish"]):
            text = self.modar(*words, "--help-all").stdout
            for code in ("{false}", "Excludes:", "Needs:", " in [", "UINT", ":POSITIVE"):
                self.assertNotIn(code, text)
        text = " ".join(self.modar("bake", "--help-all").stdout.split())
        self.assertIn("(1 to 12, default 12)", text)
        self.assertIn("(not with --lods)", text)

    def test_a_short_bake_without_a_terminal_says_what_it_made_and_no_stage(self):
        done = self.modar("bake", "--model", POTTERY, "--no-lods", "-o", "a.modar")
        lines = done.stderr.splitlines()
        self.assertEqual([line.split()[0] for line in lines if not line.startswith("note:")],
                         ["model", "texture", "a.modar:"])
        self.assertEqual(len(lines), len(set(lines)))
        self.assertEqual(self.modar("bake", "--model", POTTERY, "--no-lods", "-o", "a.modar", "--quiet").stderr, "")

    def test_a_newer_bundle_is_unsupported_not_bad(self):
        bundle = self.bake_demo()
        data = bytearray(bundle.read_bytes())
        major, = struct.unpack_from("<H", data, 8)
        struct.pack_into("<H", data, 8, major + 1)
        bundle.write_bytes(data)
        for words in (["check", bundle], ["inspect", bundle], ["check", bundle, "--json"]):
            self.assertEqual(self.modar(*words).returncode, 5, words)
        self.assertEqual(self.run_program("modar-play", bundle, "--input", COVER).returncode, 5)


if __name__ == "__main__":
    unittest.main()
