"""The description of a 3-bar prism."""

from __future__ import annotations

import math
from statistics import fmean
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from tensegrity.yaml_model import StrictModel, field, inconsistent

PRISM_RODS = ((0, 1), (2, 3), (4, 5))
"""Endcaps of the rods; the first rod carries the base IMU."""

PRISM_CABLES = ((0, 4), (0, 2), (2, 4), (1, 5), (1, 3), (3, 5), (1, 4), (0, 3), (2, 5))
"""Endcaps of the cables in the order of T eq. 1: six side cables, then three cross cables."""

# YAML has lists, Python's immutable sequence is the tuple: only the container is converted.
Endcap = Annotated[int, Field(ge=0)]
Pair = Annotated[tuple[Endcap, Endcap], Field(strict=False)]

LARGEST_MISALIGNMENT = math.radians(20)
"""An IMU that was mounted along the rod is off by less; more is another choice of axes [rad]."""

SmallAngle = Annotated[float, Field(ge=-LARGEST_MISALIGNMENT, le=LARGEST_MISALIGNMENT)]


class Cable(StrictModel):
    """A cable that pulls with ``stiffness * (length - rest_length) + damping * rate``, never
    pushes."""

    endcaps: Pair = field("endcaps the cable joins")
    kind: Literal["actuated", "passive"] = field("side cables are actuated, cross cables passive")
    stiffness: float = field("stiffness", unit="N/m", gt=0)
    damping: float = field("damping", unit="N s/m", ge=0)
    rest_length: float = field("rest length", unit="m", gt=0)


class Robot(StrictModel):
    """A 3-bar prism: three rods joined by nine cables (T §III-A).

    Body frame: that of the base IMU on rod (0, 1), z from endcap 1 to endcap 0, origin
    ``imu_offset`` from the rod's centre toward endcap 0. An IMU whose own z axis misses the rod's
    is turned into the body frame by ``imu_misalignment``; ``cable_offsets`` are taken off the
    measured lengths. ``tensegrity calibrate-robot`` finds all three from a recording.
    """

    name: str = field("name of the robot", min_length=1)
    chirality: Literal["counter_clockwise", "clockwise"] = field(
        "sense in which the rods twist; counter_clockwise is the robot of T Fig. 2"
    )
    rod_length: float = field("between the endcap centres of a rod", unit="m", gt=0)
    rod_diameter: float = field("diameter of a rod", unit="m", gt=0)
    rod_mass: float = field("mass of a rod", unit="kg", gt=0)
    imu_offset: float = field("IMU from the centre of rod (0, 1) toward endcap 0", unit="m")
    imu_misalignment: Annotated[tuple[SmallAngle, SmallAngle], Field(strict=False)] = field(
        "turns about the body's x and y that take the body frame to the IMU's", unit="rad"
    )
    endcap_radius: float = field("radius of the spherical endcaps", unit="m", ge=0)
    cable_attachment_offset: float = field(
        "distance of the cables' attachment points from the rod's axis", unit="m", ge=0
    )
    rods: Annotated[tuple[Pair, ...], Field(strict=False)] = field("endcaps of each rod")
    cables: Annotated[tuple[Cable, ...], Field(strict=False)] = field(
        "cables in the order of T eq. 1; stiffness [N/m], damping [N s/m], rest_length [m]"
    )
    cable_offsets: Annotated[tuple[float, ...], Field(strict=False)] = field(
        "constant errors of the measured lengths, in the order of the cables", unit="m"
    )

    @field_validator("rods")
    @classmethod
    def _are_those_of_the_prism(cls, rods: tuple[Pair, ...]) -> tuple[Pair, ...]:
        if rods != PRISM_RODS:
            raise ValueError(f"expected the rods of the prism, {_listing(PRISM_RODS)}")
        return rods

    @field_validator("cables")
    @classmethod
    def _are_in_the_order_of_the_paper(cls, cables: tuple[Cable, ...]) -> tuple[Cable, ...]:
        if tuple(cable.endcaps for cable in cables) != PRISM_CABLES:
            raise ValueError(f"expected the cables of the prism in order, {_listing(PRISM_CABLES)}")
        return cables

    @model_validator(mode="after")
    def _has_an_offset_for_every_cable(self) -> Robot:
        if len(self.cable_offsets) != len(self.cables):
            raise inconsistent(
                f"expected {len(self.cables)} offsets [m], one per cable, "
                f"got {len(self.cable_offsets)}",
                "cable_offsets",
            )
        return self

    @model_validator(mode="after")
    def _can_be_built(self) -> Robot:
        if abs(self.imu_offset) > self.rod_length / 2:
            raise inconsistent(
                f"imu_offset {self.imu_offset:g} m is off the rod, which ends at "
                f"{self.rod_length / 2:g} m",
                "imu_offset",
                "rod_length",
            )
        if self._rod_across() >= self.rod_length:
            raise inconsistent(
                f"a prism with side cables of {self.side_length:g} m needs rods longer than "
                f"{self._rod_across():.3g} m, rod_length is {self.rod_length:g} m",
                "rod_length",
                "cables",
            )
        return self

    @property
    def number_of_endcaps(self) -> int:
        """Two per rod."""
        return 2 * len(self.rods)

    @property
    def side_length(self) -> float:
        """Length of the side cables of the undeformed prism [m]: mean actuated rest length."""
        rest = [cable.rest_length for cable in self.cables if cable.kind == "actuated"]
        return fmean(rest)

    def undeformed_endcaps(self) -> NDArray[np.float64]:
        """Endcap centres (6, 3) of the undeformed prism in the body frame [m].

        Both triangles are equilateral with sides of :attr:`side_length`. Even endcaps stand at
        120 deg * k on one circle, odd ones at 120 deg * k - 150 deg on the other (mirrored for a
        clockwise robot); then the shortest rotation takes rod (0, 1) to the body z axis.
        """
        radius = self.side_length / math.sqrt(3)
        height = math.sqrt(self.rod_length**2 - self._rod_across() ** 2)
        mirror = 1.0 if self.chirality == "counter_clockwise" else -1.0
        even = np.radians([0.0, 120.0, 240.0])
        endcaps = np.empty((6, 3))
        for first, angle, level in (
            (0, even, height / 2),
            (1, even - np.radians(150), -height / 2),
        ):
            endcaps[first::2, 0] = radius * np.cos(angle)
            endcaps[first::2, 1] = mirror * radius * np.sin(angle)
            endcaps[first::2, 2] = level
        axis = (endcaps[0] - endcaps[1]) / self.rod_length
        w = np.cross(axis, [0.0, 0.0, 1.0])
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        rotation = np.eye(3) + skew + skew @ skew / (1 + axis[2])  # Rodrigues; axis[2] = h/L > 0
        body = (endcaps - (endcaps[0] + endcaps[1]) / 2) @ rotation.T
        body[:, 2] -= self.imu_offset
        return body

    def _rod_across(self) -> float:
        """Horizontal extent of a rod of the undeformed prism [m]: its ends are 150 deg apart."""
        return 2 * self.side_length / math.sqrt(3) * math.sin(math.radians(75))


def _listing(pairs: tuple[tuple[int, int], ...]) -> str:
    return ", ".join(f"[{i}, {j}]" for i, j in pairs)
