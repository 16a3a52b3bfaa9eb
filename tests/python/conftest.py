"""Fixtures of all Python tests."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from helpers.sequences import make_sequence
from tensegrity.sequence import Sequence, write


@pytest.fixture(scope="session")
def repo_root() -> Path:
    return Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def shared_data(repo_root: Path) -> Path:
    """Folder with recordings beside the repository; tests that need them are skipped without."""
    folder = repo_root.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no recordings in ../shared/data")
    return folder


@pytest.fixture(scope="session")
def still_sequence() -> Sequence:
    """One second of the undeformed robot at rest."""
    return make_sequence()


@pytest.fixture(scope="session")
def written_sequence(still_sequence: Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """:func:`still_sequence` as a directory, which no test may change."""
    path = tmp_path_factory.mktemp("data") / "sequence"
    write(still_sequence, path)
    return path


@pytest.fixture
def sequence_path(written_sequence: Path, tmp_path: Path) -> Path:
    """A valid sequence directory that the test may change."""
    return Path(shutil.copytree(written_sequence, tmp_path / "sequence"))
