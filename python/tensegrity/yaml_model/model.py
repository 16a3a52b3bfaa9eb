"""Models with units."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError


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


INCONSISTENT = "inconsistent"


def inconsistent(problem: str, *fields: str) -> PydanticCustomError:
    """An error to raise in a model's validator about ``fields`` that contradict each other."""
    return PydanticCustomError(INCONSISTENT, "{problem}", {"problem": problem, "fields": fields})
