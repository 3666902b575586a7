#!/usr/bin/env bash
# Builds the fuzz targets as OSS-Fuzz asks: with its compiler, flags and engine (CC, CXX, CFLAGS, CXXFLAGS, LIB_FUZZING_ENGINE), each
# with its seeds and dictionary, into $OUT. Shared libraries that the targets need go to $OUT/lib.
#   OUT=DIR [WORK=DIR] tests/fuzz/oss_fuzz.sh        without OSS-Fuzz's variables: clang, ASan, UBSan and libFuzzer
# Needs the packages of scripts/packages.txt, clang and zip.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
: "${OUT:?set OUT to the folder to write}"
work=${WORK:-$(mktemp -d)}/modar
export CC=${CC:-clang} CXX=${CXX:-clang++}
default=-fsanitize=address,undefined,fuzzer-no-link
export CFLAGS=${CFLAGS:-$default} CXXFLAGS=${CXXFLAGS:-$default}
mkdir -p "$OUT/lib"

cmake -S "$root" -B "$work" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=20 \
  -DMODAR_FUZZ=ON -DMODAR_TESTS=OFF "-DMODAR_FUZZ_ENGINE=${LIB_FUZZING_ENGINE:--fsanitize=fuzzer}" \
  "-DCMAKE_EXE_LINKER_FLAGS=-Wl,-rpath,'\$ORIGIN/lib'" -DCMAKE_BUILD_WITH_INSTALL_RPATH=ON
mapfile -t targets <"$work/fuzz_targets.txt"
ninja -C "$work" "${targets[@]%% *}"

for line in "${targets[@]}"; do
  IFS='; ' read -ra words <<<"$line"
  name=${words[0]}
  cp "$work/bin/$name" "$OUT/"
  # What every Debian has (libc, the loader and their like) stays there.
  ldd "$work/bin/$name" | awk '$2 == "=>" && $3 ~ "^/" { print $3 }' |
    grep -vE '/(libc|libm|libdl|librt|libpthread|libgcc_s|libresolv)\.so' | xargs -r cp -Lnt "$OUT/lib"
  seeds=("${words[@]:1}")
  (cd "$root" && find "${seeds[@]#"$root/"}" -type f | LC_ALL=C sort | zip -qX "$OUT/${name}_seed_corpus.zip" -@)
  [ ! -f "$root/tests/fuzz/$name.dict" ] || cp "$root/tests/fuzz/$name.dict" "$OUT/"
  printf '[libfuzzer]\nmax_len = 65536\ntimeout = 60\nrss_limit_mb = 2048\n' >"$OUT/$name.options"
done
echo "${#targets[@]} fuzz targets are in $OUT"
