"""The laws hold, and each check of scripts/check_laws.py is seen failing on a planted violation."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
SCRIPT = ROOT / "scripts" / "check_laws.py"
PLAYER = ROOT / "build" / "device" / "bin" / "modar-play"


def run(*arguments):
    done = subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True)
    return done.returncode, done.stdout


class Laws(unittest.TestCase):
    def test_the_tree_keeps_them(self):
        self.assertEqual(run("--root", ROOT), (0, ""))

    def test_the_player_of_the_device_keeps_them(self):
        if not PLAYER.exists():
            self.skipTest("the preset device is not built here (scripts/test.sh builds it)")
        self.assertEqual(run("--root", ROOT, "--player", PLAYER), (0, ""))


class PlantedViolations(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        for room in ("formats", "bake/commands", "bake/import", "bake/mesh", "bake/extensions/lab", "runtime/track", "tests"):
            (self.folder / room).mkdir(parents=True)

    def assert_refused(self, path, text, expected):
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_text(text)
        code, out = run("--root", self.folder)
        self.assertEqual(code, 3)
        self.assertIn(path, out)
        self.assertIn(expected, out)

    def test_an_empty_house_is_fine(self):
        self.assertEqual(run("--root", self.folder), (0, ""))

    def test_formats_includes_nothing_else(self):
        self.assert_refused("formats/a.hpp", "#include <glm/vec3.hpp>\n", "standard library")

    def test_runtime_knows_no_bake(self):
        self.assert_refused("runtime/track/a.cpp", '#include "bake/report.hpp"\n', "nothing of the bake")

    def test_bake_uses_public_headers(self):
        self.assert_refused("bake/a.cpp", '#include "runtime/track/solver.hpp"\n', "public headers")

    def test_what_emscripten_lacks(self):
        for lacked in ("std::ranges::sort(a)", "std::bit_cast<int>(a)"):
            self.assert_refused("bake/mesh/a.cpp", lacked + ";\n", "emscripten has no")

    def test_the_loop_calls_no_libm(self):
        for call in ("double a = std::hypot(1.0, 2.0);", "double a = glm::atan(1.0);", "Eigen::AngleAxisd a;"):
            self.assert_refused("runtime/track/a.cpp", call + "\n", "rounds differently")

    def test_opencv_stays_in_its_files(self):
        self.assert_refused("runtime/track/a.cpp", "#include <opencv2/core.hpp>\n", "opencv2")

    def test_each_image_library_stays_in_its_file(self):
        self.assert_refused("bake/image/jpeg.cpp", "#include <png.h>\n", "png.h")
        self.assert_refused("bake/image/png.cpp", "#include <jpeglib.h>\n", "jpeglib.h")
        self.assert_refused("bake/texture/a.cpp", "#include <webp/decode.h>\n", "webp/")
        self.assert_refused("bake/image/image_reader.cpp", "#include <tiffio.h>\n", "tiffio.h")
        self.assert_refused("bake/image/tiff.cpp", "#include <stb/stb_image.h>\n", "stb/")
        self.assert_refused("bake/image/image_reader.cpp", "#include <opencv2/imgcodecs.hpp>\n", "opencv2")

    def test_openmesh_stays_in_its_file(self):
        self.assert_refused("bake/mesh/weld/weld.cpp", "#include <OpenMesh/Core/IO/MeshIO.hh>\n", "OpenMesh")

    def test_the_command_line_library_stays_in_its_file(self):
        self.assert_refused("bake/commands/a.cpp", "#include <CLI/CLI.hpp>\n", "CLI")

    def test_json_stays_in_its_file(self):
        self.assert_refused("bake/commands/a.cpp", "#include <nlohmann/json.hpp>\n", "nlohmann")

    def test_rooms_of_the_workstation_have_an_order(self):
        self.assert_refused("bake/mesh/a.cpp", '#include "bake/commands/commands.hpp"\n', "is below")
        self.assert_refused("bake/import/a.cpp", '#include "bake/mesh/weld/weld.hpp"\n', "is below")

    def test_a_room_must_have_a_rank(self):
        self.assert_refused("bake/attic/a.cpp", '#include "bake/mesh/weld/weld.hpp"\n', "is no room")

    def test_the_product_knows_no_lab(self):
        for room in ("mesh", "commands"):
            self.assert_refused(f"bake/{room}/a.cpp", '#include "bake/extensions/lab/bench.hpp"\n', "is below")

    def test_the_core_includes_no_extension(self):
        for path, name in (("bake/commands/a.cpp", "bake/extensions/web/site.hpp"), ("runtime/play/a.cpp", "runtime/extensions/paper/paper_method.hpp"),
                           ("formats/a.cpp", "runtime/extensions/web/engine.hpp")):
            self.assert_refused(path, f'#include "{name}"\n', "of the extension")

    def test_of_the_lab_two_files_look_into_the_renderer(self):
        self.assert_refused("bake/extensions/lab/pose_bench.cpp", '#include "runtime/render/draw_list.hpp"\n', "public headers")
        (self.folder / "bake/extensions/lab/pose_bench.cpp").rename(self.folder / "bake/extensions/lab/render_bench.cpp")
        self.assertEqual(run("--root", self.folder), (0, ""))

    def test_rooms_are_entered_through_their_doors(self):
        for path, name, doors in (
                ("runtime/render/a.cpp", "runtime/track/kernels.hpp", "no door of runtime/track"),
                ("runtime/render/b.cpp", "runtime/fetch/store.hpp", "no door of runtime/fetch"),
                ("runtime/play/a.cpp", "runtime/render/program.hpp", "no door of runtime/render"),
                ("bake/mesh/a.cpp", "bake/import/obj/number_parser.hpp", "read_model.hpp"),
                ("bake/texture/a.cpp", "bake/mesh/lod/level_map.hpp", "mesh_levels.hpp"),
                ("bake/mesh/b.cpp", "bake/mesh/lod/level_map.hpp", "no door of bake/mesh/lod"),
                ("bake/bundle/a.cpp", "bake/texture/etc1/etc1_encoder.hpp", "texture_codec.hpp"),
                ("bake/check/a.cpp", "bake/bundle/request_check.hpp", "bundle_builder.hpp"),
                ("bake/commands/a.cpp", "bake/ship/recipe_maker.hpp", "publish.hpp"),
                ("bake/commands/b.cpp", "bake/pattern/trial.hpp", "pattern.hpp"),
                ("runtime/attic/a.cpp", "runtime/cellar/a.hpp", "is no room of DOORS")):
            with self.subTest(name):
                self.assert_refused(path, f'#include "{name}"\n', doors)
                (self.folder / path).unlink()
        # The lab and tests look inside.
        for path in ("bake/extensions/lab/a.cpp", "tests/a.cpp"):
            (self.folder / path).write_text('#include "bake/ship/recipe_maker.hpp"\n')
        self.assertEqual(run("--root", self.folder), (0, ""))

    def test_the_rooms_are_printed_with_their_doors(self):
        code, out = run("--rooms", "--root", ROOT)
        self.assertEqual(code, 0)
        lines = out.splitlines()
        self.assertLess(lines.index("bake/commands"), lines.index("bake/mesh"))
        self.assertRegex(out, r"\n  model_pictures.hpp +bake/extensions/studio\n")
        self.assertNotRegex(out, r"\n  [a-z_/]+\.hpp *\n", "a door that nobody comes through")

    def test_no_iostream_on_the_device(self):
        self.assert_refused("runtime/track/a.cpp", "#include <iostream>\n", "iostream")

    def test_the_top_level_is_closed(self):
        self.assert_refused("notes.txt", "", "top level")

    def test_the_player_holds_no_opencv(self):
        source = self.folder / "tests" / "player.cpp"
        source.write_text("namespace cv { int imread() { return 1; } }\nint main() { return cv::imread(); }\n")
        player = self.folder / "build"
        subprocess.run([os.environ.get("CXX", "c++"), source, "-o", player], check=True)
        code, out = run("--root", self.folder, "--player", player)
        self.assertEqual(code, 3)
        self.assertIn("holds 2cv", out)

    def test_the_player_links_no_shared_runtime(self):
        source = self.folder / "tests" / "player.cpp"
        source.write_text("#include <string>\n#include <cstdlib>\n"
                          "int main(int c, char** v) { return std::stoi(std::string(v[c - 1])); }\n")
        player = self.folder / "build"
        subprocess.run([os.environ.get("CXX", "c++"), source, "-o", player], check=True)
        code, out = run("--root", self.folder, "--player", player)
        self.assertEqual(code, 3)
        self.assertIn("links libstdc++", out)


if __name__ == "__main__":
    unittest.main()
