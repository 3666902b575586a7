#!/usr/bin/env bash
# Sources out of Debian's source packages, for what Debian has no binary packages of.
#   scripts/sources.sh FOLDER PACKAGE...   fetches their archives into FOLDER; existing ones stay
#   scripts/sources.sh --libraries         libraries of modar::fetch for WebAssembly and Android (libsodium, zstd), unpacked in
#                                          build/sources (4 MB to fetch, once)
#   scripts/sources.sh --baker             libraries of `modar` for WebAssembly, the same way (another 230 MB)
# Exit code 2 where there is no network.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)

# Through apt, with a list of sources of our own: the system's may have no deb-src.
fetch() { # FOLDER PACKAGE...
  local dir=$1 package missing=()
  shift
  for package in "$@"; do
    compgen -G "$dir/${package}_*.orig.tar.*" >/dev/null || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  mkdir -p "$dir/lists/partial" "$dir/cache"
  # shellcheck source=/dev/null
  . /etc/os-release
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] ${DEBIAN_MIRROR:-http://deb.debian.org/debian} ${VERSION_CODENAME:-bookworm} main" > "$dir/sources.list"
  local apt=(apt-get -qq -o "Dir::Etc::SourceList=$dir/sources.list" -o Dir::Etc::SourceParts=/dev/null
    -o "Dir::State::Lists=$dir/lists" -o "Dir::Cache=$dir/cache" -o APT::Sandbox::User=root)
  echo "sources.sh: fetching the source packages ${missing[*]}, once" >&2
  (cd "$dir" && "${apt[@]}" update && "${apt[@]}" source --download-only "${missing[@]}") >&2 || {
    echo "sources.sh: Debian's source packages ${missing[*]} cannot be fetched; try again with a network" >&2
    exit 2
  }
}

unpack() { # FOLDER PACKAGE PART...: the parts of the package's tree, as FOLDER/PACKAGE
  local dir=$1 package=$2 archives
  shift 2
  [ ! -d "$dir/$package" ] || return 0
  rm -rf "$dir/$package.new"
  mkdir "$dir/$package.new"
  archives=("$dir/${package}"_*.orig.tar.*)
  tar -xf "${archives[0]}" -C "$dir/$package.new" --strip-components=1 --wildcards "${@/#/*/}"
  mv "$dir/$package.new" "$dir/$package"
}

if [ "${1:-}" = --libraries ]; then
  dir=$root/build/sources
  mkdir -p "$dir"
  exec 9> "$dir/lock"
  flock 9
  fetch "$dir" libsodium libzstd
  unpack "$dir" libsodium src/libsodium
  unpack "$dir" libzstd lib
elif [ "${1:-}" = --baker ]; then
  "$0" --libraries
  dir=$root/build/sources
  exec 9> "$dir/lock"
  flock 9
  packages=(draco highway lcms2 libjpeg-turbo libpng1.6 libwebp meshoptimizer minizip newlib opencv openmesh tiff zlib)
  fetch "$dir" "${packages[@]}"
  unpack "$dir" newlib newlib/libm newlib/libc/include/machine/ieeefp.h
  unpack "$dir" opencv '[!/]*.txt' LICENSE cmake include platforms/scripts \
    modules/{calib3d,core,features2d,flann,imgproc,video}
  for package in "${packages[@]}"; do unpack "$dir" "$package" '*'; done
elif [ $# -ge 2 ]; then
  fetch "$@"
else
  sed -n '2,8s/^# \{0,1\}//p' "$0"
  exit 1
fi
