"""The adapters for engines of others: their examples in a browser, from a CDN and bundled, hold what modar-play sees in the same frames."""
import base64
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tarfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import Browser, Quiet, Server  # noqa: E402
from npm_project import install  # noqa: E402
from programs import BIN, COVER, ROOT  # noqa: E402

ADAPTERS = ROOT / "runtime" / "extensions" / "web" / "adapters"
ENGINES = ("three", "fiber", "babylon", "playcanvas")
NODE = tuple(int(part) for part in subprocess.run(["node", "-p", "process.versions.node"], capture_output=True, text=True).stdout.split(".")) \
    if shutil.which("node") else ()
TOOLS = {"vite": "^7" if NODE >= (20, 19) else "^6", "three": "^0.180", "react": "^19", "react-dom": "^19", "@react-three/fiber": "^9",
         "@babylonjs/core": "^8", "playcanvas": "^2", "typescript": "~5.6", "@types/react": "^19", "@types/three": "^0.180"}
FRAMES = 20
COVER_SIZE = struct.unpack(">II", COVER.read_bytes()[16:24])
# Frames as the worker gets them, and after each event the print's matrix in eye space, as the engine has it.
RECORD = """(() => {
  localStorage.clear();
  globalThis.told = [];
  const {postMessage} = Worker.prototype, {dispatchEvent} = EventTarget.prototype;
  Worker.prototype.postMessage = function(message, transfer) {
    if (message.type === 'frame') message.keepLuma = true;
    return postMessage.call(this, message, transfer);
  };
  const ways = {
    three: () => (camera.updateMatrixWorld(), cover.updateMatrixWorld(true), [cover.visible, camera.matrixWorldInverse.clone().multiply(cover.matrixWorld).elements]),
    fiber: () => ways.three(),
    babylon: () => [cover.isEnabled(), cover.computeWorldMatrix(true).multiply(camera.getViewMatrix(true)).asArray()],
    aframe: () => {
      const {camera} = document.querySelector('a-scene'), {object3D} = document.getElementById('cover');
      camera.updateMatrixWorld();
      object3D.updateMatrixWorld(true);
      return [object3D.visible, camera.matrixWorldInverse.clone().multiply(object3D.matrixWorld).elements];
    },
    mindar: () => ways.aframe(),
    wall: () => ways.aframe(),
    playcanvas: () => {
      const eye = camera.getWorldTransform().clone().invert();
      return [cover.enabled, eye.mul2(eye, cover.getWorldTransform()).data];
    },
  };
  EventTarget.prototype.dispatchEvent = function(event) {
    const done = dispatchEvent.call(this, event);
    const luma = event.detail?.luma;
    if (event.type !== 'frame' || !luma || told.length === %d) return done;
    globalThis.tracker = this;
    let text = '';
    for (let i = 0; i < luma.length; i += 4096) text += String.fromCharCode(...luma.subarray(i, i + 4096));
    globalThis.way = ways[/(\\w+)\\.html/.exec(location.pathname)?.[1]];
    const [shown, matrix] = globalThis.cover && way ? way() : [];
    told.push({luma: btoa(text), shown, matrix: matrix && Array.from(matrix), corners: Array.from(event.detail.poses.subarray(16, 24))});
    return done;
  };
})()""" % FRAMES
# Green over the middle of the print in the engine's canvas, above the picture's canvas.
GREEN = """new Promise((resolve) => requestAnimationFrame(() => {
  const [picture, models] = document.querySelectorAll('canvas');
  const {width, height} = models;
  const copy = Object.assign(document.createElement('canvas'), {width, height}).getContext('2d');
  copy.drawImage(models, 0, 0);
  const all = copy.getImageData(0, 0, width, height).data;
  let count = 0, x = 0, y = 0;
  for (let i = 0; i < all.length; i += 4) {
    if (all[i + 1] < 200 || all[i] > 90 || all[i + 2] > 90) continue;
    ++count;
    x += (i / 4) % width;
    y += Math.floor(i / 4 / width);
  }
  const at = [picture, models].map((canvas) => JSON.stringify(canvas.getBoundingClientRect())), [a, b] = at;
  resolve(count && {x: x / count / width, y: y / count / height, share: count / width / height, clear: all[3], same: a === b,
                    opaque: picture.getContext('2d').getImageData(9, 9, 1, 1).data[3]});
}))"""
# As a CDN such as esm.sh serves packages of CommonJS.
REACT = {"react": "export {createContext, createElement, forwardRef, useContext, useEffect, useImperativeHandle, useRef, useState} from 'react';",
         "react-dom/client": "export {createRoot} from 'react-dom/client';", "@react-three/fiber": "export * from '@react-three/fiber';"}
STRICT = {"strict": True, "target": "es2022", "module": "esnext", "moduleResolution": "bundler", "lib": ["es2022", "dom"], "noEmit": True,
          "jsx": "react-jsx", "skipLibCheck": True, "types": []}
TYPED = """import { Canvas } from '@react-three/fiber';
import { useRef } from 'react';
import * as THREE from 'three';
import * as pc from 'playcanvas';
import { FreeCamera, Scene, TransformNode } from '@babylonjs/core';
import { follow } from 'modar/three';
import { follow as followBabylon } from 'modar/babylon';
import { follow as followPlayCanvas } from 'modar/playcanvas';
import { follow as followAny } from 'modar/follow';
import { Print, Prints } from 'modar/fiber';
import { ModarViewer } from 'modar/react';
import type { ModarViewer as Viewer } from 'modar/viewer';

export async function all(renderer: THREE.WebGLRenderer, scene: THREE.Scene, camera: THREE.PerspectiveCamera, cover: THREE.Group,
                          a: Scene, b: FreeCamera, c: TransformNode, app: pc.AppBase, eye: pc.Entity, box: pc.Entity, canvas: HTMLCanvasElement) {
  const { modar, close } = await follow('a.modar', { renderer, scene, camera, prints: { cover }, extended: true });
  modar.addEventListener('found', ({ detail }) => console.log(detail.name));
  close();
  await followBabylon('a.modar', { scene: a, camera: b, prints: { cover: c } });
  await followPlayCanvas('a.modar', { app, camera: eye, prints: { cover: box }, video: document.createElement('video') });
  await followAny('a.modar', { canvas, place: (name, view) => console.log(name, view?.[15]), draw: ({ width }, projection) => console.log(width, projection[0]) });
}
export function Vase() {
  const viewer = useRef<Viewer>(null);
  return <ModarViewer ref={viewer} src="vase.modar" maxBytes={1e6} className="wide" onFound={({ detail }) => console.log(detail.name)}
                      onStateChange={() => { void viewer.current?.look(); }} onClick={() => viewer.current?.stop()} />;
}
export const Scene3 = () =>
  <Canvas><Prints bundle="a.modar" extended onReady={({ modar }) => console.log(modar.patterns)}><Print name="cover" renderOrder={1} /></Prints></Canvas>;
"""


FRAME = """<!doctype html><link rel="icon" href="data:,"><script src="aframe.min.js"></script>%s
<script>
  globalThis.events = [];
  for (const type of ['arReady', 'arError', 'targetFound', 'targetLost', 'xrimagescanning', 'realityready', 'xrimagefound', 'xrimageupdated', 'xrimagelost'])
    document.addEventListener(type, ({type, detail}) => { events.push(type); if (type === 'xrimagefound') globalThis.wallDetail = detail; });
</script>"""
BOX = '<a-box position="0 0 %s" scale="%s %s %s" material="shader: flat; color: #0f0"></a-box>'
CAMERA = '<a-camera position="0 0 0" look-controls="enabled: false" wasd-controls="enabled: false"></a-camera>'
MINDAR = f"""<script src="modar/adapters/aframe.js"></script>
<a-scene mindar-image="imageTargetSrc: demo.modar; filterMinCF: 1; filterBeta: 10000; missTolerance: 3" vr-mode-ui="enabled: false">{CAMERA}
<a-entity id="cover" mindar-image-target="targetIndex: 0">{BOX % (0.15, 0.3, 0.3, 0.3)}</a-entity></a-scene>"""
MARKUP = {"mindar": MINDAR, "mind": MINDAR.replace("demo.modar", "targets.mind"),
          "wall": f"""<script src="modar/adapters/aframe.js" data-bundle="demo.modar"></script>
<a-scene xrweb="disableWorldTracking: true" vr-mode-ui="enabled: false"><a-camera position="0 4 10"></a-camera>
<xrextras-named-image-target id="cover" name="cover">{BOX % (0.15, 0.3, 0.3, 0.3)}</xrextras-named-image-target></a-scene>"""}
EVENTS = {"mindar": ["arReady", "targetFound", "targetLost"],
          "wall": ["xrimagescanning", "realityready", "xrimagefound", "xrimageupdated", "xrimagelost"]}


class Shared(Quiet):
    """Of another origin, as a CDN."""

    def end_headers(self):
        self.send_header("Access-Control-Allow-Origin", "*")
        super().end_headers()


def view_of(seen):
    """Column-major, by the formula of modar.h: y and z of camera space point the other way in GL's eye space."""
    stretch = seen.get("stretch") or [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
    columns = []
    for column in range(4):
        way = [sum(seen["rotation"][3 * row + k] * stretch[4 * k + column] for k in range(3)) for row in range(3)]
        if column == 3:
            way = [a + b for a, b in zip(way, seen["translation"])]
        columns += [way[0], -way[1], -way[2], float(column == 3)]
    return columns


class Adapters(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.base, _ = install(cls, TOOLS)
        files = pathlib.Path(os.environ["MODAR_DEMO_FILES"])
        cls.bundle = files / "demo.modar"
        cls.video = cls.base / "camera.y4m"
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-framerate", "15", "-i", next((files / "clip").glob("*00.png")).parent / "frame_%05d.png",
                        "-pix_fmt", "yuv420p", cls.video], check=True)
        for file in (ADAPTERS / "example").iterdir():
            shutil.copy(file, cls.base)
        (cls.base / "public").mkdir()
        shutil.copy(cls.bundle, cls.base / "public")
        shutil.copy(cls.bundle, cls.base)
        cls.browser = Browser(cls.base / "profile", cls.video)
        cls.addClassCleanup(cls.browser.close)
        cls.browser.camera("granted")
        cls.browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD)

    def tool(self, package, program, *words):
        done = subprocess.run(["node", self.base / "node_modules" / package / program, *words], cwd=self.base, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def assert_follows(self, url, name, placed=lambda view: view, delta=1e-5, scale=1):
        self.browser.errors.clear()
        self.browser.open(f"{url}{name}.html")
        self.browser.wait(f"told.length === {FRAMES}", f"{FRAMES} frames of {name}")
        told = self.browser.run("told")
        frames = self.base / "seen.gray"
        frames.write_bytes(b"".join(base64.b64decode(each["luma"]) for each in told))
        played = subprocess.run([BIN / "modar-play", self.bundle, "--input", f"grey:480x360:{frames}", "--json"], capture_output=True, text=True)
        self.assertEqual(played.returncode, 0, played.stderr)
        expected = [line for line in map(json.loads, played.stdout.splitlines()) if "frame" in line]
        compared = 0
        for each, play in zip(told, expected, strict=True):
            # A print is shown from its third frame on.
            for seen in play["visible"] if each.get("shown") else ():
                for got, wanted in zip(each["matrix"], placed(view_of(seen)), strict=True):
                    self.assertAlmostEqual(got / scale, wanted / scale, delta=delta, msg=name)
                compared += 1
        self.assertGreater(compared, 4, name)
        self.browser.wait(GREEN, "the cube")
        green = next(filter(None, (self.browser.run(GREEN) for _ in range(50))))
        self.browser.run("tracker.stop(), tracker.dispatchEvent(new CustomEvent('lost', {detail: {name: 'cover', pattern: 0}}))")
        self.assertFalse(self.browser.run("way()[0]"), name)
        if keep := os.environ.get("MODAR_KEEP"):
            self.browser.screenshot(pathlib.Path(keep) / f"{name}.png")
        self.assertEqual((green["clear"], green["same"], green["opaque"]), (0, True, 255), name)
        self.assertGreater(green["share"], 0.005, name)
        self.assertEqual(self.browser.errors, [], name)

    def test_from_a_cdn(self):
        cdn = Server(self.base / "node_modules", Shared)
        self.addCleanup(cdn.close)
        server = Server(self.base)
        self.addCleanup(server.close)
        entries = self.base / "entries"
        entries.mkdir()
        for name, text in REACT.items():
            (entries / (name.replace("/", "-") + ".js")).write_text(text)
        done = subprocess.run([self.base / "node_modules/esbuild/bin/esbuild", *entries.glob("*.js"), "--bundle", "--splitting", "--format=esm",
                               "--outdir=cdn", '--define:process.env.NODE_ENV="production"', "--log-level=error"],
                              cwd=self.base, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        imports = {name: f"./cdn/{name.replace('/', '-')}.js" for name in REACT} | {
            f"modar/{name}": f"{cdn.url}modar/adapters/{name}.js" for name in ("fiber", "react")}
        for name in (*ENGINES, "react"):
            text = (ADAPTERS / "example" / f"{name}.html").read_text().replace("./node_modules/", cdn.url)
            if "importmap" not in text:
                text = text.replace("<div", f'<script type="importmap">{json.dumps({"imports": imports})}</script>\n<div')
            (self.base / f"{name}.html").write_text(text)
        for name in ENGINES:
            with self.subTest(name):
                self.assert_follows(server.url, name)
        self.assert_component(server.url)

    def assert_component(self, url):
        self.browser.errors.clear()
        self.browser.open(url + "react.html")
        self.browser.wait("globalThis.viewer?.state === 'start'", "the viewer")
        self.assertEqual(self.browser.run("[viewer.src, viewer.getAttribute('alt'), viewer.hasAttribute('max-bytes')]"), ["demo.modar", "A red vase", False])
        self.browser.run("viewer.start()")
        self.browser.wait("seen.includes('cover')", "the cover")
        self.assertEqual(self.browser.run("seen.slice(0, 2)"), ["looking", "cover"])
        self.browser.run("viewer.stop()")
        self.browser.wait("seen.at(-1) === 'start'", "the end")
        self.assertEqual(self.browser.errors, [])

    def test_bundled(self):
        pages = {name: name + ".html" for name in (*ENGINES, "react")}
        for name in pages:
            shutil.copy(ADAPTERS / "example" / f"{name}.html", self.base)
            page = self.base / f"{name}.html"
            page.write_text(re.sub(r'<script type="importmap">.*?</script>', "", page.read_text(), flags=re.DOTALL))
        (self.base / "vite.config.js").write_text(
            f"export default {{build: {{target: 'es2022', minify: false, rollupOptions: {{input: {json.dumps(list(pages.values()))}}}}}}};")
        self.tool("vite", "bin/vite.js", "build", "--outDir", "built", "--logLevel", "error")
        server = Server(self.base / "built")
        self.addCleanup(server.close)
        for name in ENGINES:
            with self.subTest(name):
                self.assert_follows(server.url, name)
        self.assert_component(server.url)

    def test_a_frame(self):
        """Our own markup, and that of pages for MindAR and 8th Wall after `modar adopt`: matrices and the order of events."""
        packed = subprocess.run(["npm", "pack", "--silent", "aframe@1.7"], cwd=self.base, capture_output=True, text=True)
        if packed.returncode != 0:
            self.skipTest("npm cannot fetch A-Frame: " + packed.stderr[-200:])
        with tarfile.open(self.base / packed.stdout.strip().splitlines()[-1]) as tar:
            minified = next(name for name in tar.getnames() if re.fullmatch(r"package/dist/aframe-v[\d.]+\.min\.js", name))
            (self.base / "aframe.min.js").write_bytes(tar.extractfile(minified).read())
        for name, text in MARKUP.items():
            (self.base / f"{name}.html").write_text(FRAME % text)
        (self.base / "modar").symlink_to(self.base / "node_modules" / "modar")
        server = Server(self.base)
        self.addCleanup(server.close)
        self.assert_follows(server.url, "aframe")
        width = 2 * COVER_SIZE[0] / COVER_SIZE[1]
        # An entity's unit is the picture's width, which is 1000 units of the scene.
        self.assert_follows(server.url, "mindar", lambda view: [
            1000 * number / (width if i in (12, 13, 14) else 1) if i % 4 < 3 else number for i, number in enumerate(view)], scale=1000)
        # A position and a rotation, with the longer side as unit: what a wrong focal length stretches is not in them.
        self.assert_follows(server.url, "wall", lambda view: [2 * number if i < 12 else number for i, number in enumerate(view)], delta=0.1)
        for name, expected in EVENTS.items():
            with self.subTest(name):
                self.browser.open(f"{server.url}{name}.html")
                self.browser.wait(f"events.length > {len(expected) - 2}", "events")
                self.browser.run("tracker.stop(), tracker.dispatchEvent(new CustomEvent('lost', {detail: {name: 'cover', pattern: 0}}))")
                seen = self.browser.run("events")
                self.assertEqual([*dict.fromkeys(seen)], expected)
                self.assertEqual((seen[0], seen[-1]), (expected[0], expected[-1]))
        self.assertEqual(self.browser.run("[wallDetail.scaledWidth.toFixed(3), wallDetail.scaledHeight.toFixed(3), wallDetail.scale]"),
                         [f"{COVER_SIZE[0] / COVER_SIZE[1]:.3f}", "1.000", 2])
        self.browser.open(server.url + "mind.html")
        self.browser.wait("events.length > 0", "the error")
        self.assertEqual(self.browser.run("events"), ["arError"])
        self.assertIn("modar adopt", self.browser.run("document.querySelector('.mindar-ui-overlay:not(.hidden)').textContent"))

    def test_strict_types(self):
        (self.base / "typed.tsx").write_text(TYPED)
        (self.base / "wrong.tsx").write_text(
            "import { Print } from 'modar/fiber';\nimport { ModarViewer } from 'modar/react';\n"
            "export const a = <Print nam=\"cover\" />;\nexport const b = <ModarViewer scr=\"a\" />;\n")
        for name, expected in (("typed", 0), ("wrong", 2)):
            (self.base / "tsconfig.json").write_text(json.dumps({"compilerOptions": STRICT, "files": [f"{name}.tsx"]}))
            done = subprocess.run(["node", self.base / "node_modules/typescript/bin/tsc", "-p", "."], cwd=self.base, capture_output=True, text=True)
            self.assertEqual(len(re.findall(r"error TS", done.stdout)), expected, done.stdout)

    def test_their_own_types(self):
        modules = str(self.base / "node_modules")
        options = {**STRICT, "allowJs": True, "checkJs": True, "baseUrl": modules, "paths": {"*": ["./@types/*", "./*"]}}
        files = [str(ROOT / "tests/house/browser.d.ts"), *(str(file) for file in ADAPTERS.glob("*.js"))]
        (self.base / "tsconfig.json").write_text(json.dumps({"compilerOptions": options, "files": files}))
        self.tool("typescript", "bin/tsc", "-p", ".")

    def test_each_is_short(self):
        for file in ADAPTERS.glob("*.js"):
            if file.name != "aframe.js":
                self.assertLessEqual(len(file.read_text().splitlines()), 80, file.name)


if __name__ == "__main__":
    unittest.main()
