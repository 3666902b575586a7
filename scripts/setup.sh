#!/usr/bin/env bash
# Installs Debian packages that are named in scripts/packages*.txt and not yet there.
#   scripts/setup.sh [test] [demo]
# Packages of the build always; those of the tests and the demo where named. Uses sudo if not root.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

lists=("$here/packages.txt")
for extra in "$@"; do
  case $extra in
    test | demo) lists+=("$here/packages-$extra.txt") ;;
    *) echo "setup.sh: '$extra' is neither test nor demo" >&2; exit 1 ;;
  esac
done

wanted=$(sed -E 's/#.*//; s/^[[:space:]]*([^[:space:]]+).*/\1/' "${lists[@]}" | grep -v '^[[:space:]]*$' | sort -u)
# What is there, by its own name or as what another package provides.
there=$(dpkg-query -W -f '${db:Status-Abbrev}${Package}, ${Provides}\n' 2>/dev/null |
  sed -n -E 's/^ii //; T; s/ \([^)]*\)//g; s/, */\n/g; p' | sort -u || true)
mapfile -t missing < <(comm -23 <(echo "$wanted") <(echo "$there"))
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi

command -v apt-get >/dev/null || {
  echo "setup.sh: no apt-get here; install by hand: ${missing[*]}" >&2; exit 5; }
as_root=()
if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
echo "Installing ${#missing[@]} Debian packages: ${missing[*]}" >&2
export DEBIAN_FRONTEND=noninteractive
# One list that a mirror serves broken (another architecture's, say) does not stop what the other lists hold.
"${as_root[@]}" apt-get update -qq >&2 ||
  echo "setup.sh: some package lists could not be fetched; going on with the others" >&2
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
  "${missing[@]}" >&2
