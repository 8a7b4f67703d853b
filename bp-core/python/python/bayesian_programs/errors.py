"""The exceptions of the package.

Each prints what `bp` prints: the found value, the expected one, and where. A wrong program shows its lines with carets.
"""

from __future__ import annotations

from typing import Any


class Error(ValueError):
    """Any error of a program, of data or of a question."""

    def __init__(self, message: str, **about: Any) -> None:
        super().__init__(message)
        self._about = about
        for name, value in about.items():
            setattr(self, name, value)

    def __reduce__(self) -> tuple[Any, tuple[type[Error], str, dict[str, Any]]]:
        # Exceptions cross processes with their places.
        return _again, (type(self), str(self), self._about)


def _again(kind: type[Error], message: str, about: dict[str, Any]) -> Error:
    return kind(message, **about)


class ProgramError(Error):
    """A wrong program or question.

    `diagnostics` is a list of dicts: `message`, `help` (or None), `line`, `column`, `end_line`, `end_column` (from 1, the
    end excluded), and `labels`, each (start, end, remark) with start and end as (line, column). `text` is the text.
    """

    diagnostics: list[dict[str, Any]] = []
    text: str = ""

    @property
    def line(self) -> int:
        """The line of the first mistake, from 1."""
        return int(self.diagnostics[0]["line"])

    @property
    def column(self) -> int:
        """The column of the first mistake, from 1."""
        return int(self.diagnostics[0]["column"])

    def _render_traceback_(self) -> list[str]:
        # In a notebook the mistakes alone, under their words.
        return [f"{type(self).__name__}: {self}"]

    def _repr_html_(self) -> str:
        from .display import mistakes

        return mistakes(self)


class DataError(Error):
    """A table that cannot be read or does not fit.

    `path`; for a cell also `row`, `column`, `value`. The row of a file is its line, that of a frame its position from 0.
    """

    path: Any = None
    row: int | None = None
    column: str | None = None
    value: str | None = None


class InputError(Error):
    """A value, a name or an array that does not fit; `name` is the name of the input, if it has one."""

    name: str | None = None


class AnswerError(Error):
    """A lookup of something that an answer does not have: the message lists what it has."""


class ImpossibleEvidence(Error):
    """Evidence of probability zero, or evidence that no draw met."""


class NoAnswer(Error):
    """A question that no strategy answers, or that takes too long or too much memory: the message says what to change."""
