"""What an arm is: its chain, tool and limits, read from a URDF through Pinocchio."""

from robots.library import list_robots, load_robot
from robots.robot import Robot, RobotError

__all__ = ["Robot", "RobotError", "list_robots", "load_robot"]
