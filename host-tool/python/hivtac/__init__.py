"""Forces, tare, pictures and recordings of a HiVTac sensor, by the code of the tool `hivtac`.

    import hivtac

    with hivtac.open() as sensor:
        sensor.tare()
        for sample in sensor:
            print(sample.force, sample.place)

Numbers are in SI units (N, m, rad, s), positions in the image in pixels: the centre of pixel (0, 0)
is the origin, x right, y down. The film frame is right-handed: x right and y down in the image, z
out of the film, away from the camera; a press has a negative force along z.

What goes wrong raises `Error` or a class of it, with the text that the tool would print. Ctrl-C
works while anything waits. Lines that a sensor logs go to the logger `hivtac`.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hivtac._hivtac import (
    Connection,
    Error,
    LostError,
    NoDeviceError,
    Reader,
    RefusedError,
    VersionError,
)

__all__ = [
    "Device",
    "Error",
    "LostError",
    "Moved",
    "NoDeviceError",
    "Recording",
    "RefusedError",
    "Rest",
    "Sample",
    "Sensor",
    "Tare",
    "VersionError",
    "open",
    "recording",
]

Floats = npt.NDArray[np.float64]

_log = logging.getLogger("hivtac")


@dataclass(frozen=True)
class Device:
    """A sensor, as it says of itself."""

    serial: str
    """Serial number: 24 hexadecimal digits."""
    name: str
    """What its user calls it; empty when nothing."""
    board: str
    """Board and camera."""
    firmware: str
    """Firmware and its version."""
    model: str | None
    """The model in use; `None` when there is no usable one."""
    width: int
    """Columns of a frame, px."""
    height: int
    """Rows of a frame, px."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One frame's force, or why there is none."""

    sequence: int
    """Counts the samples that were produced; a gap is one lost on the way."""
    frame: int
    """Counts the frames that were exposed; a gap is one that was not processed."""
    time: float
    """Device time of the middle of the frame's exposure, s since its start."""
    host_time: float
    """When it came to the computer that read it, s since 1970."""
    status: tuple[str, ...]
    """Why there is no force, or how far to trust it: names of `docs/wire.md`."""
    status_bits: int
    """The same as bits, also those that this release has no name for."""
    force: Floats | None
    """(3,): force on the film, N; `None` when the status says why there is none."""
    alpha: float | None
    """Direction α, rad: force = magnitude · (sin α cos β, sin β, −cos α cos β)."""
    beta: float | None
    """Direction β, rad."""
    magnitude: float | None
    """Size of the force, N."""
    direction_sigma: float | None
    """Standard uncertainty of the direction, rad: 95 of 100 are within 1.731 times this."""
    magnitude_sigma: float | None
    """Standard uncertainty of the magnitude, N: 95 of 100 are within 1.960 times this."""
    place: Floats | None
    """(2,): where the tip touches, m from the film's middle; `None` when it is not told."""
    place_sigma: float | None
    """Standard uncertainty of each coordinate of the place, m."""
    markers: Floats | None
    """(4, 2): column and row of the markers 0–3, px; `None` when they were not found."""
    marker_areas: npt.NDArray[np.int64] | None
    """(4,): pixels of each marker."""

    @property
    def contact(self) -> bool:
        """Whether something touches the film."""
        return "contact" in self.status

    @property
    def slip(self) -> bool:
        """Whether what touches the film slips."""
        return "slip" in self.status


@dataclass(frozen=True, eq=False)
class Moved:
    """How far a rest position is from the one before, and what a camera's motion explains of it."""

    farthest: float
    """How far the marker moved that moved most, px."""
    shift: Floats
    """(2,): how far the markers' middle moved, px."""
    turn: float
    """How far they turned about it, x towards y, rad."""
    larger: float
    """How much larger their pattern is, in parts of it."""
    beside: float
    """How far beside that they are: the coordinate that is farthest, px."""


@dataclass(frozen=True)
class Rest:
    """The rest position in use, and what became of it since it was taken."""

    taken: bool
    """Whether one was taken; the model's own is in use otherwise."""
    kept: bool
    """Whether it is the same after a restart."""
    rezeroed: float
    """How far re-zeroing moved it, px."""
    seen: float | None
    """How far from it the untouched film was seen last, px; `None` until it was seen."""
    from_kept: float | None
    """How far it is from the kept one, px; `None` unless there are both."""


@dataclass(frozen=True, eq=False)
class Tare:
    """What a tare gave."""

    markers: Floats
    """(4, 2): column and row of the markers at rest, px."""
    spread: float
    """How far the markers moved meanwhile, px."""
    moved: Moved | None
    """How far the rest position moved from the one before; `None` of the first one."""


def open(
    port: str | None = None, *, device: str | None = None, timeout: float = 2.0
) -> Sensor:
    """Connects to a sensor: to the only one that is plugged in, to a port (a serial port's name, or
    `tcp:HOST:PORT`), or to the `device` with a name or serial number. `timeout`: longest wait for
    its answers, s.

    Raises `NoDeviceError` when there is none or nobody answers, `VersionError` when it speaks
    another version.
    """
    return Sensor(Connection(port, device, timeout))


def recording(path: str | os.PathLike[str], *, device: str | None = None) -> Recording:
    """Opens an MCAP file of `hivtac record`, also one that was cut. `device`: the name or serial
    number of one of its sensors, where it has several.

    Raises `Error` when it is none, or has no such sensor.
    """
    return Recording(Reader(os.fspath(path), device))


class Sensor:
    """A connection to a sensor: iterates over its samples as they come, without an end. Close it,
    or use it in a `with` statement."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.device = Device(**connection.hello())

    def __enter__(self) -> Sensor:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __iter__(self) -> Iterator[Sample]:
        return self

    def __next__(self) -> Sample:
        """Waits for the next sample. Samples are kept while a tare or a snapshot is taken, and
        those that the program is too slow for are lost and leave a gap in `Sample.sequence`.

        Raises `LostError` when the connection is lost; `StopIteration` once it was closed.
        """
        try:
            numbers = self._connection.next()
        finally:
            self._tell_log()
        if numbers is None:
            raise StopIteration
        return _sample(*numbers)

    def tare(self, frames: int = 32, *, force: bool = False, keep: bool = False) -> Tare:
        """Takes the mean of the next good `frames` (1–256) as the rest position: nothing may touch
        the film. `force`: though something seems to. `keep`: through restarts.

        Raises `RefusedError` when the sensor finds that it is not at rest, with the force that the
        markers look like, or sees no markers.
        """
        try:
            markers, spread, moved = self._connection.tare(frames, force, keep)
        finally:
            self._tell_log()
        return Tare(np.array(markers), spread, _moved(*moved) if moved else None)

    def rest(self) -> Rest:
        """The rest position in use, and how far from it the untouched film was seen last."""
        try:
            return Rest(*self._connection.rest())
        finally:
            self._tell_log()

    def set_down(self, x: float, y: float, z: float) -> None:
        """Says where gravity pulls on the film, from its next frame on: a vector of any length, x
        right and y down in the image, z away from the camera. The film hangs by its own weight;
        told how it is held, a sensor that turns measures on. As often as the robot moves, up to 100
        times a second: nothing answers. The tare must have been taken when this was told, too.

        Raises `Error` when the vector has no direction.
        """
        self._connection.set_down((x, y, z))

    def down_unknown(self) -> None:
        """Says that nobody knows where gravity pulls: uncertainties include that."""
        self._connection.set_down(None)

    def snapshot(self) -> npt.NDArray[np.uint8]:
        """(height, width, 3): the next whole frame as the sensing reads it, levels of red, green
        and blue.

        Raises `RefusedError` when the camera sends none, `LostError` when it came damaged.
        """
        try:
            _, _, width, height, levels = self._connection.snapshot()
        finally:
            self._tell_log()
        return np.frombuffer(levels, np.uint8).reshape(height, width, 3).copy()

    def close(self) -> None:
        """Ends the connection."""
        self._connection.close()

    def _tell_log(self) -> None:
        for level, line in self._connection.take_lines():
            _log.log(level, "%s", line)


class Recording:
    """What was recorded of a sensor: iterates once over its samples."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self.device = Device(**reader.hello())

    @property
    def is_cut(self) -> bool:
        """True once its end was reached, when it had been cut before its own."""
        return self._reader.is_cut()

    def __iter__(self) -> Iterator[Sample]:
        return self

    def __next__(self) -> Sample:
        numbers = self._reader.next()
        if numbers is None:
            raise StopIteration
        return _sample(*numbers)


def _moved(
    farthest: float, shift: tuple[float, float], turn: float, larger: float, beside: float
) -> Moved:
    return Moved(farthest, np.array(shift), turn, larger, beside)


def _sample(
    sequence: int,
    frame: int,
    time: float,
    host_time: float,
    bits: int,
    names: list[str],
    force: Any,
    markers: list[tuple[float, float, int]] | None,
) -> Sample:
    vector, (alpha, beta), magnitude, direction_sigma, magnitude_sigma, place = force or (
        None,
        (None, None),
        None,
        None,
        None,
        None,
    )
    return Sample(
        sequence=sequence,
        frame=frame,
        time=time,
        host_time=host_time,
        status=tuple(names),
        status_bits=bits,
        force=None if vector is None else np.array(vector),
        alpha=alpha,
        beta=beta,
        magnitude=magnitude,
        direction_sigma=direction_sigma,
        magnitude_sigma=magnitude_sigma,
        place=np.array(place[0]) if place else None,
        place_sigma=place[1] if place else None,
        markers=np.array([marker[:2] for marker in markers]) if markers else None,
        marker_areas=np.array([marker[2] for marker in markers]) if markers else None,
    )
