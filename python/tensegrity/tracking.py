"""Where a ranging robot was: :func:`track` runs the C++ estimator over a recording.

The estimator is the unscented filter of C = Caluwaerts et al. 2016, §IV, with the net's dynamics as
its process. It works on what a recording has: ranges to anchors, and if there are any, ranges among
the robot's modules, IMUs and the motors' rest lengths::

    sequence = read_sequence("recording/")
    track = tensegrity.tracking.track(sequence)
    track.nodes[-1]  # ends of the rods (n, 3), world [m]
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import tensegrity._core as _core
from tensegrity._core import RangingConfig, RangingHealth
from tensegrity.dynamics import core_net
from tensegrity.errors import InputError
from tensegrity.ranging.recording import Anchors, FloorTruth, Offsets
from tensegrity.ranging.sequence import RangingSequence
from tensegrity.robots import Net
from tensegrity.sequence.sequence import EndcapStream

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FilterSettings = RangingConfig
"""Of the C++ filter; ``FilterSettings.paper()`` is the filter as published."""


@dataclass(frozen=True)
class TrackSettings:
    """Settings of :func:`track`: of the filter, and how well offsets are known [m].

    The error of an offset does not average out over the ranges of its pair. It is counted as noise
    of every range, which keeps pairs from outvoting each other by their number.
    """

    filter: RangingConfig = field(default_factory=RangingConfig)
    offset_std: float = 0.2
    unknown_offset_std: float = 0.25


def paper_settings() -> TrackSettings:
    """C's filter: its noises, the sigma weights of the authors' code, offsets taken for exact."""
    return TrackSettings(RangingConfig.paper(), offset_std=0.0, unknown_offset_std=0.0)


@dataclass(frozen=True)
class Track:
    """States after each of T updates of the filter; n nodes in the order of ``net``, world, z up.

    * ``t_ns`` (T,) [ns]
    * ``nodes``, ``velocities``, ``node_std`` (T, n, 3): ends of the rods [m], [m/s], and the
      standard deviations of their positions [m]
    * ``centre_of_mass`` (T, 3) [m] and ``centre_of_mass_covariance`` (T, 3, 3) [m^2]
    * ``faces`` (T, 3) ids of the three lowest nodes, lowest first: the face that is down
    * ``surprise`` (T,) recent mean squared innovation in variances; 1 is right
    * ``health`` counts what was used, rejected and dropped, and restarts
    """

    net: Net
    t_ns: IntArray
    nodes: FloatArray
    velocities: FloatArray
    node_std: FloatArray
    centre_of_mass: FloatArray
    centre_of_mass_covariance: FloatArray
    faces: IntArray
    surprise: FloatArray
    health: RangingHealth

    def __len__(self) -> int:
        return len(self.t_ns)


def track(
    sequence: RangingSequence,
    *,
    anchors: Anchors | None = None,
    offsets: Offsets | None = None,
    settings: TrackSettings | None = None,
) -> Track:
    """Estimate the states of a recorded robot.

    ``anchors`` and ``offsets`` of a calibration take the place of the recording's own. A pair
    without an offset gets the median of its anchor and is trusted less; so does a module whose
    offsets are one default for all anchors, while those of others differ.

    Raises :class:`InputError` when an anchor has no position, when there are no offsets, when the
    recording has no times, and when the filter never found a start.
    """
    settings = TrackSettings() if settings is None else settings
    anchors = sequence.anchors if anchors is None else anchors
    offsets = sequence.offsets if offsets is None else offsets
    _check(sequence, anchors, offsets)
    assert offsets is not None
    estimator = _core.RangingEstimator(
        core_robot(sequence.net),
        core_anchors(sequence.net, anchors, offsets, settings),
        core_net(sequence.net),
        sequence.net.rest_lengths(),
        settings.filter,
    )
    states = estimator.run(_arrays(sequence, anchors))
    if not len(states["t_ns"]):
        raise InputError(
            f"{sequence.name}: no start was found in {len(sequence.ranges)} ranges",
            hint=f"it takes {settings.filter.start_pairs} pairs of modules within "
            f"{settings.filter.start_window:g} s",
        )
    return Track(
        net=sequence.net,
        t_ns=states["t_ns"],
        nodes=states["positions"],
        velocities=states["velocities"],
        node_std=states["position_std"],
        centre_of_mass=states["centre_of_mass"],
        centre_of_mass_covariance=states["centre_of_mass_covariance"],
        faces=np.array(sequence.net.node_ids, dtype=np.int64)[states["face"]],
        surprise=states["surprise"],
        health=estimator.state.health,
    )


def core_robot(net: Net) -> _core.RangingRobot:
    """The geometry that the estimator needs."""
    return _core.RangingRobot(
        net.undeformed_positions(), net.rod_ends(), net.rod_length, net.module_inset
    )


def core_anchors(
    net: Net, anchors: Anchors, offsets: Offsets, settings: TrackSettings
) -> _core.RangingAnchors:
    """Anchors and offsets by index, with pairs that have none filled in."""
    known = _calibrated(offsets.table(net.node_ids, anchors.ids))
    std = np.where(np.isnan(known), settings.unknown_offset_std, settings.offset_std)
    internal = offsets.table(net.node_ids, net.node_ids)
    return _core.RangingAnchors(
        anchors.position_m, _filled(known), std, _filled_among(internal, known)
    )


def floor_errors(track: Track, truth: FloorTruth) -> FloatArray:
    """Errors (F, 2) in x and y [m] of the nodes in ``truth``, each the mean over its window; NaN
    where the track has no state in the window."""
    seconds = track.t_ns * 1e-9
    errors = np.full(truth.position_m.shape, np.nan)
    for row, (start, end, node) in enumerate(
        zip(truth.start_s, truth.end_s, truth.node, strict=True)
    ):
        inside = (start <= seconds) & (seconds < end)
        if inside.any():
            mean = track.nodes[inside, track.net.index_of(int(node)), :2].mean(axis=0)
            errors[row] = mean - truth.position_m[row]
    return errors


@dataclass(frozen=True)
class TrackErrors:
    """Against true ends of the rods, over the updates that both cover (T of them).

    * ``nodes`` (T, n) and ``centre_of_mass`` (T,) distances from the truth [m]
    * ``nees`` (T,) squared error of the centre of mass in its covariance: 3 on average if that is
      right
    * ``face_right`` (T,) whether the three lowest nodes are the true ones
    """

    t_ns: IntArray
    nodes: FloatArray
    centre_of_mass: FloatArray
    nees: FloatArray
    face_right: NDArray[np.bool_]

    @property
    def node_rmse(self) -> float:
        """Of all nodes [m]."""
        return float(np.sqrt(np.mean(self.nodes**2)))

    @property
    def centre_of_mass_rmse(self) -> float:
        """[m]"""
        return float(np.sqrt(np.mean(self.centre_of_mass**2)))


def track_errors(track: Track, truth: EndcapStream) -> TrackErrors:
    """Errors of a track; the truth is interpolated at its updates.

    Raises :class:`InputError` when the two have no time in common.
    """
    common = (track.t_ns >= truth.t_ns[0]) & (track.t_ns <= truth.t_ns[-1])
    if not common.any():
        raise InputError("the track and the truth have no time in common")
    t_ns, nodes = track.t_ns[common], track.nodes[common]
    flat = truth.position.reshape(len(truth.t_ns), -1)
    true = np.stack([np.interp(t_ns, truth.t_ns, column) for column in flat.T], axis=1).reshape(
        nodes.shape
    )
    error = track.centre_of_mass[common] - true.mean(axis=1)
    weighted = np.linalg.solve(track.centre_of_mass_covariance[common], error[:, :, None])[:, :, 0]
    lowest = np.sort(np.argsort(true[:, :, 2], axis=1)[:, :3], axis=1)
    true_faces = np.array(track.net.node_ids)[lowest]
    return TrackErrors(
        t_ns=t_ns,
        nodes=np.linalg.norm(nodes - true, axis=2),
        centre_of_mass=np.linalg.norm(error, axis=1),
        nees=np.sum(error * weighted, axis=1),
        face_right=np.all(
            np.sort(track.faces[common], axis=1) == np.sort(true_faces, axis=1), axis=1
        ),
    )


def _check(sequence: RangingSequence, anchors: Anchors, offsets: Offsets | None) -> None:
    if not sequence.ranges.timed:
        raise InputError(
            f"{sequence.name}: has steps, no times", hint="a filter needs a column t_ns"
        )
    unknown = anchors.ids[~anchors.known.all(axis=1)]
    used = [int(anchor) for anchor in unknown if anchor in sequence.ranges.anchors]
    if used:
        raise InputError(
            f"anchor {used[0]} has no position", hint="calibrate first: tensegrity calibrate"
        )
    strange = np.setdiff1d(sequence.ranges.anchors, anchors.ids)
    if len(strange):
        raise InputError(f"anchor {strange[0]} was ranged but is not among the anchors")
    pairs = None if offsets is None else offsets.table(sequence.net.node_ids, anchors.ids)
    if pairs is None or np.isnan(pairs).all():
        raise InputError(
            f"{sequence.name}: there are no offsets of the ranges",
            hint="raw ranges are some metres too long; calibrate first: tensegrity calibrate",
        )


def _calibrated(offsets: FloatArray) -> FloatArray:
    """Offsets (nodes, anchors) with NaN for modules that have one and the same number for every
    anchor while others have not: a default that no calibration has touched."""
    counts = np.sum(~np.isnan(offsets), axis=1)
    spread = np.array(
        [np.ptp(row[~np.isnan(row)]) if n else 0.0 for row, n in zip(offsets, counts, strict=True)]
    )
    default = (counts > 1) & (spread == 0)
    if not (spread > 0).any():
        return offsets
    return np.where(default[:, None], np.nan, offsets)


def _filled(offsets: FloatArray) -> FloatArray:
    """Offsets (nodes, anchors) with NaN replaced by the anchor's median, else that of all."""
    result = offsets.copy()
    for column in result.T:
        known = column[~np.isnan(column)]
        column[np.isnan(column)] = np.median(known) if len(known) else np.nanmedian(offsets)
    return result


def _filled_among(internal: FloatArray, to_anchors: FloatArray) -> FloatArray:
    """Offsets (nodes, nodes), listed in one direction or both; unknown ones are taken from those to
    the anchors."""
    both = np.where(np.isnan(internal), internal.T, internal)
    fallback = np.nanmedian(both) if not np.isnan(both).all() else np.nanmedian(to_anchors)
    return np.where(np.isnan(both), fallback, both)


def _arrays(sequence: RangingSequence, anchors: Anchors) -> _core.RangingArrays:
    net, ranges = sequence.net, sequence.ranges
    index = {node: i for i, node in enumerate(net.node_ids)}
    anchor_index = {int(anchor): i for i, anchor in enumerate(anchors.ids)}
    arrays = _core.RangingArrays()
    arrays.range_t = ranges.t_ns
    arrays.range_pairs = np.array(
        [
            (index[node], anchor_index[anchor])
            for node, anchor in zip(ranges.node.tolist(), ranges.anchor.tolist(), strict=True)
        ],
        dtype=np.int32,
    ).reshape(-1, 2)
    arrays.ranges = ranges.range_m
    internal = sequence.internal_ranges
    if internal is not None:
        arrays.internal_t = internal.t_ns
        arrays.internal_pairs = np.array(
            [
                (index[node], index[other])
                for node, other in zip(internal.node.tolist(), internal.other.tolist(), strict=True)
            ],
            dtype=np.int32,
        ).reshape(-1, 2)
        arrays.internal_ranges = internal.range_m
    if sequence.motors is not None:
        lengths = np.tile(net.rest_lengths(), (len(sequence.motors.t_ns), 1))
        lengths[:, net.actuated()] = sequence.motors.rest_lengths
        arrays.motor_t, arrays.rest_lengths = sequence.motors.t_ns, lengths
    if sequence.imus:
        stamps = np.concatenate([imu.t_ns for imu in sequence.imus.values()])
        order = np.argsort(stamps, kind="stable")
        nodes = np.concatenate(
            [np.full(len(imu.t_ns), index[node]) for node, imu in sequence.imus.items()]
        )
        arrays.imu_t = stamps[order]
        arrays.imu_nodes = nodes[order].astype(np.int32)
        arrays.gyro = np.concatenate([imu.gyro for imu in sequence.imus.values()])[order]
        arrays.accel = np.concatenate([imu.accel for imu in sequence.imus.values()])[order]
    return arrays
