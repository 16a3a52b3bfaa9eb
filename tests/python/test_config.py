"""Profiles of the filter, user files that build on them, and the effective configuration."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from tensegrity.config import FilterConfig, packaged
from tensegrity.errors import InputError
from tensegrity.yaml_model import unit_of


def load_text(folder: Path, text: str) -> FilterConfig:
    file = folder / "filter.yaml"
    file.write_text(text)
    return FilterConfig.load(file)


@pytest.mark.parametrize("name", ["paper", "full"])
def test_packaged_profiles_are_complete_and_of_their_method(name: str) -> None:
    assert packaged() == ["full", "paper"]
    assert FilterConfig.load(name).settings.method == name


def test_the_paper_is_as_published() -> None:
    config = FilterConfig.load("paper")
    settings, noises = config.settings, config.noises
    assert settings.filter == "loose"
    assert (settings.shape, settings.spin) == ("least_squares", "fixed")
    assert (settings.contact_point, settings.contact_noise) == ("centre", "constant")
    # T Table I
    assert (noises.accelerometer_std, noises.gyroscope_std) == (0.043, 0.002)
    assert (noises.accelerometer_bias_std, noises.gyroscope_bias_std) == (0.001, 0.001)
    assert noises.contact_std == 0.05


def test_full_is_the_tightly_coupled_filter() -> None:
    assert FilterConfig.load("full").settings.filter == "tight"


def test_the_loosely_coupled_filter_is_one_setting_away(tmp_path: Path) -> None:
    """With its improvements, which the profile names besides."""
    settings = load_text(tmp_path, "settings:\n  filter: loose\n").settings
    assert (settings.method, settings.filter) == ("full", "loose")
    assert (settings.shape, settings.spin) == ("tracker", "estimated")
    assert (settings.contact_point, settings.contact_noise) == ("rolling", "from_shape")


@pytest.mark.parametrize("base", ["paper", "full"])
def test_every_profile_takes_the_declarations_of_the_other_filter(
    base: str, tmp_path: Path
) -> None:
    """So that one file of a user serves both methods."""
    declared = "settings:\n  terrain: slope\n  friction: 0.5\n  contact_error: 0.2\n"
    settings = load_text(tmp_path, f"base: {base}\n{declared}").settings
    assert (settings.terrain, settings.friction, settings.contact_error) == ("slope", 0.5, 0.2)


@pytest.mark.parametrize(
    ("section", "key"),
    [
        ("settings", "cable_gate"),  # takes all
        ("priors", "cable_offset_std"),  # there are none
        ("priors", "ground_slope_std"),
        ("noises", "slip_length"),  # feet never slip
        ("noises", "ground_slope_walk"),
    ],
)
def test_zero_switches_off(section: str, key: str, tmp_path: Path) -> None:
    config = load_text(tmp_path, f"{section}:\n  {key}: 0\n")
    assert getattr(getattr(config, section), key) == 0


@pytest.mark.parametrize(
    ("text", "base"),
    [
        ("noises:\n  cable_std: 0.5\n", "full"),
        ("base: paper\nnoises:\n  cable_std: 0.5\n", "paper"),
        ("settings:\n  method: paper\nnoises:\n  cable_std: 0.5\n", "paper"),
    ],
)
def test_a_file_states_only_what_differs(text: str, base: str, tmp_path: Path) -> None:
    expected = FilterConfig.load(base).model_dump()
    expected["noises"]["cable_std"] = 0.5
    assert load_text(tmp_path, text).model_dump() == expected


def test_a_section_with_everything_commented_out_changes_nothing(tmp_path: Path) -> None:
    text = "noises:\n  # cable_std: 0.5\npriors:\n"
    assert load_text(tmp_path, text) == FilterConfig.load("full")


def test_whole_numbers_serve_as_numbers(tmp_path: Path) -> None:
    assert load_text(tmp_path, "settings:\n  gravity: 10\n").settings.gravity == 10.0


def test_vectors_are_read(tmp_path: Path) -> None:
    config = load_text(tmp_path, "priors:\n  gyroscope_bias: [0.1, -2, 3e-3]\n")
    assert config.priors.gyroscope_bias == (0.1, -2.0, 0.003)


def test_an_unknown_profile_lists_the_packaged_ones() -> None:
    with pytest.raises(InputError, match="known: full, paper"):
        FilterConfig.load("xyz")


def sections() -> list[tuple[str, type[BaseModel]]]:
    return [
        (name, info.annotation)
        for name, info in FilterConfig.model_fields.items()
        if info.annotation is not None
    ]


def test_every_key_is_printed_with_its_description_and_unit() -> None:
    lines = FilterConfig.load("full").to_yaml().splitlines()
    for _, section in sections():
        for name, info in section.model_fields.items():
            assert info.description
            unit = f" [{unit_of(info)}]" if unit_of(info) else ""
            assert any(
                line.startswith(f"  {name}: ") and line.endswith(f"{info.description}{unit}")
                for line in lines
            ), name


def test_every_physical_quantity_has_a_unit() -> None:
    without = {
        name
        for _, section in sections()
        for name, i in section.model_fields.items()
        if not unit_of(i)
    }
    assert without == {
        "method",
        "filter",
        "shape",
        "spin",
        "contact_point",
        "contact_noise",
        "imu_sampling",
        "static_bias_initialization",
        "chi_square_gate",
        "terrain",
        "friction",
        "contact_error",
        "cable_gate",
        "rod_inclination_std",
    }


POSITIVE = st.floats(1e-300, 1e300)


@settings(max_examples=25, deadline=None)
@given(
    name=st.sampled_from(["paper", "full"]),
    cable_std=POSITIVE,
    bias=st.tuples(*[st.floats(-1e300, 1e300)] * 3),
    gate=st.floats(0, 1, exclude_max=True),
    size=st.integers(1, 10**12),
    still=st.booleans(),
)
def test_the_printed_configuration_loads_back_equal(
    tmp_path_factory: pytest.TempPathFactory,
    name: str,
    cable_std: float,
    bias: tuple[float, float, float],
    gate: float,
    size: int,
    still: bool,
) -> None:
    values = FilterConfig.load(name).model_dump()
    values["noises"]["cable_std"] = cable_std
    values["priors"]["gyroscope_bias"] = bias
    values["settings"] |= {
        "chi_square_gate": gate,
        "init_bias_size": size,
        "static_bias_initialization": still,
    }
    config = FilterConfig.model_validate(values)
    file = tmp_path_factory.mktemp("config") / "filter.yaml"
    file.write_text(config.to_yaml())
    assert FilterConfig.load(file) == config


def test_every_key_is_documented_with_its_unit(repo_root: Path) -> None:
    lines = (repo_root / "docs" / "configuration.md").read_text().splitlines()
    for title, section in sections():
        start = lines.index(f"## {title}")
        end = next((i for i in range(start + 1, len(lines)) if lines[i][:3] == "## "), len(lines))
        rows = [line.split("|")[1:3] for line in lines[start:end] if line.startswith("| `")]
        documented = {key.strip(" `"): unit.strip() for key, unit in rows}
        assert documented == {n: unit_of(i) for n, i in section.model_fields.items()}
