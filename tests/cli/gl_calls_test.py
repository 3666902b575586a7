"""Every GL call of the player, as apitrace records it, against Khronos' own headers of OpenGL ES 2.0."""
import collections
import json
import pathlib
import re
import shutil
import subprocess
import unittest

from programs import BIN, ROOT, ProgramTest, demo_clip

HEADERS = pathlib.Path("/usr/include/GLES2")


def core():
    """Names of gl2.h, which is the list."""
    return set(re.findall(r"\bgl[A-Z]\w+|\bGL_[A-Z]\w+", (HEADERS / "gl2.h").read_text()))


def extensions():
    """{function or constant: the extensions of gl2ext.h that have it}."""
    owners = collections.defaultdict(set)
    for name, body in re.findall(r"#ifndef (GL_\w+)\n#define \1 1\n(.*?)#endif /\* \1 \*/",
                                 (HEADERS / "gl2ext.h").read_text(), re.S):
        for word in re.findall(r"\bgl[A-Z]\w+|\bGL_[A-Z]\w+", body):
            owners[word].add(name)
    # The header names it once; the specification of the vertices' extension has it, too.
    owners["GL_HALF_FLOAT_OES"].add("GL_OES_vertex_half_float")
    return owners


# Constants of ES 3 with the number of one of ES 2.0: the tracer writes the former.
SAME_NUMBER = {"GL_DRAW_FRAMEBUFFER_BINDING": "GL_FRAMEBUFFER_BINDING"}


def strangers(dump, allowed):
    """Calls and constants of a dump that neither ES 2.0 nor an allowed extension has."""
    known, owners = core(), extensions()
    found = collections.Counter()
    for line in dump.splitlines():
        call = re.match(r"(gl\w+)\((.*)", line)
        # "fake" calls are the tracer's own.
        if not call or line.endswith("// fake"):
            continue
        constants = [] if "Source" in call[1] else re.findall(r"\bGL_\w+", re.sub(r'"[^"]*"', "", call[2]))
        for word in [call[1], *(SAME_NUMBER.get(name, name) for name in constants)]:
            # The tracer writes constants without the suffix that they have on ES 2.0.
            names = [word, *(word + suffix for suffix in ("_OES", "_KHR", "_EXT"))]
            if word not in known and not any(owners[name] & allowed for name in names):
                found[word] += 1
    return dict(found)


@unittest.skipUnless(shutil.which("apitrace"), "apitrace is not installed")
@unittest.skipUnless((HEADERS / "gl2ext.h").exists(), "Khronos' headers are not installed")
class GlCalls(ProgramTest):
    def trace(self, *arguments, env=None):
        """The dump of what the player calls."""
        trace = self.folder / "player.trace"
        # The tracer is loaded before the sanitizer, which is right and told; leaks are for other tests.
        done = self.run_program(
            shutil.which("apitrace"), "trace", "--api", "egl", "-o", trace, BIN / "modar-play", *arguments, "--json",
            env={"ASAN_OPTIONS": "verify_asan_link_order=0:detect_leaks=0", **(env or {})})
        self.assertEqual(done.returncode, 0, done.stderr)
        dump = subprocess.run(["apitrace", "dump", "--color=never", "--call-nos=no", "--arg-names=no", trace],
                              capture_output=True, text=True, check=True).stdout
        self.assertIn("glDrawElements", dump)
        self.assertIn("EGL_CONTEXT_MAJOR_VERSION, 2", dump)
        return dump

    def clip(self):
        """Frames with the pattern in NV21: the camera's picture goes through the two-plane shader."""
        folder = demo_clip(self.folder / "clip", 4)
        done = subprocess.run(["ffmpeg", "-v", "error", "-pattern_type", "glob", "-i", folder / "*.png", "-vf", "scale=320:240",
                               "-pix_fmt", "nv21", "-f", "rawvideo", self.folder / "clip.raw"], capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return f"nv21:320x240@30:{self.folder / 'clip.raw'}"

    def test_a_device_s_own_calls_alone(self):
        bundle, clip = self.bake_demo(), self.clip()
        for device in ("mali400", "noext", "ace2"):
            profile = json.loads((ROOT / "assets" / "devices" / f"{device}.json").read_text())
            dump = self.trace(bundle, "--input", clip, "--device", device, "--outline", "--out", f"pictures-{device}")
            self.assertEqual(strangers(dump, set(profile["extensions"])), {}, device)
            self.assertEqual(dump.count("glGetError("), 0, "no storm of glGetError")
            self.assertIn("glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 160, 120, GL_LUMINANCE_ALPHA", dump,
                          "chroma goes to the GPU as the camera gave it")

    def test_extensions_of_this_context_alone(self):
        dump = self.trace(self.bake_demo(), "--turntable", "2", "--size", "96x64", "--out", "turn",
                          env={"MESA_GLES_VERSION_OVERRIDE": "2.0"})
        offered = set(re.findall(r"GL_\w+", " ".join(re.findall(r'glGetString\(GL_EXTENSIONS\) = "([^"]*)"', dump))))
        if not offered:
            offered = set(re.findall(r"GL_(?:EXT|OES|KHR|ANGLE)_\w+", (HEADERS / "gl2ext.h").read_text()))
        self.assertEqual(strangers(dump, offered), {})

    def test_every_draw_call_lies_in_the_group_of_its_pass(self):
        dump = self.trace(self.bake_demo(), "--input", self.clip(), "--out", "pictures")
        if "glPushDebugGroup" not in dump and "glPushGroupMarker" not in dump:
            self.skipTest("this driver has no groups")
        open_groups, draws = [], collections.Counter()
        for line in dump.splitlines():
            pushed = re.match(r'gl(?:PushDebugGroup|PushGroupMarker)\w*\(.*"(.*)"', line)
            if pushed:
                open_groups.append(pushed[1])
            elif re.match(r"gl(PopDebugGroup|PopGroupMarker)", line):
                open_groups.pop()
            elif re.match(r"glDraw(Arrays|Elements)", line):
                draws["/".join(open_groups)] += 1
            elif re.match(r"gl(Compressed)?TexImage2D|glBufferData\(GL_ELEMENT", line):
                self.assertIn("/".join(open_groups), ("upload", "camera picture", ""))
        self.assertEqual(open_groups, [])
        self.assertEqual(set(draws), {"camera picture", "shadows", "models"}, draws)
        guide = (ROOT / "runtime/TROUBLESHOOTING.md").read_text()
        for name in (*draws, "upload", "present"):
            self.assertIn(f"`{name}`", guide)

    def test_a_stranger_is_seen(self):
        dump = ("glBindVertexArray(1)\nglTexImage2D(GL_TEXTURE_2D, 0, GL_RED, 1, 1, 0, GL_RED, GL_UNSIGNED_BYTE, NULL)\n"
                "glClear(GL_COLOR_BUFFER_BIT)\nglPushGroupMarkerEXT(6, \"models\")\nglReadBuffer(GL_BACK) // fake\n")
        self.assertEqual(strangers(dump, set()), {"glBindVertexArray": 1, "GL_RED": 2, "glPushGroupMarkerEXT": 1})
        self.assertEqual(strangers(dump, {"GL_EXT_debug_marker", "GL_OES_vertex_array_object"}),
                         {"glBindVertexArray": 1, "GL_RED": 2})


if __name__ == "__main__":
    unittest.main()
