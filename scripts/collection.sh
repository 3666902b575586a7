#!/usr/bin/env bash
# The ModAR paper's collection: POTTERY, BUST, STATUE and CHURCH, each on any of six patterns, as bundles, a page and an app.
#   scripts/collection.sh [--vertices N] [FOLDER]     FOLDER: out/collection
# --vertices   of the church (7,335,148 with 14,645,744 triangles: minutes, 2.2 GB of memory, a bundle of 286 MB); a smaller one bakes in seconds
# Writes FOLDER/{pottery,bust,statue,church}.modar, FOLDER/site where the page's engine was
# built (cmake --preset web; with preset wasm visitors may open an OBJ file), and FOLDER/collection.apk where ANDROID_NDK names Google's compilers. MODAR: the program
# (build/release/bin/modar). Page and app list the four models; any of the six printed patterns shows the chosen one.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
modar=$(realpath "${MODAR:-$root/build/release/bin/modar}")
vertices=() folder=out/collection
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
    --vertices) [ $# -ge 2 ] || { echo "collection.sh: --vertices wants a number" >&2; exit 1; }; vertices=(--vertices "$2"); shift 2 ;;
    -*) echo "collection.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
    *) folder=$1; shift ;;
  esac
done
mkdir -p "$folder"
python3 "$root/assets/make_church.py" "$folder/church.obj" "${vertices[@]}"

bundles=()
for model in "$root"/assets/models/{pottery,bust,statue}.obj "$folder/church.obj"; do
  name=$(basename "$model" .obj)
  words=(--model "$model")
  for pattern in cover game mural painting poems survey; do
    words+=(--pattern "$root/assets/patterns/$pattern.png" --scene "$pattern=$name")
  done
  "$modar" bake "${words[@]}" -o "$folder/$name.modar" --quiet
  echo "$folder/$name.modar"
  bundles+=("$folder/$name.modar")
done
if [ -f "$root/build/web/web/engine-plain.wasm" ]; then
  page=("$root/build/web/web")
  if [ -f "$root/build/wasm/bin/baker.wasm" ]; then
    "$root/scripts/wasm/package.sh" "$folder/page"
    page=("$folder/page" --baker)
  fi
  "$modar" web "${bundles[@]}" -o "$folder/site" --page "${page[@]}" --title "Collection" --force --quiet
  echo "$folder/site"
else
  echo "collection.sh: no page: the engine was not built (cmake --preset web)" >&2
fi
if [ -n "${ANDROID_NDK:-}" ]; then
  "$root/scripts/apk.sh" "${bundles[@]}" --title "Collection" --out "$folder/collection.apk"
else
  echo "collection.sh: no app: ANDROID_NDK is not set" >&2
fi
