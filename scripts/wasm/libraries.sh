#!/usr/bin/env bash
# Builds the libraries of `modar` for WebAssembly from Debian's sources:
#   scripts/wasm/libraries.sh [FOLDER]   (default: build/wasm-libraries; finished ones stay)
# Takes 7 CPU-minutes, of which OpenCV's are five. The preset `wasm` finds them in that folder.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
out=$(realpath -m "${1:-$root/build/wasm-libraries}")
"$root/scripts/sources.sh" --baker
sources=$root/build/sources
# Debian's emscripten runs under Node 18 and newer with these alone: with fetch() it takes paths for addresses.
export NODE_PATH=/usr/share/nodejs NODE_OPTIONS=--no-experimental-fetch
toolchain=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake
flags="-O2 -DNDEBUG -msimd128 -fwasm-exceptions -sSUPPORT_LONGJMP=wasm -ffp-contract=off -ffunction-sections -fdata-sections -w"
# Zlib alone is found: the others build without what the machine happens to have.
common=(-G Ninja "-DCMAKE_TOOLCHAIN_FILE=$toolchain" -DCMAKE_BUILD_TYPE=Release "-DCMAKE_INSTALL_PREFIX=$out"
  "-DCMAKE_FIND_ROOT_PATH=$out" -DBUILD_SHARED_LIBS=OFF "-DCMAKE_C_FLAGS_RELEASE=$flags" "-DCMAKE_CXX_FLAGS_RELEASE=$flags"
  "-DZLIB_INCLUDE_DIR=$out/include" "-DZLIB_LIBRARY=$out/lib/libz.a")
if command -v ccache >/dev/null; then
  common+=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
mkdir -p "$out/log"

build() {  # NAME FOLDER OPTION...
  local name=$1 folder=$2
  shift 2
  [ ! -e "$out/log/$name.done" ] || return 0
  echo "libraries.sh: $name" >&2
  if cmake -S "$folder" -B "$out/build/$name" "${common[@]}" "$@" >"$out/log/$name.log" 2>&1 &&
    cmake --build "$out/build/$name" --target install >>"$out/log/$name.log" 2>&1; then
    touch "$out/log/$name.done"
  else
    tail -n 20 "$out/log/$name.log" >&2
    echo "libraries.sh: $name was not built, see $out/log/$name.log" >&2
    exit 1
  fi
}

switches() {  # ON|OFF NAME...
  local value=$1
  shift
  printf -- '-D%s\n' "${@/%/=$value}"
}

if ! cmp -s "$root/scripts/wasm/opencv.patch" "$sources/opencv/patched"; then
  rm -rf "$sources/opencv" "$out/log/opencv.done"
  "$root/scripts/sources.sh" --baker
  patch -d "$sources/opencv" -p1 --quiet <"$root/scripts/wasm/opencv.patch"
  cp "$root/scripts/wasm/opencv.patch" "$sources/opencv/patched"
fi
build small "$root/scripts/wasm" "-DSOURCES=$sources"
mapfile -t off < <(switches OFF PNG_SHARED PNG_TESTS PNG_EXECUTABLES PNG_HARDWARE_OPTIMIZATIONS)
build png "$sources/libpng1.6" "${off[@]}" -DM_LIBRARY=
build jpeg "$sources/libjpeg-turbo" -DENABLE_SHARED=OFF -DWITH_SIMD=OFF -DWITH_TURBOJPEG=OFF
mapfile -t off < <(switches OFF WEBP_{BUILD_{ANIM_UTILS,CWEBP,DWEBP,GIF2WEBP,IMG2WEBP,VWEBP,WEBPINFO,WEBPMUX,EXTRAS},ENABLE_SIMD,USE_THREAD})
build webp "$sources/libwebp" "${off[@]}"
mapfile -t off < <(switches OFF tiff-{tools,tests,contrib,docs} old-jpeg jbig lzma zstd webp lerc libdeflate cxx)
build tiff "$sources/tiff" "${off[@]}" "-DJPEG_INCLUDE_DIR=$out/include" "-DJPEG_LIBRARY=$out/lib/libjpeg.a"
mapfile -t off < <(switches OFF ENABLE_PIC BUILD_{ZLIB,TESTS,PERF_TESTS,EXAMPLES,DOCS,JAVA,opencv_apps,opencv_python3,opencv_js} \
  OPENCV_GENERATE_PKGCONFIG WITH_{PTHREADS_PF,IPP,ITT,OPENCL,OPENCL_SVM,TBB,OPENMP,LAPACK,EIGEN,QUIRC,ADE,PROTOBUF,JPEG} \
  WITH_{PNG,TIFF,WEBP,JASPER,OPENEXR,OPENJPEG,FFMPEG,GSTREAMER,GTK,1394,V4L,VTK,VA,VA_INTEL} \
  WITH_IMGCODEC_{HDR,SUNRASTER,PXM,PFM})
build opencv "$sources/opencv" "${off[@]}" -DBUILD_LIST=core,imgproc,flann,features2d,calib3d,video \
  -DCV_ENABLE_INTRINSICS=ON -DCPU_BASELINE= -DCPU_DISPATCH= -DZLIB_FOUND=TRUE
echo "The libraries are in $out." >&2
