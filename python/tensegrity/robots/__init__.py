"""Robots as data: :class:`Robot`, and :func:`load` for packaged ones and for your own YAML."""

from tensegrity.robots.loading import DEFAULT, load, packaged
from tensegrity.robots.robot import PRISM_CABLES, PRISM_RODS, Cable, Robot

__all__ = ["DEFAULT", "PRISM_CABLES", "PRISM_RODS", "Cable", "Robot", "load", "packaged"]
