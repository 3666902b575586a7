"""What scripts of the newcomer's path share: the age of the sources, and steps that show that they run."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))


class Scratch(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="modar-install-"))
        self.addCleanup(shutil.rmtree, self.folder)


class CommitTime(Scratch):
    """scripts/commit_time.cmake."""
    COMMITTED, OTHER = 1_700_000_001, 1_600_000_000

    def git(self, folder, *words, time=0):
        return subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b.c", "-C", folder, *words], check=True,
                              capture_output=True, env={**os.environ, "GIT_COMMITTER_DATE": f"{time} +0200"}).stdout

    def repository(self, folder, time):
        (folder / "scripts").mkdir(parents=True)
        shutil.copy(ROOT / "scripts/commit_time.cmake", folder / "scripts")
        shutil.copy(ROOT / ".gitattributes", folder)
        self.git(folder, "init", "-q")
        self.git(folder, "add", "-A")
        self.git(folder, "commit", "-qm", "a", time=time)
        return folder

    def time_of(self, folder, epoch=None):
        script = self.folder / "print.cmake"
        script.write_text(f'include({folder}/scripts/commit_time.cmake)\nmessage("time=${{MODAR_COMMIT_TIME}}")\n')
        environment = {key: value for key, value in os.environ.items() if key != "SOURCE_DATE_EPOCH"}
        done = subprocess.run(["cmake", "-P", script], capture_output=True, text=True, cwd=self.folder,
                              env=environment | ({"SOURCE_DATE_EPOCH": epoch} if epoch else {}))
        self.assertEqual(done.returncode, 0, done.stderr)
        return int(done.stderr.rpartition("time=")[2]), done.stderr

    def test_the_clone_and_the_archive_of_a_commit_are_of_its_time(self):
        outer = self.repository(self.folder / "outer", self.OTHER)
        clone = self.repository(outer / "clone", self.COMMITTED)
        self.assertEqual(self.time_of(clone)[0], self.COMMITTED)
        self.assertEqual(self.time_of(clone, "86400")[0], 86400)
        archive = outer / "archive"  # inside another repository
        archive.mkdir()
        subprocess.run(["tar", "x", "-C", archive], input=self.git(clone, "archive", "HEAD"), check=True)
        self.assertEqual(self.time_of(archive)[0], self.COMMITTED)

    def test_sources_of_unknown_age_build_with_a_warning(self):
        clone = self.repository(self.folder / "clone", self.COMMITTED)
        shutil.rmtree(clone / ".git")
        time, said = self.time_of(clone)
        self.assertEqual(time, 0)
        self.assertIn("SOURCE_DATE_EPOCH", said)


class Steps(Scratch):
    """scripts/steps.sh."""
    def start(self, text, pause="0.2"):
        script = self.folder / "try.sh"
        script.write_text(f"set -euo pipefail\nlog={self.folder}/log\nsteps=2\n. {ROOT}/scripts/steps.sh\n{text}\n")
        return subprocess.Popen(["bash", script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                env={**os.environ, "MODAR_STEP_PAUSE": pause})

    def test_a_step_is_named_at_its_start_and_shows_life(self):
        gate = self.folder / "gate"
        process = self.start(f'wait_for() {{ echo "[3/7] a"; until [ -e {gate} ]; do sleep 0.1; done; }}\nstep "one thing" wait_for')
        self.addCleanup(process.stdout.close)
        self.assertRegex(process.stdout.readline(), r"^1/2  one thing +\.\.\.$")
        for _ in range(2):  # while it runs
            self.assertRegex(process.stdout.readline(), r"^1/2  one thing +\d+ s \[3/7\] +$")
        gate.touch()
        rest = process.stdout.read()
        self.assertEqual(process.wait(), 0)
        self.assertRegex(rest.splitlines()[-1], r"^1/2  one thing +\d+ s *$")

    def test_any_failed_command_of_a_step_ends_the_script(self):
        process = self.start('fails() { echo cause; (exit 7); echo after; }\nstep "one" fails\necho never', pause="60")
        said = process.communicate(timeout=20)[0]  # no sleep of 60 s holds the pipe
        self.assertEqual(process.returncode, 7)
        self.assertIn("cause", said)
        self.assertNotIn("after", said)
        self.assertNotIn("never", said)


if __name__ == "__main__":
    unittest.main()
