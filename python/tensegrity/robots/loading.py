"""Robots from packaged YAML files and from your own."""

from __future__ import annotations

from pathlib import Path

from tensegrity.packaged import PackagedModels
from tensegrity.robots.net import Net
from tensegrity.robots.robot import Robot

DEFAULT = "prism3"
"""The robot of recordings and files that name none."""

DEFAULT_NET = "superball"
"""The net that files build on when they name none."""

_ROBOTS = PackagedModels(Robot, Path(__file__).parent, "robot", lambda content: DEFAULT)
_NETS = PackagedModels(Net, Path(__file__).parent / "nets", "net", lambda content: DEFAULT_NET)


def packaged() -> list[str]:
    """Names of the robots that come with the package."""
    return _ROBOTS.names()


def load(name_or_path: str | Path = DEFAULT) -> Robot:
    """A packaged robot by name, or the robot that a YAML file describes.

    A file may state only what differs from the packaged robot it names with ``base`` (``prism3``
    when it names none); a list such as ``cables`` is replaced as a whole. A file that holds
    nothing but a name means that packaged robot.

    Raises :class:`InputError` with file, line and key.
    """
    return _ROBOTS.load(name_or_path)


def packaged_nets() -> list[str]:
    """Names of the nets that come with the package."""
    return _NETS.names()


def load_net(name_or_path: str | Path = DEFAULT_NET) -> Net:
    """A packaged net by name, or the net that a YAML file describes, by the rules of :func:`load`.

    Raises :class:`InputError` with file, line and key.
    """
    return _NETS.load(name_or_path)
