#!/usr/bin/env bash
# The path of somebody new, by the README's own commands, on models, a photo and a video of Debian packages:
#   scripts/newcomer.sh      as root, with a network; scripts/test.sh runs it
# 1. here: scripts/demo.sh, the guide's next command, scripts/release.sh
# 2. in another bare Debian 12 (scripts/bare.sh): installs the packages and runs README.md's commands as printed
# 3. here: finds the model's pixels in the played video, and counts warnings, edits and bytes, each of which has a limit
# Ends with code 77, where no bare root can be made, and with changes that are not committed: they would not be released.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
# What a newcomer bears: commands of README.md that the photo or the machine makes him change; lines with a warning; megabytes that
# the install takes, with all that is recommended; megabytes of the packages; KB of the bundle, its report and its page.
limits="edits=2 warnings=8 installed=900 packages=30 bundle=2048 report=2048 page=6144"
say() { printf 'newcomer.sh: %s\n' "$*" >&2; }

if [ "${1:-}" = --inside ]; then
  mapfile -d $'\x1e' -t blocks < <(awk '/^```sh$/ { inside = 1; next } /^```$/ { if (inside) printf "\x1e"; inside = 0 } inside' README.md)
  block() {  # the one with these words
    local each
    for each in "${blocks[@]}"; do [[ $each != *"$1"* ]] || { printf '%s' "$each"; return; }; done
    say "README.md has no '$1' any more"
    exit 4
  }
  run() { sed 's/^/$ /' <<<"$1"; bash -ec "$1" < <(yes ''); }  # as typed, with Enter at a question
  edited() {  # WHY TEXT FROM TO
    echo "EDIT: $1" >&2
    [[ $2 == *"$3"* ]] || { say "README.md has no '$3' any more"; exit 4; }
    printf '%s' "${2/"$3"/"$4"}"
  }
  installed() { dpkg-query -W -f '${Installed-Size}\n' | awk '{ sum += $1 } END { printf "%d", sum / 1024 }'; }
  export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
  apt-get update -qq
  before=$(installed)
  run "$(block 'apt-get install' | grep '^apt-get install')"
  echo "INSTALLED: $(($(installed) - before))"
  test -s modar-demo/play/overlay.mp4

  cd build/newcomer
  steps=$(edited "a hand holds the box, so its corners are pointed at" "$(block 'pattern rectify')" "photo.jpg" \
    "photo.jpg --corners 285.8,111.2,513.6,168.7,473.3,282.6,200.8,195.6")
  run "$(grep -v -e '--serve' <<<"$steps")"
  # Until Ctrl-C, which comes when the page has been served for a while.
  serve=$(grep -e '--serve' <<<"$steps")
  status=0
  run "exec timeout --foreground -s INT 15 $serve" | tee served || status=$?
  [ $status -eq 0 ] || [ $status -eq 124 ] || { say "--serve ended with $status"; exit 4; }
  grep -q https:// served

  echo "EDIT: a compiler is installed, and the example fetched, for README.md's cc" >&2
  apt-get install -y -qq --no-install-recommends g++ pkg-config >/dev/null
  cp /usr/share/doc/libmodar-dev/examples/overlay.c .
  for each in "${blocks[@]}"; do
    [[ $each == *scripts/* || $each == *"pattern rectify"* ]] || run "$each"
  done
  head -c 460800 /dev/zero | ./overlay vase.modar 640 480 | wc -c | grep -qx 1228800
  cd museum
  run "modar ship keygen --out museum.key && modar ship publish out/museum.modar --to ar --key museum.key
    modar-fetch ar --store store --trust museum.key.pub && modar check store/museum.modar"
  exit
fi

[ -z "$(git status --porcelain --untracked-files=no)" ] || { say "there are changes that are not committed"; exit 77; }
scripts/bare.sh true || { say "no bare Debian 12 can be made here"; exit 77; }
scripts/demo.sh
build/release/bin/modar web out/demo/demo.modar -o out/demo/next --title "The guide's next command"
scripts/release.sh

log=build/newcomer.log
steps=3
# shellcheck source=scripts/steps.sh
. scripts/steps.sh
data=build/newcomer
report=$(sed -n 's/^modar-play .*--report \([^ ]*\).*/\1/p' README.md)
inputs() {
  local models doc file
  rm -rf $data
  mkdir -p $data/museum
  models=$(dirname "$(package_file assimp-testmodels /usr/share/assimp/models/OBJ/spider.obj)")
  doc=$(dirname "$(package_file opencv-doc /usr/share/doc/opencv-doc/examples/data/home.jpg)")
  gzip -dc "$(package_file opencv-doc /usr/share/doc/opencv-doc/opencv4/html/box.mp4.gz)" >$data/video.mp4
  ffmpeg -v fatal -nostdin -y -i $data/video.mp4 -vf 'select=eq(n\,264)' -frames:v 1 -q:v 2 $data/photo.jpg
  cp "$models"/*.jpg "$models/spider.mtl" $data
  cp "$models/spider.obj" $data/vase.obj
  cp "$models"/../glTF2/BoxTextured-glTF-Binary/BoxTextured.glb $data/vase.glb
  cp "$doc/graf1.png" $data/poster.png
  ffmpeg -v fatal -nostdin -y -i "$doc/graf1.png" -q:v 2 $data/poster.jpg
  cp "$models"/spider.* "$models"/*.jpg "$models"/../PLY/Wuson.ply "$models"/../STL/Spider_binary.stl $data/museum
  cp "$models"/../glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb $data/museum
  mkdir $data/museum/pictures
  for file in home baboon aloeL; do cp "$doc/$file.jpg" $data/museum/pictures; done
}
bare() { sed -n 's/^bare.sh: the root is //p' $log; }
look() {
  python3 - "$(bare)/root/${root##*/}" "$log" "$report" $limits <<'P'
import pathlib, re, subprocess, sys
root, log, report = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).read_text(errors="replace"), sys.argv[3]
made, limits = root / "build/newcomer", dict(word.split("=") for word in sys.argv[4:])
SIDE = (160, 120)

def frames(path):
    """Every tenth frame, small, as red, green and blue."""
    done = subprocess.run(["ffmpeg", "-v", "fatal", "-nostdin", "-i", path, "-vf", r"select=not(mod(n\,10)),scale=%d:%d:flags=area" % SIDE,
                           "-vsync", "0", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
    size = 3 * SIDE[0] * SIDE[1]
    return [done[at:at + size] for at in range(0, len(done) - size + 1, size)]

def mean_colour(path):
    return subprocess.run(["ffmpeg", "-v", "fatal", "-nostdin", "-i", path, "-vf", "scale=1:1:flags=area", "-f", "rawvideo", "-pix_fmt",
                           "rgb24", "-"], capture_output=True, check=True).stdout

faults, sums, covered, shown = [], [0, 0, 0], 0, []
for before, after in zip(frames(made / "video.mp4"), frames(made / report / "overlay.mp4")):
    changed = [at for at in range(0, len(before), 3) if max(abs(before[at + c] - after[at + c]) for c in range(3)) > 40]
    shown.append(len(changed) / (len(before) / 3))
    covered += len(changed)
    sums = [total + sum(after[at + c] for at in changed) for c, total in enumerate(sums)]
colour = [total / max(covered, 1) for total in sums]
skins = [mean_colour(made / f"{name}.jpg") for name in ("SpiderTex", "drkwood2", "wal67ar_small")]
expected = [sum(skin[c] for skin in skins) / len(skins) for c in range(3)]
seen = sum(share >= 0.02 for share in shown) / max(len(shown), 1)
print(f"model's pixels in {100 * seen:.0f} % of frames, their colour {[round(c) for c in colour]}, of its pictures {[round(c) for c in expected]}")
if len(shown) < 40 or seen < 0.9 or max(abs(a - b) for a, b in zip(colour, expected)) > 40:
    faults.append("the model's pixels are not in the video that was played")

def kb(path):
    files = [path] if path.is_file() else [each for each in path.rglob("*") if each.is_file()]
    return sum(file.stat().st_size for file in files) / 1024
found = {"edits": len(re.findall("^EDIT: ", log, re.MULTILINE)), "warnings": len(re.findall("^(?:warning|W):? ", log, re.MULTILINE)),
         "installed": int(re.search(r"^INSTALLED: (\d+)", log, re.MULTILINE)[1]),
         "packages": sum(kb(file) for file in (root / "out/release").glob("*.deb")) / 1024, "bundle": kb(made / "vase.modar"),
         "report": kb(made / "vase.html"), "page": kb(made / "site")}
for name, limit in limits.items():
    print(f"{name} {found[name]:.0f} of {limit}")
    if found[name] > int(limit):
        faults.append(f"{name}: {found[name]:.0f}, at most {limit} are allowed")
sys.exit("\n".join(faults) or 0)
P
}
step "a photo, a video and models of Debian packages" inputs
trap 'rm -rf --one-file-system $(bare)' EXIT
step "README's commands in another bare Debian 12" \
  scripts/bare.sh --keep --take out/release --take $data scripts/newcomer.sh --inside
step "the model's pixels; warnings, edits, bytes" look
tail -n 8 $log
