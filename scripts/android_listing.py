#!/usr/bin/env python3
"""Writes the listing of an app for app stores: scripts/apk.sh --store.

  scripts/android_listing.py DIR ICON TITLE ID VERSION_NAME VERSION_CODE RELEASE_URL

The texts say what the app does, which its sources and tests show: the permissions, stored data, sent data. Whoever publishes
it adds a name and an address, at the places in [brackets].
"""
import html
import pathlib
import shutil
import sys

TITLE_CHARACTERS = 30  # of Google Play
SHORT = "Point the camera at the picture and see a model on it."
FULL = """Point the phone at one of the pictures that this app knows, and a model appears on it: walk around it, turn it, come closer.
Without the picture, look at the models by touch.

The app works without a network, an account or advertisements. The camera's picture is neither stored nor sent.{release}
"""
FULL_RELEASE = "\nUpdates of the content are fetched from {host} when you touch Update."

PRIVACY = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Privacy policy of {title}</title>
<h1>Privacy policy of {title}</h1>
<p>This policy is that of the Android app {title} ({id}), published by [name and address].</p>
<h2>The camera</h2>
<p>The app uses the camera to find known pictures and to draw models on them. The camera's pictures are processed on the device. They
are not stored and not sent, except for photos that you take with the button Picture: these are saved on the device, and you decide
whether to share them.</p>
<h2>Data on the device</h2>
<p>The app's content, photos that you take, a measurement of the camera's lens, and a file with technical diagnostics (phone model,
frame rates, errors). The diagnostics are not sent. All of it but the photos is deleted with the app.</p>
<h2>Data that is sent</h2>
<p>{network}</p>
<h2>Others</h2>
<p>The app contains no advertisements, no analytics and no code of third parties that would collect data. It needs no account.</p>
<h2>Questions</h2>
<p>[name, e-mail address]</p>
</html>
"""
OFFLINE = "Nothing: the app has no permission to use the network."
ONLINE = ("When you touch Update, the app requests files from {url}. As with any web site, that server learns the device's network "
          "address and the time. The request contains nothing about you or the device.")

SAFETY = """Answers to Google Play's data safety form (Play Console, App content), version {version} of {id}

Does your app collect or share any of the required user data types?   No
  The camera's pictures are processed on the device only, and photos leave it only if the visitor shares them, which the form
  counts as neither collecting nor sharing.
Is all of the user data collected by your app encrypted in transit?    not asked, as nothing is collected{insecure}
Do you provide a way for users to request that their data is deleted?  not asked, as nothing is collected

Other declarations
  Permissions     {permissions}
  Ads             No
  Account         none
  Target audience any age; nothing in the app is directed at children by itself
  Content rating  that of your content: the app adds none
"""
INSECURE = "\n  Releases come over plain HTTP here; they are signed, and hold nothing of the visitor's."

FDROID = """AuthorName: '[name]'
Categories:
  - Science & Education
License: MIT
Name: {title}
Summary: {short}
Description: |-
{full}
CurrentVersion: '{version}'
CurrentVersionCode: {code}
"""


def quoted(text):
    """A YAML string."""
    return "'" + text.replace("'", "''") + "'"


def main():
    if len(sys.argv) != 8:
        sys.exit(__doc__)
    folder, icon, title, app, version, code, release = sys.argv[1:]
    folder = pathlib.Path(folder)
    if len(title) > TITLE_CHARACTERS:
        print(f"apk.sh: --title has {len(title)} characters; Google Play allows {TITLE_CHARACTERS}", file=sys.stderr)
    full = FULL.format(release=FULL_RELEASE.format(host=release) if release else "")
    words = {"title": title, "id": app, "version": version}
    permissions = "camera" + (", network" if release else "")
    listing = "fastlane/metadata/android/en-US"
    texts = {
        "privacy.html": PRIVACY.format(**{key: html.escape(value) for key, value in words.items()},
                                       network=ONLINE.format(url=html.escape(release)) if release else OFFLINE),
        "data-safety.txt": SAFETY.format(**words, permissions=permissions, insecure=INSECURE if release.startswith("http:") else ""),
        f"{listing}/title.txt": f"{title}\n",
        f"{listing}/short_description.txt": f"{SHORT}\n",
        f"{listing}/full_description.txt": full,
        f"metadata/{app}.yml": FDROID.format(title=quoted(title), short=quoted(SHORT), version=version.replace("'", "''"), code=code,
                                             full="\n".join(f"  {line}".rstrip() for line in full.splitlines())),
    }
    for name, text in texts.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    (folder / listing / "images").mkdir(exist_ok=True)
    shutil.copyfile(icon, folder / listing / "images" / "icon.png")


if __name__ == "__main__":
    main()
