"""Figures are drawn for what evaluation gives, and show what they claim."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tensegrity.evaluation import Alignment, Comparison, Innovations, Motion
from tensegrity.evaluation.consistency import band
from tensegrity.plotting import (
    cable_lengths,
    consistency,
    endcap_errors,
    pose,
    save_figures,
    style,
    top_view,
)

pytest.importorskip("matplotlib", reason="figures need the 'viz' extra")
from matplotlib.figure import Figure

CABLES = ("0–4", "0–2", "2–4", "1–5", "1–3", "3–5", "1–4", "0–3", "2–5")


def comparison(method: str, offset: float, n: int = 300) -> Comparison:
    """A run that is ``offset`` metres off in everything."""
    t = np.linspace(0.0, 3.0, n)
    position = np.stack([t, np.sin(t), 0.4 + 0.0 * t], axis=1)
    orientation = Rotation.from_rotvec(np.outer(t, [1.0, 0.0, 2.0]))
    endcaps = np.random.default_rng(0).normal(size=(6, 3)) * np.ones((n, 1, 1))
    lengths = 1.0 + 0.2 * np.sin(t)[:, None] * np.linspace(0.5, 1.0, 9)
    eye = np.tile(np.eye(3), (n, 1, 1))
    velocity = np.gradient(position, t, axis=0)
    nis = np.random.default_rng(1).chisquare(9, n) / 9
    nis[:20] = np.nan
    return Comparison(
        method=method,
        sequence="right",
        cable_names=CABLES,
        t_s=t,
        estimate=Motion(
            position + offset, orientation, velocity, endcaps + offset, lengths + offset
        ),
        truth=Motion(position, orientation, velocity, endcaps, lengths),
        position_covariance=0.04 * eye,
        orientation_covariance=0.01 * eye,
        velocity_covariance=0.01 * eye,
        cable_innovations=Innovations(nis, np.full(n, 9.0)),
        ground_innovations=Innovations(np.sqrt(nis), np.linspace(0, 4, n).round()),
        alignment=Alignment.POSE,
        still=1,
        initial_tilt_rad=0.0,
    )


@pytest.fixture
def runs() -> dict[str, Comparison]:
    return {"paper": comparison("paper", 0.1), "full": comparison("full", 0.02)}


def png_size(path: Path) -> tuple[int, int]:
    header = path.read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", header[16:24])
    return width, height


def test_figures_are_written_and_not_blank(runs: dict[str, Comparison], tmp_path: Path) -> None:
    from matplotlib.image import imread

    paths = save_figures(runs, tmp_path / "new" / "figures")
    assert {path.name for path in paths} == {
        "cable_lengths.png",
        "consistency.png",
        "endcap_errors.png",
        "pose.png",
        "top_view.png",
    }
    for path in paths:
        width, height = png_size(path)
        assert width >= 800
        assert height >= 500
        pixels = np.round(255 * imread(path)[..., :3])
        for colour in ("#000000", *style.colours(runs).values()):
            rgb = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
            # Thin lines are blended with the white behind them.
            assert (np.abs(pixels - rgb).max(axis=2) <= 60).sum() > 100, (path, colour)


def test_without_true_endcaps_only_pose_figures(
    runs: dict[str, Comparison], tmp_path: Path
) -> None:
    unknown = {
        label: dataclasses.replace(
            run,
            truth=dataclasses.replace(
                run.truth,
                endcaps_body=np.full_like(run.truth.endcaps_body, np.nan),
                cable_lengths=np.full_like(run.truth.cable_lengths, np.nan),
            ),
        )
        for label, run in runs.items()
    }
    assert {path.name for path in save_figures(unknown, tmp_path)} == {
        "consistency.png",
        "pose.png",
        "top_view.png",
    }


@pytest.mark.parametrize(
    ("draw", "panels", "y_labels"),
    [
        (cable_lengths.draw, 9, {"length [m]"}),
        (endcap_errors.draw, 4, {"error [mm]"}),
        (top_view.draw, 1, {"y [m]"}),
        (consistency.draw, 4, {"NEES", "NIS"}),
        (
            pose.draw,
            6,
            {"x [m]", "y [m]", "z [m]", "roll [deg]", "pitch [deg]", "yaw [deg]"},
        ),
    ],
)
def test_panels_are_labelled_with_units(
    runs: dict[str, Comparison],
    draw: Callable[[dict[str, Comparison]], Figure],
    panels: int,
    y_labels: set[str],
) -> None:
    figure = draw(runs)
    assert len(figure.axes) == panels
    assert {panel.get_ylabel() for panel in figure.axes} - {""} == y_labels
    assert {panel.get_xlabel() for panel in figure.axes} - {""} <= {"time [s]", "x [m]"}
    assert len(figure.legends) == 1


def test_endcap_panels_show_the_error_in_millimetres(runs: dict[str, Comparison]) -> None:
    figure = endcap_errors.draw(runs)
    paper, full = figure.axes[0].lines
    np.testing.assert_allclose(paper.get_ydata(), 1e3 * 0.1 * np.sqrt(3))
    np.testing.assert_allclose(full.get_ydata(), 1e3 * 0.02 * np.sqrt(3))


def test_position_bands_are_two_standard_deviations(runs: dict[str, Comparison]) -> None:
    figure = pose.draw(runs)
    band = figure.axes[0].collections[0].get_paths()[0].vertices
    first = band[np.isclose(band[:, 0], 0.0)][:, 1]
    np.testing.assert_allclose([first.min(), first.max()], [0.1 - 0.4, 0.1 + 0.4])


def test_consistency_panels_show_squares_and_their_bands(runs: dict[str, Comparison]) -> None:
    figure = consistency.draw(runs)
    assert {panel.get_yscale() for panel in figure.axes} == {"log"}
    position, _, cables, ground = figure.axes
    paper, full = position.lines
    np.testing.assert_allclose(paper.get_ydata(), 0.1**2 / 0.04)  # three equal errors, over three
    np.testing.assert_allclose(full.get_ydata(), 0.02**2 / 0.04)
    for panel, ends in ((position, band(3)), (cables, band(9))):
        heights = panel.collections[0].get_paths()[0].vertices[:, 1]
        np.testing.assert_allclose([heights.min(), heights.max()], ends)
    innovations = runs["full"].cable_innovations
    np.testing.assert_array_equal(cables.lines[1].get_ydata(), innovations.nis[20:])
    # One piece of band for each number of feet, beginning with the first foot.
    bands = [path.vertices for path in ground.collections[0].get_paths()]
    assert min(piece[:, 1].min() for piece in bands) == pytest.approx(float(band(1)[0]))
    assert max(piece[:, 1].max() for piece in bands) == pytest.approx(float(band(1)[1]))
    assert min(piece[:, 0].min() for piece in bands) == pytest.approx(0.38, abs=0.02)


def test_consistency_without_innovations_has_no_panels_for_them(
    runs: dict[str, Comparison],
) -> None:
    none = Innovations(np.full(300, np.nan), np.full(300, 9.0))
    loose = dataclasses.replace(runs["paper"], cable_innovations=none, ground_innovations=none)
    alone = consistency.draw({"paper": loose})
    assert len(alone.axes) == 2
    together = consistency.draw({"paper": loose, "full": runs["full"]})
    assert len(together.axes) == 4
    assert [len(line.get_ydata()) for line in together.axes[2].lines] == [0, 280]


def test_consistency_of_a_robot_that_never_moves_is_empty(
    runs: dict[str, Comparison], tmp_path: Path
) -> None:
    still = dataclasses.replace(runs["full"], still=300)
    figure = consistency.draw({"full": still})
    assert {len(line.get_ydata()) for panel in figure.axes for line in panel.lines} == {0}
    assert style.save(figure, tmp_path / "consistency.png").is_file()


def test_a_method_keeps_its_colour() -> None:
    paper, full = comparison("paper", 0.1), comparison("full", 0.1)
    both = style.colours({"paper": paper, "full": full})
    alone = style.colours({"runs/right-full": full})
    assert both["full"] == alone["runs/right-full"]
    many = style.colours({str(k): full for k in range(5)})
    assert len(set(many.values())) == 5


def test_angle_deviations_match_a_sample() -> None:
    """First-order deviations of roll, pitch and yaw against rotations drawn at random."""
    rng = np.random.default_rng(1)
    angles = [[-2.0, 0.9, 0.7]]  # roll, pitch, yaw
    mean = Rotation.from_euler("xyz", angles)
    np.testing.assert_allclose(pose.euler_angles(mean), angles)
    root = 1e-3 * rng.normal(size=(3, 3))
    errors = Rotation.from_rotvec(rng.normal(size=(200_000, 3)) @ root.T)
    sample = pose.euler_angles(errors * mean[0])
    expected = pose.euler_sigma(mean, (root @ root.T)[None])[0]
    np.testing.assert_allclose(sample.std(axis=0), expected, rtol=0.01)


def test_angle_deviations_stay_finite_at_the_singularity() -> None:
    level = Rotation.from_rotvec([[0.0, np.pi / 2, 0.0]])
    sigma = pose.euler_sigma(level, 0.01 * np.eye(3)[None])[0]
    assert np.isfinite(sigma).all()
    assert sigma[1] == pytest.approx(0.1)
