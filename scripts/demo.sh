#!/usr/bin/env bash
# First light: bakes a model and a pattern, checks the bundle, plays a video with the model on it.
#   scripts/demo.sh          spider.obj on the box of a real hand-held video (Debian packages)
#   scripts/demo.sh --web    the same as a page for browsers in out/web (Debian's emscripten compiles its engine)
#   scripts/demo.sh --own    our own pottery on our own cover, on a clip that we render: needs no
#                            package but the build's
# Leaves everything in out/demo (out/demo-own) and prints where to look.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

own=no
web=no
case ${1:-} in
  "") ;;
  --own) own=yes ;;
  --web) web=yes ;;
  -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) echo "demo.sh: '$1' is not understood; try --help" >&2; exit 1 ;;
esac

step() { printf '\n== %s\n' "$*" >&2; }

# The path of a file of an installed package; where the machine installs no documentation, the package
# is unpacked into build/packages instead.
package_file() {
  local package=$1 path=$2
  if [ -r "$path" ]; then echo "$path"; return; fi
  local unpacked=build/packages/$package
  if [ ! -r "$unpacked$path" ]; then
    mkdir -p "$unpacked"
    (cd "$unpacked" && apt-get download -qq "$package" >&2)
    dpkg -x "$unpacked"/"$package"_*.deb "$unpacked"
  fi
  echo "$unpacked$path"
}

step "Packages"
if [ $own = yes ]; then scripts/setup.sh; elif [ $web = yes ]; then scripts/setup.sh demo test; else scripts/setup.sh demo; fi

step "Build (release)"
cmake --preset release >build-release.log 2>&1 || { cat build-release.log >&2; exit 4; }
rm -f build-release.log
cmake --build --preset release
bin=build/release/bin

if [ $own = yes ]; then
  out=out/demo-own
  rm -rf "$out"; mkdir -p "$out"
  model=assets/models/pottery.obj
  pattern=assets/patterns/cover.png
  scene="cover=pottery,scale=0.5"
  step "Clip: our cover before a made-up background"
  python3 assets/make_clip.py --pattern "$pattern" --frames 60 --size 480x360 "$out/clip"
  video=$out/clip
else
  out=out/demo
  rm -rf "$out"; mkdir -p "$out"
  model=$(package_file assimp-testmodels /usr/share/assimp/models/OBJ/spider.obj)
  packed=$(package_file opencv-doc /usr/share/doc/opencv-doc/opencv4/html/box.mp4.gz)
  video=$out/box.mp4
  gzip -dc "$packed" >"$video"
  step "Pattern: the front of the box, from four corners in one frame of the video"
  ffmpeg -v fatal -nostdin -y -i "$video" -vf 'select=eq(n\,264)' -frames:v 1 "$out/photo.png"
  pattern=$out/box.png
  # The corners as read off the photo in an image viewer; the box's front is 258 x 189 mm.
  "$bin/modar" pattern rectify "$out/photo.png" \
    --corners 285.8,111.2,513.6,168.7,473.3,282.6,200.8,195.6 \
    --width-mm 258 --height-mm 189 -o "$pattern"
  # The spider of the package is modelled with Y up.
  scene="box=spider,up=y,scale=0.6"
fi

step "Bake"
bundle=$out/demo.modar
"$bin/modar" bake --model "$model" --pattern "$pattern" --scene "$scene" -o "$bundle"

step "Check"
"$bin/modar" check "$bundle"
"$bin/modar" inspect "$bundle"

if [ $web = yes ]; then
  step "Page"
  cmake --preset web >/dev/null
  cmake --build --preset web
  "$bin/modar" web "$bundle" -o out/web --title "A spider on a box"
  step "Done. Open it"
  echo "here:       python3 -m http.server --bind 127.0.0.1 --directory $root/out/web   (http://localhost:8000)"
  echo "on a phone: $root/$bin/modar web $root/$bundle -o $root/out/web --title 'A spider on a box' --serve"
  exit
fi

step "Play"
# Our own loop, the default, holds this small, tilted picture throughout; --method paper finds it in few
# frames and takes clutter for it in many.
# --force: the folder holds the video, too.
"$bin/modar-play" "$bundle" --input "$video" --outline --report "$out" --force

step "Before and after: plain shading, ours, ours in the light that the camera shows"
mkdir "$out/frames"
if [ $own = yes ]; then
  for frame in 05 30 55; do cp "$video/frame_000$frame.png" "$out/frames"; done
else
  ffmpeg -v fatal -nostdin -y -i "$video" -vf 'select=eq(n\,40)+eq(n\,200)+eq(n\,400)' -vsync vfr "$out/frames/%d.png"
fi
"$bin/modar" bench light "$bundle" "$out"/frames/*.png -o "$out"
rm -r "$out/frames"
figure='<h2>Before and after</h2>\n<a href=before_after.png><img src=before_after.png alt="plain shading, ours, ours in the light that the camera shows"></a>'
sed -i "s|<h2>Contact sheet</h2>|$figure\n&|" "$out/index.html"

step "Done. Look at"
for file in index.html overlay.mp4 contact_sheet.png before_after.png demo.modar; do
  [ -s "$out/$file" ] || { echo "demo.sh: $out/$file was not made" >&2; exit 4; }
  echo "$root/$out/$file"
done
