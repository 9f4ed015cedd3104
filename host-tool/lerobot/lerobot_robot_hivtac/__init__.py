"""A robot of LeRobot with HiVTac sensors at its fingers.

LeRobot imports this package because its name begins with `lerobot_robot_`. From then on
`--robot.type=hivtac` is known to `lerobot-record` and its other commands.
"""

from lerobot_robot_hivtac.config import FingerConfig, HivtacConfig
from lerobot_robot_hivtac.finger import FIELDS, Finger
from lerobot_robot_hivtac.robot import Hivtac

__all__ = ["FIELDS", "Finger", "FingerConfig", "Hivtac", "HivtacConfig"]
