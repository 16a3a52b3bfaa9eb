"""How the prism rolls: rest-length offsets looked up by the face it lies on.

The prism has eight faces. It rolls over the six that are not one of its triangles, in the order of
:data:`FACES`; each lies on three endcaps. Turning the robot by a third about its axis maps every
face to the next but one, so a gait is two rows of offsets, one per kind of face.
"""

from __future__ import annotations

from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from tensegrity.robots import PRISM_CABLES
from tensegrity.simulation.manoeuvres import Manoeuvre

FloatArray = NDArray[np.float64]

FACES = ((0, 3, 5), (0, 5, 2), (2, 5, 1), (2, 1, 4), (4, 1, 3), (4, 3, 0))
SIDE_CABLES = PRISM_CABLES[:6]

# Offsets [m] of the rest lengths of SIDE_CABLES on FACES[0] and FACES[1]; found by stochastic
# search. "left" and "right" are those of a counter-clockwise robot.
_STRAIGHT = (
    (0.436, -0.145, -0.211, -0.108, -0.002, -0.449),
    (-0.033, 0.123, -0.373, 0.048, 0.363, -0.339),
)
_RIGHT = (
    (0.022, -0.434, -0.451, -0.215, -0.044, -0.428),
    (0.100, 0.306, -0.387, 0.113, 0.151, -0.312),
)
_LEFT = (
    (0.438, -0.121, -0.313, 0.224, 0.154, -0.439),
    (0.021, 0.136, 0.102, 0.088, -0.097, -0.442),
)

REST_LENGTH_LIMITS = (0.55, 1.35)
"""Shortest and longest rest length of a side cable [m]."""

_FULL_STEER = np.radians(20)  # course error at which a straight run turns as fast as it can
_CROSS_TRACK_GAIN = np.radians(20)  # course correction per metre off the line
# Times are stated as what a cable can travel in them [m], so that they fit fast and slow robots.
_STUCK_AFTER = 1.0
_TIP_BACK = (0.26, 0.52)  # drawn at random
_REST = 0.5  # more than the largest offset
_TIP_BACK_AHEAD = (2, 4)  # faces ahead whose shape tips the robot back: from 2 up to, not with, 4
_NO_FACE = -1
_VARIATION = 0.06  # standard deviation of what a new attempt adds to the offsets [m]


def _turn_by_a_third(endcap: int) -> int:
    return (endcap + 2) % 6


def _expand(kinds: tuple[tuple[float, ...], ...]) -> FloatArray:
    """Offsets (faces, side cables) from those of the two kinds of face."""
    faces = {frozenset(face): index for index, face in enumerate(FACES)}
    cables = {frozenset(cable): index for index, cable in enumerate(SIDE_CABLES)}
    table = np.empty((len(FACES), len(SIDE_CABLES)))
    for kind, offsets in enumerate(kinds):
        face, names = frozenset(FACES[kind]), [frozenset(cable) for cable in SIDE_CABLES]
        for _ in range(3):
            for name, offset in zip(names, offsets, strict=True):
                table[faces[face], cables[name]] = offset
            face = frozenset(map(_turn_by_a_third, face))
            names = [frozenset(map(_turn_by_a_third, name)) for name in names]
    return table


class _Phase(Enum):
    ROLLING = auto()
    TIPPING_BACK = auto()
    RESTING = auto()


class Gait:
    """Rest lengths of the side cables for a manoeuvre, from the pose of the endcaps.

    Rolling backward is rolling forward with the endcaps counted from the other end (k -> 5 - k): a
    half turn that maps the prism onto itself. The mirror image of the robot turns the other way.
    Straight runs hold their line by blending in the turning gaits; turns run open loop.

    From rest the gaits set out from faces of the first kind only. On a face of the second kind, and
    when the robot stays on one face for too long, it first tips back over the edge it would have
    come from, by taking the shape of a face further on, and then returns to its undeformed shape. A
    new attempt at a face varies the offsets at random.
    """

    def __init__(
        self,
        manoeuvre: Manoeuvre,
        clockwise: bool,
        nominal: FloatArray,
        ground_normal: FloatArray,
        gain: float,
        cable_speed: float,
        rng: np.random.Generator,
    ) -> None:
        """``nominal`` (6,) are the rest lengths of the undeformed robot [m]; ``gain`` scales the
        offsets; ``cable_speed`` is that of the rest lengths [m/s]; ``rng`` draws how long and how
        the robot tips back when stuck."""
        self._reversed = manoeuvre is Manoeuvre.BACKWARD
        self._clockwise = clockwise
        straight, left, right = _expand(_STRAIGHT), _expand(_LEFT), _expand(_RIGHT)
        if clockwise:
            left, right = right, left
        self._straight, self._left, self._right = straight, left, right
        self._turn = {Manoeuvre.LEFT_TURN: left, Manoeuvre.RIGHT_TURN: right}.get(manoeuvre)
        relabelled = [frozenset(5 - endcap for endcap in cable) for cable in SIDE_CABLES]
        self._reverse_cables = [relabelled.index(frozenset(cable)) for cable in SIDE_CABLES]
        self._faces = np.array(FACES)
        self._nominal = nominal
        self._up = ground_normal
        self._gain = gain
        self._cable_speed = cable_speed
        self._rng = rng
        self._line: tuple[FloatArray, float] | None = None
        self._face = self._hard_face = _NO_FACE
        self._phase = _Phase.ROLLING
        self._phase_end = 0.0
        self._stuck_at = 0.0
        self._tip_back_shape = 0
        self._variation = np.zeros(len(SIDE_CABLES))

    def rest_lengths(self, time: float, endcaps: FloatArray) -> FloatArray:
        """Wanted rest lengths (6,) [m] at ``time`` [s] with ``endcaps`` (6, 3) in the world [m]."""
        if self._reversed:
            endcaps = endcaps[::-1]
        heights = endcaps @ self._up
        face = int(heights[self._faces].mean(axis=1).argmin())
        self._advance(face, time)
        table = self._steered(endcaps) if self._turn is None else self._turn
        offsets = self._gain * self._row(table, face)
        if self._reversed:
            offsets = offsets[self._reverse_cables]
        return np.clip(self._nominal + offsets, *REST_LENGTH_LIMITS)

    def _advance(self, face: int, time: float) -> None:
        """Note the face the robot lies on; begin and end attempts to get unstuck."""
        changed = face != self._face
        sets_out_badly = self._face == _NO_FACE and face % 2 == 1
        self._face = face
        if self._phase is _Phase.ROLLING:
            if changed:
                self._stuck_at = time + _STUCK_AFTER / self._cable_speed
                if face == (self._hard_face + 1) % len(FACES):
                    self._hard_face = _NO_FACE
            stuck = time > self._stuck_at
            if stuck:
                self._hard_face = face
                self._variation = self._rng.normal(0.0, _VARIATION, len(SIDE_CABLES))
            if stuck or sets_out_badly:
                self._phase = _Phase.TIPPING_BACK
                self._phase_end = time + self._rng.uniform(*_TIP_BACK) / self._cable_speed
                ahead = int(self._rng.integers(*_TIP_BACK_AHEAD))
                self._tip_back_shape = (face + ahead) % len(FACES)
        elif self._phase is _Phase.TIPPING_BACK:
            if changed or time > self._phase_end:
                self._phase = _Phase.RESTING
                self._phase_end = time + _REST / self._cable_speed
        elif time > self._phase_end:
            self._phase = _Phase.ROLLING
            self._stuck_at = time + _STUCK_AFTER / self._cable_speed

    def _row(self, table: FloatArray, face: int) -> FloatArray:
        """Offsets (6,) for ``face`` in the current phase."""
        if self._phase is _Phase.RESTING:
            return np.zeros(len(SIDE_CABLES))
        if self._phase is _Phase.TIPPING_BACK:
            return table[self._tip_back_shape]
        return table[face] + (self._variation if face == self._hard_face else 0)

    def _steered(self, endcaps: FloatArray) -> FloatArray:
        """The straight gait with as much of a turn as leads back to the line of the start."""
        centre = endcaps[:, :2].mean(axis=0)
        axis = (endcaps[0::2] - endcaps[1::2]).sum(axis=0)
        # The prism rolls across its axis: to the left of it, its mirror image to the right.
        course = np.arctan2(axis[0], -axis[1])
        if self._clockwise:
            course += np.pi
        if self._line is None:
            self._line = centre, course
        start, wanted = self._line
        off = centre - start
        to_the_left = np.cos(wanted) * off[1] - np.sin(wanted) * off[0]
        correction = np.clip(_CROSS_TRACK_GAIN * to_the_left, -np.pi / 4, np.pi / 4)
        error = (wanted - correction - course + np.pi) % (2 * np.pi) - np.pi
        steer = float(np.clip(error / _FULL_STEER, -1, 1))
        turning = self._left if steer > 0 else self._right
        return (1 - abs(steer)) * self._straight + abs(steer) * turning
