#!/usr/bin/env bash
# Builds with ASan + UBSan and runs the tests under CTest.
#   scripts/test.sh           all of them, as continuous integration does in a bare Debian 12: installs every tool, goes a
#                             newcomer's way (scripts/newcomer.sh), runs pages in browsers, the studio, the app in a JVM
#   scripts/test.sh --quick   while you edit: the build's packages and those that parse JavaScript and Java; names what it leaves out
#   scripts/test.sh --soak    runs the tests with the label soak at full length: a million mutations, 10,000 frames (minutes)
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

packages=(quick test web browser android)
tests=()
options=(-DMODAR_SANITIZE_SCOPES=ON)
left_out=
export MODAR_SOAK=1
case ${1:-} in
  "") ;;
  # What a build has of MODAR_SANITIZE_SCOPES stays, so that it stays warm. -FS: no engine is built for the studio's server.
  --quick) packages=(quick); MODAR_SOAK=0; options=(); left_out='^(web_.*|studio_page|android_apk)$'; tests=(-E "$left_out" -FS web_engine) ;;
  --soak) packages=(test); MODAR_SOAK=full; tests=(-L soak) ;;
  -h | --help) sed -n '2,6s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) echo "test.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
esac

mkdir -p build
spent=()
# CPU-minutes so far, of this shell and its children.
add_spent() {
  times >build/times.txt  # user and system: 1m2.345s 0m1.234s
  spent+=("$(awk '{ for (i = 1; i <= 2; i++) { split($i, t, /[ms]/); sum += 60 * t[1] + t[2] } } END { print sum / 60 }' build/times.txt)")
}

# First, while no package of the tests hides one that the lists of the demo and of the release lack.
newcomer=77
if [ $# -eq 0 ]; then newcomer=0; scripts/newcomer.sh || newcomer=$?; fi
add_spent

scripts/setup.sh "${packages[@]}"
add_spent
jobs=$(nproc)

cmake --preset dev "${options[@]}"
cmake --build --preset dev -- -j "$jobs"

# The phone's player must build without the workstation's libraries.
cmake --preset device
cmake --build --preset device -- -j "$jobs"
add_spent

log=build/dev/Testing/Temporary/LastTest.log
status=0
ctest --preset dev -j "$jobs" --no-tests=error "${tests[@]}" || status=$?
echo
echo "Skipped (see scripts/packages-*.txt and CONTRIBUTING.md):"
{ cat build/dev/skipped.txt
  sed -nE "s/^(test_[A-Za-z0-9_]+ .*) \.\.\. skipped (.*)/\1: \2/p; s/^\[  SKIPPED \] ([A-Za-z0-9_./]+) \([0-9]+ ms\)$/\1/p" "$log"
  [ $newcomer -ne 77 ] || echo "scripts/newcomer.sh"
  if [ -n "$left_out" ]; then
    ctest --preset dev -N -R "$left_out" | sed -n 's/^ *Test *#[0-9]*: //p'
    echo "slow tests (MODAR_SOAK)"
  fi
} | sort -u | sed 's/^/  /' | grep . || echo "  nothing"
add_spent
awk '{ printf "test.sh: %.1f CPU-minutes: newcomer %.1f, packages %.1f, building %.1f, testing %.1f\n", $4, $1, $2 - $1, $3 - $2, $4 - $3 }' \
  <<<"${spent[*]}"
if [ $# -eq 0 ] && [ $newcomer -ne 0 ]; then
  echo "test.sh: =================================================================="
  [ $newcomer -eq 77 ] && what="NOT RUN, for the reason that it printed above" || what="FAILED with $newcomer"
  echo "test.sh: THE NEWCOMER'S PATH (scripts/newcomer.sh): $what"
  echo "test.sh: =================================================================="
  [ $newcomer -eq 77 ] || exit $newcomer
fi
exit $status
