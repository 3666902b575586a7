#!/usr/bin/env bash
# Lays out the npm package: the page and its engine (preset `web`), and `modar` for Node and as a library (preset `wasm`).
#   scripts/wasm/package.sh FOLDER
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=${1:?a folder is missing}
rm -rf "$out"
mkdir -p "$out/bin"
cp -a "$root/build/web/web/." "$out"
cp "$root"/build/wasm/bin/baker.{js,wasm} "$root"/bake/extensions/wasm/{modar,paths.js,server.js,studio.js} "$out/bin"
echo '{ "type": "commonjs" }' >"$out/bin/package.json"
"$root/scripts/wasm/studio_page.sh" "$out/studio"
# The library: the same WebAssembly under a script whose files are in memory.
cmp "$root"/build/wasm/bin/baker{,-module}.wasm
mkdir "$out/bin/module"
cp "$root/build/wasm/bin/baker-module.js" "$out/bin/module/baker.js"
echo '{ "type": "module" }' >"$out/bin/module/package.json"
cp "$root"/bake/extensions/wasm/{bake.js,bake.d.ts,bake-worker.js,platform.js} "$out"
node "$out/bin/modar" document -o "$out/documents"
mv "$out/documents/modar/commands.d.ts" "$out"
rm -r "$out/documents"
# Notices: of the built libraries from their sources, of header-only ones and of mithril from their packages.
for archive in "$root"/build/sources/*.debian.tar.xz; do
  printf '\n\n---- bin/baker.wasm holds code of %s ----\n\n' "$(basename "$archive" .debian.tar.xz)"
  tar -xJOf "$archive" debian/copyright
done >>"$out/LICENSE"
for package in libcli11-dev libexpected-dev libfast-float-dev libstb-dev libtinygltf-dev libtomlplusplus-dev libxxhash-dev \
  nlohmann-json3-dev rapidjson-dev node-mithril; do
  [ -e "/usr/share/doc/$package/copyright" ] || continue
  printf '\n\n---- the package holds code of %s ----\n\n' "$package"
  cat "/usr/share/doc/$package/copyright"
done >>"$out/LICENSE"
python3 - "$out" <<'END'
import json, pathlib, sys
out = pathlib.Path(sys.argv[1])
package = json.loads((out / "package.json").read_text())
package["bin"] = {"modar": "bin/modar"}
package["exports"]["./bake"] = {"types": "./bake.d.ts", "default": "./bake.js"}
package["engines"] = {"node": ">=18"}
package["files"] = sorted(each.name for each in out.iterdir() if each.name != "package.json")
(out / "package.json").write_text(json.dumps(package, indent=2) + "\n")
END
