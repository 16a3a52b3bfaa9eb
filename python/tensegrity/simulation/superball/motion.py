"""How the robot moves: rest lengths of the actuated cables over time.

C = Caluwaerts et al. 2016. The faces of the six-rod robot are twenty triangles: eight have cables
on all three sides, twelve have one side open. Six of the eight have one actuated cable, two have
three.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tensegrity.errors import InputError
from tensegrity.robots.net import Net

FloatArray = NDArray[np.float64]
Face = tuple[int, int, int]


class Experiment(StrEnum):
    """The experiments of C §V."""

    ROLLING = "rolling"
    LOCAL = "local"


class Motion(Protocol):
    """Commands rest lengths."""

    first_face: Face
    """Indices of the nodes that are down at first."""
    cable_speed: float
    """Fastest change of a rest length [m/s]."""
    duration: float
    """Of a recording of which nothing else is said [s]."""

    def course(self, nodes: FloatArray) -> float | None:
        """Direction in which the robot will go from x toward y [rad], with the nodes (n, 3) lying
        on the first face; None when it stays."""
        ...

    def rest_lengths(self, time: float, nodes: FloatArray) -> FloatArray:
        """Wanted rest lengths (cables,) [m] at ``time`` [s] since the start of the motion, with the
        nodes (n, 3) in the world [m]."""
        ...


class Faces:
    """The triangles the undeformed robot can lie on."""

    def __init__(self, net: Net) -> None:
        hull = ConvexHull(net.undeformed_positions())
        self._faces = [_as_face(simplex) for simplex in np.sort(hull.simplices, axis=1)]
        self._nodes = np.array(self._faces)
        cables = {frozenset(ends) for ends in net.cable_ends().tolist()}
        self.closed = sorted(face for face in self._faces if cables >= set(sides(face)))
        """Those with cables on all three sides."""

    def down(self, nodes: FloatArray) -> Face:
        """The face with the lowest centre for nodes (n, 3) in the world."""
        return self._faces[int(nodes[:, 2][self._nodes].mean(axis=1).argmin())]

    def beyond(self, face: Face, side: frozenset[int]) -> Face:
        """The neighbour of ``face`` at one of its sides."""
        return next(other for other in self._faces if other != face and side <= set(other))


def sides(face: Face) -> list[frozenset[int]]:
    """Pairs of nodes at the sides of a face."""
    return [frozenset((face[i], face[i - 1])) for i in range(3)]


class Rolling:
    """Face to face: shorten the actuated cable of the face that is down by ``stroke``.

    The robot tips over one of the other two sides, crosses the open face beyond it and falls onto
    the next closed face. There the cable is let out again, the robot comes to rest, and the next
    roll begins. On SUPERball each roll leads 0.7 m on. The actuated cables of the six closed faces
    that have only one form a ring; their faces follow each other in a cycle, alternately turned to
    the right and to the left, so that the robot keeps a straight line.
    """

    duration = 75.0

    _REST_S = 2.0
    _PATIENCE_S = 2.0  # with the cable as short as it gets

    def __init__(
        self, net: Net, stroke: float, cable_speed: float, rng: np.random.Generator
    ) -> None:
        """``rng`` draws the first face. Raises :class:`InputError` for a robot whose faces do not
        follow each other in this way."""
        self._faces = Faces(net)
        self._nominal = net.rest_lengths()
        self.cable_speed = cable_speed
        self._stroke, self._full_travel_s = stroke, stroke / cable_speed
        ends = {index: frozenset(net.cable_ends()[index].tolist()) for index in net.actuated()}
        self._cables = {
            face: next((index for index in ends if ends[index] in sides(face)), None)
            for face in self._faces.closed
        }
        ring = {
            face: next(end for end in ends.values() if end in sides(face))
            for face in self._faces.closed
            if sum(end in sides(face) for end in ends.values()) == 1
        }
        self._rolled_over = {
            face: side
            for face, cable in ring.items()
            for side in sides(face)
            if side != cable
            and any(next_ in sides(self._faces.beyond(face, side)) for next_ in ring.values())
        }
        if not self._rolled_over or None in self._cables.values():
            raise InputError(
                f"{net.name} has no ring of actuated cables to roll along",
                field="net",
                hint="rolling is that of SUPERball",
            )
        faces = sorted(self._rolled_over)
        self.first_face = faces[int(rng.integers(len(faces)))]
        self._left: Face | None = None  # while a cable is being shortened
        self._until = 0.0
        self._goal = self._nominal

    def course(self, nodes: FloatArray) -> float:
        one, other = nodes[list(self._rolled_over[self.first_face]), :2]
        inside = nodes[list(self.first_face), :2].mean(axis=0)
        across = np.array([(one - other)[1], (other - one)[0]])
        across *= np.sign(across @ (one - inside))
        return float(np.arctan2(across[1], across[0]))

    def rest_lengths(self, time: float, nodes: FloatArray) -> FloatArray:
        face = self._faces.down(nodes)
        if self._left is not None:
            arrived = face != self._left and face in self._cables
            if arrived or time > self._until:
                self._left, self._goal = None, self._nominal
                self._until = time + self._full_travel_s + self._REST_S
        elif time >= self._until and (cable := self._cables.get(face)) is not None:
            self._left = face
            self._goal = self._nominal.copy()
            self._goal[cable] -= self._stroke
            self._until = time + self._full_travel_s + self._PATIENCE_S
        return self._goal


class Local:
    """C §V-B: the robot stays where it is, two actuators follow sinusoids in steps, a quarter of a
    period apart.

    Both cables end at node 2, and none that moves at node 1, which is on the same rod.
    """

    cable_speed = 0.3  # steps are taken as fast as motors can
    duration = 60.0

    _CABLES = (frozenset((2, 5)), frozenset((4, 2)))
    _FACE = (4, 10, 12)  # rod 1-2 is level
    _AMPLITUDE_M = 0.12
    _PERIOD_S = 12.0
    _STEP_S = 0.75

    def __init__(self, net: Net) -> None:
        """Raises :class:`InputError` for a robot without these cables or this face."""
        ends = [frozenset(cable.ends) for cable in net.cables]
        try:
            self._moved = [ends.index(cable) for cable in self._CABLES]
            first, second, third = (net.index_of(node) for node in self._FACE)
        except (KeyError, ValueError):
            raise InputError(
                f"{net.name} has no cables 2-5 and 4-2 or no nodes 4, 10, 12",
                field="net",
                hint="local motion is that of SUPERball",
            ) from None
        self.first_face = first, second, third
        self._nominal = net.rest_lengths()

    def course(self, nodes: FloatArray) -> None:
        return None

    def rest_lengths(self, time: float, nodes: FloatArray) -> FloatArray:
        held = np.floor(time / self._STEP_S) * self._STEP_S
        phases = 2 * np.pi * held / self._PERIOD_S - np.array([0.0, np.pi / 2])
        # From the nominal length and back: motors take cable in, they have none to give.
        shortening = self._AMPLITUDE_M * (1 - np.cos(phases)) / 2
        if time < self._PERIOD_S / 4:
            shortening[1] = 0.0  # has yet to begin
        lengths = self._nominal.copy()
        lengths[self._moved] -= shortening
        return lengths


def _as_face(nodes: NDArray[np.int32]) -> Face:
    first, second, third = nodes.tolist()
    return first, second, third
