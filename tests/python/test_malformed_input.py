"""Every kind of broken input gives one error that names file, line and field."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from malformed import MALFORMED_CONFIGS, MALFORMED_SEQUENCES, MalformedSequence, MalformedYaml
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.sequence import read


def check(error: InputError, file: Path, kind: MalformedSequence | MalformedYaml) -> None:
    message = str(error)
    assert error.file == file
    assert kind.says in message
    assert "\n" not in message
    if kind.line is not None:
        assert error.line == kind.line
        assert message.startswith(f"{file}:{kind.line}: ")
    if kind.field is not None:
        assert error.field == kind.field
        assert kind.field in message


def test_the_sequence_is_fine_before_it_is_broken(sequence_path: Path) -> None:
    assert len(read(sequence_path).imu.t_ns) == 201


@pytest.mark.parametrize("kind", MALFORMED_SEQUENCES, ids=lambda kind: kind.name)
def test_sequence(kind: MalformedSequence, sequence_path: Path) -> None:
    kind.apply(sequence_path)
    with pytest.raises(InputError) as caught:
        read(sequence_path)
    check(caught.value, sequence_path / kind.file, kind)


@pytest.mark.parametrize("kind", MALFORMED_CONFIGS, ids=lambda kind: kind.name)
def test_config(kind: MalformedYaml, tmp_path: Path) -> None:
    file = tmp_path / "filter.yaml"
    file.write_text(kind.text)
    with pytest.raises(InputError) as caught:
        FilterConfig.load(file)
    check(caught.value, file, kind)


def test_kinds_are_many_and_distinct() -> None:
    assert len({kind.name for kind in MALFORMED_SEQUENCES}) == len(MALFORMED_SEQUENCES) >= 30
    assert len({kind.name for kind in MALFORMED_CONFIGS}) == len(MALFORMED_CONFIGS)


FILES = ["imu.csv", "cables.csv", "contacts.csv", "groundtruth.tum", "endcaps.csv", "robot.yaml"]


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(FILES),
    place=st.floats(0, 1),
    removed=st.integers(0, 30),
    inserted=st.one_of(
        st.binary(max_size=6),
        st.text("0123456789.,-+eE#:[]{}'\n\r\t _naif", max_size=6).map(str.encode),
    ),
)
def test_random_damage_is_an_input_error_or_still_a_sequence(
    tmp_path_factory: pytest.TempPathFactory,
    written_sequence: Path,
    name: str,
    place: float,
    removed: int,
    inserted: bytes,
) -> None:
    folder = tmp_path_factory.mktemp("damaged") / "s"
    shutil.copytree(written_sequence, folder)
    content = (folder / name).read_bytes()
    at = int(place * len(content))
    (folder / name).write_bytes(content[:at] + inserted + content[at + removed :])
    try:
        sequence = read(folder)
    except InputError as error:
        described = error
    else:
        assert np.isfinite(sequence.imu.gyro).all()
        lengths = sequence.cables.lengths
        assert ((lengths > 0) | np.isnan(lengths)).all()  # a cell may have become empty
        return
    assert described.file is not None
    assert described.file.exists()
    assert "\n" not in str(described)
