"""`modar ship` and `modar-fetch` over folders: releases, keys, what is refused, what is reused."""
import json
import shutil
import stat
import subprocess
import unittest

from programs import BIN, ROOT
from ship_files import ShipTest, soak


class Publish(ShipTest):
    def test_a_release_installs_byte_for_byte(self):
        report = self.publish(self.shop.old)
        self.assertEqual(report["release"]["version"], 1)
        fetched = self.fetch_json()
        self.assertTrue(fetched["changed"])
        self.assert_installed(self.shop.old)
        self.assertFalse(self.fetch_json()["changed"])
        self.assertEqual(fetched["bundles"], [str(self.store / "museum.modar")])

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

    def test_a_bad_bundle_is_not_published(self):
        broken = self.folder / "broken.modar"
        data = bytearray(self.shop.old.read_bytes())
        data[-1] ^= 1
        broken.write_bytes(data)
        done = self.modar("ship", "publish", broken, "--to", self.site, "--key", self.shop.key)
        self.assert_fails(done, 3, "ship.bad-bundle", "modar check")
        self.assertFalse((self.site / "latest").exists())

    def test_release_numbers_only_grow(self):
        self.publish(self.shop.old, options=["--release", "5"])
        done = self.modar("ship", "publish", self.shop.old, "--to", self.site, "--key", self.shop.key, "--release", "5")
        self.assert_fails(done, 1, "ship.version")
        self.assertEqual(self.publish(self.shop.old)["release"]["version"], 6)

    def test_patterns_need_no_text_on_the_way(self):
        report = self.publish(self.shop.pattern)
        forms = {form["form"]: form for form in report["forms"]}
        self.assertEqual(forms["derived-text"]["stored_bytes"], 0)
        self.assertEqual(forms["derived-text"]["pieces"], 4)
        self.fetch_json()
        self.assert_installed(self.shop.pattern)


class Keys(ShipTest):
    def test_keygen_writes_minisign_files(self):
        key = self.folder / "k"
        done = self.modar("ship", "keygen", "--out", key)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(stat.S_IMODE(key.stat().st_mode), 0o600)
        self.assert_fails(self.modar("ship", "keygen", "--out", key), 1, "key.exists")

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
        self.publish(self.shop.old, key=theirs)
        self.fetch_json(trust=f"{theirs}.pub")
        signed = subprocess.run(["minisign", "-Sm", document, "-s", theirs], capture_output=True, input=b"\n")
        self.assertEqual(signed.returncode, 0, signed.stderr)
        (self.site / "latest").write_text("1\n")
        self.fetch_json(trust=f"{theirs}.pub", store=self.folder / "second")

    @unittest.skipUnless(soak(), "scrypt needs 1 GiB and seconds; soak runs it")
    def test_an_encrypted_key_wants_its_pass_phrase(self):
        phrase, wrong = self.folder / "phrase", self.folder / "wrong"
        phrase.write_text("open sesame\n")
        wrong.write_text("open barley\n")
        key = self.folder / "k"
        done = self.modar("ship", "keygen", "--out", key, "--pass-phrase-file", phrase)
        self.assertEqual(done.returncode, 0, done.stderr)
        publish = ["ship", "publish", self.shop.old, "--to", self.site, "--key", key]
        self.assert_fails(self.modar(*publish, "--pass-phrase-file", wrong), 3, "key.pass-phrase")
        self.assertEqual(self.modar(*publish, "--pass-phrase-file", phrase, "--quiet").returncode, 0)
        self.fetch_json(trust=f"{key}.pub")

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
        # The old key is worth nothing any more.
        self.publish(self.shop.old, key=keys[0])
        self.assert_fails(self.fetch(), 10, "signature.key")

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
        self.assert_fails(self.fetch(), 13, "fetch.missing")

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

    def test_no_bundle_for_this_device(self):
        self.publish(self.shop.old, options=["--for", "museum=ace2"])
        self.assert_fails(self.fetch(self.site, "--device", "mali400"), 5, "fetch.device")
        self.fetch_json(self.site, "--device", "ace2")

    def test_usage(self):
        self.assert_fails(self.fetch(self.folder / "nowhere"), 1, "fetch.url")
        self.assert_fails(self.run_program("modar-fetch"), 1, "--store")
        self.assert_fails(self.run_program("modar-fetch", "--stroe", "x"), 1, "--stroe")
        self.assertEqual(self.run_program("modar-fetch", "--help").returncode, 0)
        self.assert_fails(self.fetch(trust=self.folder / "nokey"), 2, "nokey")


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

    def test_an_unchanged_bundle_is_shared_by_both_slots(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.pattern, other)
        self.publish(self.shop.old, other)
        self.fetch_json()
        self.publish(self.shop.new, other)
        report = self.fetch_json()
        self.assertEqual((self.store / "other.modar").stat().st_nlink, 2)
        self.assertGreaterEqual(report["reused_bytes"], other.stat().st_size)
        self.assert_installed(self.shop.new, other)

    def test_a_bundle_that_left_the_release_leaves_the_store(self):
        other = self.folder / "other.modar"
        shutil.copy(self.shop.old, other)
        self.publish(self.shop.old, other)
        self.fetch_json()
        self.publish(self.shop.old)
        self.fetch_json()
        self.assertEqual(sorted(p.name for p in self.store.glob("*.modar")), ["museum.modar"])


class Programs(unittest.TestCase):
    @unittest.skipUnless(shutil.which("nm"), "nm is not installed")
    def test_the_device_links_decoders_alone(self):
        def symbols(program):
            return subprocess.run(["nm", "-C", program], capture_output=True, text=True, check=True).stdout
        fetch = symbols(BIN / "modar-fetch")
        self.assertIn("draco::Decoder", fetch)
        self.assertNotIn("draco::ExpertEncoder", fetch)
        self.assertIn("draco::ExpertEncoder", symbols(BIN / "modar"))
        self.assertNotIn("draco::", symbols(BIN / "modar-play"))


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
        self.assertLess(plan["update_bytes"], plan["full_bytes"])
        self.assert_fails(self.modar("ship", "plan", self.shop.old, self.shop.new, "--link", "5g"), 1, "ship.link")


if __name__ == "__main__":
    unittest.main()
