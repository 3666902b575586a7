#!/usr/bin/env bash
# Installs the Debian packages in a clean Debian 12, measures what they bring, runs the demo, builds the example app against
# libmodar-dev, and makes a project of 60 models and 20 pictures of Debian packages by the README's words: init, bake, report,
# publish, fetch. By hand, as root, with mmdebstrap and a network:
#   scripts/package_try.sh [FOLDER-OF-PACKAGES [FOLDER]]      (default: build/package/packages)
# FOLDER: where the clean Debian is made, and left; without it, it is removed at the end.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
packages=$(cd "${1:-$root/build/package/packages}" && pwd)
clean=${2:-}
if [ -z "$clean" ]; then
  clean=$(mktemp -d /tmp/modar-clean-XXXXXX)
  trap 'umount "$clean/proc" 2>/dev/null || true; rm -rf --one-file-system "$clean"' EXIT
else
  trap 'umount "$clean/proc" 2>/dev/null || true' EXIT
fi
say() { printf '%-58s %s\n' "$1" "$2"; }
[ -x "$clean/usr/bin/apt-get" ] || mmdebstrap --quiet --variant=apt --mode=root bookworm "$clean" >&2
cp /etc/resolv.conf "$clean/etc/resolv.conf"
mountpoint -q "$clean/proc" || mount -t proc proc "$clean/proc"
mkdir -p "$clean/packages"
cp "$packages"/*.deb "$clean/packages"

in_clean() { chroot "$clean" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
megabytes() { in_clean dpkg-query -W -f '${Installed-Size}\n' | awk '{ sum += $1 } END { printf "%.0f", sum / 1024 }'; }
install() {  # WORDS FOR APT...
  in_clean sh -c "apt-get install -y -qq $*" >>"$clean/install.log" 2>&1 || { tail -n 20 "$clean/install.log" >&2; exit 4; }
}
timed() {  # WHAT COMMAND...: runs it in bash, in the clean Debian
  local start
  start=$(date +%s.%N)
  in_clean bash -ec "cd /root; $2" >"$clean/step.log" 2>&1 || { cat "$clean/step.log" >&2; exit 4; }
  say "$1" "$(echo "$(date +%s.%N) - $start" | bc | cut -c1-6) s"
}

# --- What they bring ---
in_clean apt-get update -qq
before=$(megabytes)
install --no-install-recommends /packages/modar_*.deb /packages/modar-player_*.deb
say "modar and modar-player with all they require" "$(($(megabytes) - before)) MB"
in_clean sh -c 'modar --version && modar-play --version && modar-fetch --version' >&2
install /packages/modar_*.deb /packages/modar-player_*.deb libgl1-mesa-dri libopencv-videoio406
say "with what they recommend (codecs, software OpenGL)" "$(($(megabytes) - before)) MB"
install man-db bash-completion >/dev/null
in_clean sh -c 'man modar-bake | grep -q -- --max-error'
in_clean bash -c '. /usr/share/bash-completion/bash_completion && _completion_loader modar; complete -p modar' >/dev/null
timed "modar-demo" 'rm -rf modar-demo; modar-demo'
in_clean test -s /root/modar-demo/play/index.html -a -s /root/modar-demo/play/overlay.mp4 -a -s /root/modar-demo/report.html

# --- An app of somebody else's ---
install --no-install-recommends '/packages/libmodar*.deb g++ make cmake pkg-config'
timed "the example app with CMake and the static library" 'cp -r /usr/share/doc/libmodar-dev/examples app; cd app; cmake -S . -B build
  cmake --build build; head -c 460800 /dev/zero | build/overlay ../modar-demo/demo.modar 640 480 | wc -c | grep -x 1228800'
timed "the same by pkg-config" 'cd app; c++ -x c overlay.c -x none $(pkg-config --cflags --libs modar) -o by-pkg-config
  head -c 460800 /dev/zero | ./by-pkg-config ../modar-demo/demo.modar 640 480 | wc -c | grep -x 1228800; rm -rf ../app'

# --- A collection, from what Debian packages hold; unpacked, not installed ---
timed "60 models that bake, and 20 pictures" '
  rm -rf museum source; mkdir -p source museum/models museum/pictures; cd source
  apt-get download -qq assimp-testmodels stellarium-data mate-backgrounds plasma-workspace-wallpapers
  for package in *.deb; do dpkg -x "$package" .; done; rm ./*.deb
  count=0
  while read -r model; do
    modar bake --model "$model" -o /tmp/try.modar --quiet --no-lods --no-ao >/dev/null 2>&1 || continue
    folder="/root/museum/models/$count"
    mkdir "$folder"
    cp "$model" "$folder/"
    # With the files beside it that it names.
    find "$(dirname "$model")" -maxdepth 1 -type f | sort -r >beside
    for kind in "\.mtl$" "."; do
      grep -i -- "$kind" beside | while read -r file; do
        ! grep -qF "$(basename "$file")" "$folder"/* || cp "$file" "$folder/"
      done
    done
    count=$((count + 1))
    [ $count -lt 60 ] || break
  done < <(find usr/share/assimp usr/share/stellarium -iname "*.obj" -o -iname "*.gltf" -o -iname "*.glb" | sort)
  [ $count = 60 ]
  mkdir /root/source/pool
  find usr/share/backgrounds -name "*.jpg" -size +40k -exec cp -n {} pool/ \;
  for folder in usr/share/wallpapers/*/contents/images; do
    picture=$(ls "$folder"/* | sort -V | head -n 1)
    cp "$picture" "pool/$(basename "${folder%/contents/images}").${picture##*.}"
  done
  ls pool | sort | head -n 20 | while read -r picture; do mv "pool/$picture" /root/museum/pictures/; done
  [ "$(ls /root/museum/pictures | wc -l)" = 20 ]; rm -rf usr'
timed "modar init museum" 'modar init museum'
# Pictures that are too plain to be found again are named; others take their place.
timed "modar bake" 'cd museum
  until modar bake 2>bake.log; do
    grep -q "pattern.no-features" bake.log || { cat bake.log; exit 3; }
    for picture in $(grep -o "pictures/[^:]*" bake.log | sort -u); do
      echo "too plain: $picture"; rm "$picture"
      next=$(ls ../source/pool | sort | head -n 1); [ -n "$next" ]; mv "../source/pool/$next" pictures/
    done
    modar init --force .
  done'
timed "modar bake again" 'cd museum; modar bake 2>&1 | tee /dev/stderr | grep -q "80 assets, 80 up to date"'
timed "modar check, modar inspect" 'cd museum; modar check out/museum.modar; modar inspect out/museum.modar'
timed "modar report" 'cd museum; modar report out/museum.modar -o museum.html'
timed "modar ship keygen, publish" 'cd museum; modar ship keygen --out museum.key
  modar ship publish out/museum.modar --to ar --key museum.key'
timed "modar-fetch" 'cd museum; modar-fetch ar --store store --trust museum.key.pub; cmp store/museum.modar out/museum.modar'
say "the fetched bundle is the published one" "$(in_clean stat -c %s /root/museum/out/museum.modar) bytes"

# --- A page, with the engine that the package brings ---
timed "modar web" 'cd museum; modar web out/museum.modar -o site --title Museum; test -s site/index.html; ls site/*.wasm'
say "the page" "$(in_clean sh -c 'du -sk /root/museum/site | cut -f1') KB"
