"""Robots: the packaged prism, files that build on it, and what makes a prism impossible."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tensegrity import robots
from tensegrity.errors import InputError
from tensegrity.robots import PRISM_CABLES, Robot
from tensegrity.yaml_model import dump, unit_of


def mutual_moments(endcaps: np.ndarray) -> list[float]:
    """(c_j - c_i) . (u_i x u_j) of the rod pairs; their sign is the chirality."""
    centre = (endcaps[0::2] + endcaps[1::2]) / 2
    axis = endcaps[0::2] - endcaps[1::2]
    return [
        float((centre[j] - centre[i]) @ np.cross(axis[i], axis[j]))
        for i, j in ((0, 1), (1, 2), (2, 0))
    ]


def test_packaged_prism_is_that_of_the_paper() -> None:
    robot = robots.load("prism3")
    assert robots.packaged() == ["prism3"]
    assert (robot.rod_length, robot.rod_diameter, robot.rod_mass) == (1.45, 0.076, 4.0)
    assert robot.chirality == "counter_clockwise"
    assert tuple(cable.endcaps for cable in robot.cables) == PRISM_CABLES
    assert [cable.kind for cable in robot.cables] == ["actuated"] * 6 + ["passive"] * 3
    assert robot.side_length == 0.98
    assert robot.number_of_endcaps == 6


@pytest.mark.parametrize(("chirality", "sign"), [("counter_clockwise", -1), ("clockwise", 1)])
def test_undeformed_prism(chirality: str, sign: int) -> None:
    robot = Robot.model_validate(robots.load().model_dump() | {"chirality": chirality})
    q = robot.undeformed_endcaps()
    for i, j in robot.rods:
        assert np.linalg.norm(q[i] - q[j]) == pytest.approx(robot.rod_length, abs=1e-12)
    lengths = [np.linalg.norm(q[i] - q[j]) for i, j in (cable.endcaps for cable in robot.cables)]
    assert lengths[:6] == pytest.approx([0.98] * 6, abs=1e-12)
    assert lengths[6:] == pytest.approx([lengths[6]] * 3, abs=1e-12)
    np.testing.assert_allclose(q[0], [0, 0, 1.45 / 2 - 0.02], atol=1e-12)
    np.testing.assert_allclose(q[1], [0, 0, -1.45 / 2 - 0.02], atol=1e-12)
    assert [np.sign(moment) for moment in mutual_moments(q)] == [sign] * 3


def test_a_file_is_completed_from_the_packaged_robot(tmp_path: Path) -> None:
    file = tmp_path / "ours.yaml"
    file.write_text("name: ours\nrod_length: 1.5\n")
    assert robots.load(file) == robots.load().model_copy(update={"name": "ours", "rod_length": 1.5})
    file.write_text("base: prism3\nname: ours\nrod_length: 1.5\n")
    assert robots.load(str(file)).rod_length == 1.5


@pytest.mark.parametrize("text", ["", "# nothing\n", "prism3\n", "base: prism3\n"])
def test_a_file_may_only_name_a_packaged_robot(text: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(text)
    assert robots.load(tmp_path / "robot.yaml") == robots.load("prism3")


def test_an_unknown_name_lists_the_packaged_robots() -> None:
    with pytest.raises(InputError, match=r"called 'prism4' \(did you mean 'prism3'\?"):
        robots.load("prism4")
    with pytest.raises(InputError, match=r"known: prism3"):
        robots.load("quadruped")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file") as caught:
        robots.load(tmp_path / "none.yaml")
    assert caught.value.file == tmp_path / "none.yaml"


@pytest.mark.parametrize(
    ("text", "line", "field", "says"),
    [
        ("mass: 4\n", 1, "mass", "did you mean 'rod_mass'"),
        ("chirality: left\n", 1, "chirality", "one of counter_clockwise, clockwise"),
        ("rod_mass: heavy\n", 1, "rod_mass", "[kg], got 'heavy'"),
        ("name: 3\n", 1, "name", "text, got 3"),
        ("rods: [[0, 1], [2, 3]]\n", 1, "rods", "[4, 5]"),
        ("rods: [[0, 1], [2, x], [4, 5]]\n", 1, "rods[1][1]", "a whole number >= 0"),
        ("rods: [[0, 1, 2], [2, 3], [4, 5]]\n", 1, "rods[0]", "a list of 2 numbers"),
        ("cables: many\n", 1, "cables", "a list, got 'many'"),
        ("imu_offset: 0.8\n", 1, "imu_offset", "off the rod"),
        ("name: short\nrod_length: 1.0\n", 2, "rod_length", "longer than 1.09 m"),
    ],
)
def test_mistakes_are_located(text: str, line: int, field: str, says: str, tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        robots.load(file)
    assert (caught.value.file, caught.value.line, caught.value.field) == (file, line, field)
    assert says in str(caught.value)


def test_mistakes_inside_a_cable_are_located(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    text = dump(robots.load()).replace("kind: passive", "knid: passive", 1)
    file.write_text(text)
    with pytest.raises(InputError, match=r"did you mean 'kind'") as caught:
        robots.load(file)
    assert caught.value.field == "cables[6].knid"
    assert caught.value.line == 1 + text[: text.index("knid")].count("\n")


def test_cables_in_another_order_are_refused(tmp_path: Path) -> None:
    values = robots.load().model_dump()
    values["cables"] = values["cables"][::-1]
    with pytest.raises(ValueError, match=r"in order, \[0, 4\], \[0, 2\]"):
        Robot.model_validate(values)


@settings(max_examples=25, deadline=None)
@given(
    name=st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1),
    chirality=st.sampled_from(["counter_clockwise", "clockwise"]),
    rod_length=st.floats(1.2, 1e6),
    mass=st.floats(5e-324, 1e300),
    offset=st.floats(-0.6, 0.6),
)
def test_written_robots_read_back_equal(
    tmp_path_factory: pytest.TempPathFactory,
    name: str,
    chirality: str,
    rod_length: float,
    mass: float,
    offset: float,
) -> None:
    robot = Robot.model_validate(
        robots.load().model_dump()
        | {
            "name": name,
            "chirality": chirality,
            "rod_length": rod_length,
            "rod_mass": mass,
            "imu_offset": offset,
        }
    )
    file = tmp_path_factory.mktemp("robot") / "robot.yaml"
    file.write_text(dump(robot), encoding="utf-8")
    assert robots.load(file) == robot


def test_robots_of_the_shared_recordings(shared_data: Path) -> None:
    for name in ("forward", "right"):
        assert robots.load(shared_data / "prism3" / name / "robot.yaml") == robots.load("prism3")


def test_every_key_is_documented_with_its_unit(repo_root: Path) -> None:
    text = (repo_root / "docs" / "files.md").read_text()
    section = text[text.index("## Robot") : text.index("## Run")]
    rows = [line.split("|")[1:3] for line in section.splitlines() if line.startswith("| `")]
    documented = {key.strip(" `"): unit.strip() for key, unit in rows}
    assert documented == {name: unit_of(info) for name, info in Robot.model_fields.items()}
