"""Models as YAML with comments."""

from __future__ import annotations

import io
import typing
from typing import Any, Literal

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from tensegrity.yaml_model.explanation import bare_type
from tensegrity.yaml_model.model import unit_of

_COMMENT_COLUMN = 34


def dump(model: BaseModel) -> str:
    """The model as YAML with description and unit behind every key; loads back to an equal one."""
    yaml = YAML(typ="rt")
    yaml.width = 4096  # long lines instead of folded comments
    stream = io.StringIO()
    yaml.dump(_commented(model), stream)
    return stream.getvalue()


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
    bare = bare_type(info.annotation)
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
