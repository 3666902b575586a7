#!/usr/bin/env bash
# Makes an Android app of bundles: a signed, aligned APK, with Debian's packages only.
#   scripts/apk.sh BUNDLE... [--title T] [--id org.museum.vases] [--key FILE] [--out FILE]
#                  [--release URL --trust K.pub] [--words FILE] [--icon FILE] [--version-code N] [--version-name V] [--store DIR]
# --title, --id   name of the app on the phone (ModAR), and its application id (org.modar)
# --key           keystore (PKCS 12) that signs, with its password in APK_PASSWORD (default: a new key, made once
#                 in build/android/debug.p12). Phones accept updates only from the same key: keep it.
# --release address of a folder that `modar ship publish` filled, and the key to trust: adds the network permission --words
# words.properties: the texts of the screen, instead of the built-in ones in de, el, en, es, fr, it, nl, pl; words-ca.properties: for
#                 phones in that language
# --icon          PNG or JPEG, its middle square (default: the first bundle's hint, else ModAR's)
# --version-code, --version-name   stores want a higher code each time (default: the number of the newest release at --release,
#                 else 1 and ModAR's version)
# --store         what stores ask for: an Android App Bundle, icon and texts of the listing, privacy policy, data safety answers,
#                 metadata for F-Droid
# NAME.png or NAME.jpg (the hint) and NAME.properties (texts) next to NAME.modar are included. Keypoints of the ModAR paper's method are
# left out, unless the bundle was baked with --parameters.
# ANDROID_NDK names the folder of Google's NDK (r25 or newer), which builds the native library for armeabi-v7a, arm64-v8a, x86 and x86_64
# (or ANDROID_ABIS; "none" is for tests: such an APK starts on no phone), and with --release the installer. r25 builds for Android 4.4
# (API 19) and later, newer ones for 5.0 (API 21): the manifest says which. MODAR_NDK_FLAGS: further words for CMake.
# Exit codes: 1 wrong words, 2 a file or the network is missing, 4 a tool failed, 5 a package or the NDK is missing.
# dx and the signatures of Android's classes come from Debian's source packages, once, into build/android/debian (121 MB).
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
work=$root/build/android
app=$root/runtime/extensions/android

say() { echo "apk.sh: $*" >&2; }
stop() { say "$2"; exit "$1"; }

least=19 title=ModAR id=org.modar key="" out="" release="" trust="" words="" icon="" code="" name="" store="" bundles=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,22s/^# \{0,1\}//p' "$0"; exit 0 ;;
    --title | --id | --key | --out | --release | --trust | --words | --icon | --store | --version-code | --version-name)
      [ $# -ge 2 ] || stop 1 "$1 wants a value"
      word=${1#--}
      printf -v "${word#version-}" %s "$2"; shift 2 ;;
    -*) stop 1 "unknown option '$1'; try --help" ;;
    *) bundles+=("$1"); shift ;;
  esac
done
[ ${#bundles[@]} -gt 0 ] || stop 1 "name a bundle: scripts/apk.sh vase.modar"
[[ $id =~ ^[a-zA-Z][a-zA-Z0-9_]*(\.[a-zA-Z][a-zA-Z0-9_]*)+$ ]] || stop 1 "--id '$id' is no application id like org.museum.vases"
[[ ${code:-1} =~ ^[1-9][0-9]{0,9}$ && ${code:-1} -le 2100000000 ]] || stop 1 "--version-code '$code' is no number from 1 to 2100000000"
[ -z "$icon" ] || [ -r "$icon" ] || stop 2 "--icon $icon cannot be read"
[ -z "$release" ] || [ -r "$trust" ] || stop 1 "--release wants --trust K.pub, the key that signs the releases"
out=${out:-$root/out/${id##*.}.apk}
for bundle in "${bundles[@]}"; do
  [ "$(head -c 8 "$bundle" 2>/dev/null | tr -d '\0')" != "" ] || stop 2 "$bundle cannot be read"
done
missing=()
for tool in javac aapt aapt2 zipalign apksigner jarsigner keytool proguard python3 xz; do
  command -v $tool >/dev/null || missing+=("$tool")
done
/usr/bin/python3 -c 'import PIL' 2>/dev/null || missing+=(python3-pil)
[ ${#missing[@]} -eq 0 ] ||
  stop 5 "missing: ${missing[*]}; apt-get install aapt zipalign apksigner android-framework-res default-jdk-headless proguard-cli python3-pil xz-utils"
framework=/usr/share/android-framework-res/framework-res.apk
[ -r $framework ] || stop 5 "missing: $framework; apt-get install android-framework-res"

abis=${ANDROID_ABIS:-armeabi-v7a arm64-v8a x86 x86_64}
if [ "$abis" != none ]; then
  [ -n "${ANDROID_NDK:-}" ] || stop 5 "ANDROID_NDK is not set: without Google's NDK the app has no native library and starts on no phone;\
 download NDK r25c from https://developer.android.com/ndk/downloads, unpack it, and export ANDROID_NDK=FOLDER"
  revision=$(sed -n 's/^Pkg.Revision *= *\([0-9]*\).*/\1/p' "$ANDROID_NDK/source.properties" 2>/dev/null || true)
  [ "${revision:-0}" -ge 25 ] || stop 5 "ANDROID_NDK: $ANDROID_NDK is no NDK of r25 or newer (its source.properties says '$revision')"
fi

if [ -n "$release" ] && [ -z "$code" ]; then
  code=$(python3 - "$release/latest" <<'P'
import sys, urllib.request
try:
    with urllib.request.urlopen(sys.argv[1], timeout=10) as answer:
        print(int(answer.read(32)))
except (OSError, ValueError):
    pass
P
)
  [ -n "$code" ] || say "$release/latest cannot be read: the version code is 1; --version-code sets it"
  name=${name:-$code}
fi
code=${code:-1}
name=${name:-$(sed -n 's/^project(modar VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")}
for hint in "${bundles[0]%.modar}".png "${bundles[0]%.modar}".jpg; do
  [ -n "$icon" ] || [ ! -r "$hint" ] || icon=$hint
done

mkdir -p "$work"
exec 9> "$work/lock"
flock 9  # two of these at once share the folders below

# These programs end before the second compiler of a JVM pays: ProGuard takes 2.7 CPU-s with them, 7.8 without.
short=(-XX:TieredStopAtLevel=1 -XX:+UseSerialGC)
quick=("${short[@]/#/-J}" -proc:none -nowarn -Xlint:-options -encoding utf-8)

fetch_source() { # PACKAGE
  "$root/scripts/sources.sh" "$work/debian" "$1" || exit $?
}

# dx turns class files into a phone's: 408 files, compiled once.
if [ ! -f "$work/dx.jar" ]; then
  fetch_source android-platform-tools
  rm -rf "$work/dx"
  mkdir -p "$work/dx/src" "$work/dx/classes"
  tar -xf "$work"/debian/android-platform-tools_*.orig.tar.* -C "$work/dx/src" --strip-components=4 --wildcards '*/dalvik/dx/src/*'
  find "$work/dx/src" -name '*.java' > "$work/dx/files"
  javac "${quick[@]}" -g:none -d "$work/dx/classes" "@$work/dx/files" 2>/dev/null
  (cd "$work/dx/classes" && jar cf "$work/dx.jar.tmp" .)
  mv "$work/dx.jar.tmp" "$work/dx.jar"
  rm -rf "$work/dx"
fi
# Stubs of the classes that the app names, out of Android's own list of signatures.
if [ ! -f "$work/current.txt" ]; then
  fetch_source android-platform-frameworks-base
  tar -xf "$work"/debian/android-platform-frameworks-base_*.orig.tar.* -O --occurrence=1 api/current.txt > "$work/current.txt.tmp"
  mv "$work/current.txt.tmp" "$work/current.txt"
fi

# The app's code, once for all APKs: compiled with the stubs, shrunk (to $java/classes), turned into a phone's.
java=$work/code
made_of=$(cat "$work/current.txt" "$0" "$root/scripts/android_stubs.py" "$app/proguard-rules.pro" "$app/AndroidManifest.xml" \
  "$app"/res/*/* "$app"/java/org/modar/* | sha256sum)
if [ "$made_of" != "$(cat "$java/made_of" 2>/dev/null)" ]; then
  rm -rf "$java"
  mkdir -p "$java/stub-classes" "$java/all-classes" "$java/names"
  python3 "$root/scripts/android_stubs.py" "$work/current.txt" "$app/java" "$java/stubs"
  find "$java/stubs" -name '*.java' > "$java/stubs.list"
  aapt package -m -J "$java/names" -M "$app/AndroidManifest.xml" -S "$app/res" -I $framework >&2
  find "$app/java" "$java/names" -name '*.java' > "$java/app.list"
  javac "${quick[@]}" --release 7 -d "$java/stub-classes" "@$java/stubs.list"
  javac "${quick[@]/-nowarn/-Xlint:all}" -Werror -g:none --release 7 -cp "$java/stub-classes" -d "$java/all-classes" "@$java/app.list"
  # Java's own classes as the JDK lists them for --release 7. Its lists are in a format newer than ProGuard; what the format
  # added is not in them.
  python3 - "$(dirname "$(dirname "$(readlink -f "$(command -v javac)")")")/lib/ct.sym" "$java/java.jar" <<'P'
import sys, zipfile
with zipfile.ZipFile(sys.argv[1]) as lists, zipfile.ZipFile(sys.argv[2], "w") as out:
    for name in lists.namelist():
        releases, _, path = name.partition("/java.base/")
        if "7" in releases and path.endswith(".sig"):
            content = lists.read(name)
            out.writestr(path[:-4] + ".class", content[:4] + bytes((0, 0, 0, 51)) + content[8:])
P
  JDK_JAVA_OPTIONS="${short[*]}" proguard -injars "$java/all-classes" -outjars "$java/classes" -libraryjars "$java/java.jar" \
    -libraryjars "$java/stub-classes" "@$app/proguard-rules.pro" &> "$java/proguard.log" || stop 4 "$(cat "$java/proguard.log")"
  java "${short[@]}" -cp "$work/dx.jar" com.android.dx.command.Main --dex --min-sdk-version=19 \
    --output="$java/classes.dex" "$java/classes"
  echo "$made_of" > "$java/made_of"
fi

step=$work/apk
rm -rf "$step"
mkdir -p "$step/tree/assets/bundles" "$(dirname "$out")"
cp "$java/classes.dex" "$step/tree/"
for bundle in "${bundles[@]}"; do
  python3 "$root/scripts/trim_bundle.py" "$bundle" "$step/tree/assets/bundles/$(basename "$bundle")"
  for beside in png jpg properties; do
    [ ! -f "${bundle%.modar}.$beside" ] || cp "${bundle%.modar}.$beside" "$step/tree/assets/bundles/"
  done
done
# Of a key that is there twice, the later line counts. Own words are for all phones, those of a file like my-ca.properties for one language.
language=$(sed -n 's/.*-\([a-z][a-z]\(-[A-Z][A-Z]\)\?\)\.properties$/-\1/p' <<< "$words")
[ -n "$words" ] && [ -z "$language" ] || cp "$app"/assets/words-*.properties "$step/tree/assets/"
cp "$app/assets/words.properties" "$step/tree/assets/"
[ -z "$words" ] || cat "$words" >> "$step/tree/assets/words$language.properties"
if [ -n "$release" ]; then
  printf '%s\n' "$release" > "$step/tree/assets/release.txt"
  cp "$trust" "$step/tree/assets/release.pub"
fi

if [ "$abis" != none ]; then
  [ -z "$release" ] || "$root/scripts/sources.sh" --libraries || exit $?
  includes=/usr/include/eigen3\;/usr/include
  [ "$revision" -lt 26 ] || least=21
  for abi in $abis; do
    level=$least
    [[ $abi != *64* ]] || level=21
    # An app that fetches carries the installer and its libraries, out of Debian's sources.
    target=(modar_jni) sources=()
    if [ -n "$release" ]; then
      target+=(modar_fetch_jni)
      sources=("-DMODAR_SOURCES=$root/build/sources")
    fi
    # shellcheck disable=SC2086
    cmake -S "$root" -B "$work/$abi" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$ANDROID_NDK/build/cmake/android.toolchain.cmake" \
      -DANDROID_ABI=$abi -DANDROID_PLATFORM=android-$level -DANDROID_STL=c++_static -DCMAKE_BUILD_TYPE=MinSizeRel \
      -DMODAR_LIBRARY_ONLY=ON -DMODAR_TESTS=OFF "-DMODAR_INCLUDE_PATHS=$includes" "${sources[@]}" ${MODAR_NDK_FLAGS:-} >&2
    cmake --build "$work/$abi" --target "${target[@]}" >&2
    mkdir -p "$step/tree/lib/$abi"
    find "$work/$abi" -name 'libmodar*_jni.so' -exec cp {} "$step/tree/lib/$abi/" \;
    strip=("$ANDROID_NDK"/toolchains/llvm/prebuilt/*/bin/llvm-strip)
    "${strip[0]}" "$step/tree/lib/$abi"/*.so
  done
fi

python3 - "$app" "$step" "$title" "$release" $least "$code" "$name" <<'P'
import html, pathlib, shutil, sys
app, step, title, release = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4]
manifest = (app / "AndroidManifest.xml").read_text().replace('minSdkVersion="19"', f'minSdkVersion="{sys.argv[5]}"')
manifest = manifest.replace('versionCode="1" android:versionName="0.1.0"',
                            f'versionCode="{sys.argv[6]}" android:versionName="{html.escape(sys.argv[7])}"')
if release:
    network = '    <uses-permission android:name="android.permission.INTERNET" />\n    <application'
    manifest = manifest.replace("    <application", network, 1)
    if release.startswith("http:"):
        manifest = manifest.replace("<application ", '<application android:usesCleartextTraffic="true" ', 1)
(step / "AndroidManifest.xml").write_text(manifest)
shutil.copytree(app / "res", step / "res")
strings = step / "res" / "values" / "strings.xml"
quoted = html.escape(title, quote=False).replace("\\", "\\\\").replace("'", "\\'").replace('"', '\\"')
strings.write_text(strings.read_text().replace(">ModAR<", f">{quoted}<"))
P
if [ -n "$icon" ]; then
  "$root/scripts/android_icon.py" "$icon" "$step/res" "$step/icon.png" || exit 2
else
  cp "$root/runtime/extensions/web/icon-512.png" "$step/icon.png"
fi
# Bundles are stored uncompressed, so that the phone maps them inside the APK.
aapt package -f -M "$step/AndroidManifest.xml" -S "$step/res" -I $framework --rename-manifest-package "$id" -0 modar \
  -F "$step/unaligned.apk" "$step/tree" >&2
# 8: a bundle's own alignment; -p lays libraries on pages.
zipalign -f -p 8 "$step/unaligned.apk" "$step/aligned.apk"
if [ -z "$key" ]; then
  key=$work/debug.p12
  APK_PASSWORD=modar-debug
  if [ ! -f "$key" ]; then
    keytool "${short[@]/#/-J}" -genkeypair -keystore "$key" -storetype PKCS12 -storepass $APK_PASSWORD -alias modar -keyalg RSA \
      -keysize 2048 -validity 10000 -dname "CN=ModAR debug" >/dev/null 2>&1
  fi
fi
export APK_PASSWORD=${APK_PASSWORD:?password of --key}
apksigner "${short[@]/#-/-J}" sign --ks "$key" --ks-pass env:APK_PASSWORD --min-sdk-version 19 \
  --v1-signing-enabled true --v2-signing-enabled true --v3-signing-enabled true --out "$out.tmp" "$step/aligned.apk"
rm -f "$out.tmp.idsig"
mv "$out.tmp" "$out"
if [ -n "$store" ]; then
  # The code names resources by the numbers that aapt gave them.
  sed -n 's/.*static final class \([a-z]*\) {.*/\1/p; s/.*static final int \([a-z_]*\)=\(0x[0-9a-f]*\);.*/\1 \2/p' \
    "$java/names/org/modar/R.java" | awk 'NF == 1 { kind = $1 } NF == 2 { print "org.modar:" kind "/" $1 " = " $2 }' > "$step/ids"
  aapt2 compile --dir "$step/res" -o "$step/res.zip" >&2
  aapt2 link --proto-format -o "$step/proto.apk" -I $framework --manifest "$step/AndroidManifest.xml" \
    --rename-manifest-package "$id" --stable-ids "$step/ids" "$step/res.zip" >&2
  mkdir -p "$store"
  bundle=$store/$(basename "${out%.apk}").aab
  "$root/scripts/android_bundle.py" "$step/proto.apk" "$step/tree" "$bundle.tmp"
  owner=$(keytool "${short[@]/#/-J}" -list -keystore "$key" -storepass:env APK_PASSWORD | sed -n 's/,.*PrivateKeyEntry.*//p' | head -n 1)
  jarsigner "${short[@]/#/-J}" -keystore "$key" -storepass:env APK_PASSWORD "$bundle.tmp" "$owner" >/dev/null ||
    { rm -f "$bundle.tmp"; stop 4 "$bundle could not be signed with $key"; }
  mv "$bundle.tmp" "$bundle"
  python3 "$root/scripts/android_listing.py" "$store" "$step/icon.png" "$title" "$id" "$name" "$code" "$release"
  say "$store: read the texts before you publish them"
fi
say "$(wc -c < "$out") bytes, $(wc -c < "$step/tree/classes.dex") of them code in Java"
echo "$out"
