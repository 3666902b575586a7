#!/bin/sh
# Builds the pose loop for another processor and proves that it sees there, to the last bit, what it sees here. Not
# part of CI. For ARM, the device's player too, with Debian's cross compilers, and its size; ARM runs under qemu, wasm
# (SIMD of 128 bits) in node.
# Usage: scripts/foreign.sh armhf|arm64|wasm BUNDLE VIDEO   (e.g. armhf build/box.modar box.mp4; 60 frames of it)
# Needs ffmpeg and: g++-arm-linux-gnueabihf or g++-aarch64-linux-gnu with qemu-user, dpkg --add-architecture and
# apt-get update; for wasm emscripten and node.
set -eu
arch=${1:-} bundle=${2:-} video=${3:-}
case $arch in
  armhf) triple=arm-linux-gnueabihf run="qemu-arm build/armhf/bits-there" ;;
  arm64) triple=aarch64-linux-gnu run="qemu-aarch64 build/arm64/bits-there" ;;
  # Debian 12's emscripten takes the fetch() of newer nodes for a browser's.
  wasm) run="node --no-experimental-fetch build/wasm/bits-there.js" ;;
  *) sed -n 2,7p "$0" >&2; exit 1 ;;
esac
if [ ! -f "$bundle" ] || [ ! -f "$video" ]; then
  echo "foreign.sh: give a bundle and a video that shows its pattern" >&2
  exit 1
fi
bundle=$(realpath "$bundle")
video=$(realpath "$video")
cd "$(dirname "$0")/.."
build=$PWD/build/$arch
mkdir -p "$build"

probe() { # COMPILER BUILD OUT FLAG...: links the probe with a build's pose loop
  compiler=$1 of=$2 out=$3
  shift 3
  "$compiler" -O2 -std=c++20 -ffp-contract=off -I. -Iruntime/include "$@" tests/track/pose_bits.cpp \
    "$of/runtime/libmodar_runtime.a" "$of/formats/libmodar_formats.a" -pthread -o "$out"
}

there_on_arm() {
  root=$build/root
  libraries=$root/usr/lib/$triple

  # EGL and GLES to link against: unpacked, not installed.
  if [ ! -f "$root/pkgconfig/glesv2.pc" ]; then
    mkdir -p "$root/pkgconfig"
    (cd "$root" && apt-get download "libegl1:$arch" "libgles2:$arch" "libglvnd0:$arch")
    for package in "$root"/*.deb; do dpkg -x "$package" "$root"; done
    for library in egl:EGL:1 glesv2:GLESv2:2; do
      name=${library%%:*} rest=${library#*:}
      ln -sf "lib${rest%:*}.so.${rest#*:}" "$libraries/lib${rest%:*}.so"
      printf 'Name: %s\nDescription: of %s\nVersion: 1\nLibs: -L%s -l%s\n' \
        "$name" "$arch" "$libraries" "${rest%:*}" > "$root/pkgconfig/$name.pc"
    done
  fi

  cmake --preset device -B "$build" --toolchain "$PWD/scripts/foreign.cmake" -DMODAR_FOREIGN="$arch" -DMODAR_FETCH=OFF \
    -DMODAR_FOREIGN_ROOT="$root" > /dev/null
  cmake --build "$build" --target modar-play
  "$triple-strip" -o "$build/modar-play.stripped" "$build/bin/modar-play"
  echo "$arch player: $(wc -c < "$build/modar-play.stripped") bytes"
  probe "$triple-g++" "$build" "$build/bits-there" -static -idirafter /usr/include
}

there_in_wasm() { # what the loop needs, without EGL
  sources="runtime/track/*.cpp formats/bundle_view.cpp formats/tracker_record.cpp formats/validate.cpp formats/rules.cpp formats/etc1.cpp"
  # shellcheck disable=SC2086
  NODE_PATH=/usr/share/nodejs em++ -O2 -msimd128 -std=c++20 -ffp-contract=off -fno-exceptions -fno-rtti \
    -DEIGEN_DONT_VECTORIZE -I. -Iruntime/include -idirafter /usr/include/eigen3 -idirafter /usr/include \
    $sources tests/track/pose_bits.cpp -sNODERAWFS=1 -sALLOW_MEMORY_GROWTH=1 -o "$build/bits-there.js"
  echo "pose loop and its test as wasm: $(wc -c < "$build/bits-there.wasm") bytes"
}

cmake --preset device > /dev/null
cmake --build --preset device --target modar_runtime modar_formats
probe g++ build/device "$build/bits-here"
if [ "$arch" = wasm ]; then there_in_wasm; else there_on_arm; fi
frames=$build/frames.grey
ffmpeg -loglevel error -y -i "$video" -frames:v 60 -pix_fmt gray -f rawvideo "$frames"
size=$(ffprobe -loglevel error -select_streams v:0 -show_entries stream=width,height -of csv=p=0:s=x "$video" | tr x ' ')
# shellcheck disable=SC2086
"$build/bits-here" "$bundle" $size < "$frames" > "$build/here.txt"
# shellcheck disable=SC2086
$run "$bundle" $size < "$frames" > "$build/there.txt"
cmp "$build/here.txt" "$build/there.txt"
echo "$(grep -c reason "$build/here.txt") frames, $(grep -c pattern "$build/here.txt") poses: the same to the last bit"
