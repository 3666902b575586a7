#!/usr/bin/env bash
# Called by the preset `package` when it has built:
#   scripts/package_notices.sh BUILD OUT VERSION
# Writes OUT/copyright: the licence of ModAR, and the copyright files of all Debian packages whose code is inside its binaries: the
# owners of the headers that were compiled and of the archives that were linked, as Ninja knows them, and of the engine of the page
# where it comes along; and OUT/changelog.gz, as Debian reads it.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=$1
out=$2
version=$3
mkdir -p "$out"

ninja -C "$build" -t inputs modar modar-play modar-fetch modar-lab modar_media modar_video_library modar_shared modar_runtime \
  modar_formats modar_fetch | sort -u >"$out/inputs"
{
  # Headers of their objects, and archives.
  ninja -C "$build" -t deps | awk 'NR == FNR { wanted[$1]; next } /^[^ ]/ { sub(/:.*/, ""); on = $0 in wanted; next } on && $1 ~ /^\/usr\// { print $1 }' \
    "$out/inputs" -
  grep -E '^/usr/.*\.a$' "$out/inputs" || true
  [ ! -d "$root/build/web/web" ] || echo /usr/bin/em++
  [ ! -f "$build/studio/mithril.js" ] || echo /usr/lib/nodejs/mithril/mithril.js
} | xargs -r realpath -e | sort -u >"$out/files"
# The C library and the compiler's own come from the system that runs the binaries, or by their exception need no notice.
xargs -r dpkg -S <"$out/files" 2>/dev/null | sed 's/: .*//; s/, .*//; s/:.*//' | sort -u |
  grep -vE '^(libc6-dev|linux-libc-dev|libstdc\+\+-|libgcc-|libcrypt-dev)' >"$out/packages"
[ -s "$out/packages" ] || { echo "package_notices.sh: nothing is known of the build in $build" >&2; exit 4; }

{
  cat <<'END'
ModAR, and what its binaries hold of others

1. ModAR
END
  sed 's/^/  /; s/ *$//' "$root/LICENSE"
  cat <<'END'

  The models, pictures and the clip of modar-demo are dedicated to the public domain by their authors under CC0 1.0
  Universal; on Debian systems its text is in /usr/share/common-licenses/CC0-1.0.

2. Code of others
  These Debian packages' headers were compiled, or their archives linked, when ModAR was built. Their notices follow as in these packages.
END
  n=0
  while read -r package; do
    n=$((n + 1))
    notice=/usr/share/doc/$package/copyright
    [ -r "$notice" ] || { echo "package_notices.sh: $notice is missing" >&2; exit 4; }
    sum=$(sha256sum <"$notice")
    printf '\n2.%d %s %s\n' $n "$package" "$(dpkg-query -W -f '${Version}' "$package")"
    same=$(sed -n "s/^$sum //p" "$out/sums" 2>/dev/null || true)
    if [ -n "$same" ]; then
      echo "  The same notices as of $same."
    else
      echo "$sum $package" >>"$out/sums"
      if [ "$(head -c 2 "$notice" | od -An -tx1 | tr -d ' ')" = 1f8b ]; then gzip -dc "$notice"; else cat "$notice"; fi | sed 's/^/  /; s/[[:space:]]*$//'
    fi
  done <"$out/packages"
} >"$out/copyright.new"
rm -f "$out/sums" "$out/inputs" "$out/files" "$out/packages"
mv "$out/copyright.new" "$out/copyright"

date=$(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")
printf 'modar (%s) unstable; urgency=medium\n\n  * See /usr/share/doc/modar/CHANGELOG.md.gz in the package modar.\n\n -- The ModAR maintainers <%s>  %s\n' \
  "$version" "${MODAR_MAINTAINER_MAIL:-maintainers@modar.invalid}" "$date" | gzip -9n >"$out/changelog.gz"
