"""What other sites, other users and damaged files may try: nothing is read, written or lost."""
import http.client
import io
import json
import os
import pathlib
import random
import signal
import socket
import stat
import struct
import subprocess
import time
import tomllib
import unittest
import zipfile

from studio import NATIVE, Studio, StudioTest
from programs import BIN, POTTERY, mount_fat, picture

MIB = 1 << 20


def zip_of(*members):
    """members: (name, data) or (ZipInfo, data)."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return out.getvalue()


class Gate(StudioTest):
    def setUp(self):
        super().setUp()
        picture(self.folder / "a.png")
        (self.folder / "modar.toml").write_text('[[pattern]]\nfile = "a.png"\n')
        self.running = self.studio()

    def test_answers_its_own_page_only(self):
        ours = {"Host": f"127.0.0.1:{self.running.port}"}
        json_type = {"Content-Type": "application/json"}
        secret = self.running.secret
        # (headers, path, status): another name that leads here, a forged Host, a foreign page, a frame of one, no secret.
        for headers, path, status in (({"Host": f"evil.example:{self.running.port}"}, secret, 403), ({"Host": "127.0.0.1"}, secret, 403),
                                      ({"Host": f"localhost.evil.example:{self.running.port}"}, secret, 403),
                                      ({**ours, "Origin": "http://evil.example"}, secret, 403), ({**ours, "Origin": "null"}, secret, 403),
                                      ({**ours, "Sec-Fetch-Site": "cross-site"}, secret, 403), (ours, "/", 403),
                                      (ours, "/api/project", 403), (ours, secret[:-2] + "/", 403), (ours, secret[:-2] + "a/", 403),
                                      (ours, secret + "api/project", 200), ({**ours, "Sec-Fetch-Site": "same-origin"}, secret + "api/project", 200)):
            self.assertEqual(self.running.ask("GET", "", headers=headers, whole=path).status, status, (headers, path))
        before = (self.folder / "modar.toml").read_bytes()
        body = json.dumps({"revision": self.running.project()["revision"],
                           "edits": [{"op": "set", "table": "project", "key": "name", "value": "evil"}]})
        # A form of another page has one of these types, and the Origin of its page.
        for kind in ("application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "text/plain"):
            self.assertGreaterEqual(self.running.ask("POST", "api/edit", body, {"Content-Type": kind}).status, 400)
        self.assertEqual(self.running.ask("POST", "api/edit", body, {**json_type, "Origin": "http://evil.example"}).status, 403)
        for method in ("OPTIONS", "PATCH", "TRACE"):
            self.assertIn(self.running.ask(method, "api/project").status, (400, 403, 404, 405))
        self.assertEqual((self.folder / "modar.toml").read_bytes(), before)
        headers = self.running.get("").headers
        self.assertIn("default-src 'self'", headers["Content-Security-Policy"])
        self.assertNotIn("unsafe-inline", headers["Content-Security-Policy"])
        self.assertEqual((headers["X-Content-Type-Options"], headers["Referrer-Policy"]), ("nosniff", "no-referrer"))
        self.assertIsNone(headers["Access-Control-Allow-Origin"])

    def test_listens_on_this_machine_alone(self):
        rows = [line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
        bound = {row[1].split(":")[0] for row in rows if row[3] == "0A" and int(row[1].split(":")[1], 16) == self.running.port}
        self.assertEqual(bound, {"0100007F"})

    def test_a_refused_body_is_no_request(self):
        """What follows a request in its connection is never read as a second one."""
        inner = f"GET {self.running.secret}api/project HTTP/1.1\r\nHost: 127.0.0.1:{self.running.port}\r\n\r\n".encode()
        with socket.create_connection(("127.0.0.1", self.running.port)) as connection:
            connection.sendall(f"POST / HTTP/1.1\r\nHost: 127.0.0.1:{self.running.port}\r\nContent-Length: {len(inner)}\r\n\r\n".encode() + inner)
            connection.settimeout(5)
            told = b""
            try:
                while got := connection.recv(65536):
                    told += got
            except (ConnectionResetError, TimeoutError):
                pass
        self.assertEqual(told.count(b"HTTP/1.1"), 1)
        self.assertIn(b"403", told.split(b"\r\n")[0])

    def test_names_lead_nowhere_else(self):
        outside = self.folder.parent / (self.folder.name + "-outside")
        outside.write_text("secret")
        self.addCleanup(outside.unlink)
        (self.folder / "link.png").symlink_to(outside)
        (self.folder / "away").symlink_to("/etc")
        for name in ("..%2f" + outside.name, "../" + outside.name, "%2e%2e/" + outside.name, "away/passwd", "link.png", "/etc/passwd",
                     "%2fetc%2fpasswd", ".modar/studio/address", "a.png%00.txt", "..\\" + outside.name, "a/../../" + outside.name):
            for verb in ("api/files/", "api/thumb/", "", "api/export/"):
                answer = self.running.get(verb + name)
                self.assertGreaterEqual(answer.status, 400, verb + name)
                self.assertNotIn(b"secret", answer.body)
                self.assertNotIn(b"root:", answer.body)
            answer = self.running.ask("PUT", "api/files/" + name, b"evil")
            if name != "link.png":  # this one gets the next free name
                self.assertGreaterEqual(answer.status, 400, name)
        self.assertEqual(outside.read_text(), "secret")
        self.assertEqual(self.running.put("modar.toml", b"x = 1").status, 422)
        # Names that pages and shells stumble over are names.
        for name in ("<script>alert(1)<\u200bscript>.png", "a'b\".png", "\U0001f3fa \u05db\u05d3.png", "[a]*?.png", "!b.png", "-rf.png"):
            self.assertEqual(self.good(self.running.put(name, (self.folder / "a.png").read_bytes() + name.encode()))["added"], [name])
        names = {one["file"] for one in self.running.project()["patterns"]}
        self.assertEqual(len(names), 8, names)  # with the link's, link-2.png
        self.assertEqual(self.running.project()["problems"], [])

    def test_what_models_name_outside_the_folder_is_not_read(self):
        """What such files say never shows, nor whether they are there: they are missing, and wanted next to the model."""
        outside = self.folder.parent / (self.folder.name + "-outside.mtl")
        outside.write_text("newmtl a\nmap_Kd the-secret.png\n")
        self.addCleanup(outside.unlink)
        (self.folder / "link.mtl").symlink_to(outside)
        faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"
        for i, name in enumerate((f"../{outside.name}", f"../../../../../../..{outside}", str(outside), "link.mtl", f"..\\{outside.name}")):
            for there in (outside.name, "none.mtl"):
                named = name.replace(outside.name, there)
                added = self.good(self.running.put(f"m{i}{there}.obj", f"mtllib {named}\n{faces}".encode()))
                self.assertEqual(added["missing"], [there if name != "link.mtl" else name], name)
        for i, key in enumerate(("images", "buffers")):
            added = self.good(self.running.put(f"g{i}.gltf", json.dumps({key: [{"uri": f"../{outside.name}"}]}).encode()))
            self.assertEqual(added["missing"], [outside.name], key)

    def test_archives_bring_files_and_nothing_else(self):
        link = zipfile.ZipInfo("link.obj")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        bomb = zip_of(("bomb.obj", b"\0" * (64 * MIB)))
        cases = {"traversal": zip_of(("../evil.obj", b"x")), "absolute": zip_of(("/tmp/evil.obj", b"x")), "deep": zip_of(("a/../../evil.obj", b"x")),
                 "link": zip_of((link, b"/etc/passwd")), "bomb": bomb, "damaged": zip_of(("a.obj", bytes(range(256)) * 400))[:-300],
                 "many": zip_of(*((f"{i}.obj", b"") for i in range(2001))), "cut": b"PK\3\4" + b"\0" * 40,
                 "crc": zip_of(("a.obj", bytes(range(256)) * 4)).replace(struct.pack("<I", zipfile.crc32(bytes(range(256)) * 4)), b"\1\2\3\4")}
        before = sorted(path.name for path in self.folder.rglob("*"))
        for name, data in cases.items():
            answer = self.running.put(f"{name}.zip", data)
            self.assertEqual(answer.status, 422, (name, answer.body))
            self.assertTrue(answer.json["error"] and answer.json["cure"], name)
        self.assertEqual(sorted(path.name for path in self.folder.rglob("*")), before)
        good = zip_of(("pot/pottery.obj", POTTERY.read_bytes()), ("pot/pottery.mtl", POTTERY.with_suffix(".mtl").read_bytes()),
                      ("__MACOSX/pot/._pottery.obj", b"x"), ("pot/.DS_Store", b"x"))
        added = self.good(self.running.put("pot.zip", good))
        self.assertEqual((added["kind"], added["added"], added["missing"]), ("archive", ["pot/pottery.obj", "pot/pottery.mtl"], ["pot/pottery.png"]))
        self.assertEqual((self.folder / "pot" / "pottery.obj").read_bytes(), POTTERY.read_bytes())
        texture = self.good(self.running.put("pot/pottery.png", POTTERY.with_suffix(".png").read_bytes()))
        self.assertEqual((texture["missing"], [one["file"] for one in texture["project"]["patterns"]]), ([], ["a.png"]))
        self.assertEqual([one["file"] for one in texture["project"]["models"]], ["pot/pottery.obj"])

    def test_a_file_that_a_model_misses_goes_next_to_the_model(self):
        self.good(self.running.put("pot.zip", zip_of(("pottery.obj", POTTERY.read_bytes()))))
        for name, missing in (("pottery.mtl", ["pot/pottery.png"]), ("pottery.png", [])):
            added = self.good(self.running.put(name, POTTERY.with_name(name).read_bytes()))
            self.assertEqual(added["added"], [f"pot/{name}"])
            self.assertEqual([one["missing"] for one in added["project"]["models"]], [missing])

    def test_a_texture_that_came_first_is_no_picture(self):
        project = self.good(self.running.put("pottery.png", POTTERY.with_suffix(".png").read_bytes()))["project"]
        self.assertEqual(len(project["patterns"]), 2)
        self.running.put("pottery.mtl", POTTERY.with_suffix(".mtl").read_bytes())
        project = self.good(self.running.put("pottery.obj", POTTERY.read_bytes()))["project"]
        self.assertEqual([one["name"] for one in project["patterns"]], ["a"])

    def test_originals_are_never_changed(self):
        first = (self.folder / "a.png").read_bytes()
        self.assertEqual(self.good(self.running.put("a.png", first))["added"], ["a.png"])
        picture(self.folder / ".other", mirrored=True)
        other = (self.folder / ".other").read_bytes()
        self.assertEqual(self.good(self.running.put("a.png", other))["added"], ["a-2.png"])
        self.assertEqual(((self.folder / "a.png").read_bytes(), (self.folder / "a-2.png").read_bytes()), (first, other))

    def test_huge_files_are_refused_in_bounded_memory(self):
        """Of 5 GB, said at once or only sent: the server's memory stays."""
        connection = http.client.HTTPConnection("127.0.0.1", self.running.port, timeout=60)
        connection.putrequest("PUT", self.running.secret + "api/files/huge.obj")
        connection.putheader("Content-Length", str(5 << 30))
        connection.endheaders()
        self.assertEqual(connection.getresponse().status, 413)
        connection.close()

        def peak():
            status = pathlib.Path(f"/proc/{self.running.process.pid}/status").read_text()
            return int(status.partition("VmHWM:")[2].split()[0])
        before = peak()
        answer = self.running.put("large.obj", b"# a comment\n" * (48 * MIB // 12) + b"v 0 0 0\n")
        self.assertLess(answer.status, 300, answer.body[:300])
        self.assertLess(peak() - before, 40 * 1024)
        self.assertGreaterEqual(self.running.ask("POST", "api/edit", b"x" * (5 * MIB), {"Content-Type": "application/json"}).status, 400)

    def test_a_huge_file_beside_it_is_refused_soon(self):
        """5 GB, of which the disk has a few bytes, as a copy that broke off leaves them: zeros, or a line of its own and zeros."""
        table = '[[model]]\nfile = "huge.obj"\n\n[[scene]]\npattern = "a"\nmodel = "huge"\n'
        (self.folder / "modar.toml").write_text('[[pattern]]\nfile = "a.png"\n\n' + table)
        for head in (b"", b"v 0 0 0\n"):
            with open(self.folder / "huge.obj", "wb") as huge:
                huge.write(head)
                huge.truncate(5 << 30)
            start = time.monotonic()
            name, told, _ = self.running.job("api/bake", {})
            self.assertEqual((name, told["errors"][0]["code"], told["errors"][0]["where"]), ("failed", "obj.not-text", "huge.obj"), told)
            print(f"5 GB: {time.monotonic() - start:.1f} s")
            self.assertLess(time.monotonic() - start, 20)  # however loaded the machine is; to read them takes a minute then

    def test_slow_connections_keep_nobody_waiting(self):
        """Many that send nothing, half a head, a body in drops, with and without the secret: the page is answered at once, and they are closed."""
        head = f"PUT {self.running.secret}api/files/slow.obj HTTP/1.1\r\nHost: 127.0.0.1:{self.running.port}\r\nContent-Length: 1000000\r\n\r\n"
        begun = [b"", b"G", head[:60].encode(), head.encode(), head.encode() + b"#" * 70000, head.replace(self.running.secret, "/").encode() + b"#" * 70000]
        slow = []
        for i in range(240):
            connection = socket.create_connection(("127.0.0.1", self.running.port))
            try:
                connection.sendall(begun[i % len(begun)])
            except (ConnectionResetError, BrokenPipeError):
                pass
            slow.append(connection)
        start = time.monotonic()
        for _ in range(5):
            self.assertEqual(self.running.get("api/project").status, 200)
            for connection in slow:
                try:
                    connection.send(b"#")
                except OSError:
                    pass
            self.assertLess(time.monotonic() - start, 5)
        self.assertEqual(self.good(self.running.post("api/edit", {"revision": self.running.project()["revision"], "edits": []}))["problems"], [])
        for connection in slow[-len(begun):]:  # the latest are not closed for those after them
            connection.settimeout(20)
            try:
                while connection.recv(65536):
                    pass
            except ConnectionResetError:
                pass
        self.assertLess(time.monotonic() - start, 20)
        for connection in slow:
            connection.close()

    def test_many_connections_and_listeners_are_bounded(self):
        silent = [socket.create_connection(("127.0.0.1", self.running.port)) for _ in range(12)]
        self.assertEqual(self.running.get("api/project").status, 200)
        for connection in silent:
            connection.close()
        listeners = []
        for _ in range(9):
            connection = http.client.HTTPConnection("127.0.0.1", self.running.port, timeout=60)
            connection.request("GET", self.running.secret + "api/events")
            listeners.append((connection, connection.getresponse()))
        self.assertEqual([response.status for _, response in listeners], [200] * 8 + [503])
        self.assertEqual(self.running.get("api/project").status, 200)
        for connection, _ in listeners:
            connection.close()


class Process(StudioTest):
    def test_one_studio_serves_a_folder(self):
        first = self.studio()
        second = Studio(self.folder)  # shows the first one's page and ends
        self.assertEqual((second.wait(), second.address), (0, first.address))
        self.assertIn("it was open already", second.error)
        address = self.folder / ".modar" / "studio" / "address"
        self.assertEqual((address.read_text(), stat.S_IMODE(address.stat().st_mode)), (first.address, 0o600))
        self.assertEqual(first.quit(), 0)
        self.assertEqual(self.studio().quit(), 0)

    def test_signals_end_it_and_what_it_started(self):
        for sent in (signal.SIGINT, signal.SIGTERM):
            studio = self.studio()
            studio.process.send_signal(sent)
            self.assertEqual(studio.wait(), 0 if NATIVE else -sent)

    def test_a_disk_without_hard_links_permissions_and_all_names(self):
        """A stick: files and archives arrive, the same name twice keeps both, and a name that FAT refuses is reported as such."""
        picture(self.folder / "a.png")
        picture(self.folder / "b.png", mirrored=True)
        first, second = ((self.folder / name).read_bytes() for name in ("a.png", "b.png"))
        stick = mount_fat(self) / "museum"
        studio = self.studio(stick)
        for data, name in ((first, "a.png"), (first, "a.png"), (second, "a-2.png")):
            self.assertEqual(self.good(studio.put("a.png", data))["added"], [name])
        archive = zip_of(("pottery.obj", POTTERY.read_bytes()), ("pottery.mtl", POTTERY.with_suffix(".mtl").read_bytes()))
        self.assertEqual(self.good(studio.put("pot.zip", archive))["added"], ["pot/pottery.obj", "pot/pottery.mtl"])
        self.assertEqual([(stick / name).read_bytes() for name in ("a.png", "a-2.png", "pot/pottery.obj")], [first, second, POTTERY.read_bytes()])
        refused = studio.put("what?.png", first)
        if not (stick / "what?.png").exists():  # not every driver refuses it
            self.assertGreaterEqual(refused.status, 400)
        self.good(studio.edit({"op": "set", "table": "bake", "key": "loop-views", "value": 8},
                              {"op": "add", "table": "scene", "value": {"pattern": "a", "model": "pottery"}}))
        self.assertEqual(studio.job("api/bake", {})[0], "baked")
        self.assertEqual(studio.job("api/export", {"kind": "release"})[0], "exported")
        self.assertEqual(studio.quit(), 0)

    def test_killed_at_any_time_it_loses_nothing(self):
        """Studios die while they save: the file is what it was before an edit or after it. MODAR_KILLS=100 kills as many."""
        picture(self.folder / "a.png")
        toml = self.folder / "modar.toml"
        toml.write_text('# mine\n[[pattern]]\nfile = "a.png" # mine, too\n')
        rng = random.Random(5)
        last = 0
        for _ in range(int(os.environ.get("MODAR_KILLS", "12"))):
            studio = self.studio()
            deadline = time.monotonic() + rng.uniform(0.02, 0.25)
            number = last
            while time.monotonic() < deadline:
                number += 1
                answer = studio.edit({"op": "set", "table": "pattern", "index": 0, "key": "width", "value": f"{number}mm"})
                self.assertEqual(answer.status, 200)
            revision = studio.project()["revision"]
            body = json.dumps({"revision": revision, "edits": [{"op": "set", "table": "pattern", "index": 0, "key": "width", "value": f"{number + 1}mm"}]})
            connection = http.client.HTTPConnection("127.0.0.1", studio.port)
            connection.request("POST", studio.secret + "api/edit", body, {"Content-Type": "application/json"})
            time.sleep(rng.uniform(0, 0.006))
            studio.end()
            connection.close()
            text = toml.read_text()
            read = tomllib.loads(text)["pattern"][0]
            self.assertIn(int(read.get("width", "0mm")[:-2]), (number, number + 1))
            self.assertTrue(text.startswith('# mine\n[[pattern]]\nfile = "a.png" # mine, too\n'))
            last = int(read.get("width", "0mm")[:-2])
        self.studio().quit()
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), [".modar", "a.png", "modar.toml"])

    @unittest.skipUnless(os.geteuid() == 0, "needs root to mount a small disk")
    def test_a_full_disk_is_said_and_harms_nothing(self):
        small = self.folder / "small"
        small.mkdir()
        picture(self.folder / "a.png")
        (self.folder / "modar.toml").write_text('[[pattern]]\nfile = "a.png"\n')
        script = "mount -t tmpfs -o size=1m tmpfs {0}/small && cp {0}/a.png {0}/modar.toml {0}/small && exec {1} studio {0}/small --no-browser".format(
            self.folder, BIN / "modar")
        process = subprocess.Popen(["unshare", "-m", "sh", "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        address = process.stdout.readline().strip()
        if not address:
            self.skipTest("mounts are not allowed here: " + process.stderr.read())
        studio = Studio.__new__(Studio)
        studio.process, studio.port, studio.secret = process, int(address.split(":")[2].split("/")[0]), "/" + address.split("/", 3)[3]
        answer = studio.put("large.obj", b"v 0 0 0\n" * (3 * MIB // 8))
        self.assertEqual((answer.status, answer.json["code"]), (507, "io.write"))
        self.assertIn("room", answer.json["cure"])
        # Filled to the last byte, an edit fails and the file stays.
        root = f"/proc/{process.pid}/root{small}"
        with open(root + "/fill", "wb") as fill:
            try:
                while fill.write(b"\0" * 65536):
                    fill.flush()
            except OSError:
                pass
        before = pathlib.Path(root, "modar.toml").read_bytes()
        answer = studio.edit({"op": "set", "table": "pattern", "index": 0, "key": "name", "value": "x" * 6000})
        self.assertGreaterEqual(answer.status, 400)
        self.assertEqual(pathlib.Path(root, "modar.toml").read_bytes(), before)
        os.unlink(root + "/fill")
        self.assertEqual(studio.edit({"op": "set", "table": "pattern", "index": 0, "key": "name", "value": "x"}).status, 200)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 0)
        process.stdout.close()
        process.stderr.close()


if __name__ == "__main__":
    unittest.main()
