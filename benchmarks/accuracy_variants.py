"""Recordings that differ from the nominal one in one respect each: ground, robot, gait, sensors."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tensegrity.config import FilterConfig
from tensegrity.sequence import Sequence
from tensegrity.simulation import SimulationOptions


def changed(config: FilterConfig, **sections: Mapping[str, Any]) -> FilterConfig:
    """``config`` with other values in its ``sections``: ``settings``, ``priors``, ``noises``."""
    values = config.model_dump()
    for section, differing in sections.items():
        values[section] |= differing
    return FilterConfig.model_validate(values)


@dataclass(frozen=True)
class Variant:
    """One difference from the nominal recording, and what the user tells the filter about it.

    * ``options`` of the simulation; what they change in the robot, the recording says itself
    * ``settings`` of the filter that a user with this ground or these sensors declares in the
      YAML's section ``settings``, whatever the method
    * ``contact_flags`` false: the recorded flags are dropped before estimating
    """

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    contact_flags: bool = True

    def simulation(self, seed: int) -> SimulationOptions:
        """Options of the recording with this seed."""
        return SimulationOptions(seed=seed, **self.options)

    def declared(self, config: FilterConfig) -> FilterConfig:
        """``config`` with the variant's ``settings``."""
        return changed(config, settings=self.settings)

    def sensed(self, sequence: Sequence) -> Sequence:
        """What the estimator gets of a recording."""
        return sequence if self.contact_flags else dataclasses.replace(sequence, contacts=None)


NOMINAL = Variant("nominal")

_LOST_CABLE = {"lost_cable": "l_0_4", "lost_cable_from": 5.0}

VARIANTS = {
    variant.name: variant
    for variant in (
        NOMINAL,
        # ground
        Variant("friction-0.4", {"friction": 0.4}),
        *(
            Variant(
                f"slope-5deg-{direction}",
                {"slope": 5.0, "slope_direction": float(direction)},
                settings={"terrain": "slope"},
            )
            for direction in (0, 120, 240)
        ),
        Variant("slope-5deg-0-called-flat", {"slope": 5.0}, settings={"terrain": "flat"}),
        Variant("stiff-floor", {"floor_time_constant": 0.005}),
        # robot and gait
        Variant("endcaps-5mm", {"endcap_radius": 0.005}),
        Variant("free-spin", {"cable_attachment_offset": 0.0}),
        Variant("fast", {"cable_speed": 0.26}),
        # sensors
        Variant("wrong-contacts", {"contact_false_rate": 0.1, "contact_missing_rate": 0.1}),
        Variant("no-contacts", contact_flags=False),
        Variant("imu-gaps", {"imu_gap": 0.05, "imu_gap_period": 10.0}),
        Variant(
            "instantaneous-imu",
            {"imu_sampling": "instantaneous"},
            settings={"imu_sampling": "instantaneous"},
        ),
        Variant("rod-imus", {"rod_imus": True}),
        Variant("cable-lost-5s", _LOST_CABLE | {"lost_cable_duration": 5.0}),
        Variant("cable-lost", _LOST_CABLE),
        Variant("cable-offsets-5mm", {"cable_offset_std": 0.005}),
    )
}
"""All variants by name, the nominal recording first."""
