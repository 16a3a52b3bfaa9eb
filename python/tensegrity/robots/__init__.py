"""Robots as data: :class:`Robot` is a 3-bar prism, :class:`Net` any tensegrity as a spring-mass
net; :func:`load` and :func:`load_net` for packaged ones and for your own YAML."""

from tensegrity.robots.loading import (
    DEFAULT,
    DEFAULT_NET,
    load,
    load_net,
    packaged,
    packaged_nets,
)
from tensegrity.robots.net import Ground, Net, NetCable, NetRod, Node
from tensegrity.robots.robot import PRISM_CABLES, PRISM_RODS, Cable, Robot

__all__ = [
    "DEFAULT",
    "DEFAULT_NET",
    "PRISM_CABLES",
    "PRISM_RODS",
    "Cable",
    "Ground",
    "Net",
    "NetCable",
    "NetRod",
    "Node",
    "Robot",
    "load",
    "load_net",
    "packaged",
    "packaged_nets",
]
