"""A sensor's samples and pictures as observations."""

import logging
import threading
import time
from collections.abc import Sequence

import hivtac
import numpy as np
import numpy.typing as npt

from lerobot_robot_hivtac.config import FingerConfig

_log = logging.getLogger(__name__)

_OF_A_CONTACT = ("force_x_n", "force_y_n", "force_z_n", "place_x_m", "place_y_m")
_MOST_CONTACTS = 2

FIELDS = (
    "force_x_n",
    "force_y_n",
    "force_z_n",
    "force_sigma_n",
    "direction_sigma_rad",
    "place_x_m",
    "place_y_m",
    "place_sigma_m",
    "contact",
    "slip",
    "force_known",
    "place_known",
    "age_s",
    "contact_count",
    *(f"contact{n}_{field}" for n in range(1, _MOST_CONTACTS + 1) for field in _OF_A_CONTACT),
)
"""What a finger observes: N, m, rad and s; the film's frame; 1 or 0 for yes or no. Force, place and
their standard uncertainties are 0 unless `force_known` and `place_known` are 1: one number that is
none would make the statistics of a whole data set useless. `contact_count` is how many contacts
are told, 0 to 2, and the numbers of the others are 0."""

OLDEST = 0.1
"""Age from which a sample counts no more, s: some 16 frames of the slower camera."""

OLDEST_PICTURE = 2.0
"""Age from which a picture counts no more, s."""


class Finger:
    """A sensor by its configuration. It is not found before `connect`."""

    def __init__(self, name: str, config: FingerConfig) -> None:
        self.name = name
        self.config = config
        self._sensor: hivtac.Sensor | None = None
        self._sample: hivtac.Sample | None = None
        self._pictures: Pictures | None = None

    @property
    def is_connected(self) -> bool:
        """Whether it was connected, and not disconnected since. A sensor that was lost counts as
        connected, so that its arm is disconnected in order."""
        return self._sensor is not None

    def connect(self) -> None:
        """Connects, and waits for the first sample and picture.

        Raises `hivtac.Error` with what to do, `ValueError` for another size of picture.
        """
        sensor = hivtac.open(self.config.port, device=self.config.device)
        try:
            self._check_size(sensor.device)
            self._sample = sensor.newest()
            if not sensor.rest().taken:
                _log.warning(
                    "%s has no rest position: take one with `hivtac tare` while nothing touches",
                    self.name,
                )
            if self.config.picture:
                self._pictures = Pictures(self.name, sensor)
        except BaseException:
            sensor.close()
            raise
        self._sensor = sensor

    def disconnect(self) -> None:
        """Ends the connection."""
        if self._pictures is not None:
            self._pictures.stop()
        if self._sensor is not None:
            self._sensor.close()
        self._sensor = self._pictures = None

    def observe(self) -> dict[str, float]:
        """The newest sample by `FIELDS`, without a wait. Those between two calls are passed over.

        Raises `hivtac.LostError` once the connection is lost.
        """
        assert self._sensor is not None, "connect first"
        self._sample = self._sensor.newest(timeout=0) or self._sample
        assert self._sample is not None
        return observed(self._sample, time.time() - self._sample.host_time)

    def picture(self) -> npt.NDArray[np.uint8]:
        """(height, width, 3): the newest picture, red, green and blue, without a wait.

        Raises `hivtac.Error` when there is no new one any more.
        """
        assert self._pictures is not None, "connect first, with `picture`"
        return self._pictures.newest()

    def _check_size(self, device: hivtac.Device) -> None:
        wanted, has = (self.config.width, self.config.height), (device.width, device.height)
        if self.config.picture and wanted != has:
            raise ValueError(
                f"{self.name}: its pictures have {has[0]} × {has[1]} px, not {wanted[0]} × "
                f"{wanted[1]}; set width and height of the finger"
            )


def observed(sample: hivtac.Sample, age: float) -> dict[str, float]:
    """A sample that came `age` s ago, by `FIELDS`."""
    is_new = age <= OLDEST
    force = sample.force if is_new else None
    place = sample.place if is_new else None
    numbers = [0.0] * 8
    if force is not None:
        numbers[:5] = [*force, sample.magnitude_sigma, sample.direction_sigma]
    if place is not None:
        numbers[5:] = [*place, sample.place_sigma]
    is_felt = [is_new and sample.contact, is_new and sample.slip]
    flags = [*is_felt, force is not None, place is not None]
    contacts = sample.contacts if is_new else ()
    told = [*numbers, *flags, max(age, 0.0), len(contacts), *_each(contacts)]
    return dict(zip(FIELDS, map(float, told), strict=True))


def _each(contacts: Sequence[hivtac.Contact]) -> list[float]:
    """The numbers of each contact by `_OF_A_CONTACT`, 0 for those that are not known."""
    each = np.zeros((_MOST_CONTACTS, len(_OF_A_CONTACT)))
    for row, contact in zip(each, contacts, strict=False):
        row[:3] = contact.force
        if contact.place is not None:
            row[3:] = contact.place
    return each.ravel().tolist()


class Pictures:
    """Takes picture after picture in a thread, while samples go on."""

    def __init__(self, name: str, sensor: hivtac.Sensor) -> None:
        self._name = name
        self._sensor = sensor
        self._newest = (sensor.snapshot(), time.monotonic())
        self._failure: hivtac.Error | None = None
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._take, daemon=True)
        self._thread.start()

    def newest(self) -> npt.NDArray[np.uint8]:
        """The newest picture; the failure if there is none for 2 s."""
        picture, came = self._newest
        if time.monotonic() - came > OLDEST_PICTURE:
            raise self._failure or hivtac.LostError(
                f"{self._name}: no picture for {OLDEST_PICTURE} s"
            )
        return picture

    def stop(self) -> None:
        """Ends the thread, after the picture that is under way."""
        self._is_over.set()
        self._thread.join()

    def _take(self) -> None:
        while not self._is_over.is_set():
            try:
                self._newest = (self._sensor.snapshot(), time.monotonic())
            except hivtac.Error as failure:
                # A picture can be damaged on the way; `newest` judges how long there was none.
                self._failure = failure
                self._is_over.wait(0.1)
