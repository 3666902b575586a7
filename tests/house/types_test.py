"""The pages' JavaScript against its types: strict, by Debian's TypeScript, in each module that begins with // @ts-check."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
TSC = shutil.which("tsc")
FOLDERS = (ROOT / "runtime/extensions/web", ROOT / "bake/extensions/studio/page")
# These import what emscripten builds.
GENERATED = {"modar-worker-plain.js", "modar-worker-simd.js", "record-worker-plain.js", "record-worker-simd.js"}
OPTIONS = {"strict": True, "allowJs": True, "noEmit": True, "target": "es2022", "module": "esnext", "moduleResolution": "node",
           "lib": ["es2022", "dom", "dom.iterable"], "types": []}


# The library `modar/bake`, which scripts/wasm/package.sh puts next to the page's modules.
LIBRARY = ROOT / "bake/extensions/wasm"
BIN = pathlib.Path(os.environ.get("MODAR_BIN_DIR", ROOT / "build" / "dev" / "bin"))
USE = """import {bake} from './bake.js';
const {bundle} = await bake({'vase.glb': new Uint8Array(1)}, {tier: 'phone', noLods: true, pattern: ['a.png', 'b.png']});
bundle.subarray(1);
// @ts-expect-error: no such tier
void bake({}, {tier: 'museum'});
// @ts-expect-error: no such option
void bake({}, {noSuchOption: true});
// @ts-expect-error: the call sets it
void bake({}, {output: 'a.modar'});
"""
WRONG = {"TS2339": "/** @param {number} a */\nexport const f = (a) => a.length;\n", "TS7006": "export const f = (a) => a;\n",
         "TS2531": "export const f = document.body.querySelector('a').href;\n"}


def modules():
    return [file for folder in FOLDERS for file in sorted(folder.glob("*.js"))]


class Types(unittest.TestCase):
    def test_each_module_is_checked(self):
        unchecked = {file.name for file in modules() if not file.read_text().startswith("// @ts-check\n")}
        self.assertEqual(unchecked, GENERATED)

    @unittest.skipUnless(TSC, "node-typescript is not installed")
    def test_they_hold_and_planted_faults_are_found(self):
        with tempfile.TemporaryDirectory(prefix="modar-types-") as folder:
            project = pathlib.Path(folder) / "tsconfig.json"
            for code, text in WRONG.items():
                (pathlib.Path(folder) / f"{code}.js").write_text("// @ts-check\n" + text)
            laid = pathlib.Path(folder) / "laid"
            laid.mkdir()
            for file in [*(ROOT / "runtime/extensions/web").glob("*.*s"), *LIBRARY.glob("bake*.*s"), LIBRARY / "platform.js"]:
                shutil.copy(file, laid)
            subprocess.run([BIN / "modar", "document", "-o", laid / "documents"], check=True)
            shutil.copy(laid / "documents/modar/commands.d.ts", laid)
            (laid / "use.ts").write_text(USE)
            (laid / "baker").mkdir()
            (laid / "baker/baker.js").write_text("export default async (/** @type {any} */ module) => module;\n")
            for file in (LIBRARY / "studio").glob("*.js"):
                shutil.copy(file, laid)
            files = [ROOT / "tests/house/browser.d.ts", *laid.glob("studio-*.js"), laid / "bake.js", laid / "bake-worker.js", laid / "use.ts", *pathlib.Path(folder).glob("*.js"), *(file for file in modules() if file.name not in GENERATED)]
            project.write_text(json.dumps({"compilerOptions": {**OPTIONS, "rootDirs": [str(laid), str(ROOT / "bake/extensions/studio/page")]}, "files": [str(file) for file in files]}))
            told = subprocess.run([TSC, "-p", project], cwd=ROOT, capture_output=True, text=True).stdout.splitlines()
        planted = [line for line in told if any(f"{code}.js" in line for code in WRONG)]
        self.assertEqual(sorted(re.search(r"error (TS\d+)", line)[1] for line in planted), sorted(WRONG), told)
        self.assertEqual("\n".join(line for line in told if line not in planted), "")


if __name__ == "__main__":
    unittest.main()
