"""Tables in and out: frames of pandas, polars and Arrow, and draws for ArviZ.

None of these packages is required. Frames come in by Arrow's C data interface (`__arrow_c_stream__`); a pandas frame
without pyarrow comes in column by column. What goes out has the kind of what came in.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native


class Columns(Mapping[str, "npt.NDArray[np.float64]"]):
    """Columns of numbers by name, one row for each case.

    A mapping of names to numpy arrays (float64); `errors` maps the rows without an answer to their reasons. It has
    `__arrow_c_stream__`, so that `pyarrow.table(columns)` and DuckDB read it, with a last column `error`; NaN becomes null
    there.
    """

    def __init__(
        self, rows: int, names: list[str], columns: list[npt.NDArray[np.float64]], errors: list[tuple[int, str]]
    ) -> None:
        self.rows = rows
        self._columns = dict(zip(names, columns))
        self.errors: dict[int, str] = dict(errors)

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        try:
            return self._columns[name]
        except KeyError:
            raise KeyError(f"there is no column {name!r}; the columns are {', '.join(self._columns)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"<Columns: {self.rows} rows of {', '.join(self._columns)}; {len(self.errors)} errors>"

    def error_column(self) -> npt.NDArray[np.object_]:
        """The reason of each row, `None` where it has an answer: an array of objects."""
        column = np.full(self.rows, None, dtype=object)
        for row, reason in self.errors.items():
            column[row] = reason
        return column

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        table = _native._stream(self.rows, list(self._columns.items()), self.errors)
        return table.__arrow_c_stream__(requested_schema)

    def to_pandas(self, index: Any = None) -> Any:
        """A frame of pandas."""
        import pandas

        return pandas.DataFrame({**self._columns, "error": self.error_column()}, index=index)

    def to_polars(self) -> Any:
        """A frame of polars."""
        import polars

        # As a mapping it would be without the column `error`.
        return polars.DataFrame(_native._stream(self.rows, list(self._columns.items()), self.errors))


def batch(program: _native.Program, table: Any, only: list[str], ignore: list[str]) -> Any:
    """The posteriors of many cases, as a frame of the kind of `table`."""
    found = Columns(*program._batch(table, only, ignore))
    kind = type(table)
    package = kind.__module__.partition(".")[0]
    if package == "pandas":
        return found.to_pandas(index=table.index)
    if package == "polars":
        return found.to_polars()
    if package == "pyarrow":
        pyarrow = sys.modules["pyarrow"]
        whole = pyarrow.table(found)
        return whole.combine_chunks().to_batches()[0] if _is_batch(table, whole) else whole
    return found


Group = dict[str, npt.NDArray[np.float64]]


def _is_batch(table: Any, whole: Any) -> bool:
    # Without rows there is no batch in a table.
    return type(table).__name__ == "RecordBatch" and whole.num_rows > 0


def to_arviz(posterior: _native.Posterior, resample: bool) -> dict[str, Group]:
    """The groups of `az.from_dict`, each array (chain, draw)."""
    drawn = posterior._all_draws()
    if drawn is None:
        from .errors import AnswerError

        raise AnswerError(f"`{posterior.question}`: it is exact: there are no draws; ask `by(\"weighting\")` or `by(\"gibbs\")`")
    values, weights, length = drawn
    stats = {"weight": weights}
    if length is None and resample and not np.allclose(weights, weights[0], rtol=1e-12, atol=0.0):
        seed = (posterior.estimate or {}).get("seed", 0)
        chosen = _systematic(weights, np.random.default_rng(seed))
        values = {name: draws[chosen] for name, draws in values.items()}
        stats = {"weight": np.full(len(weights), 1.0 / len(weights)), "weight_before": weights[chosen]}
    chains = 1 if length is None else len(weights) // length
    groups = {"posterior": values, "sample_stats": stats}
    return {name: {of: array.reshape(chains, -1) for of, array in group.items()} for name, group in groups.items()}


def _systematic(weights: npt.NDArray[np.float64], random: np.random.Generator) -> npt.NDArray[np.intp]:
    """The positions of a systematic resampling (Kitagawa, J. Comp. Graph. Stat. 5:1-25, 1996)."""
    count = len(weights)
    levels = (np.arange(count) + random.random()) / count
    return np.searchsorted(np.cumsum(weights) / np.sum(weights), levels).clip(max=count - 1)
