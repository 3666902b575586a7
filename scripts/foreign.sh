#!/bin/sh
# Builds the pose loop for another processor and proves that it sees there, to the last bit, what it sees here, with an
# estimated camera (the default) and with a given one. For ARM, the device's player too, with Debian's cross compilers, and
# its size; ARM runs under qemu, wasm (SIMD of 128 bits) in node. Not part of CI.
#   scripts/foreign.sh armhf|arm64|wasm BUNDLE VIDEO [PACKED]   e.g. armhf build/box.modar box.mp4; 60 frames of it. PACKED:
#                                                      of modar web, which ARM unpacks to the same bytes
#   scripts/foreign.sh memory BUNDLE                   tracks and draws BUNDLE here within 256 MB of addresses, by the
#                                                      device's code and a driver that draws nothing: memory a stage
#   scripts/foreign.sh budget [MODAR [BIG_BUNDLE]]     instructions on ARMv7, compared with tests/bench/arm_budget.csv; fails
#                                                      where one is 2 % above. MODAR: program that bakes the demo scene
#                                                      (build/release/bin/modar); BIG_BUNDLE: of about 200 MB
# Needs ffmpeg (not for the budget) and: g++-arm-linux-gnueabihf or g++-aarch64-linux-gnu with qemu-user,
# dpkg --add-architecture and apt-get update; for wasm emscripten and node.
set -eu
arch=${1:-} bundle=${2:-} video=${3:-} packed=${4:-}
case $arch in
  budget) triple=arm-linux-gnueabihf ;;
  armhf) triple=arm-linux-gnueabihf run="qemu-arm build/armhf/bits-there" ;;
  arm64) triple=aarch64-linux-gnu run="qemu-aarch64 build/arm64/bits-there" ;;
  # Debian 12's emscripten takes the fetch() of newer nodes for a browser's.
  wasm) run="node --no-experimental-fetch build/wasm/bits-there.js" ;;
  memory) triple= ;;
  *) sed -n 2,13p "$0" >&2; exit 1 ;;
esac
if [ "$arch" = budget ]; then
  arch=armhf
  budget=${2:-build/release/bin/modar}
  big=${3:-}
elif [ ! -f "$bundle" ] || { [ "$arch" != memory ] && [ ! -f "$video" ]; }; then
  echo "foreign.sh: give a bundle and a video that shows its pattern" >&2
  exit 1
fi
[ -z "$bundle" ] || bundle=$(realpath "$bundle")
[ ! -f "$video" ] || video=$(realpath "$video")
[ -z "$packed" ] || packed=$(realpath "$packed")
cd "$(dirname "$0")/.."
build=$PWD/build/$arch
mkdir -p "$build"

probe() { # COMPILER BUILD OUT FLAG...: links the probe with a build's pose loop
  compiler=$1 of=$2 out=$3
  shift 3
  "$compiler" -O2 -std=c++20 -ffp-contract=off -flto=auto -I. -Iruntime/include "$@" tests/track/pose_bits.cpp \
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
  [ -z "${budget:-}" ] || return 0
  cmake --build "$build" --target modar-play
  "$triple-strip" -o "$build/modar-play.stripped" "$build/bin/modar-play"
  echo "$arch player: $(wc -c < "$build/modar-play.stripped") bytes"
  probe "$triple-g++" "$build" "$build/bits-there" -static -idirafter /usr/include
}

# The tests of formats and runtime that need no library of the workstation.
tests_there() {
  google=/usr/src/googletest/googletest
  [ -f "$build/gtest.o" ] || "$triple-g++" -O1 -std=c++20 -I$google/include -I$google -c $google/src/gtest-all.cc \
    -o "$build/gtest.o"
  "$triple-g++" -w -std=c++20 -ffp-contract=off -I. -Iruntime/include -I$google/include -static -idirafter /usr/include \
    tests/track/hysteresis_test.cpp tests/track/pose_smoother_test.cpp tests/formats/bundle_test.cpp \
    tests/formats/number_text_test.cpp tests/formats/utf8_test.cpp tests/formats/vertex_scan_test.cpp \
    tests/formats/allocation_counter.cpp tests/formats/support.cpp tests/formats/contents.cpp \
    $google/src/gtest_main.cc "$build/gtest.o" "$build/runtime/libmodar_runtime.a" \
    "$build/formats/libmodar_formats.a" -pthread -o "$build/runtime-tests"
  MODAR_SOURCE_DIR=$PWD ${run% *} "$build/runtime-tests" --gtest_brief=1
}

unpacker() { # COMPILER BUILD OUT FLAG...
  compiler=$1 of=$2 out=$3
  shift 3
  "$compiler" -O2 -std=c++20 -I. -Iruntime/include "$@" tests/ship/unpack_probe.cpp "$of/runtime/libmodar_runtime.a" \
    "$of/formats/libmodar_formats.a" -pthread -o "$out"
}

# A packed bundle here and there.
unpack_there() {
  unpacker g++ build/device "$build/unpack-here"
  unpacker "$triple-g++" "$build" "$build/unpack-there" -static -idirafter /usr/include
  here=$("$build/unpack-here" "$1")
  there=$(${run% *} "$build/unpack-there" "$1")
  [ "$here" = "$there" ]
  echo "unpacked: $there, the same bytes"
}

there_in_wasm() { # what the loop needs, without EGL
  sources="runtime/track/*.cpp formats/bundle_view.cpp formats/pattern_shape.cpp formats/tracker_record.cpp formats/base/turn.cpp formats/validate.cpp formats/rules.cpp formats/etc1.cpp"
  # shellcheck disable=SC2086
  NODE_PATH=/usr/share/nodejs em++ -O2 -msimd128 -std=c++20 -ffp-contract=off -fno-exceptions -fno-rtti \
    -DEIGEN_DONT_VECTORIZE -I. -Iruntime/include -idirafter /usr/include/eigen3 -idirafter /usr/include \
    $sources tests/track/pose_bits.cpp -sNODERAWFS=1 -sALLOW_MEMORY_GROWTH=1 -o "$build/bits-there.js"
  echo "pose loop and its test as wasm: $(wc -c < "$build/bits-there.wasm") bytes"
}

# tests/track/budget_probe.cpp with a build's library and a driver that draws nothing.
null_probe() { # PREFIX OF THE COMPILER, BUILD
  "$1g++" -O2 -c -idirafter /usr/include tests/track/null_gl.cpp -o "$build/null_gl.o"
  # What null_gl.cpp does not have returns 0.
  "$1nm" "$2/runtime/libmodar_runtime.a" "$build/null_gl.o" 2> /dev/null | awk '
    $NF ~ /^e?gl[A-Z]/ { if ($(NF - 1) == "T") has[$NF] = 1; else if ($(NF - 1) == "U") wants[$NF] = 1 }
    END { for (name in wants) if (!has[name]) print "int " name "(void) { return 0; }" }' > "$build/null_rest.c"
  "$1gcc" -w -O2 -c "$build/null_rest.c" -o "$build/null_rest.o"
  "$1g++" -w -O2 -std=c++20 -ffp-contract=off -flto=auto -I. -Iruntime/include -static -idirafter /usr/include \
    tests/track/budget_probe.cpp "$build/null_gl.o" "$2/runtime/libmodar_runtime.a" \
    "$2/formats/libmodar_formats.a" "$build/null_rest.o" -pthread -o "$build/budget-probe"
}

# Instructions of the steps between two writes of budget_probe: the median, and the greatest.
count() { # STEP BUNDLE FRAMES SKIP
  env -i qemu-arm -cpu cortex-a9 -plugin "$build/count.so" "$build/budget-probe" "$1" "$2" 640 480 "$3" 2>&1 > /dev/null |
    awk '$1 == "count" { if (++n % 2) from = $2; else print $2 - from }' | tail -n +"$4" | sort -n |
    awk '{ all[NR] = $1 } END { print all[int((NR + 1) / 2)], all[NR] }'
}

measure() { # NAME STEP BUNDLE FRAMES SKIP [worst]: prints a row with the committed one; worst: of the greatest
  figures=$(count "$2" "$3" "$4" "$5")
  median=${figures% *} most=${figures#* }
  if [ "${6:-}" = worst ]; then now=$most; else now=$median; fi
  before=$(awk -F, -v name="$1" '$1 == name { print $2 }' tests/bench/arm_budget.csv)
  echo "$1,$now" >> "$build/arm_budget.csv"
  awk -v name="$1" -v now="$now" -v median="$median" -v most="$most" -v before="${before:-0}" 'BEGIN {
    printf "%-18s %11d instructions, committed %d (median %d, greatest %d)\n", name, now, before, median, most
    exit before > 0 && now > 1.02 * before }' || fat=yes
}

if [ "$arch" = memory ]; then
  cmake --preset device > /dev/null
  cmake --build --preset device --target modar_runtime modar_formats
  null_probe "" build/device
  (ulimit -v 262144 && "$build/budget-probe" memory "$bundle" 640 480 10 > /dev/null)
  exit 0
fi

if [ -n "${budget:-}" ]; then
  there_on_arm
  cmake --build "$build" --target modar_runtime modar_formats
  cc -O2 -shared -fPIC -o "$build/count.so" scripts/qemu_count.c
  null_probe "$triple-" "$build"
  "$budget" bake --quiet --model assets/models/pottery.obj --pattern assets/patterns/cover.png -o "$build/demo.modar"
  echo measure,instructions > "$build/arm_budget.csv"
  fat=no
  # The first interval is the opening of the bundle; the first frames search, and fill caches.
  measure track_default_camera track-default "$build/demo.modar" 30 4
  measure search_default_camera search-default "$build/demo.modar" 7 3
  measure track_640x480 track "$build/demo.modar" 30 4
  # Four copies of the pattern are tracked, each half as wide.
  measure track_4_copies copies "$build/demo.modar" 30 4
  measure search_640x480 search "$build/demo.modar" 7 3
  measure clutter_640x480 clutter "$build/demo.modar" 7 3
  # Searched and found in slices, then tracked, within PoseLoopOptions::budget of 12 million a frame.
  measure sliced_640x480 sliced "$build/demo.modar" 30 2 worst
  # The pattern is covered, and its surroundings are followed.
  measure extended_640x480 extended "$build/demo.modar" 60 46
  measure render_demo render "$build/demo.modar" 8 4
  # Poses of 60 bones between two clips; at most 150,000.
  measure clips_60_bones clips "$build/demo.modar" 9 3
  [ -z "$big" ] || measure open_200mb open "$big" 1 1
  [ $fat = no ] || { echo "foreign.sh: above the budget by more than 2 %" >&2; exit 3; }
  exit 0
fi

cmake --preset device > /dev/null
cmake --build --preset device --target modar_runtime modar_formats
probe g++ build/device "$build/bits-here"
if [ "$arch" = wasm ]; then there_in_wasm; else there_on_arm && tests_there; fi
[ -z "$packed" ] || [ "$arch" = wasm ] || unpack_there "$packed"
frames=$build/frames.grey
ffmpeg -loglevel error -y -i "$video" -frames:v 60 -pix_fmt gray -f rawvideo "$frames"
size=$(ffprobe -loglevel error -select_streams v:0 -show_entries stream=width,height -of csv=p=0:s=x "$video" | tr x ' ')
# shellcheck disable=SC2086
"$build/bits-here" "$bundle" $size < "$frames" > "$build/here.txt"
# shellcheck disable=SC2086
$run "$bundle" $size < "$frames" > "$build/there.txt"
cmp "$build/here.txt" "$build/there.txt"
echo "$(grep -c reason "$build/here.txt") frames, $(grep -c pattern "$build/here.txt") poses: the same to the last bit"
