#!/bin/sh
# Builds the device's player for another processor with Debian's cross compilers, says how large it is, and proves
# under qemu that the pose loop sees the same to the last bit as on this one. Not part of CI.
# Usage: scripts/foreign.sh armhf|arm64 BUNDLE VIDEO   (e.g. armhf build/box.modar box.mp4; 60 frames of it)
# Needs: g++-arm-linux-gnueabihf or g++-aarch64-linux-gnu, qemu-user, ffmpeg; dpkg --add-architecture and apt-get update.
set -eu
arch=${1:-} bundle=${2:-} video=${3:-}
case $arch in
  armhf) triple=arm-linux-gnueabihf qemu=qemu-arm ;;
  arm64) triple=aarch64-linux-gnu qemu=qemu-aarch64 ;;
  *) sed -n 2,5p "$0" >&2; exit 1 ;;
esac
if [ ! -f "$bundle" ] || [ ! -f "$video" ]; then
  echo "foreign.sh: give a bundle and a video that shows its pattern" >&2
  exit 1
fi
bundle=$(realpath "$bundle")
video=$(realpath "$video")
cd "$(dirname "$0")/.."
build=$PWD/build/$arch
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

cmake --preset device -B "$build" --toolchain "$PWD/scripts/foreign.cmake" -DMODAR_FOREIGN="$arch" \
  -DMODAR_FOREIGN_ROOT="$root" > /dev/null
cmake --build "$build" --target modar-play
cmake --preset device > /dev/null
cmake --build --preset device --target modar_runtime modar_formats
"$triple-strip" -o "$build/modar-play.stripped" "$build/bin/modar-play"
echo "$arch player: $(wc -c < "$build/modar-play.stripped") bytes"

probe() { # COMPILER BUILD OUT FLAG...: links the probe with a build's pose loop
  compiler=$1 of=$2 out=$3
  shift 3
  "$compiler" -O2 -std=c++20 -ffp-contract=off -I. -Iruntime/include "$@" tests/track/pose_bits.cpp \
    "$of/runtime/libmodar_runtime.a" "$of/formats/libmodar_formats.a" -pthread -o "$out"
}
probe g++ build/device "$build/bits-here"
probe "$triple-g++" "$build" "$build/bits-there" -static -idirafter /usr/include
frames=$build/frames.grey
ffmpeg -loglevel error -y -i "$video" -frames:v 60 -pix_fmt gray -f rawvideo "$frames"
size=$(ffprobe -loglevel error -select_streams v:0 -show_entries stream=width,height -of csv=p=0:s=x "$video" | tr x ' ')
# shellcheck disable=SC2086
"$build/bits-here" "$bundle" $size < "$frames" > "$build/here.txt"
# shellcheck disable=SC2086
$qemu "$build/bits-there" "$bundle" $size < "$frames" > "$build/there.txt"
cmp "$build/here.txt" "$build/there.txt"
echo "$(grep -c reason "$build/here.txt") frames, $(grep -c pattern "$build/here.txt") poses: the same to the last bit"
