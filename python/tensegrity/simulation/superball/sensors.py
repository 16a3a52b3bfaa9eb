"""What a ranging robot's sensors say about a motion that is known at every simulation step.

C = Caluwaerts et al. 2016. Rows of the arrays given here are simulation steps if nothing else is
said, the first is time zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tensegrity.ranging.radio import Links, rejects
from tensegrity.ranging.recording import Anchors, InternalRanges, Offsets, RangeRecording
from tensegrity.ranging.sequence import MotorStream
from tensegrity.robots.net import Net
from tensegrity.sequence.sequence import ImuStream
from tensegrity.simulation.rigid_bodies import STEP_S
from tensegrity.simulation.sensors import FrameMotion, inertial_samples, stamps
from tensegrity.simulation.superball.options import SuperballOptions

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

IMU_PERIOD_S = 0.01
IMU_STEPS = round(IMU_PERIOD_S / STEP_S)
CONTROL_PERIOD_S = 0.01
"""Of the motors, whose encoders are read at half that rate."""
MOTOR_PERIOD_S = 2 * CONTROL_PERIOD_S
_SATURATED_RATE = np.radians(2000)
_PACKET_SPACING_S = 0.001  # C §III-B


@dataclass(frozen=True)
class PairOffsets:
    """Antenna offsets (n, n + anchors) [m] between every node and every node or anchor, in the
    order of the net and of the anchors."""

    table: FloatArray

    @classmethod
    def draw(
        cls, nodes: int, anchors: int, options: SuperballOptions, rng: np.random.Generator
    ) -> PairOffsets:
        """Each module adds to the offsets of its pairs, and each pair has something of its own: C
        found offsets of single modules not to be enough."""
        count = nodes + anchors
        module = rng.normal(0.0, options.module_offset_std, count)
        pair = np.triu(rng.normal(0.0, options.pair_offset_std, (count, count)), 1)
        table = options.offset_mean + module[:, None] + module[None, :] + pair + pair.T
        return cls(table[:nodes])

    def listed(self, net: Net, anchors: Anchors) -> Offsets:
        """Of every pair, by ids; pairs of nodes in the order of the net."""
        ids = np.array(net.node_ids, dtype=np.int64)
        first, second = np.triu_indices(len(ids), 1)
        node, anchor = np.divmod(np.arange(len(ids) * len(anchors)), len(anchors))
        return Offsets(
            node=np.concatenate([ids[node], ids[first]]),
            anchor=np.concatenate([anchors.ids[anchor], ids[second]]),
            offset_m=np.concatenate(
                [self.table[node, len(ids) + anchor], self.table[first, second]]
            ),
        )


def ranges(
    modules: FloatArray,
    net: Net,
    anchors: Anchors,
    offsets: PairOffsets,
    options: SuperballOptions,
    rng: np.random.Generator,
) -> tuple[RangeRecording, InternalRanges]:
    """Raw ranges from ``modules`` (N, n, 3), positions of the robot's modules [m].

    Modules range by broadcasts (C §III-A.2), nodes first, then anchors: packets are sent one after
    the other, first all polls, then all responses, then all finals. A range is the distance when
    the module that computes it responds, and is stamped with that moment. Only nodes report, so a
    pair of nodes gives two ranges in a round, a node and an anchor one.
    """
    nodes, count = len(net.nodes), len(net.nodes) + len(anchors)
    ids = np.concatenate([net.node_ids, anchors.ids]).astype(np.int64)
    node, other = (index.ravel() for index in np.indices((nodes, count)))
    node, other = node[node != other], other[node != other]
    # Both directions share a link.
    links, link_of = np.unique(
        np.minimum(node, other) * count + np.maximum(node, other), return_inverse=True
    )
    states = Links(len(links), rng) if options.obstacles else None
    responds_after = np.round((count + np.arange(nodes)) * _PACKET_SPACING_S / STEP_S).astype(int)
    period = 1 / options.round_rate
    rounds = int(np.floor((len(modules) * STEP_S - 3 * count * _PACKET_SPACING_S) / period))
    columns: list[tuple[IntArray, IntArray, IntArray, FloatArray]] = []
    for number in range(rounds):
        steps = round(number * period / STEP_S) + responds_after
        # Anchors stand still; nodes are where they are when `node` responds.
        near = modules[steps, np.arange(nodes)]
        everything = np.broadcast_to(anchors.position_m, (nodes, len(anchors), 3))
        far = np.concatenate([modules[steps], everything], axis=1)
        distance = np.linalg.norm(near[node] - far[node, other], axis=1)
        value = distance + offsets.table[node, other]
        value += rng.normal(0.0, options.range_noise, len(value))
        accepted = np.full(len(value), True)
        if states is not None:
            states.advance(period)
            shortest = np.zeros(len(links))
            shortest[link_of] = distance
            detour, first_path, total = states.packets(shortest)
            value += detour[link_of]
            accepted = ~rejects(first_path, total)[link_of]
        stamp = np.round(steps * STEP_S * 1e9).astype(np.int64)
        kept = accepted & (value > 0)
        columns.append((stamp[node[kept]], ids[node[kept]], ids[other[kept]], value[kept]))
    t_ns, node_id, other_id, range_m = (np.concatenate(c) for c in zip(*columns, strict=True))
    order = np.argsort(t_ns, kind="stable")
    t_ns, node_id, other_id, range_m = (c[order] for c in (t_ns, node_id, other_id, range_m))
    outside = np.isin(other_id, anchors.ids)
    return (
        RangeRecording(t_ns, node_id, other_id, range_m).where(outside),
        InternalRanges(t_ns[~outside], node_id[~outside], other_id[~outside], range_m[~outside]),
    )


def imu(motion: FrameMotion, options: SuperballOptions, rng: np.random.Generator) -> ImuStream:
    """An IMU at the origin of the frame of ``motion``, with biases that stay."""
    gyro, accel = inertial_samples(motion, IMU_STEPS, "interval_mean")
    for values, noise, bias in (
        (gyro, options.gyro_noise, options.gyro_bias),
        (accel, options.accel_noise, options.accel_bias),
    ):
        values += rng.normal(0.0, bias, 3) + rng.normal(0.0, noise, values.shape)
    # A sample covers the interval that ends at its stamp.
    return ImuStream(stamps(len(gyro) + 1, IMU_PERIOD_S)[1:], gyro, accel)


def with_spurious_sample(stream: ImuStream, time_s: float) -> ImuStream:
    """``stream`` with the gyroscope saturated across the rod in the sample after ``time_s`` [s]."""
    gyro = stream.gyro.copy()
    gyro[np.searchsorted(stream.t_ns, time_s * 1e9) :][:1] = (_SATURATED_RATE, _SATURATED_RATE, 0)
    return ImuStream(stream.t_ns, gyro, stream.accel)


def motors(
    rest_lengths: FloatArray, options: SuperballOptions, rng: np.random.Generator
) -> MotorStream:
    """What encoders say of ``rest_lengths`` (N, actuated) [m], one row per
    :data:`CONTROL_PERIOD_S`."""
    measured = rest_lengths[::2]
    measured = measured + rng.normal(0.0, options.encoder_noise, measured.shape)
    return MotorStream(stamps(len(measured), MOTOR_PERIOD_S), measured)
