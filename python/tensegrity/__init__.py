"""State estimation for tensegrity robots.

The main job in four lines::

    import tensegrity

    sequence = tensegrity.sequence.read("recording/")
    trajectory = tensegrity.estimate(sequence)
"""

from tensegrity import robots, sequence
from tensegrity.config import FilterConfig
from tensegrity.errors import InputError
from tensegrity.estimation import PrismEstimator, estimate
from tensegrity.trajectory import Trajectory

__version__ = "0.1.0"

__all__ = [
    "FilterConfig",
    "InputError",
    "PrismEstimator",
    "Trajectory",
    "__version__",
    "estimate",
    "robots",
    "sequence",
]
