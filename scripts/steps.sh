# Sourced by scripts that take minutes, in the root of the checkout: runs their steps, and shows which one runs and for how long.
#   log=FILE; steps=N (may be empty); step WHAT COMMAND...
mkdir -p "$(dirname "$log")"
: >"$log"
at=0

step() {  # WHAT COMMAND...: the command's output goes to $log; where it fails, the script ends with its exit code
  at=$((at + 1))
  local what start=$SECONDS status pause=1 back='\r' watcher
  what=$(printf '%s%-66s' "${steps:+$at/$steps  }" "$1")
  shift
  echo "== $what" >>"$log"
  if [ ! -t 1 ]; then
    pause=${MODAR_STEP_PAUSE:-20} back=
    echo "$what ..."
  fi
  # Ends with this shell; its sleep holds no pipe open.
  (while sleep "$pause" >/dev/null 2>&1 && kill -0 $$ 2>/dev/null; do show "$back"; [ -n "$back" ] || echo; done) &
  watcher=$!
  set +e
  (set -e; "$@") >>"$log" 2>&1
  status=$?
  kill $watcher
  wait $watcher 2>/dev/null
  set -e
  if [ $status -ne 0 ]; then
    printf '%b%s failed\n' "$back" "$what"
    tail -n 25 "$log" >&2
    echo "${0##*/}: the whole log is $(realpath "$log")" >&2
    exit $status
  fi
  show "$back" done
  echo
}

show() {  # BACK [done]: the step's line with its seconds, and how far a build is
  local far=
  [ $# -eq 2 ] || far=$(tail -n 1 "$log" | sed -n 's/^\(\[[0-9]*\/[0-9]*\]\).*/\1/p')
  printf '%b%s %4d s %-12s' "$1" "$what" $((SECONDS - start)) "$far"
}

# The path of a file of an installed package; where the machine installs no documentation, the package
# is unpacked into build/packages instead.
package_file() {
  local package=$1 path=$2
  if [ -r "$path" ]; then echo "$path"; return; fi
  local unpacked=build/packages/$package
  if [ ! -r "$unpacked$path" ]; then
    mkdir -p "$unpacked"
    (cd "$unpacked" && apt-get download -qq "$package" >&2)
    dpkg -x "$unpacked"/"$package"_*.deb "$unpacked"
  fi
  echo "$unpacked$path"
}
