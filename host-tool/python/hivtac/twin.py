"""A simulated sensor inside a simulation: it is pressed as the simulation says, in its time.

    twin = hivtac.twin.Twin()
    twin.press([0.0, 0.0, -0.1], [0.001, 0.0])
    for sample in twin.advance(0.1):
        print(sample.time, sample.force)

Each frame is rendered and sensed as `hivtac twin` does it, with the film, the noise and the shutter
of the simulated sensor. Nothing runs in real time, and the same presses give the same samples.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

import hivtac
from hivtac import _hivtac

__all__ = ["Twin", "contact_on"]


class Twin:
    """A simulated sensor whose tare was taken; nothing touches it. `camera`: "ov7725" with 156
    frames a second, "ov5640" with 119, or "mt9v034" with 232. `contact`: what presses, as of
    `Sensor.set_contact`; the simulated film is pressed by a needle. `seed`: decides the noise.
    `unit`: 1 to 1000000, that of `hivtac twin --unit`, or the file of a calibrated unit's model;
    without it the nominal one. `model`: the file of a model, which was made for this drawn unit;
    without it the built-in one.

    The film and the camera of a calibrated unit are those that its model has, however the film was
    stretched: its samples are what that unit says of a press.

    Raises `hivtac.Error` when there is no such camera, shape or unit, or the model does not fit.
    """

    def __init__(
        self,
        camera: str = "ov7725",
        *,
        contact: str = "needle",
        seed: int = 1,
        unit: int | str | os.PathLike[str] | None = None,
        model: str | os.PathLike[str] | None = None,
    ) -> None:
        is_unit = unit is not None and not isinstance(unit, int)
        if is_unit and model is not None:
            raise hivtac.Error("a calibrated unit has its model: leave model out")
        number = unit if isinstance(unit, int) else None
        file = model if isinstance(unit, int) or unit is None else unit
        path = None if file is None else os.fspath(file)
        self._twin = _hivtac.Twin(camera, contact, seed, number, path, is_unit)

    def press(
        self, force: Sequence[float] | hivtac.Floats, place: Sequence[float] | hivtac.Floats
    ) -> None:
        """Presses the film from its next frame on. `force`: (3,), on the film, N, z < 0; `place`:
        (2,), m from the film's middle; both in the film's frame.

        Raises `hivtac.Error` when the sensor does not measure that: more than 0.25 N, 4 mm from
        the middle along an axis, or 12° of α or β. The press before stays.
        """
        x, y, z = (float(part) for part in force)
        right, down = (float(part) * 1e3 for part in place)
        size = math.hypot(x, y, z)
        if size == 0.0:
            return self.release()
        beta = math.degrees(math.asin(y / size))
        alpha = math.degrees(math.atan2(x, -z))
        self._twin.press(((right, down), size, (alpha, beta)))

    def release(self) -> None:
        """Lets the film go, from its next frame on."""
        self._twin.press(None)

    def advance(self, to: float) -> list[hivtac.Sample]:
        """Goes on to a time, s since the start; returns the samples of the frames that are whole
        then, none if the time is not later. Their `time` has the same beginning. So has
        `host_time`, when the frame was whole.

        Raises `hivtac.Error` when it is no time.
        """
        return [hivtac._sample(*numbers) for numbers in self._twin.advance(to)]


def contact_on(model: Any, data: Any, geom: int, site: int) -> tuple[hivtac.Floats, hivtac.Floats]:
    """What presses on a geom of MuJoCo, in the frame of a site: x and y along the film, z out of
    it, with the film's middle as the origin. `model`, `data`: MuJoCo's, after a step.

    Returns the force, (3,), N, and the place where its normal parts have their middle, (2,), m;
    zeros without a contact. Several contacts become one force, as the simulated film has one.
    """
    import mujoco  # type: ignore[import-not-found,unused-ignore]

    turn = data.site_xmat[site].reshape(3, 3)
    total, middle, pressed = np.zeros(3), np.zeros(2), 0.0
    for index in range(data.ncon):
        contact = data.contact[index]
        if geom not in (contact.geom1, contact.geom2):
            continue
        parts = np.zeros(6)
        mujoco.mj_contactForce(model, data, index, parts)
        # MuJoCo gives the force on the second geom.
        side = 1.0 if contact.geom2 == geom else -1.0
        force = turn.T @ (side * contact.frame.reshape(3, 3).T @ parts[:3])
        place = turn.T @ (contact.pos - data.site_xpos[site])
        total += force
        middle += abs(force[2]) * place[:2]
        pressed += abs(force[2])
    return total, middle / pressed if pressed > 0.0 else np.zeros(2)
