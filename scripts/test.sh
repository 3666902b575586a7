#!/usr/bin/env bash
# Installs what the tests need, builds with ASan + UBSan, runs everything under CTest.
#   scripts/test.sh           everything, long tests in a reduced form
#   scripts/test.sh --soak    long tests (label soak) in full as well
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

case ${1:-} in
  "") export MODAR_SOAK=0 ;;
  --soak) export MODAR_SOAK=1 ;;
  -h | --help) sed -n '2,4s/^# \{0,1\}//p' "$0"; exit 0 ;;
  *) echo "test.sh: '$1' is not understood; try --help" >&2; exit 1 ;;
esac

scripts/setup.sh test
jobs=$(nproc)

cmake --preset dev
cmake --build --preset dev -- -j "$jobs"

# The phone's player must build where none of the workstation's libraries is.
cmake --preset device
cmake --build --preset device -- -j "$jobs"

ctest --preset dev -j "$jobs" --no-tests=error
