#!/usr/bin/env bash
# Lays out the studio as a static page, and packs it: put the files on any web server with HTTPS. Builds nothing: takes the presets
# `web` and `wasm`.
#   scripts/wasm/studio.sh FOLDER ARCHIVE.zip
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=${1:?a folder is missing}
archive=${2:?an archive is missing}

rm -rf "$out"
"$root/scripts/wasm/studio_page.sh" "$out"
mkdir "$out/baker"
cp -a "$root/build/web/web" "$out/engine"
find "$out/engine" -name '*.map' -delete
cmp "$root"/build/wasm/bin/baker{,-module}.wasm
cp "$root/build/wasm/bin/baker.wasm" "$out/baker"
cp "$root/build/wasm/bin/baker-module.js" "$out/baker/baker.js"
cp "$root"/bake/extensions/wasm/studio/*.js "$out"
sed -i "s/MODAR_PROGRAM_BYTES/$(stat -c %s "$out/baker/baker.wasm")/" "$out/studio-static.js"
python3 - "$out/index.html" "$out" "$archive" <<'END'
import hashlib, json, pathlib, sys, zipfile
index, out, archive = map(pathlib.Path, sys.argv[1:])
text = index.read_text()
assert 'src="app.js"' in text
(out / "index.html").write_text(text.replace('src="app.js"', 'src="studio-static.js"'))
def names(folder):
    return sorted(file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file())
# What `modar web` copies is fetched when somebody makes a page, and is among what the visit keeps.
(out / "engine/files.json").write_text(json.dumps(names(out / "engine")))
files = [name for name in names(out) if name not in ("studio-sw.js", "files.json", "index.html")]
(out / "files.json").write_text(json.dumps(files))
version = hashlib.sha256(b"".join((out / name).read_bytes() for name in ["index.html", *files])).hexdigest()[:16]
worker = out / "studio-sw.js"
worker.write_text(worker.read_text().replace("MODAR_STUDIO_VERSION", f"modar-studio {version}"))
with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as made:
    for name in names(out):
        made.writestr(zipfile.ZipInfo(f"modar-studio/{name}"), (out / name).read_bytes(), zipfile.ZIP_DEFLATED, 9)
END
