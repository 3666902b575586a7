"""A person before a browser: real mouse, key and drop events, counted; and what the page shows meanwhile."""
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "web"))
from browser import Browser  # noqa: E402

KEYS = {"Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}


class Hand(Browser):
    """clicks: presses of the mouse, with the drags and drops meanwhile."""

    def __init__(self, folder, size=(1280, 720), extra=(), camera=""):
        """camera: a video that this machine's camera sees."""
        self.clicks, self.choosers = 0, []
        super().__init__(folder, camera, size, extra)
        self.resize(*size)

    def _note(self, message):
        if message.get("method") == "Page.fileChooserOpened":
            self.choosers.append(message["params"]["backendNodeId"])
        super()._note(message)

    def wait(self, condition, what, seconds=90):
        super().wait(f"!!({condition})", what, seconds)

    def prefer(self, **features):
        self.call("Emulation.setEmulatedMedia", features=[{"name": name.replace("_", "-"), "value": value} for name, value in features.items()])

    def place(self, selector, n=0):
        """The middle of an element, scrolled into sight."""
        self.wait(f"document.querySelectorAll({json.dumps(selector)}).length > {n}", selector)
        return self.run(f"""(async (e) => {{
          e.scrollIntoView({{ block: 'nearest' }});
          const place = () => {{ const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }};
          for (let before; String(before) !== String(place());) {{ before = place(); await new Promise(requestAnimationFrame); }}
          return place();
        }})(document.querySelectorAll({json.dumps(selector)})[{n}])""")

    def _mouse(self, kind, place, buttons=1):
        self.call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], button="left" if buttons else "none", buttons=buttons, clickCount=1)

    def click(self, selector, n=0):
        self.drag(self.place(selector, n), [])

    def drag(self, start, path, meanwhile=None):
        """From a place over others; meanwhile() is called before the button is let go."""
        self.clicks += 1
        self._mouse("mouseMoved", start, 0)
        self._mouse("mousePressed", start)
        for place in path:
            self._mouse("mouseMoved", place)
        if meanwhile:
            meanwhile()
        self._mouse("mouseReleased", path[-1] if path else start)

    def drop(self, files, place=(640, 360)):
        self.clicks += 1
        data = {"items": [], "files": [str(file) for file in files], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=place[0], y=place[1], data=data)

    def press(self, key, times=1, **more):
        for _ in range(times):
            code = KEYS.get(key, ord(key[0].upper()))
            text = {"text": "\r"} if key == "Enter" else {"text": key} if len(key) == 1 and not more else {}
            for kind in ("keyDown", "keyUp"):
                self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key if len(key) > 1 else "", windowsVirtualKeyCode=code,
                          **more, **(text if kind == "keyDown" else {}))

    def tab_to(self, selector, most=80):
        """By the Tab key alone."""
        for _ in range(most):
            if self.run(f"document.activeElement.matches({json.dumps(selector)})"):
                return
            self.press("Tab")
        raise AssertionError(f"Tab does not reach {selector}")

    def choose(self, files):
        """The answer to an open file chooser."""
        end = time.monotonic() + 90
        while not self.choosers and time.monotonic() < end:
            self.run("0")
        self.call("DOM.setFileInputFiles", files=[str(file) for file in files], backendNodeId=self.choosers.pop())

    def settle(self):
        """Until what moves by itself has moved, and the server has done what it was requested."""
        self.wait("!document.querySelector('[aria-busy]') && !document.querySelector('.status progress, .sending') && (!document.querySelector('.stage3d')"
                  " || document.querySelector('.layers canvas'))", "a rest")
        self.run("Promise.all(document.getAnimations().map((each) => each.finished.catch(() => 0))).then(() => 0)")
