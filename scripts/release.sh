#!/usr/bin/env bash
# Makes all files of a release in one folder:
#   scripts/release.sh [--key FILE] [--twice] [--npx] [--out DIR]      (default: out/release)
#   *.deb                  the Debian packages, clean for lintian, with the page's engine
#   modar-web-V.tar.gz     the page and its engine, for those who build in place: unpack as build/web
#   modar-V.tgz            the engine as an npm package; with --npx the program `modar` for Node too (12 CPU-minutes more), and
#   modar-studio-V.zip     the studio as a static page: unpack it on any web server with HTTPS
#   modar-V.apk            the app with the demo's bundle, where ANDROID_NDK is set (see scripts/apk.sh)
#   modar-V-oci.tar        modar and the player on a bare Debian 12 as a container (OCI archive):
#                          podman run -v "$PWD:/srv" oci-archive:modar-V-oci.tar bake --model vase.obj -o vase.modar
#   modar-V.tar.gz         the sources
#   SHA256SUMS             of all of these; with --key SHA256SUMS.minisig, by that secret key of minisign
# --twice: builds the packages and the engine a second time, in another folder, and fails where a byte differs. Machines with
# other versions of Debian's packages differ in the copyright files alone, which name these.
# Only committed files go in. Builds in build/release and build/web, as scripts/demo.sh does. Takes 12 minutes on two cores, and
# 4 GB of disk; --twice takes 20.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
key="" twice=no npx=no out=out/release
while [ $# -gt 0 ]; do
  case $1 in
    --key | --out) [ $# -ge 2 ] || { echo "release.sh: $1 needs a value" >&2; exit 1; }; printf -v "${1#--}" %s "$2"; shift ;;
    --twice) twice=yes ;;
    --npx) npx=yes ;;
    -h | --help) sed -n '2,17s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "release.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
  esac
  shift
done
[ -z "$key" ] || [ -r "$key" ] || { echo "release.sh: $key cannot be read" >&2; exit 2; }
mapfile -t committed < <(git ls-tree --name-only HEAD)
[ -z "$(git status --porcelain -- "${committed[@]}")" ] || { echo "release.sh: commit your changes first" >&2; exit 1; }
version=$(sed -n 's/^project(modar VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
log=build/release.log
steps=
# shellcheck source=scripts/steps.sh
. scripts/steps.sh
packed() { tar --sort=name --owner=0 --group=0 --numeric-owner --mode=go=u-w "--mtime=@$SOURCE_DATE_EPOCH" -c "$@" | gzip -9n; }
npm_files() {  # FOLDER: what its package.json lists
  python3 -c 'import json, sys; print("package.json", *json.load(open(sys.argv[1]))["files"], sep="\n")' "$1/package.json"
}

build() {  # FOLDER OUT: engine and packages of the checkout in FOLDER, whatever options its builds had
  local tree=$1 to=$2 npm=$1/build/web/web presets=(web package)
  (cd "$tree" && scripts/sources.sh --libraries)
  if [ $npx = yes ]; then
    "$tree/scripts/wasm/libraries.sh"
    presets+=(wasm)
  fi
  for preset in "${presets[@]}"; do
    (cd "$tree" && cmake --fresh --preset $preset && cmake --build --preset $preset)
  done
  mkdir -p "$to"
  cp "$tree"/build/release/packages/*.deb "$to"
  packed -C "$tree/build/web" web >"$to/modar-web-$version.tar.gz"
  # As `npm pack` lays it out, whose bytes differ from version to version.
  if [ $npx = yes ]; then
    npm=$work/npm
    "$tree/scripts/wasm/package.sh" "$npm"
    "$tree/scripts/wasm/studio.sh" "$work/studio" "$to/modar-studio-$version.zip"
  fi
  npm_files "$npm" >"$work/npm-files"
  packed -C "$npm" --transform 's,^,package/,' -T "$work/npm-files" >"$to/modar-$version.tgz"
}
look() {  # Lintian's errors and warnings stop a release.
  lintian --fail-on error,warning --allow-root "$out"/*.deb
}
clone() {  # FOLDER: committed files, with the library sources
  git clone --quiet --no-local "$root" "$1"
  mkdir "$1/build"
  cp -a build/sources "$1/build/"
}
apt_sources() {  # This machine's own of Debian 12, where it has some.
  grep -ls bookworm /etc/apt/sources.list.d/debian.sources /etc/apt/sources.list | head -n 1
}
container() {
  local image="$work/oci:$version" stamp
  stamp=$(date -u -d "@$SOURCE_DATE_EPOCH" +%FT%TZ)
  grep -hE '^[[:space:]]*Acquire::' /etc/apt/apt.conf /etc/apt/apt.conf.d/* >"$work/apt.conf" 2>/dev/null || true
  mmdebstrap --quiet --variant=apt --aptopt="$work/apt.conf" --dpkgopt='path-exclude=/usr/share/man/*' \
    --customize-hook='mkdir "$1/packages"' \
    --customize-hook="copy-in $root/$out/modar_${version}_amd64.deb $root/$out/modar-player_${version}_amd64.deb \
      $root/$out/libmodar0_${version}_amd64.deb /packages" \
    --customize-hook='chroot "$1" sh -c "apt-get install -y -qq --no-install-recommends /packages/*.deb"' \
    --customize-hook='rm -r "$1/packages"' bookworm "$work/root.tar" $(apt_sources) || return
  umoci init --layout "$work/oci" && umoci new --image "$image" &&
    umoci raw add-layer --image "$image" --history.created "$stamp" "$work/root.tar" &&
    umoci config --image "$image" --config.entrypoint modar --config.cmd=--help --config.workingdir /srv \
      --created "$stamp" --history.created "$stamp" && umoci gc --layout "$work/oci" || return
  tar --sort=name --owner=0 --group=0 --numeric-owner "--mtime=@$SOURCE_DATE_EPOCH" -C "$work/oci" \
    -cf "$root/$out/modar-$version-oci.tar" .
  # It runs, and bakes.
  umoci unpack --image "$image" "$work/container" && cp -r assets "$work/container/rootfs/srv" &&
    chroot "$work/container/rootfs" modar bake --model /srv/assets/models/pottery.obj -o /tmp/pottery.modar
}
app() { "$root/scripts/apk.sh" "$work/demo.modar" --title ModAR --out "$root/$out/modar-$version.apk"; }

work=$(mktemp -d "${TMPDIR:-/tmp}/modar-release-XXXXXX")
trap 'rm -rf "$work"' EXIT
rm -rf "$out"
mkdir -p "$out"
echo "ModAR $version, $(git log -1 --format='%h of %cs'). The output of the programs goes to build/release.log."
step "Debian packages that building takes (3.3 GB, the first time)" scripts/setup.sh web release
rm -rf build/release/packages
step "engine and packages" build "$root" "$out"
step "lintian" look
if [ $twice = yes ]; then
  step "engine and packages once more, in another folder" eval 'clone "$work/two"; build "$work/two" "$work/again"'
  step "the same bytes" diff -r "$out" "$work/again"
fi
if [ "$(id -u)" -eq 0 ]; then
  step "container" container
else
  echo "No container: making one takes root."
fi
step "sources" eval 'set -o pipefail; git archive --format=tar --prefix="modar-$version/" HEAD | gzip -9n >"$out/modar-$version.tar.gz"'
if [ -n "${ANDROID_NDK:-}" ]; then
  step "packages for the app" scripts/setup.sh android
  step "a bundle for the app" build/release/bin/modar bake --model assets/models/pottery.obj \
    --pattern assets/patterns/cover.png:210mm --scene cover=pottery,scale=0.5 -o "$work/demo.modar"
  step "app" app
else
  echo "No app: ANDROID_NDK is not set, and without its compilers the app has no native library."
fi
(cd "$out" && LC_ALL=C sha256sum -- * >"$work/sums" && mv "$work/sums" SHA256SUMS)
if [ -n "$key" ]; then
  minisign -S -s "$key" -m "$out/SHA256SUMS" -t "ModAR $version" >>"$log"
else
  echo "Not signed: --key FILE signs, with a key of \`minisign -G\`."
fi
ls -l "$out"
echo "Everything is in $root/$out."
