"""Errors that a user can act on."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


class InputError(ValueError):
    """Input that cannot be used: says which file, line and field, what is wrong and what to do.

    The command line prints it as one line and exits with code 2.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        field: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = None if file is None else Path(file)
        self.line = line
        self.field = field
        self.hint = hint
        super().__init__(str(self))

    def __str__(self) -> str:
        where = "" if self.file is None else str(self.file)
        if self.line is not None:
            where += f":{self.line}"
        parts = [part for part in (where, self.field and f"field '{self.field}'") if part]
        text = ": ".join([*parts, self.problem])
        text = text if self.hint is None else f"{text} ({self.hint})"
        return text.replace("\r", "\\r").replace("\n", "\\n")  # damaged input can hold line ends


class MissingExtraError(InputError):
    """A feature needs an optional dependency that is not installed."""

    def __init__(self, feature: str, extra: str) -> None:
        super().__init__(
            f"{feature} needs the '{extra}' extra",
            hint=f"pip install 'tensegrity-estimation[{extra}]'",
        )
        self.feature = feature
        self.extra = extra

    def __reduce__(self) -> tuple[Any, ...]:
        # Worker processes hand their errors to the parent pickled; an exception is rebuilt from its
        # message alone by default, which does not fit this constructor.
        return type(self), (self.feature, self.extra)


def quoted(value: object) -> str:
    """``value`` in quotes for a message, shortened when it is long."""
    text = str(value)
    return f"'{text}'" if len(text) <= 40 else f"'{text[:37]}...'"


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """A hint that offers the choice closest to a misspelt ``word``, or all of them."""
    known = list(choices)
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known)}"
