"""The manoeuvres of T §VI-C."""

from __future__ import annotations

from enum import StrEnum

from tensegrity.errors import InputError, did_you_mean


class Manoeuvre(StrEnum):
    """What the robot does between its still start and its still end."""

    FORWARD = "forward"
    BACKWARD = "backward"
    LEFT_TURN = "left-turn"
    RIGHT_TURN = "right-turn"

    @property
    def path_length(self) -> float:
        """Length of the path in T Table II [m]."""
        return _PATH_LENGTH[self]

    @classmethod
    def named(cls, name: str) -> Manoeuvre:
        """The manoeuvre called ``name``. Raises :class:`InputError` for an unknown name."""
        try:
            return cls(name)
        except ValueError:
            known = [manoeuvre.value for manoeuvre in cls]
            raise InputError(
                f"no manoeuvre is called '{name}'", hint=did_you_mean(name, known)
            ) from None


_PATH_LENGTH = {
    Manoeuvre.FORWARD: 7.50,
    Manoeuvre.BACKWARD: 6.74,
    Manoeuvre.LEFT_TURN: 18.61,
    Manoeuvre.RIGHT_TURN: 15.70,
}
