"""Robots from packaged YAML files and from your own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tensegrity.errors import InputError, did_you_mean
from tensegrity.robots.robot import Robot
from tensegrity.yaml_model import Document, merge

_FOLDER = Path(__file__).parent
_DEFAULT_BASE = "prism3"
_ROOT = "the robot's keys or the name of a packaged robot"


def packaged() -> list[str]:
    """Names of the robots that come with the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def load(name_or_path: str | Path) -> Robot:
    """A packaged robot by name, or the robot that a YAML file describes.

    A file may state only what differs from the packaged robot it names with ``base`` (``prism3``
    when it names none); a list such as ``cables`` is replaced as a whole. A file that holds
    nothing but a name means that packaged robot.

    Raises :class:`InputError` with file, line and key.
    """
    text = str(name_or_path)
    is_name = not isinstance(name_or_path, Path) and Path(text).name == text and "." not in text
    if not is_name:
        return _from_file(Path(name_or_path))
    if text not in packaged():
        raise InputError(
            f"no packaged robot is called '{text}'",
            hint=f"{did_you_mean(text, packaged())}; a path to your own ends in .yaml",
        )
    return _from_packaged(text)


def _from_packaged(name: str) -> Robot:
    document = Document(_FOLDER / f"{name}.yaml")
    return document.model(Robot, document.mapping())


def _from_file(path: Path) -> Robot:
    document = Document(path, root=_ROOT)
    if isinstance(document.content, str):
        return _from_packaged(_packaged_name(document, document.content, ()))
    changes = dict(document.mapping())
    base = _packaged_name(document, changes.pop("base", _DEFAULT_BASE), ("base",))
    return document.model(Robot, merge(_from_packaged(base).model_dump(), changes))


def _packaged_name(document: Document, name: Any, location: tuple[str, ...]) -> str:
    if name not in packaged():
        raise document.error(
            f"no packaged robot is called '{name}'", location, did_you_mean(str(name), packaged())
        )
    return str(name)
