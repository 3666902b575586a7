from collections.abc import Iterator
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

Path = str | PathLike[str]
Bytes = NDArray[np.uint8]

class ModarError(Exception):
    status: int
    code: str
    where: str
    cause: str
    cure: str

class Bundle:
    models: list[str]
    patterns: list[str]
    textures: list[str]
    tables: dict[str, list[dict[str, Any]]]
    bytes: Bytes
    def __init__(self, path: Path) -> None: ...
    def verify(self) -> None: ...
    def picture(self, pattern: str) -> Bytes: ...
    def chunks(self, model: str, level: int = 0) -> Iterator[tuple[dict[str, Any], NDArray[np.void], NDArray[np.uint16]]]: ...
    def positions(self, model: str, level: int = 0) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
    def texture_blocks(self, texture: str, level: int = 0) -> Bytes: ...

class Pose:
    number: int
    visible: bool
    inliers: int
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    corners: NDArray[np.float64]
    raw: Any
    def view(self) -> NDArray[np.float64]: ...

class Tracker:
    camera: Any
    reason: str
    def __init__(self, bundle: Bundle, width: int, height: int, focal: float = 0.0, extended: bool = False) -> None: ...
    def step(self, frame: Bytes, time: float = -1.0) -> dict[str, Pose]: ...

class Renderer:
    def __init__(self, bundle: Bundle, width: int, height: int) -> None: ...
    def render(self, frame: Bytes, poses: dict[str, Pose], camera: Any) -> Bytes: ...

def bake(output: Path, **options: Any) -> dict[str, Any]: ...
def check(*bundles: Path, **options: Any) -> dict[str, Any]: ...
