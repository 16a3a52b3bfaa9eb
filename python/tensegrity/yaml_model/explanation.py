"""Pydantic's errors in the words of the model's fields."""

from __future__ import annotations

import typing
from typing import Annotated, Any, Literal

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from tensegrity.errors import did_you_mean, quoted
from tensegrity.yaml_model.model import INCONSISTENT, unit_of

Location = tuple[int | str, ...]
"""Keys and list positions from the root of a document to a value."""


def kind_of(value: Any) -> str:
    """What a YAML value is, for a message."""
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, bool):
        return "true" if value else "false"
    return quoted(value) if isinstance(value, str) else str(value)


def explain(model: type[BaseModel], detail: ErrorDetails) -> tuple[str, str | None]:
    """Problem and hint for one of pydantic's errors, in the words of the model's fields."""
    location, kind = detail["loc"], detail["type"]
    if kind == "extra_forbidden":
        owner = _inner_model(_type_at(model, location[:-1])[0])
        known = [] if owner is None else list(owner.model_fields)
        return "unknown key", did_you_mean(str(location[-1]), known)
    if kind == "value_error":
        return str(detail["ctx"]["error"]), None
    if kind == INCONSISTENT:
        return detail["msg"], None
    expected = describe(*_type_at(model, location))
    if kind == "missing":
        return f"missing, expected {expected}", None
    return f"expected {expected}, got {kind_of(detail['input'])}", None


def _type_at(model: type[BaseModel], location: Location) -> tuple[Any, str]:
    """The type at ``location``, with the metadata of its field, and its unit."""
    annotation: Any = model
    unit = ""
    for step in location:
        if isinstance(step, int):
            items = typing.get_args(bare_type(annotation))
            annotation = items[0] if Ellipsis in items else items[min(step, len(items) - 1)]
        else:
            owner = _inner_model(annotation)
            if owner is None or step not in owner.model_fields:
                break
            info = owner.model_fields[step]
            annotation, unit = Annotated[info.annotation, info], unit_of(info)
    return annotation, unit


def bare_type(annotation: Any) -> Any:
    """The type without its metadata."""
    while typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    return annotation


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    bare = bare_type(annotation)
    return bare if isinstance(bare, type) and issubclass(bare, BaseModel) else None


def describe(annotation: Any, unit: str) -> str:
    """What a type accepts, with range and unit: ``a number > 0 [m]``."""
    limits = []
    for extra in typing.get_args(annotation)[1:]:
        for limit in extra.metadata:  # `extra` is a FieldInfo, from a model or from a type alias
            for name, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<=")):
                if hasattr(limit, name):
                    limits.append(f"{sign} {getattr(limit, name):g}")
    text = " ".join(
        part for part in (_type_name(bare_type(annotation)), " and ".join(limits)) if part
    )
    return f"{text} [{unit}]" if unit else text


def _type_name(bare: Any) -> str:
    origin, arguments = typing.get_origin(bare), typing.get_args(bare)
    if origin is Literal:
        return "one of " + ", ".join(str(choice) for choice in arguments)
    if origin is tuple:
        return "a list" if Ellipsis in arguments else f"a list of {len(arguments)} numbers"
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
    return names.get(bare, "a mapping of keys to values")
