"""The robot: what its arm observes and does, and what its fingers feel."""

from contextlib import ExitStack
from typing import Any

from lerobot.robots.robot import Robot
from lerobot.robots.utils import make_robot_from_config

from lerobot_robot_hivtac.config import HivtacConfig
from lerobot_robot_hivtac.finger import FIELDS, Finger


class Hivtac(Robot):
    """An arm of LeRobot with sensors at its fingers, or sensors alone. Actions are the arm's."""

    config_class = HivtacConfig
    name = "hivtac"

    def __init__(self, config: HivtacConfig) -> None:
        super().__init__(config)
        if not config.fingers:
            raise ValueError("give at least one finger, such as --robot.fingers='{thumb: {}}'")
        self.config = config
        self.fingers = {name: Finger(name, own) for name, own in config.fingers.items()}
        of_arm = config.of_arm()
        self.arm: Robot | None = make_robot_from_config(of_arm) if of_arm else None
        self._pictured = {
            name: finger for name, finger in self.fingers.items() if finger.config.picture
        }
        self.cameras = {**getattr(self.arm, "cameras", {}), **self._pictured}
        self._check_names()

    def _check_names(self) -> None:
        of_arm = set(self.arm.observation_features) if self.arm else set()
        twice = of_arm & set(self._finger_features)
        if twice:
            raise ValueError(f"the arm observes {sorted(twice)}, too: name the fingers otherwise")

    @property
    def _finger_features(self) -> dict[str, Any]:
        numbers = {f"{name}.{field}": float for name in self.fingers for field in FIELDS}
        pictures = {
            name: (finger.config.height, finger.config.width, 3)
            for name, finger in self._pictured.items()
        }
        return {**numbers, **pictures}

    @property
    def observation_features(self) -> dict[str, Any]:
        """The arm's, then those of each finger: `FIELDS` after its name and a dot, and its
        picture's shape under its name."""
        of_arm = self.arm.observation_features if self.arm else {}
        return {**of_arm, **self._finger_features}

    @property
    def action_features(self) -> dict[str, Any]:
        """The arm's."""
        return self.arm.action_features if self.arm else {}

    @property
    def is_connected(self) -> bool:
        """Whether all fingers and the arm are."""
        fingers = all(finger.is_connected for finger in self.fingers.values())
        return fingers and (self.arm is None or self.arm.is_connected)

    def connect(self, calibrate: bool = True) -> None:
        """Connects the fingers, then the arm. What is connected ends again when one fails.

        Raises `hivtac.Error`, `ValueError` for another size of picture, or the arm's errors.
        """
        with ExitStack() as connected:
            for finger in self.fingers.values():
                finger.connect()
                connected.callback(finger.disconnect)
            if self.arm is not None:
                self.arm.connect(calibrate)
            connected.pop_all()

    @property
    def is_calibrated(self) -> bool:
        """Whether the arm is. A sensor has its calibration in itself."""
        return self.arm is None or self.arm.is_calibrated

    def calibrate(self) -> None:
        """Calibrates the arm."""
        if self.arm is not None:
            self.arm.calibrate()

    def configure(self) -> None:
        """Configures the arm."""
        if self.arm is not None:
            self.arm.configure()

    def get_observation(self) -> dict[str, Any]:
        """Everything of `observation_features`. Fingers answer at once, after the arm.

        Raises `hivtac.LostError` once a sensor is lost.
        """
        observation = dict(self.arm.get_observation()) if self.arm else {}
        for name, finger in self.fingers.items():
            felt = finger.observe()
            observation.update({f"{name}.{field}": felt[field] for field in FIELDS})
        for name, finger in self._pictured.items():
            observation[name] = finger.picture()
        return observation

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Sends it to the arm; returns what the arm was sent."""
        return self.arm.send_action(action) if self.arm else action

    def disconnect(self) -> None:
        """Ends all connections, the arm's first."""
        with ExitStack() as connected:
            for finger in self.fingers.values():
                connected.callback(finger.disconnect)
            if self.arm is not None and self.arm.is_connected:
                self.arm.disconnect()
