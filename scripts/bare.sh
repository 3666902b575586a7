#!/usr/bin/env bash
# Runs a command in a bare Debian 12, as on a newcomer's machine: minbase and git, with a clone of this checkout's HEAD.
#   scripts/bare.sh [--or-here] [--keep] [--take PATH]... COMMAND...     e.g. scripts/bare.sh scripts/demo.sh
#   --or-here   where no such root can be made, run COMMAND in this checkout, and say so loudly
#   --keep      leave the root, and print where it is
#   --take PATH copy this file or folder of the checkout into the clone, too
# Needs root, a kernel that lets it make name spaces, and a network. Packages come from this machine's own sources of Debian 12;
# the root and what apt fetched are kept for a week in ${MODAR_BARE_CACHE:-~/.cache/modar-bare}, which a bare root within the
# bare root uses, too. Mounts and processes end with the command. A folder ../shared of this checkout is mounted next to the clone,
# read-only. Answers with the exit code of the command, or with 5 where no root can be made.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
or_here=no
keep=no
taken=()
while [ $# -gt 0 ]; do
  case $1 in
    --or-here) or_here=yes ;;
    --keep) keep=yes ;;
    --take) taken+=("${2:?bare.sh: --take wants a path}"); shift ;;
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 0 ;;
    -*) echo "bare.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
    *) break ;;
  esac
  shift
done
[ $# -gt 0 ] || { echo "bare.sh: which command? try --help" >&2; exit 1; }
command=("$@")
cache=${MODAR_BARE_CACHE:-$HOME/.cache/modar-bare}
bare=
say() { printf 'bare.sh: %s\n' "$*" >&2; }

no_root() {  # WHY: ends here, or runs the command in place
  [ $or_here = yes ] || { say "$1"; exit 5; }
  [ -z "$bare" ] || rm -rf --one-file-system "$bare"
  say "=========================================================================="
  say "NOT IN A BARE ROOT: $1."
  say "What follows runs in place: a package that scripts/packages*.txt forget, and"
  say "that this machine happens to have, goes unnoticed."
  say "=========================================================================="
  cd "$here"
  status=0
  "${command[@]}" || status=$?
  say "NOT IN A BARE ROOT: $1."
  exit $status
}

# What of this machine's apt settings tells how to reach the network.
apt_settings() { cat /etc/apt/apt.conf /etc/apt/apt.conf.d/* 2>/dev/null | grep -E '^[[:space:]]*Acquire::' || true; }

make_base() {
  local sources=/etc/apt/sources.list.d/debian.sources
  [ -r "$sources" ] || sources=/etc/apt/sources.list
  grep -qs bookworm "$sources" || sources=
  mkdir -p "$cache"
  find "$cache" -maxdepth 1 -name base.tar -mtime +7 -exec rm -rf "$cache/archives" {} +
  mkdir -p "$cache/archives"
  [ ! -s "$cache/base.tar" ] || return 0
  say "making a bare Debian 12 with mmdebstrap (once a week)"
  if ! command -v mmdebstrap >/dev/null; then
    { apt-get update -qq; DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends mmdebstrap; } >&2 ||
      return 1
  fi
  apt_settings >"$cache/apt.conf"
  mmdebstrap --quiet --mode=root --variant=minbase --include=git --aptopt="$cache/apt.conf" \
    bookworm "$cache/base.$$.tar" ${sources:+"$sources"} >&2 || { rm -f "$cache/base.$$.tar"; return 1; }
  mv "$cache/base.$$.tar" "$cache/base.tar"
}

[ "$(id -u)" -eq 0 ] || no_root "it takes root"
unshare --mount --pid --fork --kill-child true 2>/dev/null || no_root "this kernel lets it make no name spaces"
make_base || no_root "mmdebstrap made none"
bare=$(mktemp -d "${TMPDIR:-/var/tmp}/modar-bare-XXXXXX")
inner=$bare/root/.cache/modar-bare
clean_up() {
  cp -al --no-clobber "$bare/var/cache/apt/archives/." "$inner/archives/." "$cache/archives" 2>/dev/null || true
  rm -f "$cache"/archives/lock; rm -rf "$cache/archives/partial"
  if [ $keep = yes ]; then say "the root is $bare"; else rm -rf --one-file-system "$bare"; fi
}
tar -xf "$cache/base.tar" -C "$bare" || no_root "$bare cannot be filled"
trap clean_up EXIT

cp -L /etc/resolv.conf /etc/hosts "$bare/etc/"
apt_settings >"$bare/etc/apt/apt.conf.d/99network"
copy() { cp -al "$1" "$2" 2>/dev/null || cp -a "$1" "$2"; }
mkdir -p "$inner"
copy "$cache/base.tar" "$inner"
copy "$cache/archives" "$inner"
copy "$cache/archives/." "$bare/var/cache/apt/archives"
name=$(basename "$here")
# The root is thrown away: dpkg need not wait for the disk.
echo force-unsafe-io >"$bare/etc/dpkg/dpkg.cfg.d/bare"
# The checkout may belong to somebody else, which git distrusts.
printf '[safe]\n\tdirectory = *\n[advice]\n\tdetachedHead = false\n' >"$bare/gitconfig"
GIT_CONFIG_GLOBAL=$bare/gitconfig git clone --quiet --no-local "$here" "$bare/root/$name"
rm "$bare/gitconfig"
[ ${#taken[@]} -eq 0 ] || (cd "$here" && cp -a --parents "${taken[@]}" "$bare/root/$name")
[ -z "$(git -C "$here" status --porcelain --untracked-files=no 2>/dev/null)" ] || say "uncommitted changes are not in the clone"
environment=(HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "TERM=${TERM:-dumb}")
for word in CI http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY; do
  [ -z "${!word:-}" ] || environment+=("$word=${!word}")
done
if [ -r "${NODE_EXTRA_CA_CERTS:-}" ]; then
  cp -L "$NODE_EXTRA_CA_CERTS" "$bare/etc/extra-certificates.crt"
  environment+=(NODE_EXTRA_CA_CERTS=/etc/extra-certificates.crt)
fi

# In the background, so that this shell hears signals; whatever runs in there dies with unshare.
unshare --mount --pid --fork --kill-child --propagation private bash -ec '
  bare=$1 name=$2 shared=$3; shift 3
  mount --bind "$bare" "$bare"  # the root of name spaces in there has to be a mount
  mount -t proc proc "$bare/proc"
  mount --rbind /sys "$bare/sys"
  mount --rbind /dev "$bare/dev"
  if [ -d "$shared" ]; then
    mkdir "$bare/root/shared"
    mount --bind "$shared" "$bare/root/shared"
    mount -o remount,bind,ro "$bare/root/shared"
  fi
  exec env -i "${@:2:$1}" chroot "$bare" sh -c "cd \"/root/\$0\" && exec \"\$@\"" "$name" "${@:$1 + 2}"
' bare "$bare" "$name" "$here/../shared" ${#environment[@]} "${environment[@]}" "${command[@]}" <&0 &
inside=$!
trap 'kill $inside 2>/dev/null' INT TERM HUP
status=0
wait $inside || status=$?
exit $status
