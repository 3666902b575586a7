"""`modar bake` and `modar check`: the same bytes always, errors that help, nothing half-written."""
import base64
import itertools
import json
import os
import shutil
import struct
import subprocess
import unittest

try:
    import jsonschema
except ImportError:
    jsonschema = None

from programs import BIN, COVER, POTTERY, QUICK, ROOT, STATUE, ProgramTest, picture, needs


class Bake(ProgramTest):
    def test_one_model_and_one_pattern_make_a_scene(self):
        bundle = self.bake_demo()
        report = self.modar_json("inspect", bundle)
        self.assertEqual([s["pattern"] + "=" + s["model"] for s in report["scenes"]], ["cover=pottery"])
        self.assertEqual(self.modar("check", bundle).returncode, 0)

    def test_files_are_told_apart_without_options(self):
        done = self.modar("bake", f"{COVER}:210mm", POTTERY, "-o", "bare.modar", *QUICK)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.modar("bake", "--model", POTTERY, "--pattern", f"{COVER}:210mm", "-o", "named.modar", *QUICK)
        self.assertEqual((self.folder / "bare.modar").read_bytes(), (self.folder / "named.modar").read_bytes())

    def test_counts_are_those_of_the_file(self):
        lines = POTTERY.read_text().splitlines()
        vertices = sum(line.startswith("v ") for line in lines)
        faces = sum(line.startswith("f ") for line in lines)
        model = self.modar_json("inspect", self.bake_demo())["models"][0]
        self.assertEqual(model["source_vertices"], vertices)
        self.assertEqual(model["source_faces"], faces)
        self.assertEqual(model["triangles"], faces)  # the file holds triangles only
        self.assertGreaterEqual(model["vertices"], vertices)

    def test_the_bytes_depend_on_input_and_options_only(self):
        reference = self.bake_demo().read_bytes()
        elsewhere = self.folder / "another place"
        shutil.copytree(POTTERY.parent, elsewhere)
        shutil.copy(COVER, elsewhere)
        for number, (jobs, env) in enumerate([(1, {"LC_ALL": "de_DE.UTF-8", "TZ": "Asia/Tokyo"}),
                                              (8, {"LANG": "tr_TR.UTF-8", "HOME": "/nowhere"})]):
            out = self.folder / f"again{number}.modar"
            done = self.modar("bake", "--model", elsewhere / "pottery.obj", "--pattern", "cover.png", "-o", out, *QUICK,
                              "--jobs", jobs, "--quiet", "--no-lods", env=env, cwd=elsewhere)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(out.read_bytes(), reference, f"jobs {jobs}, {env}")

    def test_the_bytes_do_not_depend_on_the_processor(self):
        bundles = []
        for less in ("", "AVX2,FMA3"):  # the pattern is one whose features differed
            out = self.folder / f"processor{len(bundles)}.modar"
            done = self.modar("bake", COVER.parent / "game.png", "-o", out, *QUICK, "--parameters", "all", env={"OPENCV_CPU_DISABLE": less})
            self.assertEqual(done.returncode, 0, done.stderr)
            bundles.append(out.read_bytes())
        self.assertEqual(*bundles)

    def keypoints(self, bundle):
        return set(self.modar_json("inspect", bundle)["patterns"][0]["keypoints"])

    @needs("paper")
    def test_the_papers_choice_is_stored_and_all_or_none_on_request(self):
        picture(self.folder / "picture.png")
        all_sets = ["orb-2000", "orb-500", "brisk-3", "brisk-2"]
        sizes = []
        for words, expected in ((["--parameters", "none"], []), (["--device", "mali400"], []), ([], ["orb-2000"]),
                                (["--device", "mali400", "--parameters", "orb-500,brisk-2"], ["orb-500", "brisk-2"]),
                                (["--parameters", "all"], all_sets)):
            sets = "-".join(word.strip("-") for word in words) or "default"
            out = self.folder / f"{sets}.modar"
            done = self.modar("bake", "--pattern", "picture.png", "-o", out, *QUICK, *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.modar_json("check", out)["issues"], [])
            pattern = self.modar_json("inspect", out)["patterns"][0]
            self.assertEqual(sorted(pattern["keypoints"]), sorted(expected))
            self.modar("inspect", out, "--extract", self.folder / sets)
            self.assertEqual(len(list((self.folder / sets).rglob("*.yml"))), len(expected))
            sizes.append(out.stat().st_size)
            read = subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", out, "--json"], capture_output=True, text=True)
            self.assertEqual(read.returncode, 0, read.stderr)  # it decodes the text and compares it with the twin
            self.assertEqual(len(json.loads(read.stdout)["features"]), len(expected))
        self.assertAlmostEqual(sizes[0], sizes[1], delta=256)  # none either way; the device is named
        self.assertEqual(sizes[1:], sorted(sizes[1:]))
        asked = self.folder / "parameters-all.modar"
        self.assertEqual(self.modar("check", asked, "--source", "picture.png").returncode, 0)
        self.assert_fails(self.modar("bake", "--pattern", COVER, "-o", self.folder / "x.modar", "--parameters", "sift"),
                          1, "--parameters")
        bare, usual = self.folder / "parameters-none.modar", self.folder / "default.modar"
        play = lambda *words: self.run_program("modar-play", *words, "--input", COVER)
        self.assert_fails(play(bare, "--method", "paper"), 3, "--parameters none", "--parameters orb-2000")
        self.assert_fails(play(usual, "--parameters", "brisk-3"), 1, "--parameters all")
        for words in ([bare], [usual], [usual, "--method", "paper"], [asked, "--parameters", "brisk-3"]):
            self.assertEqual(play(*words).returncode, 0)

    def test_sizes_of_the_usual_bundles(self):
        """With all views of a pattern, which decide how many descriptors are stored."""
        for words, most in (([], 850_000), (["--parameters", "none"], 485_000)):  # 13.8 KB of it: the picture that pages show
            done = self.modar("bake", COVER, "-o", "cover.modar", "--no-score", *words, "--quiet")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertLessEqual((self.folder / "cover.modar").stat().st_size, most)

    def test_metal_is_read_by_the_second_reader_too(self):
        (self.folder / "metal.mtl").write_text("newmtl brass\nKd 0.92 0.8 0.56\nPr 0.4\nPm 1\n")
        (self.folder / "metal.obj").write_text("mtllib metal.mtl\nusemtl brass\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        self.assertEqual(self.modar("bake", "--model", "metal.obj", "-o", "metal.modar", "--quiet").returncode, 0)
        read = subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", "metal.modar", "--json"], cwd=self.folder, capture_output=True,
                              text=True)
        self.assertEqual(read.returncode, 0, read.stderr)
        self.assertEqual(json.loads(read.stdout)["materials"][0]["flags"] >> 8 & 255, 255)

    def test_numbers_next_to_zero_are_written_as_zero(self):
        """Smaller than a float's smallest normal number, 1.2e-38."""
        picture(self.folder / "picture.png")
        (self.folder / "tiny.mtl").write_text("newmtl a\nKd 1e-40 1e-310 0.5\nKs 1e-39 0 0\nNs 1e-40\n")
        (self.folder / "tiny.obj").write_text("mtllib tiny.mtl\nusemtl a\nv 1e-39 1e-310 1e-39\nv 1 0 0\nv 0 1 1e-39\nf 1 2 3\n")
        for place in ("height=10cm,offset=1e-40:0:0", "width=10cm,turn=1e-40:0:0", "height=10cm,turn=0:1e-42:0,offset=0:0:-1e-44"):
            for positions in ([], ["--max-error", "1e-12%"]):
                done = self.modar("bake", "tiny.obj", "picture.png:210mm", "--scene", f"picture=tiny,{place}", "-o", "t.modar", *positions, *QUICK, "--quiet")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(self.modar_json("check", "t.modar")["issues"], [], place)

    def test_a_flat_model_has_no_height_or_width_to_give(self):
        """Planes in each of two axes, exactly and next to it, upright and turned: an error, or a good bundle."""
        picture(self.folder / "picture.png")
        thicknesses = itertools.cycle(("0", "1e-39", "1e-20", "1e-9", "0"))
        for flat, turn in itertools.product(range(3), ("0:0:0", "90:0:0", "0:0:90", "0:0:30")):
            thickness = next(thicknesses)
            corners = [["0"] * 3, ["0"] * 3, ["0"] * 3]
            corners[1][(flat + 1) % 3] = corners[2][(flat + 2) % 3] = "1"
            corners[2][flat] = thickness
            text = "".join(f"v {' '.join(corner)}\n" for corner in corners)
            (self.folder / "flat.obj").write_text(text + "f 1 2 3\n")
            for size in ("height", "width"):
                (self.folder / "flat.modar").unlink(missing_ok=True)
                done = self.modar("bake", "flat.obj", "picture.png:210mm", "--scene", f"picture=flat,{size}=12cm,up=y,turn={turn}",
                                  "-o", "flat.modar", "--parameters", "none", *QUICK, "--quiet")
                # Up to y, the model's x, y and z become the pattern's x, z and -y; 30 degrees leave its x and y flat in none.
                across = {"0:0:0": "xzy", "90:0:0": "xyz", "0:0:90": "yzx", "0:0:30": "-z-"}[turn][flat]
                if across == {"height": "z", "width": "x"}[size]:
                    self.assert_fails(done, 1, "flat", size, "scale=")
                    self.assertFalse((self.folder / "flat.modar").exists())
                else:
                    self.assertEqual(done.returncode, 0, (flat, thickness, size, turn, done.stderr))
                    self.assertEqual(self.modar_json("check", "flat.modar")["issues"], [])

    def test_memory_changes_no_byte(self):
        bundles = []
        for options in ([], ["--memory", "200M"]):
            out = self.folder / f"memory{len(options)}.modar"
            done = self.modar("bake", "--model", STATUE, "--no-lods", "-o", out, *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            bundles.append(out.read_bytes())
        self.assertEqual(bundles[0], bundles[1])
        self.assertEqual([file.name for file in self.folder.glob(".*")], [])
        self.assert_fails(self.modar("bake", "--model", STATUE, "-o", self.folder / "x.modar", "--memory", "1M"), 5,
                          "--memory")

    def test_the_shape_of_models_is_told(self):
        out = self.folder / "shape.modar"
        report = self.modar_json("bake", "--model", STATUE, "--no-lods", "--no-occlusion", "--topology", "-o", out)
        shape = report["bundle"]["models"][0]["topology"]
        faces = [[int(corner.split("/")[0]) for corner in line.split()[1:]]
                 for line in STATUE.read_text().splitlines() if line.startswith("f ")]
        edges = {}
        for face in faces:
            for a, b in zip(face, face[1:] + face[:1]):
                edges.setdefault(frozenset((a, b)), []).append(a < b)
        self.assertEqual(shape["triangles"], len(faces))  # the file holds triangles only
        self.assertEqual(shape["edges"], len(edges))
        self.assertEqual(shape["boundary_edges"], sum(len(uses) == 1 for uses in edges.values()))
        self.assertEqual(shape["non_manifold_edges"], sum(len(uses) > 2 for uses in edges.values()))
        self.assertEqual(shape["euler"], len({v for face in faces for v in face}) - len(edges) + len(faces))
        self.assertEqual([h["model"] for h in report["half_edges"]], ["statue"])
        self.assertIn("boundary loops", self.modar("inspect", out).stdout)
        without = self.modar_json("bake", "--model", STATUE, "--no-lods", "--no-occlusion", "-o", out)
        self.assertIsNone(without["bundle"]["models"][0]["topology"])

    def test_defects_are_counted_and_repaired_where_requested(self):
        lines = [line for line in STATUE.read_text().splitlines() if not line.startswith("f ")]
        faces = [line for line in STATUE.read_text().splitlines() if line.startswith("f ")]
        words = faces[0].split()
        turned = " ".join([words[0], words[1], words[3], words[2]])
        model = self.folder / "worn.obj"
        model.write_text("\n".join(lines + [turned] + faces[1:] + [faces[9]]) + "\n")
        out = self.folder / "worn.modar"
        plain = self.modar("bake", "--model", model, "--no-lods", "--no-occlusion", "-o", out)
        self.assertIn("1 repeated triangle, ", plain.stderr)
        self.assertIn("--repair", plain.stderr)
        report = self.modar_json("bake", "--model", model, "--no-lods", "--no-occlusion", "--repair", "-o", out)
        done = report["bundle"]["models"][0]["repair"]
        self.assertEqual((done["duplicates"]["count"], done["winding"]["count"]), (1, 1))
        self.assertGreater(done["winding"]["area"], 0)
        self.assertEqual(report["defects"][0]["duplicates"]["count"], 0)
        self.assertEqual(report["bundle"]["models"][0]["triangles"], len(faces))
        self.assertIn("repaired: ", self.modar("inspect", out).stdout)
        self.assertEqual(done["support"], {"count": 0, "area": 0})
        alone = self.modar_json("bake", "--model", model, "--no-lods", "--no-occlusion", "--repair-support", "-o", self.folder / "alone.modar")
        self.assertEqual(alone["bundle"]["models"][0]["repair"], done)
        self.assertIn("model.no-support", [finding["id"] for finding in alone["findings"]])
        self.assertEqual(self.modar("check", out, "--source", model).returncode, 0)

    def account(self, model):
        report = self.modar_json("bake", "--model", model, "--no-lods", "--no-occlusion", "-o", self.folder / "account.modar")
        schema = json.loads((ROOT / "bake" / "commands" / "bake.schema.json").read_text())
        if jsonschema:
            jsonschema.validate(report, schema)
        return {kind: tuple(fate[key] for key in ("used", "changed", "left_out")) for kind, fate in report["account"][0].items() if kind != "model"}

    def test_all_that_a_file_names_is_accounted_for(self):
        picture(self.folder / "a.png")
        (self.folder / "m.mtl").write_text("newmtl a\nKd .6 .6 .6\nmap_Kd a.png\nnewmtl b\nKd 1 0 0\nmap_Kd gone.png\nnewmtl unused\nKd 0 1 0\n")
        (self.folder / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1 4/1\nusemtl b\n"
                                           "f 1/1 2/1 4/1\nf 2/1 3/1 4/1\nf 1/1 3/1 4/1\nf 1/1 2/1 9/1\n")
        self.assertEqual(self.account(self.folder / "m.obj"), {
            "images": (1, 0, 1), "colours": (1, 1, 1), "faces": (3, 1, 1), "nodes": (0, 0, 0), "animations": (0, 0, 0), "attributes": (2, 0, 0)})
        data = struct.pack("<27f", 0, 0, 0, 1, 0, 0, 0, 1, 1, *[0] * 18)
        view = {"bufferView": 0, "componentType": 5126, "count": 3}
        images = [{"uri": "a.png", "name": name} for name in ("shown", "merged", "unnamed")]
        (self.folder / "m.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}], "extensionsUsed": ["KHR_node_visibility"],
            "nodes": [{"mesh": 0}, {"mesh": 1, "extensions": {"KHR_node_visibility": {"visible": False}}}, {}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 1, "TANGENT": 2}, "material": 0}]},
                       {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}}, {}],
            "textures": [{"source": 0}, {"source": 1}], "images": images,
            "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": path}}], "samplers": [{"input": 3, "output": 0}]} for path in ("weights", "scale")],
            "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
            "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
            "accessors": [{**view, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}, {**view, "type": "VEC2"}, {**view, "type": "VEC4"},
                          {**view, "type": "SCALAR"}]}))
        self.assertEqual(self.account(self.folder / "m.gltf"), {
            "images": (1, 1, 1), "colours": (1, 0, 1), "faces": (1, 0, 0), "nodes": (1, 0, 2), "animations": (1, 0, 1), "attributes": (2, 0, 3)})

    def test_models_only_and_patterns_only_are_legal(self):
        picture(self.folder / "picture.png")
        for arguments in (["--model", STATUE, "--no-occlusion"], ["--pattern", "picture.png", *QUICK]):
            out = self.folder / "one.modar"
            done = self.modar("bake", *arguments, "--no-lods", "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.modar("check", out).returncode, 0)

    def test_models_are_merged_in_the_same_buffers(self):
        out = self.folder / "two.modar"
        picture(self.folder / "cover.png")
        report = self.modar_json("bake", "--model", POTTERY, STATUE, "--pattern", "cover.png", "--scene",
                                 "cover=statue,scale=0.5,up=z", "cover=pottery", "--no-lods", "--no-occlusion", "-o", out, *QUICK)
        self.assertEqual([m["name"] for m in report["bundle"]["models"]], ["pottery", "statue"])
        self.assertEqual(report["bundle"]["scenes"][0]["scale"], 0.5)
        self.assertGreater(report["cpu_seconds"], 0)
        self.assertGreater(report["peak_rss_bytes"], 1e6)
        self.assertTrue(all({"name", "ms", "in", "out", "max_error"} <= set(s) for s in report["stages"]))

    def test_patterns_that_nobody_can_tell_apart_are_named(self):
        picture(self.folder / "a.png")
        picture(self.folder / "b.png", mirrored=True)
        report = self.modar_json("bake", "--pattern", "a.png", "b.png", "again=a.png", "-o", "out.modar", *QUICK)
        told = [(one["file"], one["id"]) for one in report["findings"] if one["id"] in ("pattern.same", "pattern.mirrored")]
        self.assertEqual(told, [("b", "pattern.mirrored"), ("again", "pattern.same"), ("again", "pattern.mirrored")])
        self.assertIn("take either for the other", self.modar("bake", "--pattern", "a.png", "again=a.png", "-o", "out.modar",
                                                              *QUICK).stderr)

    def test_a_scene_is_as_high_as_was_asked(self):
        picture(self.folder / "cover.png")
        report = self.modar_json("bake", "--model", STATUE, "--pattern", "cover.png:200mm", "--scene",
                                 "cover=statue,height=12cm,turn=0:0:30,offset=5:0:0", "--no-lods", "--no-occlusion", "-o", "out.modar",
                                 *QUICK)
        scene = report["bundle"]["scenes"][0]
        self.assertAlmostEqual(scene["height_mm"], 120, delta=0.1)
        self.assertEqual((scene["up"], scene["turn"]), ("z", [0, 0, 30]))
        self.assertAlmostEqual(scene["offset"][0], 5 / 100, places=6)  # half of 200 mm is a unit of the plane
        heights = [float(line.split()[3]) for line in STATUE.read_text().splitlines() if line.startswith("v ")]
        self.assertEqual(report["bundle"]["models"][0]["up"], {"axis": "z", "reason": "header"})
        sides = report["bundle"]["models"][0]["scale"] * 2  # the statue's height is its largest side
        self.assertAlmostEqual(max(heights) - min(heights), sides, delta=1e-3 * sides)
        self.assertAlmostEqual(scene["scale"], 120 / 200, places=6)

    def test_the_asked_error_is_kept_and_picks_the_layout(self):
        out = self.folder / "fine.modar"

        def baked(*options):
            done = self.modar("bake", "--model", STATUE, "-o", out, "--no-lods", "--no-occlusion", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.modar("check", out).returncode, 0)
            return self.modar_json("inspect", out)["models"][0]

        plain = baked("--positions", "half")
        self.assertEqual(plain["layout"], "half")
        fine = baked("--max-error", "0.003%")
        self.assertEqual(fine["layout"], "int16")
        self.assertLessEqual(fine["position_error_max"], 3e-5 * fine["diagonal"])
        self.assertLess(fine["bytes_per_triangle"], plain["bytes_per_triangle"])
        exact = baked("--max-error", "0.00002%")  # no grid so fine spans its triangles
        self.assertEqual(exact["layout"], "float")
        self.assertLessEqual(exact["position_error_max"], 2e-7 * exact["diagonal"])
        length = 1e-5 * fine["diagonal"]
        for options in ([f"{length:.9f}"], [f"{1000 * length:.6f}mm", "--unit", "m"]):
            self.assertLessEqual(baked("--max-error", *options)["position_error_max"], length)
        done = self.modar("bake", "--model", STATUE, "-o", out, "--max-error", "2mm")
        self.assert_fails(done, 1, "--unit")
        done = self.modar("bake", "--model", STATUE, "-o", out, "--max-error", "0.01%", "--positions", "half")
        self.assert_fails(done, 5, "half floats")

    def test_levels_of_detail_are_made_unless_told_not_to(self):
        def model(*options):
            out = self.folder / "levels.modar"
            done = self.modar("bake", "--model", POTTERY, "--no-mipmaps", "-o", out, *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.modar("check", out).returncode, 0)
            return self.modar_json("inspect", out)["models"][0]

        plain, two, more = model("--no-lods"), model("--lods", 2), model()
        self.assertEqual([plain["lods"], two["lods"]], [1, 2])
        self.assertGreater(more["lods"], 2)
        self.assertIsNone(plain["levels"])
        # What coarser levels are off by is stated: more where there are more, and the texture slides.
        self.assertLess(two["levels"]["position_error_max"], more["levels"]["position_error_max"])
        self.assertGreater(two["levels"]["uv_shift_max_texels"], 0)
        self.assertLessEqual(two["levels"]["uv_shift_max_texels"], more["levels"]["uv_shift_max_texels"])
        # One by one, finest first, the last ones as off as the whole.
        listed = more["levels"]["list"]
        triangles = [level["triangles"] for level in listed]
        self.assertEqual(triangles, sorted(triangles, reverse=True))
        self.assertEqual((triangles[0], listed[0]["chunks"], listed[0]["error"]), (more["triangles"], more["chunks"], 0))
        self.assertGreaterEqual(listed[-1]["error"], more["levels"]["position_error_max"] * (1 - 1e-6))
        words = f"{len(triangles)} levels of detail, down to {triangles[-1]} triangles"
        self.assertIn(words, self.modar("inspect", self.folder / "levels.modar").stdout)
        self.assertLess(plain["bytes"], two["bytes"])
        self.assertLess(two["bytes"], more["bytes"])
        self.assertEqual(plain["bytes_per_triangle"], more["bytes_per_triangle"])
        self.assert_fails(self.modar("bake", "--model", POTTERY, "--lods", 99, "-o", "x.modar"), 1, "--lods")

    def test_a_device_profile_bounds_the_textures(self):
        out = self.folder / "small.modar"
        report = self.modar_json("bake", "--model", POTTERY, "--max-texture", 64, "--device", "ace2", "--no-occlusion", "-o", out)
        texture = report["bundle"]["textures"][0]
        self.assertEqual((texture["width"], texture["height"], texture["levels"]), (64, 64, 7))
        done = self.modar("bake", "--model", POTTERY, "--device", "toaster", "-o", out)
        self.assert_fails(done, 1, "toaster", "ace2")

    def test_a_tier_reduces_models_before_their_levels(self):
        side = 106
        lines = [f"v {x} {y} {(x * 7 + y * 13) % 5 * 0.05}" for y in range(side) for x in range(side)]
        for y in range(side - 1):
            for x in range(side - 1):
                a = y * side + x + 1
                lines += [f"f {a} {a + 1} {a + side + 1}", f"f {a} {a + side + 1} {a + side}"]
        hill = self.folder / "hill.obj"
        hill.write_text("\n".join(lines) + "\n")
        faces = 2 * (side - 1) ** 2
        out = self.folder / "thumb.modar"
        report = self.modar_json("bake", "--model", hill, "--tier", "thumb", "--no-occlusion", "--lods", 2, "-o", out)
        model = report["bundle"]["models"][0]
        self.assertEqual(model["source_faces"], faces)
        self.assertLessEqual(model["triangles"], 20000)
        self.assertGreaterEqual(model["triangles"], 19400)
        stated = [finding for finding in report["findings"] if finding["id"] == "model.reduced"]
        self.assertEqual([finding["severity"] for finding in stated], ["info"])
        self.assertIn(f"from {faces} to {model['triangles']} triangles", stated[0]["message"])
        self.assertEqual(self.modar_json("check", out, "--source", hill)["issues"], [])
        done = self.modar("bake", "--model", POTTERY, "--tier", "poster", "-o", out)
        self.assert_fails(done, 1, "poster", "phone")

    def test_an_image_of_two_models_is_stored_once(self):
        for name in ("a", "b"):
            text = POTTERY.read_text()
            (self.folder / f"{name}.obj").write_text(text)
        shutil.copy(POTTERY.parent / "pottery.mtl", self.folder)
        shutil.copy(POTTERY.parent / "pottery.png", self.folder)
        report = self.modar_json("bake", "--model", "a.obj", "b.obj", "--no-occlusion", "--max-texture", 64, "-o", "ab.modar")
        self.assertEqual(len(report["bundle"]["textures"]), 1)

    def test_partly_shown_pictures_share_a_page(self):
        # A bent sheet in two materials, each of which shows a quarter of its picture.
        side = 9
        lines = ["mtllib two.mtl"]
        for y in range(side):
            for x in range(side):
                lines += [f"v {x} {y} {abs(x - 4) * 0.5}", f"vt {0.1 + x / 16} {0.2 + y / 16}"]
        for m in range(2):
            lines.append(f"usemtl m{m}")
            for y in range(4 * m, 4 * m + 4):
                for x in range(side - 1):
                    a, b = y * side + x + 1, (y + 1) * side + x + 1
                    lines.append(f"f {a}/{a} {a + 1}/{a + 1} {b + 1}/{b + 1} {b}/{b}")
        sheets = self.folder / "two.obj"
        sheets.write_text("\n".join(lines) + "\n")
        (self.folder / "two.mtl").write_text("newmtl m0\nKd 1 1 1\nmap_Kd bust.png\nnewmtl m1\nKd 1 1 1\nmap_Kd pottery.png\n")
        for name in ("bust.png", "pottery.png"):
            shutil.copy(POTTERY.parent / name, self.folder)

        def bake(*options):
            out = self.folder / f"two{len(options)}.modar"
            report = self.modar_json("bake", "--model", sheets, "--no-occlusion", "--max-texture", 512, *options, "-o", out)
            return out, report["bundle"], [f for f in report["findings"] if f["id"] == "texture.atlas"]

        out, together, said = bake()
        _, apart, nothing = bake("--no-atlas")
        self.assertEqual([t["name"] for t in together["textures"]], ["two-atlas"])
        self.assertEqual(len(apart["textures"]), 2)
        self.assertEqual([m["chunks"] for m in together["models"] + apart["models"]], [1, 2])
        self.assertLess(3 * together["textures"][0]["bytes"], 2 * sum(t["bytes"] for t in apart["textures"]))
        self.assertEqual([f["severity"] for f in said], ["info"])
        self.assertEqual(nothing, [])
        # Baked again as the bundle states it, and next to a renderer of the source's own pictures: hardly farther off than apart.
        done = self.modar("check", out, "--source", sheets, "--visual", self.folder / "looks", "--json")
        checked = json.loads(done.stdout)
        self.assertTrue(checked["source"]["models"][0]["same_bytes"])
        self.assertEqual(checked["source"]["different"], [])
        self.assertGreater(checked["looks"][0]["ssim_worst"], 0.97)
        self.assertGreater(checked["looks"][0]["ssim_mean"], 0.97)
        beside = self.modar_json("check", self.folder / "two1.modar", "--source", sheets, "--visual", self.folder / "apart")
        self.assertLess(checked["looks"][0]["delta_e_worst"], beside["looks"][0]["delta_e_worst"] + 0.5)
        self.assert_fails(self.modar("bake", "--model", sheets, "--atlas", "--no-atlas", "-o", out), 1, "atlas")

    def test_grey_stands_in_for_a_picture_that_cannot_be_read(self):
        (self.folder / "m.mtl").write_text("newmtl good\nKd 1 1 1\nmap_Kd pottery.png\nnewmtl bad\nKd 0.5 1 0\nmap_Kd bad.png\n")
        (self.folder / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                                           "usemtl good\nf 1/1 2/2 3/3\nusemtl bad\nf 3/3 2/2 1/1\n")
        shutil.copy(POTTERY.parent / "pottery.png", self.folder)
        whole = (POTTERY.parent / "pottery.png").read_bytes()
        (self.folder / "bad.png").write_bytes(whole[:len(whole) // 2])
        for options in ([], ["--atlas"], ["--device", "ace2"]):
            report = self.modar_json("bake", "--model", "m.obj", *options, "-o", "m.modar")
            told = [f for f in report["findings"] if f["severity"] == "warning"]
            self.assertEqual([f["id"] for f in told], ["image.decode"], options)
            self.assertIn("bad.png", told[0]["file"])
            self.assertIn("grey replaces it", told[0]["message"])
            read = json.loads(subprocess.run(["python3", ROOT / "scripts" / "read_bundle.py", "m.modar", "--json"],
                                             cwd=self.folder, capture_output=True).stdout)
            colours = {m["name"]: [round(c, 3) for c in m["diffuse"]] for m in read["materials"]}
            self.assertEqual(colours["bad"], [0.251, 0.502, 0.0])
            self.assertEqual(colours["good"], [1.0, 1.0, 1.0])

    def test_a_progress_bar_stays_out_of_pipes(self):
        done = self.modar("bake", "--model", POTTERY, "--no-lods", "--no-occlusion", "-o", self.folder / "a.modar")
        self.assertNotIn("\r", done.stderr)
        self.assertNotIn("\x1b", done.stderr)
        self.assertEqual(done.stdout, "")


class BadInput(ProgramTest):
    def bake(self, *arguments):
        return self.modar("bake", *arguments, "-o", self.folder / "out.modar")

    def assert_nothing_written(self):
        left = [name for name in os.listdir(self.folder) if "modar" in name]
        self.assertEqual(left, [])

    def test_nothing_to_bake(self):
        self.assert_fails(self.bake(), 1, "--model")
        self.assert_nothing_written()

    def test_a_file_that_is_not_there(self):
        self.assert_fails(self.bake("--model", "none.obj"), 2, "none.obj")
        self.assert_fails(self.bake("--pattern", "none.png"), 2, "none.png")
        self.assert_fails(self.bake("none.obj", "none.png"), 2, "none.obj")
        self.assert_nothing_written()

    def test_a_file_that_is_something_else(self):
        (self.folder / "text.png").write_text("no image")
        self.assert_fails(self.bake("--pattern", "text.png"), 3, "text.png")
        (self.folder / "empty.obj").write_text("# nothing\n")
        self.assert_fails(self.bake("--model", "empty.obj"), 3, "empty.obj")
        (self.folder / "line.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
        self.assert_fails(self.bake("--model", "line.obj"), 3, "line.obj: ")
        (self.folder / "m.stl").write_text("solid\n")
        self.assert_fails(self.bake("--model", "m.stl"), 3, "m.stl", "no triangle")
        (self.folder / "m.fbx").write_text("Kaydara FBX Binary")
        self.assert_fails(self.bake("m.fbx"), 5, ".fbx", "assimp export 'm.fbx' 'm.glb'")
        self.assert_fails(self.bake(self.folder), 1, "a folder is baked as a project", "modar init")
        self.assert_nothing_written()

    def test_a_scene_of_unknown_names(self):
        self.assert_fails(self.bake("--model", POTTERY, "--pattern", COVER, "--scene", "cover=vase"), 1, "vase",
                          "pottery")
        self.assert_fails(self.bake("--model", POTTERY, "--scene", "nonsense"), 1, "PATTERN=MODEL")
        self.assert_nothing_written()

    def test_a_file_that_may_not_be_read_is_not_called_empty(self):
        secret = self.folder / "secret.png"
        shutil.copy(COVER, secret)
        secret.chmod(0)
        without = "-dac_override,-dac_read_search"  # root reads every file by these capabilities
        as_owner = ["setpriv", f"--bounding-set={without}", f"--inh-caps={without}"] if os.geteuid() == 0 else []
        done = subprocess.run([*as_owner, BIN / "modar", "bake", secret, "-o", "/dev/null"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("permissions [io.open]", done.stderr)

    def test_a_width_that_a_png_states_is_said(self):
        stated, silent = self.folder / "stated.png", COVER
        self.assertEqual(self.modar("pattern", "rectify", COVER, "--corners", "0,0,347,0,347,716,0,716", "--width", "43mm", "-o", stated).returncode, 0)
        for file, told in ((stated, True), (f"{stated}:210mm", False), (silent, False)):
            with self.subTest(str(file)):
                done = self.bake("--pattern", file, *QUICK)
                self.assertEqual("it is printed 43 mm wide" in done.stderr, told, done.stderr)

    def test_two_of_one_name(self):
        (self.folder / "sub").mkdir()
        shutil.copy(POTTERY, self.folder / "sub")
        shutil.copytree(self.folder / "sub", self.folder / "other" / "sub")
        again = self.folder / "sub" / "pottery.obj"
        third = self.folder / "other" / "sub" / "pottery.obj"
        self.assert_fails(self.bake("--model", again, third), 1, "two models are named 'sub'", "--model NAME=")
        self.assert_nothing_written()
        done = self.modar_json("bake", "--model", POTTERY, again, f"third={third}", "--no-lods", "--no-occlusion", "-o", "all.modar")
        self.assertEqual([model["name"] for model in done["bundle"]["models"]], ["models", "sub", "third"])

    def test_inputs_are_looked_at_before_the_bake(self):
        (self.folder / "text.png").write_text("no image")
        for words in (["--pattern", "text.png"], ["--model", "none.glb"],
                      ["--pattern", COVER, "--scene", "cover=pottery,light=none.hdr"]):
            done = self.bake("--model", POTTERY, *words, "--json")
            self.assertIn(done.returncode, (2, 3), done.stderr)
            self.assertNotIn("texture", done.stderr)
        picture(self.folder / "plain.png")
        self.assert_fails(self.bake("--model", POTTERY, "--pattern", "plain.png", "--scene", "plain=pottery,height=12cm"), 1,
                          "width of 'plain' is unknown", "210mm")
        self.assert_nothing_written()

    def test_an_output_that_cannot_be_written(self):
        done = self.modar("bake", "--model", POTTERY, "-o", self.folder / "no" / "such" / "out.modar")
        self.assert_fails(done, 2, "out.modar")

    def test_a_failed_bake_keeps_what_was_there(self):
        out = self.folder / "out.modar"
        out.write_text("precious")
        (self.folder / "text.png").write_text("no image")
        self.assertEqual(self.bake("--model", POTTERY, "--pattern", "text.png").returncode, 3)
        self.assertEqual(out.read_text(), "precious")


class Check(ProgramTest):
    def test_every_damaged_byte_of_the_tables_is_reported(self):
        good = self.bake_demo().read_bytes()
        bad = self.folder / "bad.modar"
        for offset in range(0, 2048, 97):
            damaged = bytearray(good)
            damaged[offset] ^= 0x10
            bad.write_bytes(damaged)
            done = self.modar("check", bad)
            self.assertEqual(done.returncode, 3, f"byte {offset}")
            self.assertTrue(done.stdout.startswith(f"{bad}: BAD\n"))

    def test_a_damaged_payload_is_reported_as_json(self):
        good = bytearray(self.bake_demo().read_bytes())
        good[-5] ^= 1
        bad = self.folder / "bad.modar"
        bad.write_bytes(good)
        done = self.modar("check", bad, "--json")
        self.assertEqual(done.returncode, 3)
        self.assertIn('"verdict": "bad"', done.stdout)

    def test_the_text_twin_is_held_against_the_mapped_one(self):
        done = self.modar("check", ROOT / "tests" / "corrupt" / "PATTERN_YML_DIFFERS.modar")
        self.assertEqual(done.returncode, 3)
        self.assertIn("PATTERN_YML_DIFFERS", done.stdout)

    def test_a_truncated_file_and_a_text(self):
        good = self.bake_demo().read_bytes()
        bad = self.folder / "bad.modar"
        for size in (1, 63, 64, 1000, len(good) - 1):
            bad.write_bytes(good[:size])
            self.assertEqual(self.modar("check", bad).returncode, 3, f"size {size}")
        bad.write_text("once upon a time")
        self.assertEqual(self.modar("check", bad).returncode, 3)
        self.assertEqual(self.modar("check", self.folder / "none").returncode, 2)

    def test_the_levels_of_a_default_bundle_lie_within_their_bounds(self):
        done = self.lab("bench", "lod", ROOT / "assets" / "models" / "pottery.obj", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = {row["measure"]: row for row in json.loads(done.stdout)}
        self.assertAlmostEqual(rows["1/2 triangles/asked pottery"]["ratio"], 1, delta=0.05)
        bounds = [row for name, row in rows.items() if "stated_percent/greatest_found" in name]
        self.assertGreater(len(bounds), 1)
        for row in bounds:
            self.assertGreaterEqual(row["ratio"], 0.99, row)  # rounding of half floats is no level's error


class Help(ProgramTest):
    def test_help_shows_an_example(self):
        for command in (["bake"], ["pattern", "rectify"], ["check"], ["inspect"]):
            done = self.modar(*command, "--help")
            self.assertEqual(done.returncode, 0)
            self.assertIn("Example:", done.stdout)
            self.assertIn("Exit codes", done.stdout)
            self.assertEqual(done.stderr, "")

    def test_version(self):
        done = self.modar("--version")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"^modar \d+\.\d+\.\d+\n$")

    def test_sizes_are_no_negative_numbers(self):
        for size in ("-1", "-1G", "99999999999999999999", "1e30G", "much", "1X", ""):
            done = self.modar("bake", "--model", POTTERY, "-o", "x.modar", f"--memory={size}")
            self.assert_fails(done, 1, "--memory")
            self.assertFalse((self.folder / "x.modar").exists())

    def test_lengths_and_scales_are_those_of_prints(self):
        for width in ("nanmm", "infmm", "1e39mm", "1e-39mm", "1e300m", "0mm", "-1mm"):
            done = self.modar("bake", "--pattern", f"{COVER}:{width}", "-o", "x.modar")
            self.assert_fails(done, 1, "cli.pattern", width)
        done = self.modar("bake", "--pattern", f"{COVER}:width=20cm", "-o", "a.modar")
        self.assert_fails(done, 1, "'width=20cm' is neither a width nor a shape; write", "cover.png:210mm")
        for part in ("scale=1e39", "scale=nan", "scale=1e-30", "height=1e39mm", "height=nanmm", "width=1e-39mm", "offset=1e39:0:0"):
            done = self.modar("bake", "--model", POTTERY, "--pattern", f"{COVER}:210mm", "--scene", f"cover=pottery,{part}", "-o", "x.modar")
            self.assert_fails(done, 1, "cli.scene", part)

    def test_few_libraries_are_mapped(self):
        done = self.modar("--version", env={"LD_TRACE_LOADED_OBJECTS": "1"})
        libraries = done.stdout.splitlines()
        self.assertGreater(len(libraries), 5)
        self.assertLess(len(libraries), 60)

    @needs("lab")
    def test_a_wrong_command_line(self):
        for arguments in ([], ["fly"], ["bake", "--nonsense"], ["check"]):
            self.assert_fails(self.modar(*arguments), 1)
        for arguments in ([], ["bench", "nonsense"], ["mutate"], ["check"]):
            self.assert_fails(self.lab(*arguments), 1)
        self.assertIn("modar-lab [OPTIONS]", self.lab("--help").stdout)
        self.assert_fails(self.lab("mutate"), 1, "`modar-lab mutate --help`")


if __name__ == "__main__":
    unittest.main()
