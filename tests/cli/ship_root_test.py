"""Root keys of several people: each at home with a key of their own, the file passed on, devices that count who agreed."""
import json
import pathlib
import shutil
import subprocess
import unittest

from programs import ROOT
from ship_files import ShipTest

NAMES = ("ada", "bo", "cy", "di")


class SeveralRootKeys(ShipTest):
    def setUp(self):
        super().setUp()
        self.homes = {}
        for name in NAMES:
            self.homes[name] = self.folder / name
            self.homes[name].mkdir()
            self.done("ship", "keygen", "--out", self.homes[name] / "root.key")
        self.signing = self.folder / "signing.key"
        self.done("ship", "keygen", "--out", self.signing)
        self.trust = self.trust_of(("ada", "bo", "cy"), 2)

    def done(self, *words):
        done = self.modar(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def public(self, names):
        """The files that they sent to whoever makes the set."""
        return [self.homes[name] / "root.key.pub" for name in names]

    def trust_of(self, names, threshold):
        path = self.folder / f"{'-'.join(names)}.trust"
        self.done("ship", "trust", *self.public(names), "--threshold", threshold, "--out", path)
        return path

    def draft(self, name, *words, file="draft.json"):
        """Written and signed at the home of one of them."""
        path = self.homes[name] / file
        self.done("ship", "root", "--to", self.site, "--key", self.homes[name] / "root.key", "--draft", path, *words)
        return path

    def pass_on(self, path, name):
        """To the home of another, who signs it there, knows no folder but their own, and sends all of it on."""
        home = self.homes[name]
        for file in path.parent.glob(path.name + "*"):
            shutil.copy(file, home)
        signed = self.modar("ship", "sign", path.name, "--key", "root.key", cwd=home)
        self.assertEqual(signed.returncode, 0, signed.stderr)
        self.assertIn("epoch" if "epoch" in path.read_text() else "chain of root keys", signed.stderr)
        return home / path.name

    def accept(self, path, trust=None):
        return self.modar("ship", "accept", path, "--to", self.site, "--trust", trust or self.trust)

    def name_signer(self, first="ada", second="bo"):
        path = self.pass_on(self.draft(first, "--next", f"{self.signing}.pub"), second)
        done = self.accept(path)
        self.assertEqual(done.returncode, 0, done.stderr)
        return path

    def test_two_of_three_lead_devices(self):
        alone = self.draft("ada", "--next", f"{self.signing}.pub")
        self.assert_fails(self.accept(alone), 10, "signature.too-few")
        self.assertFalse((self.site / "root.json").exists())
        self.publish(self.shop.old, key=self.signing)  # too early: devices refuse it from the root keys' word on
        path = self.pass_on(alone, "bo")
        accepted = self.accept(path)
        self.assertEqual(accepted.returncode, 0)
        self.assertIn("publish its bundles again", accepted.stderr)
        self.publish(self.shop.old, key=self.signing)
        self.assertEqual(self.fetch_json()["epoch"], 1)
        self.assert_installed(self.shop.old)
        self.assertFalse(self.fetch_json()["changed"])
        self.done("ship", "verify", self.site, "--trust", self.trust)
        # The same draft a second time is out of date.
        self.assert_fails(self.accept(path), 1, "ship.draft")
        # What one of them signs by the shorter way is refused where several have to agree.
        short = self.modar("ship", "root", "--to", self.site, "--key", self.homes["ada"] / "root.key",
                           "--next", f"{self.signing}.pub")
        self.assert_fails(short, 1, "ship.root")

    def test_one_key_counts_once(self):
        path = self.name_signer()
        self.publish(self.shop.old, key=self.signing)
        signatures = sorted(self.site.glob("root.json.*.minisig"))
        self.assertEqual(len(signatures), 2)
        # A device sees one key's signature twice, and none of the other's.
        shutil.copy(signatures[0], signatures[1])
        self.assertEqual(self.fetch().returncode, 10)
        self.assert_fails(self.modar("ship", "verify", self.site, "--trust", self.trust), 10, "signature.too-few")
        signatures[1].unlink()
        refused = self.fetch()
        self.assertEqual(refused.returncode, 10, refused.stderr)
        self.assertIn("signature.too-few", refused.stderr)
        self.assertFalse((self.store / "museum.modar").exists())
        # A stranger's signature counts for nothing.
        strange = self.pass_on(path, "di")
        for file in strange.parent.glob("draft.json.*.minisig"):
            shutil.copy(file, self.site / file.name.replace("draft", "root"))
        shutil.copy(self.site / signatures[0].name, signatures[1])
        self.assertEqual(self.fetch().returncode, 10)

    def test_root_keys_sign_no_releases(self):
        # One of three is no publisher, even where no root metadata says who is.
        self.publish(self.shop.old, key=self.homes["ada"] / "root.key")
        refused = self.fetch()
        self.assertEqual(refused.returncode, 10, refused.stderr)
        self.assertIn("fetch.no-root", refused.stderr)

    @unittest.skipUnless(shutil.which("minisign"), "minisign is not installed")
    def test_minisign_verifies_and_makes_each_signature(self):
        path = self.draft("ada", "--next", f"{self.signing}.pub")
        for name in ("bo", "cy"):
            # By minisign's own hand, under the name that the signature is looked for.
            home = self.homes[name]
            ours = self.pass_on(path, name).parent
            number = next(file for file in ours.glob("draft.json.*.minisig") if not (path.parent / file.name).exists())
            number.unlink()
            signed = subprocess.run(["minisign", "-S", "-W", "-m", "draft.json", "-s", "root.key", "-x", number.name], cwd=home,
                                    capture_output=True, text=True, input="\n")
            if signed.returncode != 0:  # older ones sign with encrypted keys only
                self.done("ship", "sign", home / "draft.json", "--key", home / "root.key")
            shutil.copy(number, path.parent)
        self.assertEqual(self.accept(path).returncode, 0)
        signatures = sorted(self.site.glob("root.json.*.minisig"))
        self.assertEqual(len(signatures), 3)
        verified = set()
        for signature in signatures:
            for name in NAMES:
                done = subprocess.run(["minisign", "-Vm", self.site / "root.json", "-x", signature,
                                       "-p", self.homes[name] / "root.key.pub"], capture_output=True, text=True)
                if done.returncode == 0:
                    verified.add((signature.name, name))
        self.assertEqual({name for _, name in verified}, {"ada", "bo", "cy"})
        self.assertEqual(len(verified), 3)
        self.publish(self.shop.old, key=self.signing)
        self.fetch_json()

    def rotate(self, names, threshold, signers, file):
        path = self.draft(signers[0], "--roots", *self.public(names), "--threshold", threshold, file=file)
        for name in signers[1:]:
            path = self.pass_on(path, name)
        return path

    def test_root_keys_follow_each_other(self):
        self.name_signer()
        self.publish(self.shop.old, key=self.signing)
        self.fetch_json()
        early = shutil.copytree(self.store, self.folder / "early", symlinks=True)
        # Cy leaves, Di comes. The old keys alone are too few: enough of the new ones have to be there.
        alone = self.rotate(("ada", "bo", "di"), 3, ("ada", "bo"), "first.json")
        self.assert_fails(self.accept(alone), 10, "signature.too-few")
        self.assertEqual(self.accept(self.pass_on(alone, "di")).returncode, 0)
        # Then Ada: two of three before, both of two after.
        second = self.rotate(("bo", "di"), 2, ("bo", "di"), "second.json")
        done = self.accept(second)
        self.assert_fails(done, 10, "signature.too-few")
        self.assertEqual(self.accept(self.pass_on(second, "ada")).returncode, 0)
        # They name another signing key: a device that saw neither change follows both.
        next_key = self.folder / "next.key"
        self.done("ship", "keygen", "--out", next_key)
        word = self.pass_on(self.draft("bo", "--next", f"{next_key}.pub", file="word.json"), "di")
        self.assertEqual(self.accept(word).returncode, 0)
        self.publish(self.shop.new, key=next_key)
        for store in (self.store, early):
            self.assertEqual(self.fetch_json(self.site, store=store)["epoch"], 2)
            self.assert_installed(self.shop.new, store=store)
            state = json.loads((store / "state.json").read_text())
            self.assertEqual((state["root_serial"], state["roots"].split()[0]), (2, "2"))
        self.fetch_json(self.site, store=self.folder / "fresh")
        self.done("ship", "verify", self.site, "--trust", self.trust)
        self.forks_are_refused(early)

    def forks_are_refused(self, store):
        """Ada and Cy, who have left, still have two of the first three keys."""
        fork = shutil.copytree(self.site, self.folder / "fork")
        honest, self.site = self.site, fork
        shutil.rmtree(fork / "roots")
        for file in fork.glob("root.json*"):
            file.unlink()
        thief = self.folder / "thief.key"
        self.done("ship", "keygen", "--out", thief)
        for _ in range(3):  # of a later epoch than the honest one
            word = self.pass_on(self.draft("ada", "--next", f"{thief}.pub", file="forged.json"), "cy")
            self.assertEqual(self.accept(word).returncode, 0)
        shutil.rmtree(fork / "releases")
        (fork / "latest").unlink()
        self.publish(self.shop.old, key=thief, options=["--release", "99"])
        self.assertEqual(self.fetch(fork, store=store).returncode, 10)
        self.assert_installed(self.shop.new, store=store)
        self.site = honest

    def test_one_root_key_becomes_several(self):
        ada = self.homes["ada"] / "root.key"
        self.done("ship", "root", "--to", self.site, "--key", ada, "--next", f"{self.signing}.pub")
        self.publish(self.shop.old, key=self.signing)
        alone = pathlib.Path(f"{ada}.pub")
        self.fetch_json(trust=alone)
        path = self.rotate(("ada", "bo", "cy"), 2, ("ada", "bo"), "several.json")
        self.assertEqual(self.accept(path, trust=alone).returncode, 0)
        next_key = self.folder / "next.key"
        self.done("ship", "keygen", "--out", next_key)
        word = self.pass_on(self.draft("cy", "--next", f"{next_key}.pub", file="word.json"), "bo")
        self.assertEqual(self.accept(word, trust=alone).returncode, 0)
        self.publish(self.shop.new, key=next_key)
        self.fetch_json(trust=alone)
        self.assert_installed(self.shop.new)
        # A device that is given the new set from the start.
        self.fetch_json(self.site, store=self.folder / "fresh", trust=alone)

    def test_sets_that_cannot_agree_are_refused(self):
        ada, bo = self.public(("ada", "bo"))
        out = ("--out", self.folder / "bad.trust")
        self.assert_fails(self.modar("ship", "trust", ada, bo, "--threshold", 3, *out), 1, "key.set")
        self.assert_fails(self.modar("ship", "trust", ada, ada, "--threshold", 2, *out), 1, "key.set")
        self.assert_fails(self.modar("ship", "trust", self.homes["ada"] / "root.key", "--threshold", 1, *out), 3, "key.public")
        notes = self.folder / "notes.json"
        notes.write_text("{}")
        self.assert_fails(self.modar("ship", "sign", notes, "--key", self.homes["ada"] / "root.key"), 3, "ship.draft")


if __name__ == "__main__":
    unittest.main()
