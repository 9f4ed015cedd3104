"""The native half of `hivtac`: numbers as tuples, which `hivtac` makes arrays of."""

from typing import Any, Optional

_Force = tuple[
    list[float],
    list[float],
    float,
    float,
    float,
    Optional[tuple[list[float], float]],
]
_Sample = tuple[
    int,
    int,
    float,
    float,
    float,
    int,
    list[str],
    Optional[_Force],
    list[_Force],
    Optional[list[tuple[float, float, int]]],
]

_Vectors = tuple[list[float], list[float]]
_Grip = tuple[
    float,
    list[list[str]],
    Optional[bool],
    Optional[tuple[list[float], list[float], _Vectors, Optional[_Vectors]]],
    Optional[str],
]

class Error(Exception): ...
class NoDeviceError(Error): ...
class VersionError(Error): ...
class LostError(Error): ...
class RefusedError(Error): ...

class Connection:
    def __init__(
        self, port: Optional[str], device: Optional[str], timeout: float
    ) -> None: ...
    def hello(self) -> dict[str, Any]: ...
    def next(self) -> Optional[_Sample]: ...
    def newest(self, timeout: Optional[float]) -> Optional[_Sample]: ...
    def missed(self) -> int: ...
    def tare(
        self, frames: int, force: bool, keep: bool
    ) -> tuple[
        list[tuple[float, float]],
        float,
        Optional[tuple[float, tuple[float, float], float, float, float]],
    ]: ...
    def rest(self) -> tuple[bool, bool, float, Optional[float], Optional[float]]: ...
    def set_down(self, vector: Optional[tuple[float, float, float]]) -> None: ...
    def set_contact(self, shape: str, keep: bool) -> None: ...
    def snapshot(self) -> tuple[int, float, int, int, bytes]: ...
    def look(
        self,
    ) -> tuple[
        int, float, int, int, bytes, bytes, Optional[list[tuple[float, float, int]]]
    ]: ...
    def take_lines(self) -> list[tuple[int, str]]: ...
    def close(self) -> None: ...

class Grips:
    def __init__(
        self, first: Connection, second: Connection, poses: Optional[str]
    ) -> None: ...
    def next(self) -> _Grip: ...

class Reader:
    def __init__(self, path: str, device: Optional[str]) -> None: ...
    def hello(self) -> dict[str, Any]: ...
    def next(self) -> Optional[_Sample]: ...
    def is_cut(self) -> bool: ...
    def damage(self) -> list[str]: ...

class Twin:
    def __init__(
        self,
        camera: str,
        contact: str,
        seed: int,
        unit: Optional[int],
        model: Optional[str],
        is_unit: bool,
    ) -> None: ...
    def press(
        self,
        touch: Optional[tuple[tuple[float, float], float, tuple[float, float]]],
    ) -> None: ...
    def advance(self, to_s: float) -> list[_Sample]: ...
