"""Reads forces, pictures and recordings of a HiVTac sensor, with the code of the tool `hivtac`.

    import hivtac

    with hivtac.open() as sensor:
        sensor.tare()
        for sample in sensor:
            print(sample.force, sample.place)

Numbers are in SI units (N, m, rad, s), positions in the image in pixels: the centre of pixel (0, 0)
is the origin, x right, y down. The film frame is right-handed: x right and y down in the image, z
out of the film, away from the camera; a press has a negative force along z.

A failure raises `Error` or a subclass, with the text that the tool would print. Ctrl-C works during
every wait. Lines that a sensor logs go to the logger `hivtac`.

`hivtac.rerun` shows a sensor in Rerun, `hivtac.twin` is a simulated one inside a simulation.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from types import TracebackType
from typing import Any, overload

import numpy as np
import numpy.typing as npt

try:
    from hivtac._hivtac import (
        Connection,
        Error,
        Grips as _Grips,
        LostError,
        NoDeviceError,
        Reader,
        RefusedError,
        VersionError,
    )
except ImportError as failure:
    raise ImportError(
        f"the compiled part of hivtac does not load here ({failure}): it was installed for "
        "another computer, such as one with glibc in place of musl (Alpine), or for another "
        "Python. Install it anew on this one: pip install --force-reinstall --no-cache-dir hivtac"
    ) from failure

__all__ = [
    "Contact",
    "Device",
    "Error",
    "Grip",
    "Grips",
    "LostError",
    "Moved",
    "NoDeviceError",
    "Picture",
    "Recording",
    "RefusedError",
    "Rest",
    "Sample",
    "Sensor",
    "Tare",
    "VersionError",
    "grip",
    "log_rerun",
    "open",
    "recording",
]

Floats = npt.NDArray[np.float64]

_log = logging.getLogger("hivtac")


@dataclass(frozen=True)
class Device:
    """The identity of a sensor."""

    serial: str
    """Serial number: 24 hexadecimal digits."""
    name: str
    """The name that its user set; empty if not set."""
    board: str
    """Board and camera."""
    firmware: str
    """Firmware and its version."""
    model: str | None
    """The model in use; `None` if no model is usable."""
    width: int
    """Columns of a frame, px."""
    height: int
    """Rows of a frame, px."""


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact on the film."""

    force: Floats
    """(3,): its force on the film, N."""
    alpha: float
    """Direction α, rad, as of a sample."""
    beta: float
    """Direction β, rad."""
    magnitude: float
    """Size of the force, N."""
    direction_sigma: float
    """Standard uncertainty of the direction, rad."""
    magnitude_sigma: float
    """Standard uncertainty of the magnitude, N."""
    place: Floats | None
    """(2,): where it touches, m from the film's middle; `None` if unknown."""
    place_sigma: float | None
    """Standard uncertainty of each coordinate of the place, m."""
    torque_z: float | None
    """Torque about the film's normal at the place, N·m; `None` if the frame shows none."""
    torque_sigma: float | None
    """Standard uncertainty of that torque, N·m: 95 of 100 are within 1.960 times this."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One frame's force, or the reason why it is missing."""

    sequence: int
    """Running number of the samples produced; a gap shows samples lost on the way."""
    frame: int
    """Running number of the frames exposed; a gap shows frames that were not processed."""
    time: float
    """Device time of the middle of the frame's exposure, s since its start."""
    host_time: float
    """Time of its arrival at the computer, s since 1970, however late it is taken."""
    exposed: float
    """Time of the middle of the exposure by the computer's clock, s since 1970. Several sensors are
    on one clock: theirs agree to 0.2 ms."""
    status: tuple[str, ...]
    """Why the force is missing, or how reliable it is: names of `docs/wire.md`."""
    status_bits: int
    """The status as bits, including those without a name in this release."""
    force: Floats | None
    """(3,): force on the film, N; `None` if it is missing, for which `status` has the reason."""
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
    """(2,): place where the tip touches, m from the film's middle; `None` if unknown."""
    place_sigma: float | None
    """Standard uncertainty of each coordinate of the place, m."""
    torque_z: float | None
    """Torque about the film's normal at the place, N·m; `None` if the frame shows none."""
    torque_sigma: float | None
    """Standard uncertainty of that torque, N·m: 95 of 100 are within 1.960 times this."""
    contacts: tuple[Contact, ...]
    """Each contact: one, two, or none if nothing touches the film. `force` is their sum, or what
    the settings filter and creep make of it. None, too, if `status` has `two_contacts` and the two
    are not told apart."""
    markers: Floats | None
    """(N, 2): column and row of each marker, px; `None` if not all were found."""
    marker_areas: npt.NDArray[np.int64] | None
    """(N,): area of each marker, px."""

    @property
    def contact(self) -> bool:
        """Whether something touches the film."""
        return "contact" in self.status

    @property
    def slip(self) -> bool:
        """Whether the contact slips."""
        return "slip" in self.status


@dataclass(frozen=True, eq=False)
class Grip:
    """What two sensors feel together when a frame of the first was exposed; `docs/robots.md` has
    the equations. What is not known is `None`. σ is a standard uncertainty."""

    time: float
    """Time of the exposure, s since 1970."""
    cause: str | None
    """Why the grip is not known: the sensor, and names of its status; `None` if it is known."""
    contact: bool | None
    """Whether something touches both sensors."""
    status: tuple[tuple[str, ...], tuple[str, ...]]
    """Names of the status of the first and the second sensor."""
    force: float | None
    """Grip force: the part of both forces that squeezes, N."""
    force_sigma: float | None
    """Its σ, N."""
    margin: float | None
    """How much more pull there may be before the object slips, N; negative beyond."""
    margin_sigma: float | None
    """Its σ, N."""
    common: Floats | None
    """(3,): force of the object on both sensors, in the grip's frame, N."""
    common_sigma: Floats | None
    """(3,): σ of each component, N."""
    torque: Floats | None
    """(3,): torque of the object on both, about the origin of the grip's frame, N·m."""
    torque_sigma: Floats | None
    """(3,): σ of each component, N·m."""


@dataclass(frozen=True, eq=False)
class Moved:
    """Motion from the rest position before, and the part that a motion of the camera explains."""

    farthest: float
    """Largest motion of a marker, px."""
    shift: Floats
    """(2,): motion of the markers' middle, px."""
    turn: float
    """Turn of the pattern about its middle, x towards y, rad."""
    larger: float
    """Relative growth of the pattern."""
    beside: float
    """Largest coordinate of the motion that shift, turn and growth do not explain, px."""


@dataclass(frozen=True)
class Rest:
    """The rest position in use, and its changes since it was taken."""

    taken: bool
    """Whether one was taken; otherwise the model's own is in use."""
    kept: bool
    """Whether it is kept through restarts."""
    rezeroed: float
    """Distance that re-zeroing moved it, px."""
    seen: float | None
    """Last distance of the untouched film from it, px; `None` until that was seen."""
    from_kept: float | None
    """Distance from the kept one, px; `None` unless both exist."""


@dataclass(frozen=True, eq=False)
class Tare:
    """The result of a tare."""

    markers: Floats
    """(N, 2): column and row of the markers at rest, px."""
    spread: float
    """Motion of the markers during the tare, px."""
    moved: Moved | None
    """Motion from the rest position before; `None` for the first tare."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A frame as the sensing read it."""

    frame: int
    """Its number, as of its sample."""
    time: float
    """Device time of the middle of its exposure, s."""
    pixels: npt.NDArray[np.uint8]
    """(height, width, 3): levels of red, green and blue."""
    mask: npt.NDArray[np.uint8]
    """(height, width): 255 where a pixel passes the threshold, 128 where only dilation adds it."""
    markers: Floats | None
    """(N, 2): column and row of each marker, px; `None` if not all were found, or the sensor was
    not asked for samples before."""


def open(
    port: str | None = None, *, device: str | None = None, timeout: float = 2.0
) -> Sensor:
    """Connects to a sensor: to the only one that is plugged in, to a port (a serial port's name,
    `tcp:HOST:PORT`, or `uart:PORT`), or to the `device` with a name or serial number. `timeout`:
    longest wait for its answers, s.

    Raises `NoDeviceError` when the sensor is missing or does not answer, `VersionError` when its
    protocol has another version.
    """
    return Sensor(Connection(port, device, timeout))


def recording(path: str | os.PathLike[str], *, device: str | None = None) -> Recording:
    """Opens an MCAP file of `hivtac record`; it may have been cut. `device`: the name or serial
    number of one of its sensors, necessary if it has several.

    Raises `Error` when the file is not a recording, or does not have the sensor.
    """
    return Recording(Reader(os.fspath(path), device))


def log_rerun(it: Sample | Picture, name: str = "hivtac") -> None:
    """Logs a sample or a picture below the entity `name` in the program's recording in Rerun;
    `hivtac.rerun` says what is there, and has the film's outline (`log_film`).

    Raises `ImportError` without Rerun: `pip install hivtac[rerun]`.
    """
    from hivtac import rerun

    if isinstance(it, Picture):
        rerun.log_picture(it, name)
    else:
        rerun.log_sample(it, name)


def grip(
    first: Sensor, second: Sensor, *, poses: str | os.PathLike[str] | None = None
) -> Grips:
    """What two connected sensors feel together, as long as they are open. `poses`: a JSON file that
    says where they are in the grip (`docs/robots.md`); opposing fingers, 30 mm apart, if not given.

    Raises `Error` when the file cannot be used.
    """
    path = None if poses is None else os.fspath(poses)
    return Grips(_Grips(first._connection, second._connection, path))


class Sensor:
    """A connection to a sensor: iterates over its samples as they arrive, without an end. Close it,
    or use it in a `with` statement. Several threads may use it: one takes samples while another
    waits for a picture."""

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
        """Waits for the next sample. Up to 1024 samples wait for the program, also during a tare or
        a snapshot; of more, the oldest are passed over, which `missed` counts.

        Raises `LostError` when the connection is lost, `StopIteration` after it was closed.
        """
        try:
            numbers = self._connection.next()
        finally:
            self._tell_log()
        if numbers is None:
            raise StopIteration
        return _sample(*numbers)

    @overload
    def newest(self) -> Sample: ...

    @overload
    def newest(self, timeout: float) -> Sample | None: ...

    def newest(self, timeout: float | None = None) -> Sample | None:
        """Returns the newest sample that was not taken yet, and waits for one if there is none.
        Those before it are passed over, which `missed` counts. For control loops that are slower
        than the sensor. `timeout`: longest wait, s, after which it returns `None`; with 0 the loop
        never waits.

        Raises `LostError` when the connection is lost, `Error` after it was closed.
        """
        try:
            numbers = self._connection.newest(timeout)
        finally:
            self._tell_log()
        return None if numbers is None else _sample(*numbers)

    @property
    def missed(self) -> int:
        """Count of the samples that arrived and were passed over: the program was too slow, or took
        `newest`. Samples lost on the way show as a gap in `Sample.sequence`; these do, too."""
        return self._connection.missed()

    def tare(self, frames: int = 32, *, force: bool = False, keep: bool = False) -> Tare:
        """Takes the mean of the next good `frames` (1–256) as the rest position. Nothing may touch
        the film. `force`: even if the film seems to be touched. `keep`: through restarts.

        Raises `RefusedError` when the sensor sees no markers or is not at rest; then the text has
        the force that the markers show.
        """
        try:
            markers, spread, moved = self._connection.tare(frames, force, keep)
        finally:
            self._tell_log()
        return Tare(np.array(markers), spread, _moved(*moved) if moved else None)

    def rest(self) -> Rest:
        """Asks for the rest position in use, and its changes since it was taken."""
        try:
            return Rest(*self._connection.rest())
        finally:
            self._tell_log()

    def set_down(self, x: float, y: float, z: float) -> None:
        """Sets the direction of gravity on the film, from its next frame on. The vector may have
        any length; x is right and y down in the image, z away from the camera.

        The film hangs by its own weight. A sensor that turns needs this direction to keep
        measuring: call it whenever the robot moves, up to 100 times a second. The sensor sends no
        reply. The direction must also have been set when the tare was taken.

        Raises `Error` when the vector has no direction.
        """
        self._connection.set_down((x, y, z))

    def down_unknown(self) -> None:
        """Sets the direction of gravity as unknown: uncertainties then include that."""
        self._connection.set_down(None)

    def set_contact(self, shape: str, *, keep: bool = False) -> None:
        """Sets the shape of what presses the film, from the next frame on: "needle", a tip like the
        model's; "round:R" or "flat:R", a soft or rounded tip or a rigid face of radius R, 0.25 to
        4 mm; or "unknown", as a new sensor has it. `keep`: through restarts.

        Raises `Error` when it is no such shape.
        """
        try:
            self._connection.set_contact(shape, keep)
        finally:
            self._tell_log()

    def snapshot(self) -> npt.NDArray[np.uint8]:
        """(height, width, 3): the next whole frame as the sensing reads it, levels of red, green
        and blue.

        Raises `RefusedError` when the camera sends no frame, `LostError` when it arrived damaged.
        """
        try:
            _, _, width, height, levels = self._connection.snapshot()
        finally:
            self._tell_log()
        return np.frombuffer(levels, np.uint8).reshape(height, width, 3).copy()

    def look(self) -> Picture:
        """Takes the next whole frame as `snapshot` does, with its mask and markers.

        Raises what `snapshot` raises.
        """
        try:
            frame, time, width, height, levels, mask, markers = self._connection.look()
        finally:
            self._tell_log()
        return Picture(
            frame,
            time,
            np.frombuffer(levels, np.uint8).reshape(height, width, 3).copy(),
            np.frombuffer(mask, np.uint8).reshape(height, width).copy(),
            np.array([marker[:2] for marker in markers]) if markers else None,
        )

    def close(self) -> None:
        """Ends the connection, once no other thread waits in one of its calls."""
        self._connection.close()

    def _tell_log(self) -> None:
        for level, line in self._connection.take_lines():
            _log.log(level, "%s", line)


class Grips:
    """What two sensors feel together: iterates without an end, once for each frame of the first. It
    takes the samples of both; a program that also iterates over a sensor takes some away."""

    def __init__(self, grips: _Grips) -> None:
        self._grips = grips

    def __iter__(self) -> Iterator[Grip]:
        return self

    def __next__(self) -> Grip:
        """Waits for the next one; it comes with the second sensor's next sample.

        Raises `LostError` when a connection is lost.
        """
        time, names, contact, held, cause = self._grips.next()
        force, margin, common, torque = held or ((None,) * 2, (None,) * 2, None, None)
        arrays = [
            (None, None) if it is None else (np.array(it[0]), np.array(it[1]))
            for it in (common, torque)
        ]
        return Grip(
            time=time,
            cause=cause,
            contact=contact,
            status=(tuple(names[0]), tuple(names[1])),
            force=force[0],
            force_sigma=force[1],
            margin=margin[0],
            margin_sigma=margin[1],
            common=arrays[0][0],
            common_sigma=arrays[0][1],
            torque=arrays[1][0],
            torque_sigma=arrays[1][1],
        )


class Recording:
    """The recording of a sensor: iterates once over its samples."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self.device = Device(**reader.hello())

    @property
    def is_cut(self) -> bool:
        """True after the end of a recording that was cut."""
        return self._reader.is_cut()

    @property
    def damage(self) -> list[str]:
        """Texts about the damaged parts that were skipped until now."""
        return self._reader.damage()

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


def _contact(
    vector: list[float],
    angles: list[float],
    magnitude: float,
    direction_sigma: float,
    magnitude_sigma: float,
    place: tuple[list[float], float] | None,
    torque: tuple[float, float] | None,
) -> Contact:
    alpha, beta = angles
    return Contact(
        force=np.array(vector),
        alpha=alpha,
        beta=beta,
        magnitude=magnitude,
        direction_sigma=direction_sigma,
        magnitude_sigma=magnitude_sigma,
        place=np.array(place[0]) if place else None,
        place_sigma=place[1] if place else None,
        torque_z=torque[0] if torque else None,
        torque_sigma=torque[1] if torque else None,
    )


def _sample(
    sequence: int,
    frame: int,
    time: float,
    host_time: float,
    exposed: float,
    bits: int,
    names: list[str],
    force: Any,
    contacts: list[Any],
    markers: list[tuple[float, float, int]] | None,
) -> Sample:
    # A sample has the fields of a contact, for its force.
    of_force: dict[str, Any] = dict.fromkeys(field.name for field in fields(Contact))
    if force:
        of_force = vars(_contact(*force))
    return Sample(
        sequence=sequence,
        frame=frame,
        time=time,
        host_time=host_time,
        exposed=exposed,
        status=tuple(names),
        status_bits=bits,
        **of_force,
        contacts=tuple(_contact(*numbers) for numbers in contacts),
        markers=np.array([marker[:2] for marker in markers]) if markers else None,
        marker_areas=np.array([marker[2] for marker in markers]) if markers else None,
    )
