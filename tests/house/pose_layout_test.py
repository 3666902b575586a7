"""One pose in all languages: modar_pose, the floats made of it, and their offsets in JavaScript and Java. One list of reasons."""
import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
RUNTIME = ROOT / "runtime"


def members(file, name):
    """{member: count} of a struct, in order."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(), flags=re.S)
    body = re.search(r"struct %s \{(.*?)\}" % name, text, re.S)[1]
    return {found[1]: int(found[2] or 1) for found in re.finditer(r"\b(?:size_t|int|float) (\w+)(?:\[(\d+)\])?;", body)}


def words(name):
    """positionSigma and POSITION_SIGMA as position_sigma."""
    return name.lower() if name.isupper() else re.sub(r"[A-Z]", lambda upper: "_" + upper[0].lower(), name)


class PoseLayout(unittest.TestCase):
    def test_it_is_the_same_in_all_languages(self):
        floats = members(RUNTIME / "include/modar/pose_floats.hpp", "PoseFloats")
        offsets, end = {}, 0
        for name, count in floats.items():
            offsets[name] = end
            end += count
        pose = members(RUNTIME / "include/modar/modar.h", "modar_pose")
        # The view is the pose with its stretch.
        without = {"size", "stretch", "reserved"}
        self.assertEqual({**{name: pose[name] for name in pose if name not in without}, "view": 16}, floats)
        script = (RUNTIME / "extensions/web/engine.js").read_text()
        self.assertEqual(int(re.search(r"POSE_FLOATS = (\d+)", script)[1]), end)
        table = re.search(r"const POSE = \{(.*?)\}", script, re.S)[1]
        self.assertEqual({words(name): int(at) for name, at in re.findall(r"(\w+): (\d+)", table)}, offsets)
        java = dict(re.findall(r"static final int (\w+) = (\d+);", (RUNTIME / "extensions/android/java/org/modar/Poses.java").read_text()))
        self.assertEqual(int(java.pop("FLOATS")), end)
        self.assertEqual({words(name): int(at) for name, at in java.items()}, offsets)

    def test_reasons_are_the_same_in_all_languages(self):
        names = re.findall(r"MODAR_REASON_(\w+) = (\d+)", (RUNTIME / "include/modar/modar.h").read_text())
        self.assertEqual([int(number) for _, number in names], list(range(len(names))))
        texts = [name.lower().replace("_", " ") for name, _ in names]
        types = re.search(r"type Reason = (.*?);", (RUNTIME / "extensions/web/modar.d.ts").read_text(), re.S)[1]
        self.assertEqual(re.findall(r"'([^']+)'", types), texts)
        tracker = re.search(r"const char\* to_string\(Reason.*?\n\}", (RUNTIME / "track/tracker.cpp").read_text(), re.S)[0]
        self.assertEqual(re.findall(r'return "([^"]+)"', tracker), [*texts, "unknown"])
        advice = re.findall(r"(?m)^(\w+(?:\\ \w+)+)=", (RUNTIME / "extensions/android/assets/words.properties").read_text())
        self.assertLessEqual({key.replace("\\ ", " ") for key in advice}, set(texts))


if __name__ == "__main__":
    unittest.main()
