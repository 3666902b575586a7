"""ModAR for Python: bundles as numpy arrays, the tracker, the renderer, and the commands of `modar`."""
import ctypes
import json
import mmap
import subprocess
from ctypes import byref

import numpy as np

from . import _capi
from .bundle_bytes import COMPONENTS, ENTRY, NONE, TABLE, TABLES

_library = ctypes.CDLL("libmodar.so.0")
_capi.declare(_library)
_NAMES = 1, NONE, 0
_SEMANTICS = {1: "position", 2: "normal", 3: "uv", 4: "colour", 5: "octahedral_normal"}
_NUMPY = {"e": "<f2", "h": "<i2", "H": "<u2", "b": "i1", "B": "u1", "f": "<f4"}


class ModarError(Exception):
    """code: stable, like "bundle.truncated"; cure: what to do about it; status: the commands' exit code."""

    def __init__(self, status, code, where, cause, cure):
        super().__init__(f"{where}: {cause}; {cure} [{code}]")
        self.status, self.code, self.where, self.cause, self.cure = status, code, where, cause, cure


def _sized(kind):
    return kind(size=ctypes.sizeof(kind))


def _call(function, *arguments):
    """With a modar_error: the answer, or its exception."""
    error = _sized(_capi.modar_error)
    answer = function(*arguments, byref(error))
    if answer is None or (function.restype is ctypes.c_int and answer != 0):
        raise ModarError(error.status, *(getattr(error, part).decode() for part in ("code", "where", "cause", "cure")))
    return answer


class Bundle:
    """A bundle in memory, mapped. Arrays are views of its bytes, which stay as long as one of them does."""

    def __init__(self, path):
        self._handle = None
        with open(path, "rb") as file:
            try:
                self.bytes = np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint8)
            except ValueError:  # of an empty file
                self.bytes = np.empty(0, np.uint8)
        self._handle = _call(_library.modar_bundle_open_bytes, self.bytes.ctypes.data, self.bytes.size)
        count, data = int(self.bytes[12:16].view("<u4")[0]), self.bytes.data
        entries = [ENTRY.decode(data, 64 + 48 * i) for i in range(count)]
        self._sections = {(e["type"], e["owner"], e["variant"]): data[e["offset"]:e["offset"] + e["size"]] for e in entries}
        self.tables = {name: self._table(kind, record) for kind, (name, record) in TABLES.items()}
        self.models, self.patterns, self.textures = ([row["name"] for row in self.tables[kind]] for kind in ("models", "patterns", "textures"))

    def __del__(self):
        if self._handle:
            _library.modar_bundle_close(self._handle)

    def _table(self, kind, record):
        part = self._sections.get((kind, NONE, 0))
        head = TABLE.decode(part, 0) if part else {"count": 0}
        rows = [record.decode(part, 16 + i * head["stride"]) for i in range(head["count"])]
        for row in rows:
            for field in {"name", "mark", "part", "address"} & row.keys():
                begin, length = row[field]
                row[field] = bytes(self._sections[_NAMES][begin:begin + length]).decode()
        return rows

    def verify(self):
        """Compares the hash of every section. Raises ModarError."""
        _call(_library.modar_bundle_verify, self._handle)

    def picture(self, pattern):
        """The gray picture that the tracker compares with frames: height x width."""
        width, height, gray = ctypes.c_int(), ctypes.c_int(), ctypes.c_void_p()
        if not _library.modar_pattern_picture(self._handle, self.patterns.index(pattern), byref(width), byref(height), byref(gray)):
            raise KeyError(pattern)
        begin = gray.value - self.bytes.ctypes.data
        return self.bytes[begin:begin + width.value * height.value].reshape(height.value, width.value)

    def chunks(self, model, level=0):
        """Of each chunk: (record, vertices, indices). vertices: a structured array as packed; see decode()."""
        row = self.tables["models"][self.models.index(model)]
        layout = self.tables["layouts"][row["layout"]]
        parts = [bytes(layout["attributes"][8 * i:8 * i + 8]) for i in range(layout["attribute_count"])]
        kind = np.dtype({"names": [_SEMANTICS[part[0]] for part in parts], "itemsize": layout["stride"],
                         "formats": [(_NUMPY[COMPONENTS[part[1]]], part[2]) for part in parts],
                         "offsets": [part[4] + 256 * part[5] for part in parts]})
        for chunk in self.tables["chunks"][row["first_chunk"]:row["first_chunk"] + row["chunk_count"]]:
            at = self.tables["levels"][chunk["first_level"] + min(level, chunk["level_count"] - 1)]
            yield (chunk, np.frombuffer(self._sections[512, NONE, 0], kind, at["vertex_count"], at["vertex_offset"]),
                   np.frombuffer(self._sections[513, NONE, 0], "<u2", at["index_count"], at["index_offset"]).reshape(-1, 3))

    def positions(self, model, level=0):
        """All triangles of a model in its source's units: vertices (n x 3) and indices (m x 3), copied."""
        row, vertices, triangles, count = self.tables["models"][self.models.index(model)], [], [], 0
        for chunk, packed, indices in self.chunks(model, level):
            raw = packed["position"][:, :3].astype(float)
            vertices.append(np.array(chunk["position_offset"]) + chunk["position_step"] * raw)
            triangles.append(indices.astype(np.uint32) + count)
            count += len(raw)
        return np.concatenate(vertices) * row["scale"] + np.array(row["center"]), np.concatenate(triangles)

    def texture_blocks(self, texture, level=0):
        """The ETC1 blocks of a mip level: rows x columns x 8 bytes."""
        number = self.textures.index(texture)
        at = self.tables["texture_levels"][self.tables["textures"][number]["first_level"] + level]
        data = next(part for key, part in self._sections.items() if key[:2] == (514, number))
        return np.frombuffer(data, np.uint8, at["size"], at["offset"]).reshape((at["height"] + 3) // 4, (at["width"] + 3) // 4, 8)


class Tracker:
    """Finds the patterns of a bundle in gray frames (height x width) of one camera. focal: pixels; 0: estimated."""

    def __init__(self, bundle, width, height, focal=0.0, extended=False):
        self._handle, self._bundle = None, bundle
        self.camera, options = _sized(_capi.modar_camera), _sized(_capi.modar_tracker_options)
        _library.modar_camera_default(width, height, byref(self.camera))
        if focal:
            self.camera.fx = self.camera.fy = focal
        options.extended, options.estimate_camera = extended, not focal
        self._handle = _call(_library.modar_tracker_create, bundle._handle, byref(self.camera), byref(options))

    def __del__(self):
        if self._handle:
            _library.modar_tracker_destroy(self._handle)

    def step(self, frame, time=-1.0):
        """Of a gray frame: {pattern: Pose} of those that are shown."""
        if frame.shape != (self.camera.height, self.camera.width) or frame.dtype != np.uint8 or frame.strides[1] != 1:
            raise ValueError(f"a frame has {self.camera.height} x {self.camera.width} bytes")
        _call(_library.modar_tracker_step, self._handle, frame.ctypes.data, frame.strides[0], time)
        _library.modar_tracker_camera(self._handle, byref(self.camera))
        poses = {name: Pose(self._handle, number) for number, name in enumerate(self._bundle.patterns)}
        return {name: pose for name, pose in poses.items() if pose.raw.shown}

    @property
    def reason(self):
        """Why no pattern is visible in the newest frame: "few matches"."""
        return _library.modar_reason_text(_library.modar_tracker_reason(self._handle)).decode()


class Pose:
    """X_camera = rotation @ X_pattern + translation; raw: the structure modar_pose."""

    def __init__(self, tracker, number):
        self.raw, self.number = _sized(_capi.modar_pose), number
        self.visible = bool(_library.modar_tracker_pose(tracker, number, byref(self.raw)))
        self.rotation, self.translation = np.array(self.raw.rotation).reshape(3, 3), np.array(self.raw.translation)
        self.corners, self.inliers = np.array(self.raw.corners).reshape(4, 2), self.raw.inliers

    def view(self):
        """Pattern space to GL's eye space, 4 x 4."""
        view = (ctypes.c_float * 16)()
        _library.modar_view(byref(self.raw), view)
        return np.array(view).reshape(4, 4).T


class Renderer:
    """Draws the scenes of a bundle off-screen. One at a time a thread."""

    def __init__(self, bundle, width, height):
        self._bundle, self._size, self._handle = bundle, (height, width), None
        self._context = _call(_library.modar_context_create)
        self._handle = _call(_library.modar_renderer_create, bundle._handle, None, 0)
        _call(_library.modar_renderer_resize, self._handle, width, height)

    def __del__(self):
        if getattr(self, "_context", None):
            _library.modar_renderer_destroy(self._handle)
            _library.modar_context_destroy(self._context)

    def render(self, frame, poses, camera):
        """The frame (RGB, height x width x 3) with the models on its patterns, as RGBA."""
        frame, picture = np.ascontiguousarray(frame, np.uint8), _sized(_capi.modar_picture)
        picture.format, picture.height, picture.width = _capi.MODAR_RGB, *frame.shape[:2]
        picture.planes[0], picture.strides[0] = frame.ctypes.data, frame.strides[0]
        scenes, items = [_sized(_capi.modar_scene) for _ in self._bundle.tables["scenes"]], []
        for number, scene in enumerate(scenes):
            _library.modar_scene_at(self._bundle._handle, number, byref(scene))
            pose = next((pose for pose in poses.values() if pose.number == scene.pattern), None)
            if pose:
                items.append(_sized(_capi.modar_item))
                _library.modar_item_place(byref(items[-1]), byref(scene), byref(pose.raw))
        drawing = _sized(_capi.modar_drawing)
        array = (_capi.modar_item * len(items))(*items)
        drawing.camera, drawing.items, drawing.item_count = ctypes.pointer(camera), array, len(items)
        _library.modar_renderer_render(self._handle, byref(picture), byref(drawing))
        out = np.empty((*self._size, 4), np.uint8)
        _library.modar_renderer_read_rgba(self._handle, out.ctypes.data)
        return out


def _command(*words):
    done = subprocess.run(["modar", *map(str, words)], capture_output=True, text=True)
    return done, json.loads(done.stdout) if done.stdout.lstrip().startswith("{") else None


def _options(options):
    for name, value in options.items():
        for each in value if isinstance(value, (list, tuple)) else [value]:
            word = f"--{name.replace('_', '-')}"
            yield from [word] if each is True else [] if each is False else [word, each]


def bake(output, **options):
    """`modar bake` with the options of its --help: bake("vase.modar", model="vase.glb", pattern=["cover.png:210mm"]). Its report."""
    done, report = _command("bake", *_options(options), "-o", output, "--json", "--quiet")
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["modar: error: modar: unknown"]
        text, _, code = lines[-1].removeprefix("modar: error: ").rpartition(" [")
        where, _, rest = text.partition(": ")
        raise ModarError(done.returncode, code.rstrip("]"), where, *(rest.split("; ", 1) + [""])[:2])
    return report


def check(*bundles, **options):
    """`modar check`: its verdict, also of bad bundles."""
    done, verdict = _command("check", *bundles, *_options(options), "--json")
    if verdict is None:
        raise ModarError(done.returncode, "check", str(bundles), done.stderr.strip(), "")
    return verdict
