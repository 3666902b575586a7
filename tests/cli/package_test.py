"""What `cmake --install` puts where: the parts of the Debian packages, as scripts/packages.cmake names them."""
import re
import subprocess
import unittest

from programs import BIN, ROOT, ProgramTest

PROGRAMS = {"workstation": ["modar"], "player": ["modar-fetch", "modar-play"], "laboratory": ["modar-lab"], "library": [],
            "development": []}


class Package(ProgramTest):
    def install(self, component):
        prefix = self.folder / component
        done = subprocess.run(["cmake", "--install", BIN.parent, "--component", component, "--prefix", prefix],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return {path.relative_to(prefix).as_posix() for path in prefix.rglob("*") if not path.is_dir()}

    def test_each_file_belongs_to_one_package(self):
        files = {component: self.install(component) for component in PROGRAMS}
        for component, programs in PROGRAMS.items():
            self.assertEqual(sorted(name[4:] for name in files[component] if name.startswith("bin/")), programs)
        self.assertEqual(len(set().union(*files.values())), sum(map(len, files.values())))
        # A rule without a component would go to the workstation, where libraries and headers do not belong.
        self.assertEqual([name for name in files["workstation"] if name.endswith((".a", ".so", ".hpp", ".h"))], [])
        self.assertEqual({name for name in files["player"] if name.startswith("libexec/")},
                         {"libexec/modar/libmodar_media.so", "libexec/modar/libmodar_video.so"})
        # Apps that were built need the library alone; what links them needs the rest.
        self.assertEqual({re.sub(r".*/|[.]0[.].*", "", name) for name in files["library"]}, {"libmodar.so.0", "libmodar.so"})
        self.assertIn("libmodar.so", {re.sub(r".*/", "", name) for name in files["development"]})
        for schema in ("check", "modar"):
            self.assertIn(f"share/modar/{schema}.schema.json", files["workstation"])
        for header in ("modar.h", "pose_loop.hpp", "fetch.hpp"):
            self.assertIn(f"include/modar/modar/{header}", files["development"])

    def test_an_installed_project_file_names_its_schema(self):
        self.install("workstation")
        (self.folder / "wall.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
        done = subprocess.run([self.folder / "workstation/bin/modar", "init", self.folder], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        schema = self.folder / "workstation/share/modar/modar.schema.json"
        self.assertTrue((self.folder / "modar.toml").read_text().startswith(f"#:schema {schema}\n"))
        self.assertEqual(schema.read_bytes(), (ROOT / "bake/project/modar.schema.json").read_bytes())


if __name__ == "__main__":
    unittest.main()
