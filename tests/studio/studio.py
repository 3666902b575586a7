"""A studio and what a page asks of it, for the tests of this folder."""
import http.client
import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from programs import BIN, ProgramTest  # noqa: E402

# The program that is tried: another one answers the same, such as the npm package's.
PROGRAM = os.environ.get("MODAR_STUDIO_PROGRAM", str(BIN / "modar")).split()
NATIVE = "MODAR_STUDIO_PROGRAM" not in os.environ


class Answer:
    def __init__(self, response, body):
        self.status, self.headers, self.body = response.status, response.headers, body

    @property
    def json(self):
        return json.loads(self.body)


class Studio:
    """`modar studio FOLDER`, started; `edit` and the like answer the project as the page sees it."""

    def __init__(self, folder, *options, env=None):
        self.folder = pathlib.Path(folder)
        self.process = subprocess.Popen([*PROGRAM, "studio", folder, "--no-browser", *options], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, env={**os.environ, **(env or {})})
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise AssertionError(self.process.stderr.read())
        parts = urllib.parse.urlsplit(self.address)
        self.port, self.secret = parts.port, parts.path

    def ask(self, method, path, body=None, headers=None, whole=None):
        """whole: the path from the root, in place of one below the secret."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        connection.request(method, self.secret + path if whole is None else whole, body, headers or {})
        response = connection.getresponse()
        answer = Answer(response, response.read())
        connection.close()
        return answer

    def get(self, path):
        return self.ask("GET", path)

    def post(self, path, value):
        return self.ask("POST", path, json.dumps(value), {"Content-Type": "application/json"})

    def put(self, name, data):
        return self.ask("PUT", "api/files/" + urllib.parse.quote(name), data)

    def project(self):
        return self.get("api/project").json

    def edit(self, *edits, revision=None):
        return self.post("api/edit", {"revision": self.project()["revision"] if revision is None else revision, "edits": edits})

    def job(self, path, value, seconds=300):
        """Starts one and waits for the event that ends it: (name, data); all events before it."""
        events = Events(self)
        started = self.post(path, value)
        if started.status != 202:
            events.close()
            return None, started.json, []
        return events.until({"baked", "failed", "cancelled", "exported"}, seconds)

    def quit(self):
        self.post("api/quit", {})
        return self.wait()

    def wait(self):
        code = self.process.wait(60)
        self.error = self.process.stderr.read()
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
            self.wait()


class Events:
    """The server's events, read by a thread."""

    def __init__(self, studio):
        self.connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=60)
        self.connection.request("GET", studio.secret + "api/events")
        self.response = self.connection.getresponse()
        self.seen, self.changed = [], threading.Condition()
        threading.Thread(target=self.read, daemon=True).start()
        time.sleep(0.05)

    def read(self):
        name = None
        try:
            for line in self.response:
                line = line.decode().rstrip("\n")
                if line.startswith("event: "):
                    name = line[7:]
                if line.startswith("data: "):
                    with self.changed:
                        self.seen.append((name, json.loads(line[6:]), time.monotonic()))
                        self.changed.notify_all()
        except (OSError, ValueError, AttributeError, http.client.HTTPException):
            pass

    def until(self, names, seconds):
        end = time.monotonic() + seconds
        with self.changed:
            while True:
                for name, data, _ in self.seen:
                    if name in names:
                        return name, data, list(self.seen)
                if not self.changed.wait(max(0, end - time.monotonic())):
                    raise AssertionError(f"none of {names} in {seconds} s, but {self.seen}")

    def close(self):
        self.connection.close()


class StudioTest(ProgramTest):
    def studio(self, folder=None, *options, **others):
        studio = Studio(folder or self.folder, *options, **others)
        self.addCleanup(studio.end)
        return studio

    def good(self, answer):
        self.assertLess(answer.status, 300, answer.body[:2000])
        return answer.json
