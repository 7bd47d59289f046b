"""What an arm is: its chain, tool and limits, read from a URDF through Pinocchio."""

from robots.library import RobotInfo, list_robots, load_robot
from robots.robot import Robot, RobotError

__all__ = ["Robot", "RobotError", "RobotInfo", "list_robots", "load_robot"]
