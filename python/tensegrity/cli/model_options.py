"""Command line options from the fields of a model, so that each is described in one place."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tensegrity.yaml_model import unit_of

Command = TypeVar("Command", bound=Callable[..., None])


def with_options_of(model: type[BaseModel]) -> Callable[[Command], Command]:
    """Give a command an option for every field of the model, in place of its ``**options``.

    typer reads a command's options from its signature; description, unit and default are stated
    once, in the model.
    """

    def decorate(command: Command) -> Command:
        parameters = [
            parameter
            for parameter in inspect.signature(command, eval_str=True).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        parameters += [_parameter(name, info) for name, info in model.model_fields.items()]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in parameters}
        return command

    return decorate


def _parameter(name: str, info: FieldInfo) -> inspect.Parameter:
    unit = unit_of(info)
    text = f"{info.description} [{unit}]" if unit else str(info.description)
    option = typer.Option(help=text[0].upper() + text[1:] + ".")
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=info.default,
        annotation=Annotated[_option_type(info.annotation), option],
    )


def _option_type(annotation: Any) -> Any:
    """The type by which typer reads a field: lists for tuples of any length (repeated options)."""
    if typing.get_origin(annotation) is Annotated:
        return _option_type(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return typing.Union[tuple(_option_type(a) for a in typing.get_args(annotation))]  # noqa: UP007
    if typing.get_origin(annotation) is tuple:
        return list[typing.get_args(annotation)[0]]  # type: ignore[misc]
    return annotation
