#!/usr/bin/env bash
# Lays out the studio's page, without what answers it:
#   scripts/wasm/studio_page.sh FOLDER
set -euo pipefail
page=$(cd "$(dirname "$0")/../.." && pwd)/bake/extensions/studio/page
out=${1:?a folder is missing}
mithril=$(find /usr/lib/nodejs/mithril /usr/share/nodejs/mithril -maxdepth 1 -name mithril.js 2>/dev/null | head -n 1 || true)
mkdir -p "$out/words"
cp "$page"/{*.js,style.css,index.html} "$out"
cp "$page"/words/*.json "$out/words"
cp "${mithril:?node-mithril is missing: scripts/setup.sh web}" "$out/mithril.js"
