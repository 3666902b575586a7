"""`modar ship` and `modar-fetch` over folders: releases, keys, refusals, reuse."""
import base64
import contextlib
import hashlib
import json
import os
import pathlib
import shutil
import stat
import struct
import subprocess
import time
import unittest

from programs import BIN, QUICK, ROOT, mount_fat
from ship_files import ShipTest, sheet, soak


class Publish(ShipTest):
    def test_a_release_installs_byte_for_byte(self):
        report = self.publish(self.shop.old)
        self.assertEqual(report["release"]["version"], 1)
        fetched = self.fetch_json()
        self.assertTrue(fetched["changed"])
        self.assert_installed(self.shop.old)
        self.assertFalse(self.fetch_json()["changed"])
        self.assertEqual(fetched["bundles"], [str(self.store / "museum.modar")])

    def test_an_unsigned_stick_is_read_within_its_limits(self):
        # libcurl's file:// wrote past its buffer for a file after one that was missing, with a limit on the rate.
        self.publish(self.shop.old)
        stick = self.folder / "stick"
        shutil.copytree(self.site, stick)
        (stick / "keys").mkdir(exist_ok=True)
        for name in ("1.json", "2.json"):
            (stick / "keys" / name).write_bytes(b"x" * 16000)
        for words in ([], ["--limit-rate", "200000"]):
            done = self.fetch(stick, "--attempts", "1", *words, store=self.folder / f"store{len(words)}")
            self.assertNotIn("Sanitizer", done.stderr)
            self.assertIn(done.returncode, (10, 13, 16), done.stderr)
        (stick / "latest").unlink()
        os.mkfifo(stick / "latest")  # nobody writes to it
        self.assertEqual(self.fetch(stick, "--attempts", "1", store=self.folder / "waiting").returncode, 16)
        limited = self.folder / "limited"
        begin = time.monotonic()
        self.fetch_json(self.site, "--limit-rate", str(4 * self.shop.old.stat().st_size), store=limited)
        self.assertGreater(time.monotonic() - begin, 0.05)
        self.fetch_json("file://" + str(self.site), store=self.folder / "third")

    def test_the_document_keeps_its_schema(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        self.publish(self.shop.old, options=["--for", "museum=ace2,mali400"])
        schema = json.loads((ROOT / "formats" / "release.schema.json").read_text())
        document = json.loads((self.site / "releases" / "1.json").read_text())
        jsonschema.validate(document, schema)
        document["bundles"][0]["name"] = "../etc"
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.validate(document, schema)

    def test_same_bundle_same_objects(self):
        other = self.folder / "other"
        self.publish(self.shop.old, options=["--expires", "2099-01-01T00:00:00Z", "--jobs", "1"])
        self.publish(self.shop.old, site=other, options=["--expires", "2099-01-01T00:00:00Z", "--jobs", "3"])
        for name in ("objects", "releases"):
            done = subprocess.run(["diff", "-r", self.site / name, other / name], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout)

    def test_publishing_is_incremental_and_old_releases_stay(self):
        first = self.publish(self.shop.old)
        second = self.publish(self.shop.new)
        self.assertEqual(second["release"]["version"], 2)
        self.assertLess(second["added_bytes"], second["release"]["bundles"][0]["download_size"])
        third = self.publish(self.shop.old)
        self.assertEqual(third["added_bytes"], 0)
        self.assertEqual(first["release"]["bundles"], third["release"]["bundles"])

    def test_prune_removes_what_nobody_needs(self):
        self.publish(self.shop.new)
        self.publish(self.shop.old)
        done = self.modar("ship", "prune", "--to", self.site, "--keep", "1", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(json.loads(done.stdout)["freed_bytes"], 0)
        self.assertEqual(json.loads(done.stdout)["releases"], [2])
        self.fetch_json()
        self.assert_installed(self.shop.old)
        again = self.modar("ship", "prune", "--to", self.site, "--keep", "1", "--json")
        self.assertEqual(json.loads(again.stdout)["freed_bytes"], 0)

    def objects(self, site=None):
        return sorted(p for p in ((site or self.site) / "objects").rglob("*") if p.is_file())

    def rot(self, path):
        """Another byte in the middle: the same length."""
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data)

    def test_rot_on_the_server_is_written_again(self):
        self.publish(self.shop.old)
        before = {p: p.read_bytes() for p in self.objects()}
        self.rot(self.objects()[0])
        missing = self.objects()[1]
        missing.unlink()
        os.mkfifo(missing)  # nobody writes to it
        linked = self.objects()[1]
        outside = self.folder / "outside"
        outside.write_bytes(b"mine")
        linked.unlink()
        linked.symlink_to(outside)
        done = self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({p: p.read_bytes() for p in self.objects()}, before)
        self.assertEqual(outside.read_bytes(), b"mine")
        self.fetch_json()
        self.assert_installed(self.shop.old)

    def test_a_kept_bundle_that_has_rotted_is_not_signed_again(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.bake("other", "--model", sheet(self.folder / "other.obj", 12, 0.9)), other)
        self.publish(other)
        rotten = self.objects()[0]
        self.rot(rotten)
        done = self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 2, "ship.damaged", str(rotten), "publish other.modar again")
        self.assertEqual((self.site / "latest").read_text(), "1\n")
        both = self.modar("ship", "publish", self.shop.old, other, "--to", self.site, "--key", self.shop.key)
        self.assertEqual(both.returncode, 0, both.stderr)
        self.fetch_json()
        self.assert_installed(self.shop.old, other)

    def test_objects_that_were_read_are_not_read_again(self):
        self.publish(self.shop.old)
        rotten = self.objects()[0]
        self.rot(rotten)
        bytes_before, look = rotten.read_bytes(), rotten.stat()
        noted = f"{rotten.name} {look.st_size} {max(look.st_mtime_ns, look.st_ctime_ns)} {look.st_ino}"
        publish = ["ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key]
        (self.site / ".objects").write_text(f"modar objects 1\n{noted}\n")
        self.assertEqual(self.modar(*publish).returncode, 0)
        self.assertEqual(rotten.read_bytes(), bytes_before)  # it was believed
        self.assertIn(noted + "\n", (self.site / ".objects").read_text())
        os.utime(rotten)
        self.assertEqual(self.modar(*publish).returncode, 0)
        self.assertNotEqual(rotten.read_bytes(), bytes_before)

    def verify(self, place=None, *options, trust=None, env=None):
        return self.modar("ship", "verify", place or self.site, "--trust", trust or self.trust, *options, env=env)

    def test_a_mirror_is_proved_whole(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)  # the same recipe
        self.publish(self.shop.old, other)
        report = json.loads(self.verify(self.site, "--json").stdout)
        self.assertEqual(report["damaged"], [])
        self.assertEqual(report["objects"], len(self.objects()))
        self.assertEqual(report["bytes"], sum(p.stat().st_size for p in self.objects()))
        self.assertEqual((report["version"], report["bundles"]), (1, 2))
        first, second = sorted(self.objects(), key=lambda path: path.stat().st_size)[-2:]  # pieces: without its recipe none is known
        self.rot(first)
        second.unlink()
        done = self.verify()
        self.assert_fails(done, 3, "ship.damaged", first.name, second.name, "it is missing", "museum")
        damaged = json.loads(self.verify(self.site, "--json").stdout)["damaged"]
        self.assertEqual([d["path"] for d in damaged if "/" in d["path"]][0].split("/")[0], "objects")
        self.assertEqual(self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key).returncode, 0)
        self.assertEqual(self.verify().returncode, 0)
        thief = self.folder / "thief"
        self.modar("ship", "keygen", "--out", thief)
        self.assert_fails(self.verify(trust=f"{thief}.pub"), 10, "signature.key")
        for done in (self.verify(trust=thief), self.fetch(trust=thief)):
            self.assert_fails(done, 3, str(thief), "secret key", "K.pub")
        (self.site / "releases" / "2.json.minisig").unlink()
        self.assert_fails(self.verify(), 13, "ship.absent", "2.json.minisig")

    def test_a_mirror_is_verified_through_its_keys(self):
        root, other = self.folder / "root", self.folder / "other"
        for key in (root, other):
            self.modar("ship", "keygen", "--out", key)
        self.modar("ship", "root", "--to", self.site, "--key", root, "--next", self.trust)
        self.modar("ship", "rotate", "--to", self.site, "--key", self.shop.key, "--next", f"{other}.pub")
        self.publish(self.shop.old, key=other)
        self.assertEqual(self.verify(trust=f"{root}.pub").returncode, 0)
        self.assert_fails(self.verify(trust=f"{other}.pub"), 10, "signature.key")  # devices follow the root

    def test_a_mirror_on_the_web_is_proved_whole(self):
        from servers import RudeServer
        self.publish(self.shop.old)
        server = RudeServer(self.folder, lambda path, attempt: "garbage" if path.endswith(self.bad) else None)
        self.addCleanup(server.stop)
        self.bad = "nothing"
        report = json.loads(self.verify(server.url() + "/site/", "--json").stdout)
        self.assertEqual((report["damaged"], report["objects"]), ([], len(self.objects())))
        self.bad = self.objects()[0].name
        self.assert_fails(self.verify(server.url() + "/site"), 3, self.bad)
        done = self.verify(server.url().replace("//", "//curator:secret@") + "/elsewhere")
        self.assert_fails(done, 13, "ship.absent")
        self.assertNotIn("secret", done.stderr)
        for wrong in ("http://", "http://host:port/x", "http://:80/"):
            self.assert_fails(self.verify(wrong), 1, "http.url")

    def test_a_bad_bundle_is_not_published(self):
        broken = self.folder / "broken.modar"
        data = bytearray(self.shop.old.read_bytes())
        data[-1] ^= 1
        broken.write_bytes(data)
        # Nor files named next to it: all are looked at before the first is packed.
        done = self.modar("ship", "publish", self.shop.old, broken, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 3, "ship.bad-bundle", "modar check")
        self.assertFalse(self.site.exists())

    def test_devices_of_no_bundle_are_refused_before_it_packs(self):
        done = self.modar("ship", "publish", self.shop.old, "--for", "vase=mali400", "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 1, "ship.for", "vase")
        self.assertEqual([path for path in self.site.rglob("*") if path.is_file() and path.name != ".lock"], [])

    def test_release_numbers_only_grow(self):
        self.publish(self.shop.old, options=["--release", "5"])
        done = self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key, "--release", "5")
        self.assert_fails(done, 1, "ship.version")
        self.assertEqual(self.publish(self.shop.old)["release"]["version"], 6)

    def test_a_release_is_the_whole_set(self):
        other, third = self.folder / "other.modar", self.folder / "third.modar"
        for copy in (other, third):
            shutil.copy(self.shop.old, copy)
        self.publish(self.shop.old, other, options=["--for", "other=ace2"])
        report = self.publish(self.shop.new, third, options=["--drop", "other"])
        self.assertEqual([(c["change"], c["name"]) for c in report["changes"]],
                         [("changed", "museum"), ("dropped", "other"), ("added", "third")])
        report = self.publish(other)
        self.assertEqual([(c["change"], c["name"]) for c in report["changes"]],
                         [("kept", "museum"), ("added", "other"), ("kept", "third")])
        self.fetch_json()
        self.assert_installed(self.shop.new, other, third)
        done = self.modar("ship", "publish", "--to", self.site, "--key", self.shop.key, "--drop", "fourth")
        self.assert_fails(done, 1, "ship.drop")
        self.assert_fails(self.modar("ship", "publish", "--to", self.site, "--key", self.shop.key), 1, "ship.nothing")

    def test_a_dry_run_writes_nothing(self):
        self.publish(self.shop.old)
        before = sorted((p, p.stat().st_mtime_ns) for p in self.site.rglob("*") if p.is_file() and p.name != ".lock")
        report = self.publish(self.shop.new, options=["--dry-run"])
        self.assertEqual(report["changes"], [{"change": "changed", "name": "museum"}])
        after = sorted((p, p.stat().st_mtime_ns) for p in self.site.rglob("*") if p.is_file() and p.name != ".lock")
        self.assertEqual(before, after)

    def test_list_shows_releases_and_expiry(self):
        self.publish(self.shop.old, options=["--expires", "2099-01-01T00:00:00Z"])
        self.publish(self.shop.new, options=["--no-expiry"])
        listed = json.loads(self.modar("ship", "list", "--to", self.site, "--json").stdout)["releases"]
        self.assertEqual([r["release"]["expires"] for r in listed], ["2099-01-01T00:00:00Z", "never"])
        self.assertEqual([r["current"] for r in listed], [False, True])
        text = self.modar("ship", "list", "--to", self.site).stdout
        self.assertIn("does not expire", text)
        self.assertIn("museum", text)
        done = self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key, "--valid-days", "2")
        self.assertIn("valid until", done.stderr)
        self.publish(self.shop.new, options=["--no-expiry"])
        self.assertEqual(self.fetch_json()["expires"], "never")

    def test_clips_travel_and_an_update_takes_what_is_there(self):
        models = ROOT / "tests/import/clips"
        first = self.shop.bake("moving", "--model", models / "morphs.gltf", "--model", models / "skinned.gltf")
        second = self.shop.bake("moved", "--model", models / "morphs.gltf", "--model", models / "skinned.gltf", "--model", models / "moving.gltf")
        self.publish(first)
        self.fetch_json()
        self.assert_installed(first)
        update = self.publish(second)
        self.fetch_json()
        self.assert_installed(second)
        self.assertLess(update["added_bytes"], update["release"]["bundles"][0]["download_size"])

    def test_a_document_without_end_fails_at_once(self):
        self.publish(self.shop.old)
        (self.site / "releases" / "1.json").write_bytes(b" " * (9 << 20))
        done = self.fetch()
        self.assert_fails(done, 13, "fetch.too-long", "8388608")
        self.assertNotIn("attempt", done.stderr)

    def test_names_that_no_release_takes_are_refused_before_a_folder_is_made(self):
        for name in ("ärger 1", "a" * 101):
            other = self.folder / f"{name}.modar"
            shutil.copy(self.shop.old, other)
            done = self.modar("ship", "publish", other, "--to", self.folder / "new", "--key", self.shop.key)
            self.assert_fails(done, 1, "ship.name", "rename the file")
            self.assertFalse((self.folder / "new").exists())
        longest = self.folder / ("a" * 100 + ".modar")
        shutil.copy(self.shop.old, longest)
        done = self.modar("ship", "publish", longest, "--to", self.folder / "new", "--key", self.shop.key)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_folder_of_other_files_takes_no_release_unless_forced(self):
        words = ("--to", self.site, "--key", self.shop.key)
        self.site.mkdir()
        (self.site / "thesis.txt").write_text("mine")
        for command in (("publish", self.shop.old, *words), ("publish", self.shop.old, *words, "--dry-run"), ("list", *words[:2])):
            self.assert_fails(self.modar("ship", *command), 1, "out.foreign-folder", "--force")
            self.assertEqual(os.listdir(self.site), ["thesis.txt"])
        done = self.modar("ship", "publish", self.shop.old, *words, "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        # It is a release's folder from now on; copies of one without its empty folders are, too.
        (self.site / "keys").rmdir()
        (self.site / ".lock").unlink()
        done = self.modar("ship", "publish", self.shop.new, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.fetch_json()
        self.assert_installed(self.shop.new)

    def test_the_last_bundle_stays(self):
        drop = ("ship", "publish", "--key", self.shop.key, "--drop", self.shop.old.stem, "--to")
        self.assert_fails(self.modar(*drop, self.folder / "absent"), 1, "ship.nothing", "no release")
        self.assertFalse((self.folder / "absent").exists())
        self.publish(self.shop.old)
        self.assert_fails(self.modar(*drop, self.site), 1, "ship.nothing", "no bundle would be left")
        done = self.modar(*drop, self.site, self.shop.new)
        self.assertNotIn("ship.nothing", done.stderr)

    def test_names_that_differ_by_case_only_are_refused(self):
        other = self.folder / "Museum.modar"
        shutil.copy(self.shop.old, other)
        done = self.modar("ship", "publish", self.shop.old, other, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 1, "ship.name", "case")
        self.publish(self.shop.old)
        done = self.modar("ship", "publish", other, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 1, "ship.name", "case")

    def test_patterns_need_no_text_on_the_way(self):
        report = self.publish(self.shop.pattern)
        forms = {form["form"]: form for form in report["forms"]}
        self.assertEqual(forms["derived-text"]["stored_bytes"], 0)
        self.assertEqual(forms["derived-text"]["pieces"], 4)
        self.fetch_json()
        self.assert_installed(self.shop.pattern)

    def test_keypoints_travel_on_request_alone(self):
        usual = self.shop.bake("usual", "--pattern", self.shop.pattern.parent.parent / "picture.png", *QUICK)
        self.assertEqual(set(self.modar_json("inspect", usual)["patterns"][0]["keypoints"]), {"orb-2000"})
        self.publish(usual)
        self.fetch_json()
        installed = self.store / "museum.modar"
        self.assertEqual(self.modar_json("check", installed)["issues"], [])
        self.assertEqual(self.modar_json("inspect", installed)["patterns"][0]["keypoints"], {})
        self.assertLess(installed.stat().st_size, usual.stat().st_size)


class Keys(ShipTest):
    def test_keygen_writes_minisign_files(self):
        key = self.folder / "k"
        done = self.modar("ship", "keygen", "--out", key)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(stat.S_IMODE(key.stat().st_mode), 0o600)
        self.assert_fails(self.modar("ship", "keygen", "--out", key), 1, "key.exists")

    def test_a_key_on_a_disk_without_permissions(self):
        key = mount_fat(self) / "k"
        done = self.modar("ship", "keygen", "--out", key)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.publish(self.shop.old, key=key)

    def test_a_key_that_others_may_read_is_told_of(self):
        key = self.folder / "k"
        shutil.copy(self.shop.key, key)
        publish = ["ship", "publish", self.shop.old, "--to", self.site, "--key", key]
        for mode, told in ((0o600, False), (0o644, True), (0o640, True), (0o400, False)):
            key.chmod(mode)
            done = self.modar(*publish)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual("[key.mode]" in done.stderr, told, oct(mode))
        done = self.modar(*publish[:-1], self.trust)  # no secret is in it
        self.assert_fails(done, 3, "not a minisign secret key")
        self.assertNotIn("key.mode", done.stderr)

    @unittest.skipUnless(shutil.which("minisign"), "minisign is not installed")
    def test_minisign_verifies_ours_and_we_its(self):
        self.publish(self.shop.old)
        document = self.site / "releases" / "1.json"
        done = subprocess.run(["minisign", "-Vm", document, "-p", self.trust], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("modar release 1", done.stdout)
        # Another secret key in minisign's own hand.
        theirs = self.folder / "theirs"
        made = subprocess.run(["minisign", "-G", "-W", "-p", f"{theirs}.pub", "-s", theirs], capture_output=True)
        if made.returncode != 0:
            self.skipTest("this minisign makes no unencrypted keys")
        self.site = self.folder / "theirs-site"
        self.store = self.folder / "theirs-store"
        document = self.site / "releases" / "1.json"
        self.publish(self.shop.old, key=theirs)
        self.fetch_json(trust=f"{theirs}.pub")
        signed = subprocess.run(["minisign", "-Sm", document, "-s", theirs], capture_output=True, input=b"\n")
        self.assertEqual(signed.returncode, 0, signed.stderr)
        (self.site / "latest").write_text("1\n")
        self.fetch_json(trust=f"{theirs}.pub", store=self.folder / "second")
        # The old form, over the document itself, is not in the specification.
        signed = subprocess.run(["minisign", "-l", "-Sm", document, "-s", theirs], capture_output=True, input=b"\n")
        self.assertEqual(signed.returncode, 0, signed.stderr)
        self.assert_fails(self.fetch(trust=f"{theirs}.pub", store=self.folder / "third"), 3, "signature.text")

    def test_an_encrypted_key_wants_its_pass_phrase(self):
        """Encrypted here, as minisign does with 16 MiB of scrypt."""
        phrase, wrong = self.folder / "phrase", self.folder / "wrong"
        phrase.write_text("open sesame\n")
        wrong.write_text("open barley\n")
        comment, text = self.shop.key.read_text().splitlines()[:2]
        plain, salt = base64.b64decode(text), bytes(range(32))
        stream = hashlib.scrypt(b"open sesame", salt=salt, n=1 << 14, r=8, p=1, maxmem=1 << 26, dklen=len(plain) - 54)
        secret = bytes(a ^ b for a, b in zip(plain[54:], stream))
        key = self.folder / "k"
        key.write_text(f"{comment}\n" + base64.b64encode(plain[:2] + b"Sc" + plain[4:6] + salt + struct.pack("<QQ", 1 << 19, 1 << 24) + secret).decode() + "\n")
        key.chmod(0o600)
        publish = ["ship", "publish", self.shop.old, "--to", self.site, "--key", key]
        self.assert_fails(self.modar(*publish, "--pass-phrase-file", wrong), 3, "key.pass-phrase")
        self.assertEqual(self.modar(*publish, "--pass-phrase-file", phrase, "--quiet").returncode, 0)
        self.fetch_json()

    @unittest.skipUnless(soak(), "scrypt needs 1 GiB and seconds; soak runs it")
    def test_a_key_is_made_with_a_pass_phrase(self):
        phrase, key = self.folder / "phrase", self.folder / "k"
        phrase.write_text("open sesame\n")
        done = self.modar("ship", "keygen", "--out", key, "--pass-phrase-file", phrase)
        self.assertEqual(done.returncode, 0, done.stderr)
        publish = ["ship", "publish", self.shop.old, "--to", self.site, "--key", key]
        self.assertEqual(self.modar(*publish, "--pass-phrase-file", phrase, "--quiet").returncode, 0)
        self.fetch_json(trust=f"{key}.pub")

    def test_keygen_keeps_the_file_of_the_pass_phrase(self):
        phrase = self.folder / "phrase.pub"
        phrase.write_text("open sesame\n")
        for out in (phrase, self.folder / "phrase"):  # the secret key, and the public one next to it
            done = self.modar("ship", "keygen", "--force", "--out", out, "--pass-phrase-file", phrase)
            self.assert_fails(done, 1, "out.input")
            self.assertEqual(phrase.read_text(), "open sesame\n")

    def test_only_the_key_that_devices_follow_publishes(self):
        self.publish(self.shop.old)
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        publish = ["ship", "publish", self.shop.new, "--to", self.site, "--key"]
        self.assert_fails(self.modar(*publish, other), 1, "ship.key")
        rotate = self.modar("ship", "rotate", "--to", self.site, "--key", other, "--next", f"{other}.pub")
        self.assert_fails(rotate, 1, "ship.key")
        self.modar("ship", "rotate", "--to", self.site, "--key", self.shop.key, "--next", f"{other}.pub")
        self.assert_fails(self.modar(*publish, self.shop.key), 1, "ship.key")
        self.assertEqual(self.modar(*publish, other).returncode, 0)

    def test_the_root_key_takes_devices_back_from_a_thief(self):
        root, signing, next_key = (self.folder / name for name in ("root", "signing", "next"))
        for key in (root, signing, next_key):
            self.modar("ship", "keygen", "--out", key)
        trust = f"{root}.pub"
        named = self.modar("ship", "root", "--to", self.site, "--key", root, "--next", f"{signing}.pub")
        self.assertEqual(named.returncode, 0, named.stderr)
        self.publish(self.shop.old, key=signing)
        self.fetch_json(trust=trust)
        # The thief has the signing key and the server: the greatest number there is, and a key of his own.
        honest = self.folder / "honest"
        shutil.copytree(self.site, honest)
        thief = self.folder / "thief"
        self.modar("ship", "keygen", "--out", thief)
        self.modar("ship", "rotate", "--to", self.site, "--key", signing, "--next", f"{thief}.pub")
        self.publish(self.shop.new, key=thief, options=["--release", str(2**53)])
        self.assertEqual(self.fetch_json(trust=trust)["version"], 2**53)
        # He cannot speak for the root.
        forged = self.modar("ship", "root", "--to", self.site, "--key", thief, "--next", f"{thief}.pub")
        self.assert_fails(forged, 1, "ship.root")
        stolen = shutil.copytree(self.site, self.folder / "stolen")
        # The publisher takes the folder back from a copy and lets the root name another key.
        shutil.rmtree(self.site)
        shutil.copytree(honest, self.site)
        again = self.modar("ship", "root", "--to", self.site, "--key", root, "--next", f"{next_key}.pub")
        self.assertEqual(again.returncode, 0, again.stderr)
        report = self.publish(self.shop.old, key=next_key)
        self.assertEqual((report["release"]["epoch"], report["release"]["version"]), (2, 2))
        for _ in range(2):
            fetched = self.fetch_json(trust=trust)
            self.assertEqual((fetched["epoch"], fetched["version"]), (2, 2))
        self.assert_installed(self.shop.old)
        # What the thief still serves is refused, replayed root metadata included.
        self.assertIn(self.fetch(stolen, trust=trust).returncode, (10, 11))
        self.assert_installed(self.shop.old)

    def test_a_lost_state_trusts_no_old_key(self):
        self.publish(self.shop.old)
        self.fetch_json()
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        self.modar("ship", "rotate", "--to", self.site, "--key", self.shop.key, "--next", f"{other}.pub")
        self.publish(self.shop.new, key=other)
        self.fetch_json()
        thief = self.folder / "thiefs-site"
        self.publish(self.shop.old, site=thief, options=["--release", "9"])
        for lost in (["state.json"], ["slots/state.json"]):
            with self.subTest(lost):
                for name in lost:
                    (self.store / name).unlink()
                self.assert_fails(self.fetch(thief), 10, "signature.key")
                self.fetch_json()
        (self.store / "state.json").write_text("{")
        self.assert_fails(self.fetch(thief), 10, "signature.key")
        # All is lost: the chain of the server is followed to its end.
        for name in ("state.json", "slots/state.json"):
            (self.store / name).unlink(missing_ok=True)
        self.assert_fails(self.fetch(thief), 10, "fetch.retired")  # a thief leaves the chain out
        shutil.copytree(self.site / "keys", thief / "keys", dirs_exist_ok=True)
        self.assert_fails(self.fetch(thief), 10, "signature.key")
        self.fetch_json()

    def lose_state(self):
        for name in ("state.json", "slots/state.json"):
            (self.store / name).unlink(missing_ok=True)

    def test_a_lost_state_keeps_the_installed_epoch(self):
        root, signing, next_key = (self.folder / name for name in ("root", "signing", "next"))
        for key in (root, signing, next_key):
            self.modar("ship", "keygen", "--out", key)
        trust = f"{root}.pub"
        self.modar("ship", "root", "--to", self.site, "--key", root, "--next", f"{signing}.pub")
        self.publish(self.shop.old, key=signing)
        thief = shutil.copytree(self.site, self.folder / "thiefs-site")
        self.publish(self.shop.new, key=signing, site=thief, options=["--release", "99"])
        self.modar("ship", "root", "--to", self.site, "--key", root, "--next", f"{next_key}.pub")
        self.publish(self.shop.old, key=next_key)
        self.fetch_json(trust=trust)
        for _ in range(2):  # refused files leave nothing behind
            self.lose_state()
            for _ in range(2):
                self.assert_fails(self.fetch(thief, trust=trust), 11, "fetch.epoch")
        self.assertEqual(self.fetch_json(trust=trust)["epoch"], 2)
        self.assert_fails(self.fetch(thief, trust=trust), 10, "signature.key")
        # Another publisher's root, given by whoever owns the device, counts anew.
        mine = self.folder / "mine"
        self.publish(self.shop.new, site=mine)
        self.assertEqual(self.fetch_json(mine)["epoch"], 0)

    def test_a_release_held_back_is_noticed_within_days(self):
        self.publish(self.shop.old, options=["--fresh-days", "3"])
        self.fetch_json()
        fresh = self.site / "releases" / "1.fresh.json"
        held_back = shutil.copytree(self.site, self.folder / "held-back")
        self.assert_stale(held_back, 4)
        self.assertEqual(self.fetch_at(held_back, 2).returncode, 0)
        refresh = ["ship", "refresh", "--to", self.site, "--key", self.shop.key]
        before = fresh.read_text()
        time.sleep(1.1)  # its times are whole seconds
        self.assertEqual(self.modar(*refresh).returncode, 0)
        self.assertNotEqual(fresh.read_text(), before)
        self.assertFalse(self.fetch_json()["changed"])
        self.assertEqual((self.store / "current" / "fresh.json").read_text(), fresh.read_text())
        # A later release has it as well, unless told otherwise; the freshness of one is not that of another.
        self.publish(self.shop.new)
        self.assertTrue((self.site / "releases" / "2.fresh.json").is_file())
        for end in ("", ".minisig"):
            shutil.copy(f"{fresh}{end}", self.site / "releases" / f"2.fresh.json{end}")
        self.assert_fails(self.fetch(), 13, "fetch.mixed", "2.fresh.json")
        verify = ["ship", "verify", self.site, "--trust", self.trust]
        self.assert_fails(self.modar(*verify), 13, "ship.mixed")
        (self.site / "releases" / "2.fresh.json").unlink()
        self.assert_fails(self.fetch(), 13, "fetch.missing", "2.fresh.json")
        self.assert_fails(self.modar(*verify), 13, "ship.absent")
        self.assertEqual(self.modar(*refresh).returncode, 0)
        self.assertEqual(self.modar(*verify).returncode, 0)
        self.fetch_json()
        self.publish(self.shop.old, options=["--fresh-days", "0"])
        self.assert_fails(self.modar(*refresh), 1, "ship.fresh")
        self.fetch_json()
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        self.assert_fails(self.modar("ship", "refresh", "--to", held_back, "--key", other), 1, "ship.key")
        self.modar("ship", "prune", "--to", self.site, "--keep", "1")
        self.assertEqual(sorted(p.name for p in (self.site / "releases").iterdir()), ["3.json", "3.json.minisig"])

    def fetch_at(self, site, days):
        """As on a device whose clock is some days ahead, into a store of its own."""
        return self.fetch(site, store=self.folder / f"at{days}", env=self.clock(time.time() + 86400 * days))

    def assert_stale(self, site, days):
        self.assert_fails(self.fetch_at(site, days), 12, "fetch.stale", "modar ship refresh")

    def clock(self, seconds):
        """An environment in which time() says so."""
        source = self.folder / "clock.c"
        source.write_text(f"long time(long* to) {{ if (to) *to = {int(seconds)}L; return {int(seconds)}L; }}\n")
        library = self.folder / f"clock{int(seconds)}.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-fno-builtin", "-o", library, source], check=True)
        return {"LD_PRELOAD": str(library), "ASAN_OPTIONS": "verify_asan_link_order=0"}

    def test_a_clock_that_was_set_back_brings_nothing_back(self):
        soon = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 86400))
        self.publish(self.shop.old, options=["--expires", soon, "--fresh-days", "9"])
        before = shutil.copytree(self.site, self.folder / "before")
        self.assertEqual(self.fetch(before, store=self.folder / "early", env=self.clock(0)).returncode, 0)
        self.fetch_json()
        # A freshness of three days later was believed; that release expires before it.
        state = json.loads((self.store / "state.json").read_text())
        self.assertGreater(state["time"], time.time() - 3600)
        state["time"] += 3 * 86400
        for name in ("state.json", "slots/state.json"):
            (self.store / name).write_text(json.dumps(state))
        for now in (0, time.time()):
            self.assert_fails(self.fetch(before, env=self.clock(now)), 12, "fetch.expired")
        # With no state at all, the day of the program's release counts: what expired before it stays expired.
        old = self.folder / "old-site"
        self.publish(self.shop.old, site=old, options=["--expires", "2026-11-01T00:00:00Z"])
        self.assert_fails(self.fetch(old, store=self.folder / "new", env=self.clock(0)), 12, "fetch.expired")

    def test_trust_is_saved_before_the_release_is(self):
        self.publish(self.shop.old)
        self.fetch_json()
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        self.modar("ship", "rotate", "--to", self.site, "--key", self.shop.key, "--next", f"{other}.pub")
        self.publish(self.shop.new, key=other, options=["--expires", "2020-01-01T00:00:00Z"])
        self.assert_fails(self.fetch(), 12, "fetch.expired")
        self.assertEqual(json.loads((self.store / "state.json").read_text())["key_serial"], 1)

    def test_another_key_is_refused(self):
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        self.publish(self.shop.old, key=other)
        self.assert_fails(self.fetch(), 10, "signature.key")
        self.assertFalse((self.store / "museum.modar").exists())

    def test_devices_follow_the_chain_of_keys(self):
        keys = [self.shop.key]
        self.publish(self.shop.old)
        self.fetch_json()
        for i in (1, 2):
            keys.append(self.folder / f"key{i}")
            self.modar("ship", "keygen", "--out", keys[i])
            done = self.modar("ship", "rotate", "--to", self.site, "--key", keys[i - 1], "--next", f"{keys[i]}.pub")
            self.assertEqual(done.returncode, 0, done.stderr)
        self.publish(self.shop.new, key=keys[2])
        self.assertEqual(self.fetch_json()["version"], 2)
        self.assert_installed(self.shop.new)
        # A device that joins in the middle, and one that is new.
        self.fetch_json(store=self.folder / "middle", trust=f"{keys[1]}.pub")
        self.fetch_json(store=self.folder / "fresh")
        # The old key is worth nothing any more, whoever signs with it.
        stale = self.folder / "stale"
        self.publish(self.shop.old, key=keys[0], site=stale, options=["--release", "9"])
        self.assert_fails(self.fetch(stale), 10, "signature.key")

    def test_a_chain_link_that_was_changed_is_refused(self):
        other = self.folder / "other"
        self.modar("ship", "keygen", "--out", other)
        self.modar("ship", "rotate", "--to", self.site, "--key", self.shop.key, "--next", f"{other}.pub")
        self.publish(self.shop.old, key=other)
        link = self.site / "keys" / "1.json"
        link.write_text(link.read_text().replace("R", "S", 1))
        self.assertEqual(self.fetch().returncode, 10)


class Refusals(ShipTest):
    def test_roll_back(self):
        self.publish(self.shop.old)
        self.publish(self.shop.new)
        self.fetch_json()
        (self.site / "latest").write_text("1\n")
        self.assert_fails(self.fetch(), 11, "fetch.roll-back")
        self.assert_installed(self.shop.new)

    def test_expiry(self):
        self.publish(self.shop.old)
        self.fetch_json()
        late = self.modar("ship", "publish", self.shop.new, "--to", "late", "--key", self.shop.key, "--expires", "2020-01-01T00:00:00Z")
        self.assertIn("2020-01-01T00:00:00Z: the time is past", late.stderr)
        self.publish(self.shop.new, options=["--expires", "2020-01-01T00:00:00Z"])
        self.assert_fails(self.fetch(), 12, "fetch.expired")
        self.assert_installed(self.shop.old)

    def test_mixed_releases(self):
        self.publish(self.shop.old)
        self.fetch_json()
        # Another release under the same number.
        shutil.rmtree(self.site)
        self.publish(self.shop.new)
        self.assert_fails(self.fetch(), 13, "fetch.same-number")
        # Documents of one release under the number of another.
        self.publish(self.shop.old)
        for name in ("1.json", "1.json.minisig"):
            shutil.copy(self.site / "releases" / name, self.site / "releases" / name.replace("1", "2", 1))
        self.assert_fails(self.fetch(), 13, "fetch.mixed")
        self.assert_installed(self.shop.old)

    def test_an_object_that_is_missing(self):
        self.publish(self.shop.old)
        for piece in (self.site / "objects").rglob("*"):
            if piece.is_file():
                piece.unlink()
        done = self.fetch()
        self.assert_fails(done, 13, "fetch.missing", "the folder has no such file")
        self.assertNotIn("attempt", done.stderr)

    def test_status_for_operators(self):
        status = self.folder / "status.json"
        self.publish(self.shop.old)
        self.fetch_json(self.site, "--status", status)
        written = json.loads(status.read_text())
        self.assertEqual((written["result"], written["exit_code"], written["version"]), ("ok", 0, 1))
        self.assertRegex(written["program"], "^modar-fetch [0-9.]+$")
        self.publish(self.shop.new, options=["--expires", "2020-01-01T00:00:00Z"])
        self.assert_fails(self.fetch(self.site, "--status", status), 12, "fetch.expired")
        written = json.loads(status.read_text())
        self.assertEqual((written["result"], written["exit_code"], written["version"]), ("fetch.expired", 12, 1))
        self.assertEqual(written["bundles"], [str(self.store / "museum.modar")])

    def test_another_fetch_is_at_work(self):
        self.publish(self.shop.old)
        self.fetch_json()
        import fcntl
        with open(self.store / "lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.assert_fails(self.fetch(), 15, "store.locked")
        self.fetch_json()

    def test_two_publishers_never_meet(self):
        self.publish(self.shop.old)
        import fcntl
        with open(self.site / ".lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            done = self.modar("ship", "publish", self.shop.new, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 15, "ship.locked")

    def test_no_space(self):
        small = self.folder / "small"
        small.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", small], capture_output=True)
        if mounted.returncode != 0:
            self.skipTest("no right to mount a small file system")
        self.addCleanup(subprocess.run, ["umount", small])
        self.publish(self.shop.old)
        self.assert_fails(self.fetch(store=small / "store"), 14, "fetch.space")
        with contextlib.suppress(OSError), open(small / "filler", "wb", buffering=0) as filler:
            while filler.write(bytes(4096)):
                pass
        for store in ("store", "another"):
            self.assert_fails(self.fetch(store=small / store), 14, str(small / store))

    def test_what_a_killed_publisher_left_is_removed(self):
        self.publish(self.shop.old)
        left = [self.site / name for name in ("latest.123.tmp", "releases/2.json.7.tmp", next((self.site / "objects").iterdir()) / "ab.99.tmp")]
        kept = [self.site / name for name in ("notes.tmp", "a.1x.tmp")]
        for path in left + kept:
            path.write_text("half")
        done = self.modar("ship", "publish", self.shop.new, "--to", self.site, "--key", self.shop.key)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([path for path in left + kept if path.exists()], kept)

    def test_no_bundle_for_this_device(self):
        self.publish(self.shop.old, options=["--for", "museum=ace2"])
        self.assert_fails(self.fetch(self.site, "--device", "mali400"), 5, "fetch.device")
        self.fetch_json(self.site, "--device", "ace2")

    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full here")
    def test_output_that_does_not_arrive_is_an_error(self):
        self.publish(self.shop.old)
        for words in (["modar-fetch", self.site, "--store", self.store, "--trust", self.trust, "--json"],
                      ["modar", "check", self.shop.old, "--json"], ["modar", "ship", "list", "--to", self.site],
                      ["modar", "--help"]):
            with open("/dev/full", "w") as full:
                done = subprocess.run([BIN / words[0], *map(str, words[1:])], stdout=full, stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn("io.stdout", done.stderr)

    def test_a_damaged_file_of_a_folder_is_named_at_once(self):
        self.publish(self.shop.old)
        damaged = max((path for path in (self.site / "objects").rglob("*") if path.is_file()), key=lambda path: path.stat().st_size)
        good = damaged.read_bytes()
        damaged.write_bytes(good[:-1] + bytes([good[-1] ^ 1]))
        failed = self.fetch()
        self.assert_fails(failed, 13, "fetch.damaged", damaged.name, "copy the release again")
        self.assertNotIn("attempt", failed.stderr)
        damaged.write_bytes(good)
        self.assertEqual(self.fetch().returncode, 0)

    def test_usage(self):
        for address in (self.folder / "nowhere", "htp://museum.example/ar", "ftp://museum.example/ar"):
            self.assert_fails(self.fetch(address), 1, "fetch.url")
        self.assert_fails(self.run_program("modar-fetch"), 1, "--store")
        self.assert_fails(self.run_program("modar-fetch", "--stroe", "x"), 1, "--stroe")
        self.assertEqual(self.run_program("modar-fetch", "--help").returncode, 0)
        self.assert_fails(self.fetch(trust=self.folder / "nokey"), 2, "nokey")
        # A few bytes of it, as many as a key has at most, and more.
        for size in (16, 4096, 4097):
            (self.folder / "cover.png").write_bytes(b"\x89PNG\r\n\x1a\n".ljust(size, b"\0"))
            self.assert_fails(self.fetch(trust=self.folder / "cover.png"), 3, "this is a picture (PNG), not a key")


class Store(ShipTest):
    def test_pieces_of_the_installed_release_serve_again(self):
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        report = self.fetch_json()
        self.assertGreater(report["reused_bytes"], 0)
        self.assert_installed(self.shop.new)
        fresh = self.fetch_json(store=self.folder / "fresh")
        self.assertLess(report["downloaded_bytes"], fresh["downloaded_bytes"])

    def test_a_rotten_old_bundle_is_not_copied(self):
        self.publish(self.shop.old)
        self.fetch_json()
        installed = self.store / "current" / "museum.modar"
        data = bytearray(installed.read_bytes())
        data[len(data) // 2] ^= 0x10
        installed.write_bytes(data)
        self.publish(self.shop.new)
        report = self.fetch_json()
        self.assertGreaterEqual(report["corrupt_pieces"], 1)
        self.assert_installed(self.shop.new)

    def test_a_rotten_piece_is_fetched_again(self):
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        site = {p.name: p for p in (self.site / "objects").rglob("*") if p.is_file()}
        pieces = self.store / "pieces"
        for name, path in site.items():
            data = bytearray(path.read_bytes())
            data[0] ^= 1
            (pieces / name).write_bytes(data)
        self.assertIn(self.fetch().returncode, (0, 2))  # a rotten recipe is thrown away first
        self.fetch_json()
        self.assert_installed(self.shop.new)

    def test_verify_falls_back_to_the_release_before(self):
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        self.fetch_json()
        good = self.run_program("modar-fetch", "--store", self.store, "--verify", "--json")
        self.assertEqual(json.loads(good.stdout)["fell_back"], False)
        with open(self.store / "current" / "museum.modar", "r+b") as bundle:
            bundle.seek(1000)
            bundle.write(b"rot")
        done = self.run_program("modar-fetch", "--store", self.store, "--verify", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["fell_back"], True)
        self.assert_installed(self.shop.old)

    def test_the_spare_slot_shares_nothing_with_the_active_one(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)
        self.publish(self.shop.old, other)
        self.fetch_json()
        self.publish(self.shop.new)
        report = self.fetch_json()
        inodes = {p.stat().st_ino for p in (self.store / "slots").glob("*/other.modar")}
        self.assertEqual(len(inodes), 2)
        self.assertGreaterEqual(report["reused_bytes"], other.stat().st_size)
        self.assert_installed(self.shop.new, other)
        # The third release finds the unchanged bundle in its slot and leaves it there.
        kept = {p.stat().st_ino for p in (self.store / "slots" / "a").glob("other.modar")}
        self.publish(self.shop.old)
        self.fetch_json()
        self.assertEqual({p.stat().st_ino for p in (self.store / "slots" / "a").glob("other.modar")}, kept)
        self.assert_installed(self.shop.old, other)

    def test_the_spare_slot_stays_until_every_piece_is_there(self):
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        self.fetch_json()
        before = (self.store / "slots" / "a" / "museum.modar").read_bytes()
        third = self.shop.bake("third", "--model", sheet(self.folder / "third.obj", 30, 1.1))
        known = shutil.copytree(self.site / "objects", self.folder / "known")
        self.publish(third)
        recipe = json.loads((self.site / "releases" / "3.json").read_text())["bundles"][0]["recipe"]
        old = {p.name for p in known.rglob("*")}
        for piece in (self.site / "objects").rglob("*"):
            if piece.is_file() and piece.name not in old and piece.name != recipe:
                piece.unlink()
        self.assert_fails(self.fetch(), 13, "fetch.missing")
        self.assertEqual((self.store / "slots" / "a" / "museum.modar").read_bytes(), before)
        self.assertTrue((self.store / "slots" / "a" / "release.json").is_file())

    def test_a_bundle_that_left_the_release_leaves_the_store(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)
        self.publish(self.shop.old, other)
        self.fetch_json()
        self.publish(options=["--drop", "other"])
        self.fetch_json()
        self.assertEqual(sorted(p.name for p in self.store.glob("*.modar")), ["museum.modar"])

    def test_one_bundle_then_another_leaves_no_dangling_name(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)  # the same recipe twice: its part files must not meet
        self.publish(self.shop.old, other)
        self.fetch_json(self.site, "--bundle", "museum")
        self.fetch_json(self.site, "--bundle", "other")
        self.assertEqual([p.name for p in self.store.glob("*.modar")], ["other.modar"])
        self.assertTrue((self.store / "other.modar").exists())
        self.fetch_json()
        self.assert_installed(self.shop.old, other)

    def test_files_of_others_stay(self):
        self.publish(self.shop.old)
        self.store.mkdir()
        ours = ["pushed.modar", "museum.modar", "notes.tmp", "x.new", "pieces/holiday.jpg", "slots/b/readme.txt"]
        for folder in ("pieces", "slots/a", "slots/b"):
            (self.store / folder).mkdir(parents=True)
        for name in ours:
            (self.store / name).write_text("mine")
        done = self.fetch(self.site, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("museum.modar", done.stderr)
        self.publish(self.shop.new)
        report = self.fetch_json()
        for name in ours:
            self.assertEqual((self.store / name).read_text(), "mine", name)
        self.assertEqual(pathlib.Path(report["bundles"][0]).read_bytes(), self.shop.new.read_bytes())

    def test_bit_rot_is_found_and_healed(self):
        self.publish(self.shop.old)
        self.fetch_json()
        installed = self.store / "current" / "museum.modar"
        with open(installed, "r+b") as bundle:
            bundle.seek(5000)
            bundle.write(b"rot")
        done = self.run_program("modar-fetch", "--store", self.store, "--verify")
        self.assert_fails(done, 17, "store.damaged")
        report = self.fetch_json()
        self.assertTrue(report["changed"])
        self.assertGreater(report["reused_bytes"], report["downloaded_bytes"])
        self.assert_installed(self.shop.old)
        self.assertFalse(self.fetch_json()["changed"])

    def store_with_an_update(self):
        """A store with a release, a site with the next one, and a folder of somebody else's outside."""
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        self.outside = self.folder / "outside"
        self.outside.mkdir()
        self.victim = self.outside / "victim"
        self.victim.write_text("precious")

    def assert_nothing_outside(self):
        self.assertEqual([p.name for p in self.outside.iterdir()], ["victim"])
        self.assertEqual(self.victim.read_text(), "precious")

    def test_folders_that_are_links_are_refused(self):
        self.store_with_an_update()
        for name in ("slots", "slots/b", "slots/a", "pieces"):
            with self.subTest(name):
                folder = self.store / name
                kept = folder.with_name(folder.name + ".kept")
                folder.rename(kept)
                folder.symlink_to(self.outside)
                self.assert_fails(self.fetch(), 2, "store.link", str(folder))
                done = self.run_program("modar-fetch", "--store", self.store, "--verify")
                self.assert_fails(done, 2, "store.link")
                self.assert_nothing_outside()
                folder.unlink()
                kept.rename(folder)
        lock = self.store / "lock"
        lock.unlink()
        lock.symlink_to(self.outside / "made")
        self.assert_fails(self.fetch(), 2, "io.create")
        self.assert_nothing_outside()
        lock.unlink()
        self.fetch_json()
        self.assert_installed(self.shop.new)

    def plants(self):
        """Ways to put something of another's into a file's place: a link, a second name, a pipe."""
        return {"link": lambda path: path.symlink_to(self.victim), "second name": lambda path: os.link(self.victim, path),
                "pipe": os.mkfifo}

    def test_planted_pieces_lead_nothing_outside(self):
        for way in ("link", "second name", "pipe"):
            for suffix in (".part", ""):
                with self.subTest(way + suffix):
                    shutil.rmtree(self.store, ignore_errors=True)
                    shutil.rmtree(self.folder / "outside", ignore_errors=True)
                    shutil.rmtree(self.site, ignore_errors=True)
                    self.store_with_an_update()
                    for piece in (self.site / "objects").rglob("*"):
                        if piece.is_file():
                            self.plants()[way](self.store / "pieces" / f"{piece.name}{suffix}")
                    self.assertIn(self.fetch().returncode, (0, 2))  # files other than recipes are removed first
                    self.fetch_json()
                    self.assert_installed(self.shop.new)
                    self.assert_nothing_outside()

    def test_planted_bundles_and_documents_lead_nothing_outside(self):
        for way in ("link", "second name", "pipe"):
            for name in ("slots/b/museum.modar", "slots/b/museum.recipe", "slots/b/release.json", "slots/b/release.json.minisig",
                         "slots/state.json", "state.json", "current"):
                with self.subTest(way + " " + name):
                    shutil.rmtree(self.store, ignore_errors=True)
                    shutil.rmtree(self.folder / "outside", ignore_errors=True)
                    shutil.rmtree(self.site, ignore_errors=True)
                    self.store_with_an_update()
                    place = self.store / name
                    place.unlink(missing_ok=True)
                    self.plants()[way](place)
                    done = self.fetch()
                    if name == "slots/b/museum.modar":  # without a recipe next to it, it is not ours
                        self.assert_fails(done, 2, "store.foreign", str(place))
                        place.unlink()
                        done = self.fetch()
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assert_nothing_outside()
                    self.assert_installed(self.shop.new)

    def test_a_bundle_with_a_second_name_is_built_again(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)
        self.publish(self.shop.old, other)
        self.fetch_json()
        self.publish(self.shop.new)
        self.fetch_json()
        kept = self.store / "slots" / "a" / "other.modar"
        second = self.folder / "second"
        os.link(kept, second)
        self.publish(self.shop.old)
        self.fetch_json()
        self.assertEqual(kept.stat().st_nlink, 1)
        second.write_bytes(b"rot")
        self.assert_installed(self.shop.old, other)

    def test_planted_bundles_are_not_installed(self):
        """A pipe or a link in the place of an installed bundle is no bundle: the next fetch replaces it."""
        for plant in (os.mkfifo, lambda path: path.symlink_to(self.shop.old)):
            shutil.rmtree(self.store, ignore_errors=True)
            shutil.rmtree(self.site, ignore_errors=True)
            self.publish(self.shop.old)
            self.fetch_json()
            installed = self.store / "slots" / "a" / "museum.modar"
            installed.unlink()
            plant(installed)
            self.assertTrue(self.fetch_json()["changed"])
            self.assert_installed(self.shop.old)
            self.assertFalse((self.store / "museum.modar").resolve().is_fifo())

    def without_links(self):
        """An environment in which links fail, as on FAT and Android's shared storage."""
        source = self.folder / "nolinks.c"
        source.write_text("#include <errno.h>\nint symlinkat(const char* a, int f, const char* b) "
                          "{ (void)a; (void)f; (void)b; errno = EPERM; return -1; }\n"
                          "int symlink(const char* a, const char* b) { return symlinkat(a, 0, b); }\n")
        library = self.folder / "nolinks.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
        return {"LD_PRELOAD": str(library), "ASAN_OPTIONS": "verify_asan_link_order=0"}

    def check_store_without_links(self, env):
        for bundle, version in ((self.shop.old, 1), (self.shop.new, 2), (self.shop.old, 3)):
            self.publish(bundle)
            report = self.fetch_json(env=env)
            self.assertEqual(report["version"], version)
            self.assertEqual(pathlib.Path(report["bundles"][0]).read_bytes(), bundle.read_bytes())
        self.assertFalse((self.store / "current").is_symlink())
        self.assertIn((self.store / "current").read_text(), ("slots/a\n", "slots/b\n"))
        self.assertFalse(self.fetch_json(env=env)["changed"])
        with open(report["bundles"][0], "r+b") as bundle:
            bundle.write(b"rot")
        done = self.run_program("modar-fetch", "--store", self.store, "--verify", "--json", env=env)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["fell_back"], True)
        self.assertEqual(pathlib.Path(json.loads(done.stdout)["bundles"][0]).read_bytes(), self.shop.new.read_bytes())

    def test_a_store_without_symbolic_links(self):
        self.check_store_without_links(self.without_links())

    def test_a_store_on_fat(self):
        mount = mount_fat(self)
        self.store = mount / "store"
        self.check_store_without_links(None)


class Programs(unittest.TestCase):
    @unittest.skipUnless(shutil.which("nm"), "nm is not installed")
    def test_the_device_links_no_library_of_the_bakes(self):
        symbols = {program: subprocess.run(["nm", "-C", BIN / program], capture_output=True, text=True, check=True).stdout
                   for program in ("modar", "modar-fetch", "modar-play")}
        for library in ("draco::", "meshopt_"):
            self.assertTrue(library in symbols["modar"], library)
            for device in ("modar-fetch", "modar-play"):
                self.assertFalse(library in symbols[device], f"{library} in {device}")


class Plan(ShipTest):
    def test_the_plan_is_what_the_fetch_needs(self):
        plan = json.loads(self.modar("ship", "plan", self.shop.old, self.shop.new, "--link", "2g", "--device", "ace2",
                                     "--json").stdout)
        self.publish(self.shop.old)
        self.fetch_json()
        self.publish(self.shop.new)
        report = self.fetch_json()
        self.assertAlmostEqual(report["downloaded_bytes"], plan["update_bytes"], delta=1000)
        self.assertGreater(plan["minutes"], 0)
        # The assumptions are stated: 800 million instructions and 8 MB of flash a second.
        seconds = sum(plan[f"{kind}_bytes"] * plan[f"{kind}_instructions_per_byte"] for kind in ("geometry", "other")) / 8e8
        self.assertAlmostEqual(plan["install_seconds"], seconds + self.shop.new.stat().st_size / 8e6, places=6)
        self.assertLess(plan["update_bytes"], plan["full_bytes"])
        self.assert_fails(self.modar("ship", "plan", self.shop.old, self.shop.new, "--link", "5g"), 1, "ship.link")


if __name__ == "__main__":
    unittest.main()
