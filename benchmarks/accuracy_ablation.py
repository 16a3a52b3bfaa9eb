"""What each part of the estimator is worth: ``full`` with one part at a time switched off.

Every row is a matter of configuration alone, so that anyone can repeat it on a recording of their
own. Some parts pay only where something is wrong: combine ``--ablation`` with ``--variants
nominal cable-offsets-5mm wrong-contacts``. Rows and what they leave out:

* *feet never slip*: friction's likelihood. Every foot on the ground is one that stands still.
* *no cable offsets*: constant errors of the cable sensors are taken as zero.
* *fixed process noise*: the other rods' endcaps are as free at rest as at full activity.
* *flags taken as truth*: contact flags outvote the detector at once. Without flags in the
  recording, the same as ``full``.
* *terrain unknown*: the ground may rise and tilt on the way. (A variant that declares its terrain
  declares it here too.)
* *loosely coupled*: the shape is tracked by itself and then corrects the pose, with all else that
  improves on T: estimated spin, rolling endcaps, contact noise from the shape.
* *paper*: the method of T as published.
"""

from __future__ import annotations

from accuracy_variants import changed

from tensegrity.config import FilterConfig

Methods = dict[str, FilterConfig]
"""Configurations by the label they have in the table."""

# 999 : 1 with every flag; the geometry's evidence is held below e^4 : 1 (contact/detector.hpp).
_CERTAIN_FLAGS = 0.001
# T's Table I has no cable noise; this is what recordings have. The tightly coupled filter's own
# value is larger by what its linearisation leaves out.
_CABLE_STD = 0.002  # [m]


def ablation() -> Methods:
    """``full``, ``full`` with one part at a time switched off, and ``paper``."""
    full = FilterConfig.load("full")
    moving = full.noises.endcap_acceleration_moving
    return {
        "full": full,
        "feet never slip": changed(full, noises={"slip_length": 0.0}),
        "no cable offsets": changed(full, priors={"cable_offset_std": 0.0}),
        "fixed process noise": changed(full, noises={"endcap_acceleration_rest": moving}),
        "flags taken as truth": changed(full, settings={"contact_error": _CERTAIN_FLAGS}),
        "terrain unknown": changed(full, settings={"terrain": "unknown"}),
        "loosely coupled": changed(
            full, settings={"filter": "loose"}, noises={"cable_std": _CABLE_STD}
        ),
        "paper": FilterConfig.load("paper"),
    }
