"""Firefox on a screen that nobody sees, driven by Marionette, its own protocol, with a finger."""
import base64
import json
import os
import pathlib
import socket
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "web"))
from browser import FIREFOX, XVFB  # noqa: E402


class Fox:
    def __init__(self, folder, size=(1024, 768)):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        folder.mkdir()
        (folder / "user.js").write_text(f'user_pref("marionette.port", {port});\nuser_pref("dom.w3c_touch_events.enabled", 1);\n')
        read, write = os.pipe()
        self.screen = subprocess.Popen([XVFB, "-displayfd", str(write), "-screen", "0", f"{size[0]}x{size[1] + 100}x24"], pass_fds=[write],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as end:
            display = ":" + end.readline().strip()
        self.process = subprocess.Popen([FIREFOX, "--no-remote", "--profile", folder, "--marionette", f"--width={size[0]}"],
                                        env={**os.environ, "DISPLAY": display, "HOME": str(folder)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.wire, self.rest, self.calls = None, b"", 0
        try:
            self._begin(port, size)
        except BaseException:  # nobody else knows of the processes yet
            self.close()
            raise

    def _begin(self, port, size):
        self.wire = self._connect(port)
        self._message()  # who it is
        self.call("WebDriver:NewSession", capabilities={"alwaysMatch": {}})
        self.call("WebDriver:SetTimeouts", script=90_000)
        inner = self.run("[innerWidth, innerHeight, outerWidth, outerHeight]")
        self.call("WebDriver:SetWindowRect", x=0, y=0, width=size[0] + inner[2] - inner[0], height=size[1] + inner[3] - inner[1])

    def _connect(self, port):
        end = time.monotonic() + 60
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=120)
            except OSError:
                if time.monotonic() > end or self.process.poll() is not None:
                    raise
                time.sleep(0.2)

    def _bytes(self, done):
        """Up to where done() says that the message ends, which answers -1 until then."""
        while (end := done(self.rest)) < 0:
            part = self.wire.recv(1 << 20)
            if not part:
                raise RuntimeError("Firefox has ended")
            self.rest += part
        taken, self.rest = self.rest[:end], self.rest[end:]
        return taken

    def _message(self):
        size = int(self._bytes(lambda rest: rest.find(b":")))
        return json.loads(self._bytes(lambda rest: size + 1 if len(rest) > size else -1)[1:])

    def call(self, method, **params):
        self.calls += 1
        text = json.dumps([0, self.calls, method, params]).encode()
        self.wire.sendall(b"%d:%s" % (len(text), text))
        _, _, error, result = self._message()
        if error:
            raise RuntimeError(f"{method}: {error['message']}")
        return result

    def run(self, script):
        """The value of an expression, awaited."""
        return self.call("WebDriver:ExecuteAsyncScript", script=f"Promise.resolve({script}).then(arguments[0])", args=[])["value"]

    def wait(self, condition, what, seconds=90):
        end = time.monotonic() + seconds
        while not self.run(f"!!({condition})"):
            if time.monotonic() > end:
                raise AssertionError(f"{what} did not happen")
            time.sleep(0.1)

    def open(self, url):
        self.call("WebDriver:Navigate", url=url)

    def place(self, selector):
        """The middle of an element, scrolled into sight."""
        self.wait(f"document.querySelector({json.dumps(selector)})", selector)
        return self.run(f"""((e) => {{ e.scrollIntoView({{ block: 'nearest' }}); const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})
          (document.querySelector({json.dumps(selector)}))""")

    def slide(self, start, path):
        """A finger, from a place over others."""
        moves = [{"type": "pointerMove", "x": round(x), "y": round(y), "duration": 30} for x, y in path]
        self.call("WebDriver:PerformActions", actions=[{"type": "pointer", "id": "finger", "parameters": {"pointerType": "touch"}, "actions": [
            {"type": "pointerMove", "x": round(start[0]), "y": round(start[1]), "duration": 0}, {"type": "pointerDown", "button": 0}, *moves,
            {"type": "pointerUp", "button": 0}]}])

    def tap(self, selector):
        self.slide(self.place(selector), [])

    def screenshot(self, path):
        pathlib.Path(path).write_bytes(base64.b64decode(self.call("WebDriver:TakeScreenshot", full=False)["value"]))

    def close(self):
        for process in (self.process, self.screen):
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if self.wire:
            self.wire.close()
