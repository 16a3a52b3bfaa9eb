"""Estimates against the truth: alignment on the still start, drift, relative pose error, shape,
and whether the covariances are honest."""

from tensegrity.evaluation.alignment import Alignment
from tensegrity.evaluation.comparison import Comparison, Motion, compare
from tensegrity.evaluation.consistency import Innovations
from tensegrity.evaluation.metrics import Metrics, evaluate, measure
from tensegrity.evaluation.published import TABLE_II, PublishedResult, published_result

__all__ = [
    "TABLE_II",
    "Alignment",
    "Comparison",
    "Innovations",
    "Metrics",
    "Motion",
    "PublishedResult",
    "compare",
    "evaluate",
    "measure",
    "published_result",
]
