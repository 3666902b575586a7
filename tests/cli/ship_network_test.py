"""`modar-fetch` over a real nginx, over lines that break, and from servers that misbehave."""
import pathlib
import shutil
import subprocess
import time
import unittest

from programs import BIN
from servers import NGINX, BreakingLine, Nginx, RudeServer
from ship_files import ShipTest, sheet, soak


def folder_bytes(folder):
    """Bytes of the files in a folder that another program is at work in: names come and go."""
    total = 0
    for path in folder.glob("*"):
        try:
            total += path.stat().st_size
        except FileNotFoundError:
            continue
    return total


@unittest.skipUnless(NGINX, "nginx is not installed")
class RealServer(ShipTest):
    def setUp(self):
        super().setUp()
        self.publish(self.shop.old)
        self.nginx = Nginx(self.site, self.folder / "nginx")
        self.addCleanup(self.nginx.stop)

    def requests(self, status):
        return [line for line in self.nginx.log.read_text().splitlines() if f'" {status} ' in line]

    def test_installs_and_updates(self):
        self.fetch_json(self.nginx.url())
        self.publish(self.shop.new)
        report = self.fetch_json(self.nginx.url())
        self.assertTrue(report["changed"])
        self.assert_installed(self.shop.new)

    def test_the_log_shows_programs_and_releases(self):
        self.fetch_json(self.nginx.url())
        self.publish(self.shop.new)
        self.fetch_json(self.nginx.url())
        log = self.nginx.log.read_text()
        self.assertRegex(log, r'"modar-fetch/[0-9.]+ \(nothing installed\)"')
        self.assertRegex(log, r'"modar-fetch/[0-9.]+ \(release 1\)"')

    def test_resumes_in_the_middle_of_a_piece(self):
        line = BreakingLine(self.nginx.port, seed=1, most=12000)
        self.addCleanup(line.stop)
        report = self.fetch_json(f"http://127.0.0.1:{line.port}/plain", "--attempts", "200")
        self.assert_installed(self.shop.old)
        self.assertGreater(line.breaks, 2)
        self.assertGreater(report["retries"], 0)
        self.assertGreater(len(self.requests(206)), 0)
        # Bytes received before a break are not fetched again, except those in the pipe.
        whole = sum(p.stat().st_size for p in (self.site / "objects").rglob("*") if p.is_file())
        self.assertLess(report["downloaded_bytes"], 2 * whole)

    def test_a_server_without_ranges_works_too(self):
        line = BreakingLine(self.nginx.port, seed=3, most=200000)
        self.addCleanup(line.stop)
        self.fetch_json(f"http://127.0.0.1:{line.port}/noranges", "--attempts", "1000")
        self.assert_installed(self.shop.old)
        self.assertEqual(self.requests(206), [])

    def test_an_interrupted_fetch_goes_on_where_it_stopped(self):
        command = [BIN / "modar-fetch", self.nginx.url("slow"), "--store", self.store,
                   "--trust", self.trust, "--parallel", "1"]
        first = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        pieces = self.store / "pieces"
        for _ in range(400):
            if folder_bytes(pieces) > 20000:
                break
            time.sleep(0.02)
        first.kill()
        first.wait()
        report = self.fetch_json(self.nginx.url())
        whole = sum(p.stat().st_size for p in (self.site / "objects").rglob("*") if p.is_file())
        self.assertLess(report["downloaded_bytes"], whole - 10000)
        self.assert_installed(self.shop.old)

    def test_the_cap_holds(self):
        """Not only of many connections, but of one piece on a fast line, too."""
        large = self.shop.bake("large", "--model", sheet(self.folder / "large.obj", 120, 0.4), "--no-lods")
        self.publish(large)
        begin = time.monotonic()
        report = self.fetch_json(self.nginx.url(), "--limit-rate", "20000")
        self.assertGreater(time.monotonic() - begin, report["downloaded_bytes"] / 20000 - 1)
        self.assertGreater(report["downloaded_bytes"], 50000)
        self.assert_installed(large)

    def test_errors_that_last_are_told(self):
        self.assert_fails(self.fetch(self.nginx.url("broken"), "--attempts", "2"), 16, "fetch.network", "500")
        self.assert_fails(self.fetch(self.nginx.url("nothing")), 13, "fetch.missing", "check the address")
        self.nginx.stop()
        self.assert_fails(self.fetch(self.nginx.url(), "--attempts", "2"), 16, "fetch.network", "again")
        done = self.fetch(self.nginx.url(), "--attempts", "4")  # waits 0.5, 1 and 2 s
        self.assertEqual([line.split("; ")[1] for line in done.stderr.splitlines()[:-1]],
                         ["attempt 3 of 4 in 1 s", "attempt 4 of 4 in 2 s"], done.stderr)
        self.assertEqual(len(self.fetch(self.nginx.url(), "--attempts", "3", "--quiet").stderr.splitlines()), 1)

    @unittest.skipUnless(soak(), "2G takes its time; soak runs it")
    def test_2g_with_breaks(self):
        line = BreakingLine(self.nginx.port, seed=5, most=60000)
        self.addCleanup(line.stop)
        self.publish(self.shop.new)
        self.fetch_json(f"http://127.0.0.1:{line.port}/slow", "--attempts", "1000")
        self.assert_installed(self.shop.new)


class RudeServers(ShipTest):
    def fetch_from(self, rude, *options):
        self.publish(self.shop.old)
        server = RudeServer(self.site, rude)
        self.addCleanup(server.stop)
        return self.fetch(server.url(), "--json", *options)

    def expect_recovery(self, rude):
        done = self.fetch_from(rude)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assert_installed(self.shop.old)

    def test_each_rudeness_is_survived(self):
        for way in ("garbage", "short", "long", "416", "404", "500"):
            with self.subTest(way):
                self.store = self.folder / f"store-{way}"
                self.expect_recovery(lambda path, attempt: way if "objects" in path and attempt == 1 else None)

    def test_rude_documents_are_survived_or_refused(self):
        for way in ("404", "416", "500", "short"):
            with self.subTest(way):
                self.store = self.folder / f"store-{way}"
                self.expect_recovery(lambda path, attempt: way if path == "/latest" and attempt == 1 else None)
        done = self.fetch_from(lambda path, attempt: "garbage" if path.endswith(".json") else None)
        self.assertEqual(done.returncode, 10, done.stderr)

    def test_a_network_that_wants_a_login_is_named(self):
        for way in ("page", "511"):
            for part in ("latest", "json", "minisig", "objects"):
                with self.subTest(way=way, part=part):
                    self.store = self.folder / f"store-{way}-{part}"
                    done = self.fetch_from(lambda path, _: way if part in path else None, "--attempts", "2")
                    self.assert_fails(done, 16, "log in to this network")

    def test_an_answer_without_a_header_is_tried_again(self):
        self.expect_recovery(lambda path, attempt: "bare" if attempt == 1 else None)
        self.store = self.folder / "other"
        self.assert_fails(self.fetch_from(lambda path, _: "bare", "--attempts", "2"), 16, "fetch.network", "no HTTP header")

    def test_a_byte_an_answer_gives_up(self):
        done = self.fetch_from(lambda path, _: "byte" if "objects" in path else None, "--attempts", "3")
        self.assert_fails(done, 16, "fetch.network")

    @unittest.skipUnless(soak(), "the connection is closed after 30 s; soak runs it")
    def test_a_byte_a_second_gives_up(self):
        done = self.fetch_from(lambda path, _: "drip" if "objects" in path else None, "--attempts", "1")
        self.assert_fails(done, 16, "fetch.network")

    def certificate(self):
        key, certificate = self.folder / "tls.key", self.folder / "tls.pem"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", certificate,
                        "-days", "2", "-subj", "/CN=museum", "-addext", "subjectAltName=IP:127.0.0.1"],
                       check=True, capture_output=True)
        return certificate, key

    @unittest.skipUnless(shutil.which("openssl"), "openssl is not installed")
    def test_https_stays_https(self):
        self.publish(self.shop.old)
        plain = RudeServer(self.site, lambda path, attempt: None)
        self.addCleanup(plain.stop)
        certificate, key = self.certificate()
        secure = RudeServer(self.site, lambda path, attempt: None, (certificate, key))
        self.addCleanup(secure.stop)
        down = RudeServer(self.site, lambda path, attempt: "redirect:" + plain.url(), (certificate, key))
        self.addCleanup(down.stop)
        self.assert_fails(self.fetch(down.url(), "--cacert", certificate), 16, "fetch.redirect", "HTTPS")
        up = RudeServer(self.site, lambda path, attempt: "redirect:" + secure.url())
        self.addCleanup(up.stop)
        self.fetch_json(up.url(), "--cacert", certificate)

    def test_a_login_is_not_printed(self):
        self.publish(self.shop.old)
        server = RudeServer(self.site, lambda path, attempt: "500" if "objects" in path else None)
        self.addCleanup(server.stop)
        url = server.url().replace("//", "//curator:hunter2@")
        status = self.folder / "status.json"
        for attempts in ("1", "3"):
            done = self.fetch(url, "--attempts", attempts, "--status", status)
            self.assert_fails(done, 16, "127.0.0.1")
            self.assertNotIn("hunter2", done.stderr + status.read_text())
        for wrong in (url + "/nowhere", "http://curator:hunter2@127.0.0.1:1/", "https://curator:hunter2@" + server.url()[7:]):
            done = self.fetch(wrong, "--attempts", "1")
            self.assertNotEqual(done.returncode, 0)
            self.assertNotIn("hunter2", done.stderr)

    @unittest.skipUnless(shutil.which("openssl"), "openssl is not installed")
    def test_a_private_authority(self):
        certificate, key = self.certificate()
        self.publish(self.shop.old)
        server = RudeServer(self.site, lambda path, attempt: None, (certificate, key))
        self.addCleanup(server.stop)
        self.assert_fails(self.fetch(server.url()), 16, "fetch.tls", "--cacert")
        self.fetch_json(server.url(), "--cacert", certificate)
        for name in ("CURL_CA_BUNDLE", "SSL_CERT_FILE"):
            self.fetch_json(server.url(), store=self.folder / name,
                            env={"CURL_CA_BUNDLE": "", "SSL_CERT_FILE": "", name: str(certificate)})

    def test_garbage_for_ever_gives_up(self):
        done = self.fetch_from(lambda path, _: "garbage" if "objects" in path else None, "--attempts", "2")
        self.assert_fails(done, 16, "fetch.network", "differs from the published")
        self.assertFalse((pathlib.Path(self.store) / "museum.modar").exists())


if __name__ == "__main__":
    unittest.main()
