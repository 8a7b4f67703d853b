"""The cell magic `%%bp`: a program in a cell of a notebook.

    %load_ext bayesian_programs

    %%bp grass
    program Grass { … }

The cell is compiled and bound to the name, by default to the name of the program in lower case. Mistakes are shown under
their words, and raise `ProgramError`, so that a run of all cells stops there.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib import import_module
from typing import Any

from ._native import Program
from .errors import ProgramError


def register(shell: Any) -> None:
    """Registers the magic in a shell of IPython."""
    shell.register_magic_function(_magic(shell), magic_kind="cell", magic_name="bp")


def _magic(shell: Any) -> Callable[[str, str], Program]:
    def bp(line: str, cell: str) -> Program:
        """Compiles the cell as a Bayesian Program: `%%bp name`."""
        from . import program
        from .display import mistakes

        name = line.strip()
        if name and not name.isidentifier():
            raise ValueError(f"%%bp takes the name of a variable, not {name!r}")
        try:
            made = program(cell)
        except ProgramError as error:
            _show(mistakes(error))
            raise
        name = name or _snake(made.name)
        shell.user_ns[name] = made
        return made

    return bp


def _show(html: str) -> None:
    shown = import_module("IPython.display")
    shown.display(shown.HTML(html))


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
