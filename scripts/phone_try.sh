#!/usr/bin/env bash
# Tries ModAR on a phone that is plugged in: makes the app, installs and starts it, and copies its measurements to this computer.
#   scripts/phone_try.sh BUNDLE [--seconds N] [--apk FILE] [--out DIR]
# --seconds   how long you point the phone at the pattern (60)
# --apk       an app that scripts/apk.sh has made with --id org.modar.trial; without it one is made: ANDROID_NDK names Google's NDK
# --out       folder of the results (out/phone)
# Show the pattern on paper or on this computer's screen. Results: diagnostics.txt (frames a second, milliseconds, profile), memory.txt
# (dumpsys meminfo every ten seconds), log.txt, three pictures of the screen, apk.txt (bytes of the app by part).
# Exit codes: 1 wrong words, 2 a file is missing, 4 a command on the phone failed, 5 adb, a phone or the NDK is missing.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
id=org.modar.trial
say() { echo "phone_try.sh: $*" >&2; }
stop() { say "$2"; exit "$1"; }

seconds=60 apk="" out=$root/out/phone bundle=""
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
    --seconds | --apk | --out) [ $# -ge 2 ] || stop 1 "$1 wants a value"; printf -v "${1#--}" %s "$2"; shift 2 ;;
    -*) stop 1 "unknown option '$1'; try --help" ;;
    *) [ -z "$bundle" ] || stop 1 "one bundle, please: '$bundle' or '$1'"; bundle=$1; shift ;;
  esac
done
[ -n "$bundle" ] || stop 1 "name a bundle: scripts/phone_try.sh vase.modar"
[ -r "$bundle" ] || stop 2 "$bundle cannot be read"
[ -z "$apk" ] || [ -r "$apk" ] || stop 2 "--apk $apk cannot be read"
[[ $seconds =~ ^[1-9][0-9]{0,3}$ ]] || stop 1 "--seconds '$seconds' is no number from 1 to 9999"
command -v adb >/dev/null || stop 5 "adb is missing; apt-get install adb"
phones=$(adb devices | awk 'NR > 1 && $2 == "device"' | wc -l)
[ "$phones" = 1 ] || stop 5 "$phones phones are ready for adb, one is needed: plug it in, allow USB debugging, look at 'adb devices'"

mkdir -p "$out"
if [ -z "$apk" ]; then
  apk=$out/trial.apk
  "$root/scripts/apk.sh" "$bundle" --title "ModAR trial" --id $id --out "$apk"
fi
{ stat -c '%s bytes: the app' "$apk"
  python3 -c 'import sys, zipfile
for part in sorted(zipfile.ZipFile(sys.argv[1]).infolist(), key=lambda part: -part.compress_size): print(part.compress_size, part.filename)' "$apk"
} > "$out/apk.txt"
adb install -r "$apk" >/dev/null || stop 4 "the phone refuses the app; see the lines above"
adb shell pm grant $id android.permission.CAMERA >/dev/null 2>&1 || true  # before Android 6 it is granted with the installation
adb logcat -c
: > "$out/memory.txt"
adb shell am start -W -n $id/org.modar.MainActivity >/dev/null || stop 4 "the app does not start; 'adb logcat' says why"
say "point the phone at the pattern for $seconds seconds, from near and far, and keep the app open"
for ((second = 1; second <= seconds; ++second)); do
  sleep 1
  if [ $((second % 10)) = 0 ]; then
    { echo "after $second s"; adb shell dumpsys meminfo $id; } >> "$out/memory.txt"
  fi
  for share in 25 50 90; do
    [ $((seconds * share / 100)) != $second ] || adb exec-out screencap -p > "$out/screen$share.png"
  done
done
adb shell input keyevent KEYCODE_HOME  # a pause writes diagnostics.txt
sleep 2
adb logcat -d > "$out/log.txt"
adb pull "/sdcard/Android/data/$id/files/diagnostics.txt" "$out/diagnostics.txt" >/dev/null ||
  stop 4 "the app wrote no diagnostics.txt; see $out/log.txt"
cat "$out/diagnostics.txt"
grep -m1 -E 'TOTAL' "$out/memory.txt" || true
say "results are in $out; send that folder with the phone's name"
