"""Errors name the place and survive the way between processes."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from tensegrity.errors import InputError, MissingExtraError, did_you_mean, quoted
from tensegrity.files import new_directory, read_text, write_file


def test_input_error_names_file_line_field_and_hint() -> None:
    error = InputError("is odd", file="a.csv", line=3, field="x", hint="make it even")
    assert str(error) == "a.csv:3: field 'x': is odd (make it even)"
    assert str(InputError("is odd")) == "is odd"


def test_input_error_is_one_line_whatever_the_input_holds() -> None:
    error = InputError(f"got {quoted('a' * 30 + chr(10) + 'b' * 30)}", field="x\ny")
    assert str(error) == f"field 'x\\ny': got '{'a' * 30}\\n{'b' * 6}...'"


@pytest.mark.parametrize(
    "error",
    [
        InputError("is odd", file="a.csv", line=3, field="x", hint="make it even"),
        MissingExtraError("simulation", "sim"),
    ],
)
def test_errors_survive_pickling(error: InputError) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error)
    assert vars(copy) == vars(error)
    assert str(copy) == str(error)


def test_did_you_mean_offers_the_closest_or_all() -> None:
    assert did_you_mean("cable_sdt", ["cable_std", "spin_std"]) == "did you mean 'cable_std'?"
    assert did_you_mean("q", ["cable_std", "spin_std"]) == "known: cable_std, spin_std"


def test_read_text_drops_the_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfa")
    assert read_text(tmp_path / "a") == "a"


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write_into(path: Path, text: str, **options: bool) -> None:
    with new_directory(path, marker="m", **options) as folder:
        (folder / "m").write_text(text)


def test_new_directory_appears_complete_with_its_parents(tmp_path: Path) -> None:
    with new_directory(tmp_path / "a" / "b", marker="m") as folder:
        (folder / "m").write_text("1")
        assert not (tmp_path / "a" / "b").exists()
    assert names(tmp_path / "a") == ["b"]
    assert (tmp_path / "a" / "b" / "m").read_text() == "1"


def fail_while_writing(path: Path, **options: bool) -> None:
    with new_directory(path, marker="m", **options) as folder:
        (folder / "m").write_text("half")
        raise KeyError


def test_new_directory_leaves_nothing_behind_after_an_error(tmp_path: Path) -> None:
    with pytest.raises(KeyError):
        fail_while_writing(tmp_path / "a")
    assert names(tmp_path) == []


def test_a_failed_overwrite_keeps_the_old_directory(tmp_path: Path) -> None:
    write_into(tmp_path / "a", "old")
    with pytest.raises(KeyError):
        fail_while_writing(tmp_path / "a", overwrite=True)
    assert names(tmp_path) == ["a"]
    assert (tmp_path / "a" / "m").read_text() == "old"


def test_a_file_appears_complete_or_not_at_all(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    write_file(file, "old")
    with pytest.raises(InputError, match="exists already"):
        write_file(file, "new")
    with pytest.raises(UnicodeEncodeError):
        write_file(file, "half a \ud800", overwrite=True)
    assert (names(tmp_path), file.read_text()) == (["a.txt"], "old")
    write_file(file, "new", overwrite=True)
    assert (names(tmp_path), file.read_text()) == (["a.txt"], "new")


def test_overwriting_has_to_be_asked_for(tmp_path: Path) -> None:
    write_into(tmp_path / "a", "old")
    with pytest.raises(InputError, match="not empty"):
        write_into(tmp_path / "a", "new")
    write_into(tmp_path / "a", "new", overwrite=True)
    assert (tmp_path / "a" / "m").read_text() == "new"
    assert names(tmp_path) == ["a"]


def test_a_directory_of_another_kind_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.tex").write_text("years")
    with pytest.raises(InputError, match="holds no m"):
        write_into(tmp_path / "home", "new", overwrite=True)
    assert (tmp_path / "home" / "thesis.tex").read_text() == "years"


def test_an_empty_directory_is_used_and_a_file_is_not(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    write_into(tmp_path / "a", "1")
    assert names(tmp_path / "a") == ["m"]
    with pytest.raises(InputError, match="is a file"):
        write_into(tmp_path / "a" / "m", "1")
    with pytest.raises(InputError, match="cannot be created"):
        write_into(tmp_path / "a" / "m" / "below", "1")
