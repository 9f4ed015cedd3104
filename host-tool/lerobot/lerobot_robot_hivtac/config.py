"""A user's settings, on the command line of LeRobot or in Python."""

from dataclasses import dataclass, field
from typing import Any

import draccus
from lerobot.robots.config import RobotConfig


@dataclass
class FingerConfig:
    """A sensor: by its port or its name, or the only one that is plugged in."""

    port: str | None = None
    """A serial port's name, `tcp:HOST:PORT`, or `uart:PORT` of an adapter for the UART."""
    device: str | None = None
    """The sensor's name or serial number."""
    picture: bool = False
    """Whether its picture is an observation, too: about 7 new ones a second of a real sensor."""
    width: int = 320
    """Columns of the picture, px; must be the sensor's."""
    height: int = 240
    """Rows of the picture, px; must be the sensor's."""


@RobotConfig.register_subclass("hivtac")
@dataclass(kw_only=True)
class HivtacConfig(RobotConfig):
    """Sensors by the names of their fingers, and the arm that carries them."""

    fingers: dict[str, FingerConfig] = field(default_factory=dict)
    """At least one. A name begins the names of its observations."""
    # Not a `RobotConfig`, which this is one of: LeRobot would make options of it without an end.
    arm: dict[str, Any] | None = None
    """The settings of any robot that LeRobot knows, with its `type`; in Python its configuration,
    too. `None` for sensors alone."""

    def of_arm(self) -> RobotConfig | None:
        """The arm's configuration.

        Raises `draccus.DecodingError` for a setting or a type that LeRobot does not know.
        """
        if self.arm is None or isinstance(self.arm, RobotConfig):
            return self.arm
        # Its calibration is found by this name.
        return draccus.decode(RobotConfig, {"id": self.id, **self.arm})
