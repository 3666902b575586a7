"""The GitHub Action: the shell steps of action.yml as a runner runs them, with this build as the installed program."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from programs import BIN, COVER, POTTERY, ROOT  # noqa: E402

ACTION = (ROOT / "bake/extensions/wasm/action/action.yml").read_text()


def steps():
    """Of each step with a script: its name, variables and script. Values are ${{ inputs.NAME }}."""
    found = re.findall(r"    - name: (.*)\n(?:      id: .*\n)?      shell: bash\n      env:\n((?:        .*\n)+)      run: \|\n((?:        .*\n)+)", ACTION)
    for name, variables, script in found:
        yield name, dict(re.findall(r"(\w+): \$\{\{ inputs\.(\w+) \}\}", variables)), re.sub("(?m)^        ", "", script)


class Action(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "bin").mkdir()
        (self.folder / "bin/npm").write_text("#!/bin/sh\necho \"$@\" >>npm-calls\n")
        (self.folder / "bin/npm").chmod(0o755)
        os.symlink(BIN / "modar", self.folder / "bin/modar")
        self.project = self.folder / "a project"
        self.project.mkdir()

    def run_steps(self):
        inputs = {"project": "a project", "package": "modar@0.1.0", "site": "site"}
        ends = {}
        for name, variables, script in steps():
            environment = {**os.environ, "PATH": f"{self.folder}/bin:{os.environ['PATH']}", "RUNNER_TEMP": str(self.folder / "temp"),
                           "GITHUB_OUTPUT": str(self.folder / "outputs"), **{key: inputs[value] for key, value in variables.items()}}
            ends[name] = subprocess.run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script], cwd=self.folder, env=environment,
                                        capture_output=True, text=True)
            if ends[name].returncode:
                break
        return ends

    def test_a_folder_becomes_bundle_report_and_page(self):
        shutil.copy(POTTERY, self.project)
        for suffix in (".mtl", ".png"):
            shutil.copy(POTTERY.with_suffix(suffix), self.project)
        shutil.copy(COVER, self.project)
        (self.project / "modar.toml").write_text("[bake]\nscore = false\nloop-views = 8\nlods = 1\nocclusion = false\n[[pattern]]\nfile = 'cover.png'\nwidth = '210mm'\n"
                                                 "[[model]]\nfile = 'pottery.obj'\n[[scene]]\npattern = 'cover'\nmodel = 'pottery'\n")
        ends = self.run_steps()
        self.assertEqual({name: end.returncode for name, end in ends.items()}, {"Bake": 0, "Check": 0, "Make the page": 0},
                         [end.stderr for end in ends.values()])
        self.assertEqual((self.folder / "npm-calls").read_text(), "install --global --no-audit --no-fund modar@0.1.0\n")
        self.assertEqual((self.folder / "outputs").read_text(), f"sarif={self.folder}/temp/sarif\n")
        log, = (self.folder / "temp/sarif").glob("*.sarif")
        run, = json.loads(log.read_text())["runs"]
        self.assertEqual(run["automationDetails"]["id"], f"modar/{log.stem}/")
        self.assertIn("rules", run["tool"]["driver"])
        self.assertTrue((self.folder / "site/index.html").exists())

    def test_a_failed_bake_fails_the_action(self):
        (self.project / "broken.obj").write_text("f 1 2 3\n")
        ends = self.run_steps()
        self.assertEqual(list(ends), ["Bake"])
        self.assertNotEqual(ends["Bake"].returncode, 0)


if __name__ == "__main__":
    unittest.main()
