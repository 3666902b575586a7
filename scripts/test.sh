#!/usr/bin/env bash
# Builds with ASan + UBSan and runs the tests under CTest.
#   scripts/test.sh           installs the build's packages only; names what it skips
#   scripts/test.sh --ci      installs the oracles, too; CI runs this, in a bare Debian 12
#   scripts/test.sh --all     installs every tool, so that pages run in browsers and the app in a JVM, takes slow tests, too,
#                             and finds uses of variables after their scope as well
#   scripts/test.sh --soak    runs the tests with the label soak at full length: a million mutations, 10,000 frames (minutes)
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

packages=()
tests=()
scopes=OFF
export MODAR_SOAK=0
case ${1:-} in
  "") ;;
  --ci) packages=(test) ;;
  --all) packages=(test web browser android); scopes=ON; MODAR_SOAK=1 ;;
  --soak) packages=(test); MODAR_SOAK=full; tests=(-L soak) ;;
  -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) echo "test.sh: unknown option '$1'; try --help" >&2; exit 1 ;;
esac

mkdir -p build
spent=()
# CPU-minutes so far, of this shell and its children.
add_spent() {
  times >build/times.txt  # user and system: 1m2.345s 0m1.234s
  spent+=("$(awk '{ for (i = 1; i <= 2; i++) { split($i, t, /[ms]/); sum += 60 * t[1] + t[2] } } END { print sum / 60 }' build/times.txt)")
}

scripts/setup.sh "${packages[@]}"
add_spent
jobs=$(nproc)

cmake --preset dev "-DMODAR_SANITIZE_SCOPES=$scopes"
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
} | sort -u | sed 's/^/  /' | grep . || echo "  nothing"
add_spent
awk '{ printf "test.sh: %.1f CPU-minutes: packages %.1f, building %.1f, testing %.1f\n", $3, $1, $2 - $1, $3 - $2 }' <<<"${spent[*]}"
exit $status
