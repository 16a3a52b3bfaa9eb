"""The description of any tensegrity as a spring-mass net."""

from __future__ import annotations

import math
from collections import Counter
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from tensegrity.errors import InputError
from tensegrity.robots.robot import Robot
from tensegrity.yaml_model import StrictModel, field, inconsistent

# YAML has lists, Python's immutable sequence is the tuple: only the container is converted.
NodeId = Annotated[int, Field(ge=0)]
Ends = Annotated[tuple[NodeId, NodeId], Field(strict=False)]
Position = Annotated[tuple[float, float, float], Field(strict=False)]

PRISM_ROD_STIFFNESS = 1e5
"""Of the rods of :meth:`Net.from_prism` [N/m]: a prism's YAML has rigid rods. Under the few hundred
newtons of its cables a rod shortens by some millimetres, and steps of some milliseconds stay
stable."""

_ROD_LENGTH_TOLERANCE = 0.05


class Node(StrictModel):
    """A point mass of the net: one end of one rod."""

    id: NodeId = field("number of the node in recordings")
    position: Position = field("in the undeformed robot, any frame", unit="m")


class NetRod(StrictModel):
    """A rod that pushes and pulls with ``stiffness * (length - rod_length) + damping * rate``."""

    ends: Ends = field("ids of the nodes the rod joins")
    stiffness: float = field("stiffness", unit="N/m", gt=0)
    damping: float = field("damping", unit="N s/m", ge=0)


class NetCable(StrictModel):
    """A cable that pulls with ``stiffness * (length - rest_length) + damping * rate``, never
    pushes."""

    ends: Ends = field("ids of the nodes the cable joins")
    kind: Literal["actuated", "passive"] = field("whether a motor changes the rest length")
    stiffness: float = field("stiffness", unit="N/m", gt=0)
    damping: float = field("damping", unit="N s/m", ge=0)
    rest_length: float = field("rest length", unit="m", gt=0)


class Ground(StrictModel):
    """The plane z = 0 as a penalty. At depth d and downward speed v it pushes a node up with
    ``max(0, d * (stiffness + damping * v))``; friction is a spring and a damper to the point where
    the node stands, as far as the cone of static friction allows."""

    stiffness: float = field("normal force per depth", unit="N/m", gt=0)
    damping: float = field("normal force per depth and speed", unit="N s/m^2", ge=0)
    friction_stiffness: float = field(
        "friction per displacement of a standing node", unit="N/m", gt=0
    )
    friction_damping: float = field("friction per speed of a standing node", unit="N s/m", ge=0)
    friction_static: float = field("coefficient of friction of a standing node", ge=0)
    friction_kinetic: float = field("coefficient of friction of a sliding node", ge=0)

    @model_validator(mode="after")
    def _slides_no_harder_than_it_stands(self) -> Ground:
        if self.friction_kinetic > self.friction_static:
            raise inconsistent(
                f"kinetic friction {self.friction_kinetic:g} is above static friction "
                f"{self.friction_static:g}",
                "friction_kinetic",
                "friction_static",
            )
        return self


class Net(StrictModel):
    """A tensegrity as point masses, elastic rods and cables (C §IV-A; C = Caluwaerts et al. 2016).

    Arrays are in the order of ``nodes``, ``rods`` and ``cables``; members are the rods, then the
    cables. Every node is the end of exactly one rod, and ranging modules sit on the rods,
    ``module_inset`` from their ends.
    """

    name: str = field("name of the robot", min_length=1)
    rod_length: float = field("of every rod without load", unit="m", gt=0)
    node_mass: float = field("mass of every node", unit="kg", gt=0)
    module_inset: float = field("ranging module from the end of its rod", unit="m", ge=0)
    nodes: Annotated[tuple[Node, ...], Field(strict=False, min_length=2)] = field(
        "ids, and positions [m] in the undeformed robot"
    )
    rods: Annotated[tuple[NetRod, ...], Field(strict=False, min_length=1)] = field(
        "rods; stiffness [N/m], damping [N s/m]"
    )
    cables: Annotated[tuple[NetCable, ...], Field(strict=False)] = field(
        "cables; stiffness [N/m], damping [N s/m], rest_length [m]"
    )
    ground: Ground = field("the plane z = 0")

    @field_validator("nodes")
    @classmethod
    def _have_ids_of_their_own(cls, nodes: tuple[Node, ...]) -> tuple[Node, ...]:
        for id_, count in Counter(node.id for node in nodes).items():
            if count > 1:
                raise ValueError(f"node {id_} is there {count} times")
        return nodes

    @model_validator(mode="after")
    def _members_join_nodes(self) -> Net:
        known = {node.id for node in self.nodes}
        seen: set[frozenset[int]] = set()
        for key, members in (("rods", self.rods), ("cables", self.cables)):
            for member in members:
                for id_ in member.ends:
                    if id_ not in known:
                        raise inconsistent(f"{key}: there is no node {id_}", key, "nodes")
                if member.ends[0] == member.ends[1]:
                    raise inconsistent(f"{key}: {list(member.ends)} joins a node to itself", key)
                if frozenset(member.ends) in seen:
                    raise inconsistent(f"{key}: {list(member.ends)} is there twice", key)
                seen.add(frozenset(member.ends))
        return self

    @model_validator(mode="after")
    def _has_one_rod_at_every_node(self) -> Net:
        count = Counter(id_ for rod in self.rods for id_ in rod.ends)
        for node in self.nodes:
            if count[node.id] != 1:
                raise inconsistent(
                    f"node {node.id} is the end of {count[node.id]} rods, expected one",
                    "rods",
                    "nodes",
                )
        return self

    @model_validator(mode="after")
    def _fits_its_rods(self) -> Net:
        where = {node.id: node.position for node in self.nodes}
        for rod in self.rods:
            distance = math.dist(*(where[id_] for id_ in rod.ends))
            if abs(distance / self.rod_length - 1) > _ROD_LENGTH_TOLERANCE:
                raise inconsistent(
                    f"nodes {list(rod.ends)} of a rod are {distance:.3g} m apart, rod_length is "
                    f"{self.rod_length:g} m",
                    "rod_length",
                    "nodes",
                )
        if 2 * self.module_inset >= self.rod_length:
            raise inconsistent(
                f"module_inset {self.module_inset:g} m is beyond the middle of a rod of "
                f"{self.rod_length:g} m",
                "module_inset",
                "rod_length",
            )
        return self

    @classmethod
    def from_prism(
        cls,
        robot: Robot,
        *,
        ground: Ground | None = None,
        rod_stiffness: float = PRISM_ROD_STIFFNESS,
        rod_damping: float = 0.0,
    ) -> Net:
        """The net of a 3-bar prism.

        Half of a rod's mass is at each of its endcaps, cables pull on the rods' axes, endcaps are
        points, modules sit at the rods' ends. ``ground`` is SUPERball's unless stated.
        """
        if ground is None:
            from tensegrity.robots.loading import load_net  # which needs this module

            ground = load_net("superball").ground
        return cls(
            name=robot.name,
            rod_length=robot.rod_length,
            node_mass=robot.rod_mass / 2,
            module_inset=0.0,
            nodes=tuple(
                Node(id=i, position=(x, y, z))
                for i, (x, y, z) in enumerate(robot.undeformed_endcaps().tolist())
            ),
            rods=tuple(
                NetRod(ends=ends, stiffness=rod_stiffness, damping=rod_damping)
                for ends in robot.rods
            ),
            cables=tuple(
                NetCable(
                    ends=cable.endcaps,
                    kind=cable.kind,
                    stiffness=cable.stiffness,
                    damping=cable.damping,
                    rest_length=cable.rest_length,
                )
                for cable in robot.cables
            ),
            ground=ground,
        )

    @property
    def members(self) -> tuple[NetRod | NetCable, ...]:
        """The rods, then the cables."""
        return (*self.rods, *self.cables)

    @property
    def node_ids(self) -> tuple[int, ...]:
        """Ids in the order of ``nodes``."""
        return tuple(node.id for node in self.nodes)

    def index_of(self, node_id: int) -> int:
        """Position of a node in ``nodes``; KeyError when there is none."""
        try:
            return self.node_ids.index(node_id)
        except ValueError:
            raise KeyError(f"{self.name} has no node {node_id}") from None

    def undeformed_positions(self) -> NDArray[np.float64]:
        """Positions (n, 3) of the nodes as described [m]."""
        return np.array([node.position for node in self.nodes])

    def rod_ends(self) -> NDArray[np.int32]:
        """Indices (rods, 2) of the nodes that each rod joins."""
        return self._indices(tuple(rod.ends for rod in self.rods))

    def cable_ends(self) -> NDArray[np.int32]:
        """Indices (cables, 2) of the nodes that each cable joins."""
        return self._indices(tuple(cable.ends for cable in self.cables))

    def rest_lengths(self) -> NDArray[np.float64]:
        """Rest lengths (cables,) as described [m]."""
        return np.array([cable.rest_length for cable in self.cables])

    def actuated(self) -> NDArray[np.int64]:
        """Positions in ``cables`` of those with a motor."""
        return np.flatnonzero([cable.kind == "actuated" for cable in self.cables])

    def partners(self) -> NDArray[np.int32]:
        """For each node the index (n,) of the other end of its rod."""
        ends = self.rod_ends()
        partners = np.empty(len(self.nodes), dtype=np.int32)
        partners[ends[:, 0]], partners[ends[:, 1]] = ends[:, 1], ends[:, 0]
        return partners

    def module_positions(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions (..., n, 3) of the ranging modules [m] for those of the nodes."""
        toward = positions[..., self.partners(), :] - positions
        length = np.linalg.norm(toward, axis=-1, keepdims=True)
        return positions + self.module_inset * toward / length

    def standing_on(self, face: tuple[int, int, int]) -> NDArray[np.float64]:
        """Positions (n, 3) [m] of the undeformed net with the three nodes of ``face`` (ids) on the
        ground z = 0, the rest above it, its centre over the origin.

        Raises :class:`InputError` when other nodes are on both sides of the face.
        """
        positions = self.undeformed_positions() - self.undeformed_positions().mean(axis=0)
        a, b, c = (positions[self.index_of(id_)] for id_ in face)
        up = np.cross(b - a, c - a)
        if up @ a > 0:
            up = -up
        up /= np.linalg.norm(up)
        ahead = (b - a) / np.linalg.norm(b - a)
        world = positions @ np.column_stack([ahead, np.cross(up, ahead), up])
        world[:, 2] -= world[self.index_of(face[0]), 2]
        if world[:, 2].min() < -1e-9 * self.rod_length:
            raise InputError(
                f"{self.name} cannot stand on the nodes {list(face)}", hint="other nodes are lower"
            )
        return world

    def _indices(self, ends: tuple[tuple[int, int], ...]) -> NDArray[np.int32]:
        index = {id_: i for i, id_ in enumerate(self.node_ids)}
        return np.array([[index[a], index[b]] for a, b in ends], dtype=np.int32).reshape(-1, 2)
