#!/usr/bin/env bash
# First light: bakes a model and a pattern, checks the bundle, plays a video with the model on it.
#   scripts/demo.sh          a jar on the box of a real hand-held video (Debian's opencv-doc), and as a page for browsers
#   scripts/demo.sh --own    the jar on a book's cover, in a clip that it renders, and no page: needs no package but the build's
# Leaves everything in out/demo (out/demo-own) and prints where to look; the output of the programs goes to build/demo.log.
# The programs stay in build/release/bin and the page's engine in build/web, where scripts/release.sh takes them.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

own=no
case ${1:-} in
  "") ;;
  --own) own=yes ;;
  -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) echo "demo.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
esac

log=build/demo.log
steps=$([ $own = yes ] && echo 6 || echo 8)
# shellcheck source=scripts/steps.sh
. scripts/steps.sh

bin=build/release/bin
model=assets/models/pottery.obj
if [ $own = yes ]; then
  out=out/demo-own
  pattern=assets/patterns/cover.png
  width=210mm
  scene="cover=pottery,height=150mm"
  video=$out/clip
else
  out=out/demo
  pattern=$out/box.png
  width=258mm
  scene="box=pottery,height=95mm"
  video=$out/box.mp4
fi
bundle=$out/demo.modar

packages() {
  if [ $own = yes ]; then scripts/setup.sh; else scripts/setup.sh demo web; fi
}

build() {
  cmake --preset package
  ninja -C build/release modar modar-play modar-fetch modar-lab
}

engine() {
  cmake --preset web
  cmake --build --preset web
}

make_pattern() {
  rm -rf "$out"; mkdir -p "$out"
  if [ $own = yes ]; then
    python3 assets/make_clip.py --pattern "$pattern" --frames 60 --size 480x360 "$video"
    return
  fi
  local packed
  packed=$(package_file opencv-doc /usr/share/doc/opencv-doc/opencv4/html/box.mp4.gz)
  gzip -dc "$packed" >"$video"
  ffmpeg -v fatal -nostdin -y -i "$video" -vf 'select=eq(n\,264)' -frames:v 1 "$out/photo.png"
  # The corners as read off the photo in an image viewer; the box's front is 258 x 189 mm.
  "$bin/modar" pattern rectify "$out/photo.png" \
    --corners 285.8,111.2,513.6,168.7,473.3,282.6,200.8,195.6 \
    --width 258mm --height 189mm -o "$pattern"
}

check() {
  "$bin/modar" check "$bundle"
  "$bin/modar" inspect "$bundle"
  "$bin/modar" report "$bundle" -o "$out/report.html"
}

play() {
  # --force: the folder holds the video, too.
  "$bin/modar-play" "$bundle" --input "$video" --report "$out" --force
  # Three frames with plain shading, as drawn, and in the light that the camera shows.
  mkdir "$out/frames"
  if [ $own = yes ]; then
    for frame in 05 30 55; do cp "$video/frame_000$frame.png" "$out/frames"; done
  else
    ffmpeg -v fatal -nostdin -y -i "$video" -vf 'select=eq(n\,40)+eq(n\,200)+eq(n\,400)' -vsync vfr "$out/frames/%d.png"
  fi
  "$bin/modar-lab" bench light "$bundle" "$out"/frames/*.png -o "$out"
  rm -r "$out/frames"
  local figure='<h2>Before and after</h2>\n<a href=before_after.png><img src=before_after.png alt="plain shading, ours, ours in the light that the camera shows"></a>'
  sed -i "s|<h2>Contact sheet</h2>|$figure\n&|" "$out/index.html"
}

echo "ModAR: a jar is baked onto a picture, and played on a video. The output of the programs goes to $log."
step "packages of Debian (about 3.2 GB of disk, the first time)" packages
step "building the programs (minutes, the first time)" build
[ $own = yes ] || step "building the page's engine (minutes, the first time)" engine
if [ $own = yes ]; then
  step "the picture: a book's cover; a clip of it" make_pattern
else
  step "the picture: a box's front, from one frame of the video" make_pattern
fi
step "modar bake: model and picture become one file" \
  "$bin/modar" bake --model "$model" --pattern "$pattern:$width" --scene "$scene" -o "$bundle"
step "modar check, modar report" check
size=$(($(stat -c %s "$bundle") / 1024))

step "modar-play: finds the picture in each frame, draws the jar" play
if [ $own = no ]; then
  step "modar web: the page" "$bin/modar" web "$bundle" -o $out/site --title "A jar on a box"
  [ -s $out/site/index.html ]
fi
for file in index.html overlay.mp4 poster.png contact_sheet.png before_after.png report.html demo.modar; do
  [ -s "$out/$file" ] || { echo "demo.sh: $out/$file was not made" >&2; exit 4; }
done
grep -E '^[0-9]+ frames' "$log" | tail -n 1
grep -q 'in software' "$log" && echo "No graphics card was used: rendering times are those of a processor, not of a phone."
cat <<END
Made in $((SECONDS / 60)) min $((SECONDS % 60)) s, in $root/$out. Look at
  index.html    the video with the jar, and what became of each frame
  report.html   what is in the bundle of $size KB, demo.modar, and what each phone says to it
  poster.png, overlay.mp4, contact_sheet.png, before_after.png   the pictures alone
Next: your own model on your own picture, see README.md. The programs are in build/release/bin:
  export PATH=$root/$bin:\$PATH
END
[ $own = yes ] || cat <<END
The jar on a phone in the same network, by a QR code:
  $bin/modar web $bundle -o $out/site --title 'A jar on a box' --serve
END
