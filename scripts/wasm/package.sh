#!/usr/bin/env bash
# Lays out the npm package: the page and its engine (preset `web`), and `modar` for Node (preset `wasm`).
#   scripts/wasm/package.sh FOLDER
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=${1:?a folder is missing}
rm -rf "$out"
mkdir -p "$out/bin"
cp -a "$root/build/web/web/." "$out"
cp "$root"/build/wasm/bin/baker.{js,wasm} "$root"/bake/extensions/wasm/{modar,paths.js} "$out/bin"
echo '{ "type": "commonjs" }' >"$out/bin/package.json"
# Notices: of the built libraries from their sources, of header-only ones from their packages.
for archive in "$root"/build/sources/*.debian.tar.xz; do
  printf '\n\n---- bin/baker.wasm holds code of %s ----\n\n' "$(basename "$archive" .debian.tar.xz)"
  tar -xJOf "$archive" debian/copyright
done >>"$out/LICENSE"
for package in libcli11-dev libexpected-dev libfast-float-dev libstb-dev libtinygltf-dev libtomlplusplus-dev libxxhash-dev \
  nlohmann-json3-dev rapidjson-dev; do
  [ -e "/usr/share/doc/$package/copyright" ] || continue
  printf '\n\n---- bin/baker.wasm holds code of %s ----\n\n' "$package"
  cat "/usr/share/doc/$package/copyright"
done >>"$out/LICENSE"
python3 - "$out" <<'END'
import json, pathlib, sys
out = pathlib.Path(sys.argv[1])
package = json.loads((out / "package.json").read_text())
package["bin"] = {"modar": "bin/modar"}
package["engines"] = {"node": ">=18"}
package["files"] = sorted(each.name for each in out.iterdir() if each.name != "package.json")
(out / "package.json").write_text(json.dumps(package, indent=2) + "\n")
END
