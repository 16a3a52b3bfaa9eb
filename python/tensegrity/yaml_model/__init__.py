"""Pydantic models in YAML files: errors with file, line, key and unit; output with comments.

A model states description, unit and range of a field once, with :func:`field`; error messages and
the comments of :func:`dump` are made from that.
"""

from tensegrity.yaml_model.document import Document, Model, merge
from tensegrity.yaml_model.explanation import Location
from tensegrity.yaml_model.model import StrictModel, field, inconsistent, unit_of
from tensegrity.yaml_model.output import dump

__all__ = [
    "Document",
    "Location",
    "Model",
    "StrictModel",
    "dump",
    "field",
    "inconsistent",
    "merge",
    "unit_of",
]
