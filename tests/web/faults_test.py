"""The page on hosts and networks that fail: each visit ends with content or a sentence, each sentence has a retry that works, and no
failure outlasts its cause. download_test.mjs has each request with each fault; this is the whole page with some of them. Then the
element in pages of other sites: from another origin, under Permissions-Policy, under a Content-Security-Policy."""
import functools
import http.server
import json
import pathlib
import shutil
import socket
import struct
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from browser import KEPT, Browser, Quiet  # noqa: E402
from programs import COVER, POTTERY, QUICK, ROOT, ProgramTest  # noqa: E402

PAGE = ROOT / "build" / "web" / "web"
LOGIN = b"<!doctype html><title>Hotel</title><p>Log in"
# Ten times as fast: the awaited state is the same.
HASTE = "globalThis.setTimeout = ((wait) => (call, ms = 0, ...more) => wait(call, ms / 10, ...more))(setTimeout)"
# 'around', 'sentence: ...' or '' while neither is there; presses the button that leads to content.
OUTCOME = """(() => {
  const seen = (element) => element?.checkVisibility({ visibilityProperty: true }) ?? false;
  if (!document.getElementById('viewer')) return document.title === 'Hotel' || location.href.startsWith('chrome-error') ? 'sentence: not ours' : '';
  if (seen(document.getElementById('unloaded'))) {
    return 'sentence: ' + [...document.querySelectorAll('#unloaded a')].filter(seen).map(({ textContent }) => textContent).join();
  }
  const viewer = document.getElementById('viewer');
  if (!viewer.shadowRoot) return '';
  if (part('problem').open) return `sentence: ${part('problem-title').textContent}. ${part('problem-cure').textContent}`;
  if (viewer.state === 'around' && part('ground').complete) return 'around';
  if (viewer.state === 'start' && !part('look').disabled && part('look').textContent) document.getElementById('look').click();
  return '';
})()"""
PROBLEM = "document.getElementById('viewer')?.shadowRoot?.getElementById('problem').open"
RETRY = f"({PROBLEM} ? part('again') : document.querySelector('#unloaded a:not([hidden])')).click()"
# A device that a page of November 2026 has locked: its first request failed, and a part without bytes was stored.
LOCKED = """(async () => {
  const { bundles: [{ file }] } = await (await fetch('site.json')).json();
  const cache = await caches.open(`modar ${location.href.split('?')[0]} downloads`);
  await cache.put(`${file}&part=0`, new Response(new Uint8Array()));
})()"""


class Failing(Quiet):
    """server.fault: {what an address contains: fault}. server.gone: there is no server."""

    def do_GET(self):
        self.server.asked.append(self.path)
        fault = next((fault for part, fault in self.server.fault.items() if part in self.path), None)
        if self.server.gone or fault == "reset":
            return self.reset()
        if isinstance(fault, int) and 400 <= fault < 600:
            return self.send_error(fault)
        if fault == "login":
            return self.answer(200, LOGIN, {"Content-Type": "text/html"})
        if fault == "stall":
            self.server.over.wait(60)
            return self.reset()
        body = pathlib.Path(self.translate_path(self.path)).read_bytes() if fault or ".packed" in self.path else None
        if body is None:
            return super().do_GET()
        first, _, last = self.headers.get("Range", "bytes=0-").removeprefix("bytes=").partition("-")
        at, end = int(first), min(int(last or len(body) - 1), len(body) - 1) + 1
        headers = {"Content-Type": self.guess_type(self.path.split("?")[0]), "Content-Range": f"bytes {at}-{end - 1}/{len(body)}"}
        if fault == "other range":
            return self.answer(206, body[:end - at], {**headers, "Content-Range": f"bytes 0-{end - at - 1}/{len(body)}"})
        if fault == "other bytes":
            return self.answer(206, bytes(end - at), headers)
        if fault == "whole":
            return self.answer(200, body, {})
        if fault == "empty":
            return self.answer(200, b"", {})
        cut = int(fault.removeprefix("reset at ")) if fault else None
        return self.answer(206 if "Range" in self.headers else 200, body[at:end], headers, cut)

    def answer(self, status, body, headers, cut=None):
        self.send_response(status)
        for name, value in {"Content-Length": len(body), **headers}.items():
            if name != "Content-Range" or status == 206:
                self.send_header(name, str(value))
        self.end_headers()
        try:
            self.wfile.write(body[:cut])
            if cut is not None and cut < len(body):
                self.reset()
        except OSError:
            pass

    def reset(self):
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.wfile.flush()
        self.close_connection = True
        self.connection.close()
        self.wfile = self.rfile = open("/dev/null", "r+b", buffering=0)  # what the handler still flushes

    def end_headers(self):
        for name, value in self.server.headers.items():
            self.send_header(name, value)
        super().end_headers()


class Host(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, folder, fault=None, headers=None):
        super().__init__(("127.0.0.1", 0), functools.partial(Failing, directory=str(folder)))
        self.fault, self.gone, self.over, self.asked, self.headers = fault or {}, False, threading.Event(), [], headers or {}
        self.url = f"http://localhost:{self.server_port}/"
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def handle_error(self, *_):
        pass

    def close(self):
        self.over.set()
        self.shutdown()
        self.server_close()


class InBrowser(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.base = pathlib.Path(tempfile.mkdtemp(prefix="modar-faults-"))
        cls.addClassCleanup(shutil.rmtree, cls.base, ignore_errors=True)
        test = cls("run_program")
        test.folder = cls.base
        cls.site, bundle = cls.base / "site", cls.base / "demo.modar"
        for words in (["bake", "--model", POTTERY, "--pattern", COVER, "--scene", "cover=pottery,scale=0.5", "-o", bundle, "--quiet", *QUICK],
                      ["web", bundle, "-o", cls.site, "--quiet"]):
            done = test.modar(*words)
            if done.returncode != 0:
                raise AssertionError(done.stderr)
        camera = cls.base / "camera.y4m"
        camera.write_bytes(b"YUV4MPEG2 W320 H240 F30:1 Ip C420jpeg\n" + 2 * (b"FRAME\n" + bytes([128]) * (320 * 240 * 3 // 2)))
        cls.browser = Browser(cls.base / "profile", camera)
        cls.addClassCleanup(cls.browser.close)
        cls.browser.camera("granted")
        cls.browser.call("Page.addScriptToEvaluateOnNewDocument", source=HASTE)
        cls.browser.call("Animation.enable")
        cls.browser.call("Animation.setPlaybackRate", playbackRate=10)

    def host(self, *words, **more):
        host = Host(*words, **more)
        self.addCleanup(host.close)
        return host


class Faults(InBrowser):
    # What a page asks for: (address, faults, what follows).
    CELLS = [
        ("app.js", 404, "same"), ("app.js", "stall", "next"), ("engine.js", "reset", "next"), ("style.css", 503, "next"),
        ("site.json", 503, "same"), ("site.json", "login", "next"), ("site.json", "stall", "same"), ("words/", 404, "same"), ("words/", "reset", "next"),
        ("engine-simd.js", 503, "same"), ("engine-simd.js", "login", "next"), ("engine-simd.wasm", 404, "same"), ("engine-simd.wasm", "reset at 70000", "next"),
        ("engine-simd.wasm", "stall", "same"), ("modar-worker", 503, "same"), ("modar-worker", "stall", "next"),
        ("patterns/", 404, "next"), ("sw.js", "login", "next"),
        ("bundles/", 404, "same"), ("bundles/", 403, "next"), ("bundles/", 503, "offline"), ("bundles/", "reset", "next"),
        ("bundles/", "reset at 0", "offline"), ("bundles/", "reset at 1", "same"), ("bundles/", "reset at 30000", "next"), ("bundles/", "reset at 1000000", "next"),
        ("bundles/", "other range", "next"), ("bundles/", "other bytes", "next"), ("bundles/", "whole", "offline"), ("bundles/", "empty", "next"),
        ("bundles/", "login", "same"), ("bundles/", "stall", "next"),
    ]

    def outcome(self, url, what):
        """A visit's: 'around' or a sentence."""
        if url:
            self.browser.call("Page.navigate", url=url)
        end, before = time.monotonic() + 40, ""
        while time.monotonic() < end:
            try:
                told = self.browser.run(OUTCOME)
            except RuntimeError:
                told = ""  # between two pages
            if told and told == before:  # a page without its style is not painted
                return told
            before = told
            time.sleep(0.3)
        self.fail(f"{what}: neither content nor a sentence; console: {self.browser.errors[-3:]}")

    def test_each_failure_is_told_and_ends_with_its_cause(self):
        for number, (address, fault, then) in enumerate(self.CELLS):
            what = f"{address} {fault}, {then}"
            with self.subTest(what):
                host = self.host(self.site, fault={address: fault})
                self.browser.errors.clear()
                told = self.outcome(host.url, what)
                print(f"{what}: {told}")
                if address == "bundles/" and fault == "login":
                    self.assertIn("log in", told)
                host.fault = {}
                host.over.set()
                if then == "same" and told != "around":
                    self.browser.run(RETRY)
                    self.assertEqual(self.outcome(None, f"{what}, the retry"), "around")
                elif then == "offline":
                    self.browser.wait("navigator.serviceWorker.ready.then(({ active }) => active.state === 'activated')", "the service worker")
                    host.gone = True
                    told = self.outcome(f"{host.url}?offline", f"{what}, offline")
                    print(f"  offline: {told}")
                    host.gone = False
                if then != "same":
                    self.assertEqual(self.outcome(f"{host.url}?{number}", f"{what}, the next visit"), "around")
                self.browser.open("about:blank")

    def test_a_device_that_an_older_page_has_locked_recovers(self):
        host = self.host(self.site)
        self.browser.open(f"{host.url}site.json")
        self.browser.run(LOCKED.replace("location.href.split('?')[0]", json.dumps(host.url)))
        self.assertEqual(self.outcome(host.url, "a locked device"), "around")
        self.browser.wait(KEPT, "the kept bundles")
        host.gone = True
        self.assertEqual(self.outcome(f"{host.url}?offline", "offline"), "around")

    def test_a_full_disk_costs_offline_visits_only(self):
        host = self.host(self.site)
        self.browser.call("Storage.overrideQuotaForOrigin", origin=host.url.rstrip("/"), quotaSize=50_000)
        self.assertEqual(self.outcome(host.url, "a full disk"), "around")
        self.assertEqual(self.outcome(f"{host.url}?again", "a full disk"), "around")
        host.gone = True
        self.outcome(f"{host.url}?offline", "a full disk, offline")
        host.gone = False
        self.browser.call("Storage.overrideQuotaForOrigin", origin=host.url.rstrip("/"))
        self.assertEqual(self.outcome(f"{host.url}?room", "a disk with room"), "around")
        self.browser.wait(KEPT, "the kept bundles")

    def test_a_bundle_that_is_kept_and_damaged_comes_again(self):
        host = self.host(self.site)
        self.assertEqual(self.outcome(host.url, "a visit"), "around")
        self.browser.wait(KEPT, "the kept bundles")
        for damage in ("new Uint8Array(9)", "bytes.fill(7, 70, 120)", "bytes.fill(7, bytes.length - 2000)", "'<!doctype html>'"):
            with self.subTest(damage):
                self.browser.run(f"""(async () => {{
                  for (const name of await caches.keys()) {{
                    const cache = await caches.open(name);
                    for (const request of await cache.keys()) {{
                      if (!request.url.includes('.packed')) continue;
                      const bytes = new Uint8Array(await (await cache.match(request)).arrayBuffer());
                      await cache.put(request, new Response({damage}));
                    }}
                  }}
                }})()""")
                self.assertEqual(self.outcome(f"{host.url}?{len(damage)}", damage), "around")
                self.assertTrue(self.browser.run("document.getElementById('viewer').whole.then(() => true)"))
                self.browser.wait(KEPT, "it is kept again")


class Elsewhere(InBrowser):
    """The element in pages of other sites."""

    HTML = """<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><title>Museum</title>
<modar-viewer id="viewer" lang="en" src="%s" style="width:300px;height:300px"></modar-viewer><script type="module" src="%smodar-viewer.js"></script>"""
    CSP = ("default-src 'none'; script-src 'self' {module} 'wasm-unsafe-eval'; worker-src 'self' blob: {module}; connect-src 'self' {module}; "
           "img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; media-src 'self' blob:")

    def page(self, module="modar/", **headers):
        """Opens a page that loads the element from there."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.base))
        (folder / "index.html").write_text(self.HTML % ("demo.modar", module))
        shutil.copy(self.base / "demo.modar", folder)
        (folder / "modar").symlink_to(PAGE)
        host = self.host(folder, headers={name.replace("_", "-"): value for name, value in headers.items()})
        self.browser.open(host.url)
        self.browser.wait("customElements.get('modar-viewer')", "the element")

    def press(self, button):
        """The state that follows, or the message to the visitor."""
        self.browser.run(f"part('{button}').click()")
        self.browser.wait("!['start'].includes(document.getElementById('viewer').state)", button)
        state = self.browser.run("document.getElementById('viewer').state")
        return self.browser.run("[part('problem').dataset.kind, part('problem').innerText]") if state == "error" else state

    def cdn(self):
        return self.host(PAGE, headers={"Access-Control-Allow-Origin": "*"}).url

    def test_from_another_origin(self):
        self.page(self.cdn())
        self.assertIn(self.press("start"), ("looking", "seen"))
        self.browser.run("part('close').click()")
        self.assertEqual(self.press("look"), "around")

    def test_the_camera_that_a_site_forbids_is_not_the_visitors_refusal(self):
        self.page(Permissions_Policy="camera=()")
        kind, told = self.press("start")
        self.assertEqual(kind, "policy")
        self.assertIn("You cannot change", told)
        self.assertIn("Permissions-Policy", told)
        self.browser.run("part('look-instead').click()")
        self.browser.wait("document.getElementById('viewer').state === 'around'", "a look without a camera")

    def test_a_strict_content_security_policy(self):
        self.page(Content_Security_Policy=self.CSP.format(module=""))
        self.assertEqual(self.press("look"), "around")
        cdn = self.cdn()
        self.page(cdn, Content_Security_Policy=self.CSP.format(module=cdn))
        self.assertEqual(self.press("look"), "around")

    def test_what_a_content_security_policy_forbids_is_named(self):
        cdn = self.cdn()
        for module, missing in (("modar/", "'wasm-unsafe-eval'"), (cdn, "'wasm-unsafe-eval'"), (cdn, "blob:")):
            with self.subTest(f"{module} without {missing}"):
                self.page(module, Content_Security_Policy=self.CSP.format(module=cdn).replace(f" {missing}", ""))
                kind, told = self.press("look")
                self.assertEqual(kind, "policy", told)
                self.assertIn(missing, told)


if __name__ == "__main__":
    unittest.main()
