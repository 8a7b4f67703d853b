"""Bayesian Programs: declared in the notation of the formalism, derived and answered by compiled kernels.

    import bayesian_programs as bp

    grass = bp.open("wet_grass.bp")
    rain = grass.ask("P(Rain | Wet = true)")
    rain.p(True), rain.mode(), rain.ln_evidence

Names, values and answers are those of the Rust prelude; docs/python.md lists both. In a notebook,
`%load_ext bayesian_programs` provides the cell magic `%%bp`.
"""

from __future__ import annotations

import os
import warnings as _warnings
from typing import Any

from . import bvm, errors
from ._native import (
    Derivation,
    Diagram,
    Filter,
    Posterior,
    Program,
    Question,
    Sheet,
    __version__,
    likelihood,
)
from .errors import (
    AnswerError,
    DataError,
    Error,
    ImpossibleEvidence,
    InputError,
    NoAnswer,
    ProgramError,
)
from .frames import Columns

__all__ = [
    "AnswerError",
    "Columns",
    "DataError",
    "Derivation",
    "Diagram",
    "Error",
    "Filter",
    "ImpossibleEvidence",
    "InputError",
    "NoAnswer",
    "Posterior",
    "Program",
    "ProgramError",
    "Question",
    "Sheet",
    "__version__",
    "bvm",
    "errors",
    "likelihood",
    "open",
    "program",
    "read",
]


def open(path: str | os.PathLike[str]) -> Program:  # noqa: A001, the name in Rust
    """A program (`.bp`) or a network (BIF, XMLBIF, UAI, Hugin NET), by the extension of the file.

    Raises `ProgramError` with every mistake under its words, `OSError` if the file cannot be read.
    """
    return Program.open(path)


def program(text: str) -> Program:
    """A program from its text. Of several programs in it the last one is asked.

    Raises `ProgramError` with every mistake under its words.
    """
    return Program.parse(text)


def read(path: str | os.PathLike[str]) -> Program:
    """A network (BIF, XMLBIF, UAI, Hugin NET); corrections that reading made are issued as warnings.

    Raises `ProgramError` with line and column, `OSError` if the file cannot be read.
    """
    network = Program.open(path)
    for line in network.warnings:
        _warnings.warn(line, stacklevel=2)
    return network


def load_ipython_extension(shell: Any) -> None:
    """Registers the cell magic `%%bp`: `%load_ext bayesian_programs`."""
    from .magic import register

    register(shell)
