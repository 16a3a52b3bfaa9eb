"""YAML files that know the line of every key."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.reader import ReaderError

from tensegrity.errors import InputError
from tensegrity.files import read_text
from tensegrity.yaml_model.explanation import Location, explain, kind_of
from tensegrity.yaml_model.model import INCONSISTENT

Model = TypeVar("Model", bound=BaseModel)


class Document:
    """A YAML file as plain Python values that remembers the line of every key."""

    def __init__(self, file: Path, *, root: str = "a mapping of keys to values") -> None:
        """Parse ``file``. ``root`` says in errors what the file should hold."""
        self.file = file
        self._root = root
        text = read_text(file)

        def invalid(problem: str, line: int | None, hint: str | None = None) -> InputError:
            return InputError(f"not valid YAML: {problem}", file=file, line=line, hint=hint)

        try:
            self._tree = YAML(typ="rt").load(text)
            self.content = _plain(self._tree)
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            raise invalid(
                str(error.problem or error.context),
                None if mark is None else mark.line + 1,
                "look for a missing colon, quote, bracket or a wrong indentation",
            ) from None
        except ReaderError as error:
            line = text.count("\n", 0, error.position) + 1
            raise invalid(f"character {error.character!r} is not allowed", line) from None
        except RecursionError:
            raise invalid("nested too deeply", None) from None
        except (YAMLError, ValueError) as error:
            raise invalid(str(error).split("\n", 1)[0], None) from None

    def mapping(self) -> dict[str, Any]:
        """The content, which has to be a mapping (an empty file is an empty mapping)."""
        if self.content is None:
            return {}
        if not isinstance(self.content, dict):
            raise InputError(
                f"expected {self._root}, found {kind_of(self.content)}", file=self.file, line=1
            )
        return self.content

    def line(self, location: Location) -> int | None:
        """Line of the key or list item at ``location``, or of the innermost parent in the file."""
        lines = self._lines(location)
        return lines[-1] if lines else None

    def _states(self, location: Location) -> bool:
        return len(self._lines(location)) == len(location)

    def _lines(self, location: Location) -> list[int]:
        """Lines of the steps of ``location``, as far as this document goes."""
        node, lines = self._tree, []
        for step in location:
            try:
                position = (
                    node.lc.key(step) if isinstance(node, CommentedMap) else node.lc.item(step)
                )
                node = node[step]
            except (AttributeError, KeyError, IndexError, TypeError):
                break
            lines.append(position[0] + 1)
        return lines

    def error(self, problem: str, location: Location, hint: str | None = None) -> InputError:
        """An error about the value at ``location``."""
        return InputError(
            problem,
            file=self.file,
            line=self.line(location),
            field=key_path(location) or None,
            hint=hint,
        )

    def model(self, model: type[Model], values: dict[str, Any]) -> Model:
        """Validate ``values`` (this document's, perhaps completed from defaults).

        Raises :class:`InputError` for the first problem in the order of the file, misspelt keys
        before all others.
        """
        try:
            return model.model_validate(values)
        except ValidationError as error:
            problems = [(self._place(detail), detail) for detail in error.errors()]
        # A misspelt key comes first: it explains the missing one.
        location, detail = min(
            problems,
            key=lambda p: (p[1]["type"] != "extra_forbidden", self.line(p[0]) or math.inf),
        )
        problem, hint = explain(model, detail)
        raise self.error(problem, location, hint)

    def _place(self, detail: ErrorDetails) -> Location:
        """Where to point for an error: of fields that contradict each other, one that is here."""
        location = detail["loc"]
        if detail["type"] != INCONSISTENT:
            return location
        fields: list[str] = detail["ctx"]["fields"]
        stated = [name for name in fields if self._states((*location, name))]
        return (*location, (stated or fields)[0])


def key_path(location: Location) -> str:
    """``("cables", 3, "stiffness")`` as ``cables[3].stiffness``."""
    text = ""
    for step in location:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """``base`` with ``changes`` on top: mappings are merged, everything else is replaced.

    A section without keys (all of them commented out) changes nothing.
    """
    merged = dict(base)
    for key, value in changes.items():
        old = merged.get(key)
        if isinstance(old, dict) and (value is None or isinstance(value, dict)):
            merged[key] = merge(old, value or {})
        else:
            merged[key] = value
    return merged


def _plain(node: Any) -> Any:
    """Built-in types instead of ruamel's, which carry formatting."""
    if isinstance(node, dict):
        return {(key if isinstance(key, str) else str(key)): _plain(v) for key, v in node.items()}
    if isinstance(node, list):
        return [_plain(item) for item in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
