"""Pydantic models in YAML files: errors with file, line, key and unit; output with comments.

A model states the unit of a field with :func:`field`; both the error messages and the comments of
:func:`dump` are made from the same descriptions.
"""

from __future__ import annotations

import io
import math
import typing
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.reader import ReaderError

from tensegrity.errors import InputError, did_you_mean, quoted
from tensegrity.files import read_text

Model = TypeVar("Model", bound=BaseModel)
Location = tuple[int | str, ...]


class StrictModel(BaseModel):
    """Immutable, no unknown keys, no NaN or infinity, no text where a number is expected."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


def field(description: str, *, unit: str = "", **constraints: Any) -> Any:
    """A required model field with a description, a unit and pydantic's constraints."""
    return Field(description=description, json_schema_extra={"unit": unit}, **constraints)


def unit_of(info: FieldInfo) -> str:
    """Unit of a field made with :func:`field`, empty if it has none."""
    extra = info.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


_INCONSISTENT = "inconsistent"


def inconsistent(problem: str, *fields: str) -> PydanticCustomError:
    """An error to raise in a model's validator about ``fields`` that contradict each other."""
    return PydanticCustomError(_INCONSISTENT, "{problem}", {"problem": problem, "fields": fields})


# --- reading ------------------------------------------------------------------------------------


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
                f"expected {self._root}, found {_kind(self.content)}", file=self.file, line=1
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
        problem, hint = _explain(model, detail)
        raise self.error(problem, location, hint)

    def _place(self, detail: ErrorDetails) -> Location:
        """Where to point for an error: of fields that contradict each other, one that is here."""
        location = detail["loc"]
        if detail["type"] != _INCONSISTENT:
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


def _kind(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, bool):
        return "true" if value else "false"
    return quoted(value) if isinstance(value, str) else str(value)


def _explain(model: type[BaseModel], detail: ErrorDetails) -> tuple[str, str | None]:
    """Problem and hint for one of pydantic's errors, in the words of the model's fields."""
    location, kind = detail["loc"], detail["type"]
    if kind == "extra_forbidden":
        owner = _inner_model(_type_at(model, location[:-1])[0])
        known = [] if owner is None else list(owner.model_fields)
        return "unknown key", did_you_mean(str(location[-1]), known)
    if kind == "value_error":
        return str(detail["ctx"]["error"]), None
    if kind == _INCONSISTENT:
        return detail["msg"], None
    expected = describe(*_type_at(model, location))
    if kind == "missing":
        return f"missing, expected {expected}", None
    return f"expected {expected}, got {_kind(detail['input'])}", None


def _type_at(model: type[BaseModel], location: Location) -> tuple[Any, str]:
    """The type at ``location``, with the metadata of its field, and its unit."""
    annotation: Any = model
    unit = ""
    for step in location:
        if isinstance(step, int):
            items = typing.get_args(_bare(annotation))
            annotation = items[0] if Ellipsis in items else items[min(step, len(items) - 1)]
        else:
            owner = _inner_model(annotation)
            if owner is None or step not in owner.model_fields:
                break
            info = owner.model_fields[step]
            annotation, unit = Annotated[info.annotation, info], unit_of(info)
    return annotation, unit


def _bare(annotation: Any) -> Any:
    """The type without its metadata."""
    while typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    return annotation


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    bare = _bare(annotation)
    return bare if isinstance(bare, type) and issubclass(bare, BaseModel) else None


def describe(annotation: Any, unit: str) -> str:
    """What a type accepts, with range and unit: ``a number > 0 [m]``."""
    limits = []
    for extra in typing.get_args(annotation)[1:]:
        for limit in extra.metadata:  # `extra` is a FieldInfo, from a model or from a type alias
            for name, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<=")):
                if hasattr(limit, name):
                    limits.append(f"{sign} {getattr(limit, name):g}")
    text = " ".join(part for part in (_type_name(_bare(annotation)), " and ".join(limits)) if part)
    return f"{text} [{unit}]" if unit else text


def _type_name(bare: Any) -> str:
    origin, arguments = typing.get_origin(bare), typing.get_args(bare)
    if origin is Literal:
        return "one of " + ", ".join(str(choice) for choice in arguments)
    if origin is tuple:
        return "a list" if Ellipsis in arguments else f"a list of {len(arguments)} numbers"
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
    return names.get(bare, "a mapping of keys to values")


# --- writing ------------------------------------------------------------------------------------


def dump(model: BaseModel) -> str:
    """The model as YAML with description and unit behind every key; loads back to an equal one."""
    yaml = YAML(typ="rt")
    yaml.width = 4096  # long lines instead of folded comments
    stream = io.StringIO()
    yaml.dump(_commented(model), stream)
    return stream.getvalue()


_COMMENT_COLUMN = 34


def _commented(model: BaseModel) -> CommentedMap:
    node = CommentedMap()
    for name, info in type(model).model_fields.items():
        value = getattr(model, name)
        node[name] = _node(value)
        comment = _comment(info)
        if isinstance(value, BaseModel) or _is_nested(value):
            node.yaml_set_comment_before_after_key(name, before=comment)
        else:
            node.yaml_add_eol_comment(comment, name, column=_COMMENT_COLUMN)
    return node


def _comment(info: FieldInfo) -> str:
    """``description [unit]``, with the choices in front where there are some."""
    bare = _bare(info.annotation)
    choices = typing.get_args(bare) if typing.get_origin(bare) is Literal else ()
    before = " | ".join(choices) + ": " if choices else ""
    after = f" [{unit_of(info)}]" if unit_of(info) else ""
    return f"{before}{info.description}{after}"


def _is_nested(value: Any) -> bool:
    """Whether ``value`` takes more than the line of its key."""
    if isinstance(value, dict):
        return True
    return isinstance(value, tuple) and any(isinstance(item, (tuple, BaseModel)) for item in value)


def _node(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return _commented(value)
    if not isinstance(value, tuple):
        return value
    sequence = CommentedSeq(
        _flow(item.model_dump(mode="json")) if isinstance(item, BaseModel) else _node(item)
        for item in value
    )
    return sequence if any(isinstance(item, BaseModel) for item in value) else _flow(sequence)


def _flow(value: dict[str, Any] | CommentedSeq) -> CommentedMap | CommentedSeq:
    """``value`` on one line: ``{a: 1}`` or ``[1, 2]``."""
    if isinstance(value, CommentedSeq):
        value.fa.set_flow_style()
        return value
    node = CommentedMap(
        (key, _flow(CommentedSeq(item)) if isinstance(item, list) else item)
        for key, item in value.items()
    )
    node.fa.set_flow_style()
    return node
