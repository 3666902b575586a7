"""Chromium without a screen, driven by its DevTools protocol over a pair of pipes, and a server that can go away."""
import base64
import fcntl
import functools
import http.server
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import threading
import time

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
WEBKIT = next(iter(sorted(pathlib.Path("/usr/lib").glob("*/webkit2gtk-4*/MiniBrowser"))), None)
XVFB = shutil.which("Xvfb")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# WebGL by SwiftShader: the same pixels on every machine. Pages are painted without it, in two thirds of the CPU time.
FLAGS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--enable-unsafe-swiftshader",
         "--use-fake-device-for-media-stream", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-default-apps", "--disable-sync", "--hide-scrollbars",
         "--force-color-profile=srgb", "--remote-debugging-pipe"]
# A new canvas on the page, for View.create().
CANVAS = """const canvas = (width, height) => {
    const made = document.createElement('canvas');
    Object.assign(made.style, { position: 'absolute', width: `${width}px`, height: `${height}px` });
    document.body.append(made);
    return made;
  };"""
# An element of a page, or of the viewer in it.
PART = """globalThis.part = (id) => document.getElementById(id)
  ?? document.querySelector('modar-viewer').shadowRoot.getElementById(id)"""

# The service worker has the visit's downloads, and a bundle.
KEPT = """navigator.serviceWorker.ready.then(({ active }) => active.state === 'activated' && caches.keys())
  .then((names) => names && !names.some((name) => name.endsWith(' downloads')) && caches.match('bundles/demo.packed', { ignoreSearch: true }))
  .then(Boolean)"""
# Bytes of answers that the page's process keeps for whoever debugs it: as many as it would hold itself, without this.
NOTHING_KEPT = {"maxTotalBufferSize": 1, "maxResourceBufferSize": 1}


class Browser:
    """One browser with one page. Collects what a visitor's console and network would show."""

    def __init__(self, folder, video, size=(640, 480), extra=()):
        commands_out, commands_in = os.pipe()
        answers_out, answers_in = os.pipe()

        def wire():  # the protocol's ends are the descriptors 3 and 4; copies are out of their way
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (commands_out, answers_in)]
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        words = [CHROMIUM, *FLAGS, f"--user-data-dir={folder}", f"--window-size={size[0]},{size[1]}",
                 f"--use-file-for-fake-video-capture={video}", *extra, "about:blank"]
        self.process = subprocess.Popen(words, preexec_fn=wire, close_fds=False, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(commands_out)
        os.close(answers_in)
        self.commands = os.fdopen(commands_in, "wb", buffering=0)
        self.answers = os.fdopen(answers_out, "rb", buffering=0)
        self.rest, self.calls, self.session = b"", 0, None
        self.errors, self.told, self.requests = [], [], []
        self.line = None  # of throttle()
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Accessibility"):
            self.call(domain + ".enable")
        self.call("Network.enable", **NOTHING_KEPT)
        self.call("Page.addScriptToEvaluateOnNewDocument", source=PART)

    def _message(self):
        while b"\0" not in self.rest:
            part = self.answers.read(1 << 20)
            if not part:
                raise RuntimeError("the browser has ended")
            self.rest += part
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def _note(self, message):
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled":
            told = self.errors if params["type"] in ("error", "assert", "warning") else self.told
            told.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"] + " " + params["entry"].get("url", ""))
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Target.attachedToTarget" and self.line:  # a worker, which waits
            for command, words in (("Network.enable", NOTHING_KEPT), ("Network.emulateNetworkConditions", self.line), ("Runtime.runIfWaitingForDebugger", {})):
                self._send(params["sessionId"], command, words)

    def _send(self, session, method, params):
        self.calls += 1
        message = {"id": self.calls, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        self.commands.write(json.dumps(message).encode() + b"\0")
        return self.calls

    def call(self, method, **params):
        own = self._send(self.session, method, params)
        while True:
            answer = self._message()
            if answer.get("id") == own:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self._note(answer)

    def run(self, script):
        """The value of an expression, awaited, as by a visitor's own click."""
        done = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
        if "exceptionDetails" in done:
            details = done["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return done["result"].get("value")

    def wait(self, condition, what, seconds=90):
        """Until the expression holds. The limit is for a page that hangs, on a machine however loaded."""
        end = time.monotonic() + seconds
        while not self.run(condition):
            if time.monotonic() > end:
                raise AssertionError(f"{what} did not happen; console: {self.errors}")
            time.sleep(0.1)

    def open(self, url):
        self.call("Page.navigate", url=url)
        self.wait(f"location.href.startsWith({url!r}) && document.readyState === 'complete'", f"loading {url}")

    def resize(self, width, height, scale=1, mobile=False, **more):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile, **more)

    def camera(self, setting):
        """"granted" or "denied"."""
        session, self.session = self.session, None
        self.call("Browser.setPermission", permission={"name": "camera"}, setting=setting)
        self.session = session

    def throttle(self, bytes_a_second, latency_ms):
        """The page's line, and that of its workers, from now on."""
        self.line = {"offline": False, "latency": latency_ms, "downloadThroughput": bytes_a_second, "uploadThroughput": bytes_a_second}
        self.call("Network.emulateNetworkConditions", **self.line)
        self.call("Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=True, flatten=True)

    def screenshot(self, path):
        pathlib.Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (RuntimeError, OSError):
            pass
        self.commands.close()
        self.answers.close()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def engines(test, size="1280x900"):
    """(name, start) of each browser that is installed; start(url) answers its process, the first of a group. On a screen of that size,
    without which Firefox draws no WebGL."""
    def starter(words, **environment):
        def start(url):
            home = tempfile.mkdtemp(prefix="modar-home-", dir=test.folder)  # which every engine writes to
            own = {"HOME": home, "XDG_DATA_HOME": home + "/data", "XDG_CACHE_HOME": home + "/cache"}
            return subprocess.Popen([*words, url], env={**os.environ, **own, **environment}, stdout=subprocess.DEVNULL,
                                    stderr=subprocess.DEVNULL, start_new_session=True)
        return start

    if CHROMIUM:
        flags = [flag for flag in FLAGS if "pipe" not in flag]
        yield "chromium", starter([CHROMIUM, *flags, f"--user-data-dir={test.folder / 'profile-chromium'}", "--window-size=" + size.replace("x", ",")])
    if not XVFB or not (FIREFOX or WEBKIT):
        return
    display = f":{40 + os.getpid() % 50}"
    screen = subprocess.Popen([XVFB, display, "-screen", "0", size + "x24"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    test.addCleanup(screen.wait)
    test.addCleanup(screen.kill)
    time.sleep(1)
    if FIREFOX:
        (test.folder / "profile-firefox").mkdir()
        yield "firefox", starter([FIREFOX, "--no-remote", "--profile", test.folder / "profile-firefox"], DISPLAY=display)
    if WEBKIT:
        yield "webkit", starter([WEBKIT], DISPLAY=display, WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS="1")


def axe_core(folder):
    """The file of axe-core, by npm; None where there is no npm or network."""
    npm = shutil.which("npm")
    if npm is None:
        return None
    (folder / "package.json").write_text('{"private": true}')
    done = subprocess.run([npm, "install", "--no-audit", "--no-fund", "--loglevel=error", "axe-core@4"], cwd=folder, capture_output=True)
    return folder / "node_modules" / "axe-core" / "axe.min.js" if done.returncode == 0 else None


class Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".js": "text/javascript",
                      ".wasm": "application/wasm", ".modar": "application/octet-stream"}

    def log_message(self, *_):
        pass


class Reports(Quiet):
    """Takes what the page posts as JSON."""
    def do_POST(self):
        self.server.told = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        self.server.done.set()


def report_of(site, start, page="", seconds=240):
    """What a page of that folder posts in a browser of engines()."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Reports, directory=str(site)))
    server.done = threading.Event()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    process = start(f"http://localhost:{server.server_port}/{page}")
    try:
        if not server.done.wait(seconds):
            raise AssertionError("the page reported nothing")
    finally:
        os.killpg(process.pid, 9)
        process.wait()
        server.shutdown()
        server.server_close()
    return server.told


class Counted(Quiet):
    def log_request(self, code="-", size="-"):
        self.server.answered.append((self.path, int(code)))


class Server:
    """self.http.answered: (path, status) of each request."""

    def __init__(self, folder, handler=Counted):
        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(handler, directory=str(folder)))
        self.http.answered = []
        self.url = f"http://localhost:{self.http.server_port}/"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def close(self):
        self.http.shutdown()
        self.http.server_close()
