#!/usr/bin/env bash
# Installs Debian packages that are named in scripts/packages*.txt and not yet there.
#   scripts/setup.sh [core] [test] [demo] [web] [browser] [android] [release] [quick]
# Packages of the build always, without those of extensions if `core` is given; those of the tests, the demo, the page's engine (web), browsers, the Android app, a release and
# test.sh --quick where named. Uses sudo if not root.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

lists=("$here/packages.txt")
[ "${1:-}" = core ] && shift || lists+=("$here/packages-extensions.txt")
for extra in "$@"; do
  case $extra in
    test | demo | web | browser | android | release | quick) lists+=("$here/packages-$extra.txt") ;;
    *) echo "setup.sh: '$extra' is not one of core (first), test, demo, web, browser, android, release and quick" >&2; exit 1 ;;
  esac
done

wanted=$(sed -E 's/#.*//; s/^[[:space:]]*([^[:space:]]+).*/\1/' "${lists[@]}" | grep -v '^[[:space:]]*$' | sort -u)
# Installed packages, by name or as provided by another package.
there=$(dpkg-query -W -f '${db:Status-Abbrev}${Package}, ${Provides}\n' 2>/dev/null |
  sed -n -E 's/^ii //; T; s/ \([^)]*\)//g; s/, */\n/g; p' | sort -u || true)
mapfile -t missing < <(comm -23 <(echo "$wanted") <(echo "$there"))
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi

command -v apt-get >/dev/null || {
  echo "setup.sh: apt-get is missing; install these packages: ${missing[*]}" >&2; exit 5; }
as_root=()
if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
mkdir -p "$here/../build"
log=$here/../build/packages.log
echo "Installing ${#missing[@]} Debian packages: ${missing[*]} (apt's output goes to build/packages.log)" >&2
# One list that a mirror serves broken (another architecture's, say) does not stop what the other lists hold.
"${as_root[@]}" apt-get update -qq >"$log" 2>&1 ||
  echo "setup.sh: some package lists could not be fetched; continuing with the others" >&2
# How much it is, in apt's own words.
LC_ALL=C apt-get install --assume-no --no-install-recommends "${missing[@]}" 2>&1 |
  grep -E '^([0-9]+ upgraded|Need to get|After this)' >&2 || true
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
  "${missing[@]}" >>"$log" 2>&1 || { tail -n 25 "$log" >&2; exit 5; }
