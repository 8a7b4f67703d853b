"""The compiled part of the package. Names, shapes and units are those of docs/python.md."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Value: TypeAlias = bool | int | float | str | np.generic | npt.NDArray[Any] | Sequence[Any] | "likelihood"
Values: TypeAlias = Mapping[str, Value | None]
# A frame of pandas or polars, a table of Arrow or DuckDB (`__arrow_c_stream__`), a mapping of names to columns, or a path.
Table: TypeAlias = Any
Strategy: TypeAlias = Literal["sums", "join_tree", "gaussian", "chain", "weighting", "gibbs", "particles"]

__version__: str

class likelihood:
    """A likelihood for each value of a finite variable: virtual evidence. Only ratios matter."""

    weights: list[float]
    def __init__(self, weights: Sequence[float] | npt.NDArray[Any]) -> None: ...

class Program:
    """A Bayesian Program, or a network of another tool, with its settings. Immutable; pickled as its text."""

    @staticmethod
    def open(path: str | os.PathLike[str]) -> Program: ...
    @staticmethod
    def parse(text: str, format: Literal["bp", "bif", "xmlbif", "uai", "net"] = "bp") -> Program: ...
    def with_(self, values: Values | None = None, /, **named: Value) -> Program:
        """With values for parameters (a number, a list, an array) or sizes of sets.

        Raises `InputError` for an unknown name or a value outside its range.
        """

    def draws(self, count: int) -> Program: ...
    def seed(self, seed: int) -> Program: ...
    def by(self, strategy: Strategy) -> Program: ...
    def budget(self, products: int) -> Program: ...
    @property
    def name(self) -> str: ...
    @property
    def documentation(self) -> str: ...
    @property
    def variables(self) -> list[str]: ...
    @property
    def questions(self) -> list[str]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def text(self) -> str | None: ...
    @property
    def report(self) -> dict[str, Any] | None:
        """Of a learned program: `cases`, `cells_missing`, `ln_likelihood` (nats), `forms`, …"""

    def ask(self, question: str) -> Posterior:
        """The answer to a question, or to a declared one by its name; compiled once and kept.

        Raises `ProgramError` (a wrong question, under its words), `ImpossibleEvidence`, `NoAnswer`.
        """

    def ask_all(self, question: str) -> list[Posterior]: ...
    def question(self, question: str) -> Question: ...
    def filter(self, question: str, *, keep: int = 500) -> Filter: ...
    def marginals(self, evidence: Values | None = None, *, only: Sequence[str] | None = None) -> Posterior: ...
    def joint(self, names: Sequence[str], evidence: Values | None = None) -> Posterior: ...
    def most_probable(self, evidence: Values | None = None) -> Posterior: ...
    def observations(
        self, about: Sequence[str], among: Sequence[str] | None = None, evidence: Values | None = None
    ) -> tuple[float, list[tuple[str, float]]]:
        """Entropy of `about`, and what observing each of `among` would tell of it, nats, the most first."""

    def batch(self, table: Table, *, only: Sequence[str] | None = None) -> Any:
        """The posteriors of many cases, one for each row: a frame of the kind of `table`, else `Columns`.

        Columns: `ln_p_evidence` (nats), `variable=value`, `variable.mean`, `variable.deviation` (float64), and `error`
        (text). Null and NaN are not observed. Raises `DataError` with row and column.
        """

    def learn(
        self,
        table: Table,
        *,
        hidden: Sequence[str] = (),
        ignore: Sequence[str] = (),
        weight: str | None = None,
        sequence: str | None = None,
        seed: int | None = None,
        iterations: int | None = None,
    ) -> Program: ...
    def rows(self, *tables: Table, of: Sequence[str | None] = (), ignore: Sequence[str] = ()) -> Program: ...
    def learn_from_rows(self, *, seed: int | None = None, iterations: int | None = None) -> Program: ...
    def missing(self) -> list[Posterior]: ...
    def explain(self, question: str | None = None) -> Derivation: ...
    def print(self) -> Sheet:
        """The program in the brace layout of the formalism, as `bp print` shows it."""

    def diagram(self, question: str | None = None, *, evidence: Values | None = None) -> Diagram: ...

class Question:
    """A question, compiled for repeated use."""

    def given(self, values: Values | None = None, /, **named: Value) -> Question: ...
    def ask(self) -> Posterior: ...
    def ask_all(self) -> list[Posterior]: ...
    def over(self, instants: list[Values] | Table) -> Posterior:
        """Over time: a mapping for each instant, or a table with a row for each."""

class Filter:
    """The posterior at each instant, given all observations so far."""

    def step(self, observed: Values | None = None, /, **named: Value) -> Posterior:
        """The next instant. Raises `InputError` or `ImpossibleEvidence`; the filter is then unchanged."""

    def predict(self, steps: int = 1) -> Posterior: ...
    @property
    def ln_evidence(self) -> float: ...
    @property
    def instants(self) -> int: ...
    @property
    def history(self) -> list[Posterior]: ...

class Posterior:
    """The answer to a question. Lookups of what it does not have raise `AnswerError`."""

    @property
    def question(self) -> str: ...
    @property
    def strategy(self) -> str: ...
    @property
    def ln_evidence(self) -> float | None: ...
    @property
    def estimate(self) -> dict[str, Any] | None: ...
    @property
    def warning(self) -> str | None: ...
    @property
    def variables(self) -> list[str]: ...
    @property
    def instants(self) -> int: ...
    @property
    def axes(self) -> list[tuple[str, list[Any]]]: ...
    def p(self, *value: Value) -> float: ...
    def p_and_error(self, *value: Value) -> tuple[float, float]: ...
    def mode(self) -> dict[str, Any]: ...
    def values(self) -> list[tuple[dict[str, Any], float]]: ...
    def listed(self) -> list[dict[str, Any]]:
        """The rows of `draw(n)`, `best(n)` or `argmax`."""

    def mean(self) -> float: ...
    def mean_and_error(self) -> tuple[float, float]: ...
    def variance(self) -> float: ...
    def deviation(self) -> float: ...
    def covariance(self, one: str, other: str) -> float: ...
    def interval(self, level: float = 0.95) -> tuple[float, float]: ...
    def quantile(self, level: float) -> float: ...
    def entropy(self) -> float: ...
    def number(self) -> float: ...
    def of(self, name: str) -> Posterior: ...
    def given(self, values: Values | None = None, /, **named: Value) -> Posterior: ...
    def at(self, instant: int) -> Posterior: ...
    def density(self, points: Sequence[float] | npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
    def to_numpy(self) -> npt.NDArray[np.float64]:
        """The probabilities, an axis for each variable in the order of `axes`."""

    def draws(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Draws and their weights, which sum to 1."""

    def to_arviz(self, *, resample: bool = True) -> dict[str, dict[str, npt.NDArray[np.float64]]]:
        """The groups of `az.from_dict`, each array (chain, draw)."""

    def to_dict(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def __float__(self) -> float: ...

class Derivation:
    """How an answer follows from the program, step by step."""

    @property
    def program(self) -> str: ...
    @property
    def questions(self) -> list[str]: ...
    @property
    def steps(self) -> list[tuple[str, str, str]]: ...
    def to_latex(self) -> str: ...

class Diagram:
    """A picture of a network."""

    @property
    def svg(self) -> str: ...
    @property
    def legend(self) -> str: ...
    def save(self, path: str | os.PathLike[str]) -> None: ...

class Sheet:
    """A program in the brace layout of the formalism."""

    @property
    def svg(self) -> str: ...
    def to_latex(self) -> str: ...

class Gaze:
    """A direction to look at: rad, m."""

    @property
    def azimuth(self) -> float: ...
    @property
    def elevation(self) -> float: ...
    @property
    def score(self) -> float: ...
    @property
    def range_m(self) -> float | None: ...

class Map:
    """The volumetric map. Arrays have the axes (ρ, elevation, azimuth), float32."""

    def __init__(
        self,
        *,
        cells_rho: int = 16,
        rho_min_m: float = 0.5,
        rho_max_m: float = 6.0,
        azimuth_cells: int = 90,
        elevation_cells: int = 45,
    ) -> None: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def edges_m(self) -> npt.NDArray[np.float64]: ...
    @property
    def azimuths(self) -> npt.NDArray[np.float64]: ...
    @property
    def elevations(self) -> npt.NDArray[np.float64]: ...
    @property
    def occupancy(self) -> npt.NDArray[np.float32]: ...
    @property
    def entropy(self) -> npt.NDArray[np.float32]: ...
    @property
    def occupancy_entropy(self) -> npt.NDArray[np.float32]: ...
    @property
    def velocity(self) -> npt.NDArray[np.float32]: ...
    @property
    def velocities(self) -> list[list[int]]: ...
    def likelihood(
        self,
        ranges: npt.NDArray[np.float32],
        *,
        sigma_m: float = 0.05,
        confidence: float = 1.0,
        evidence: Literal["hard", "virtual"] = "hard",
    ) -> npt.NDArray[np.float32]: ...
    def observe(self, *likelihoods: npt.NDArray[np.float32]) -> None: ...
    def see(
        self,
        ranges: npt.NDArray[np.float32],
        *,
        sigma_m: float = 0.05,
        confidence: float = 1.0,
        evidence: Literal["hard", "virtual"] = "hard",
    ) -> None: ...
    def ranges(
        self,
        depth: npt.NDArray[np.float32],
        *,
        focal_px: tuple[float, float],
        centre_px: tuple[float, float],
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
    ) -> npt.NDArray[np.float32]: ...
    def gaze(self, yaw: float = 0.0) -> Gaze: ...

class Head:
    """An active head: of a robot, which gives depths and attitudes, or simulated."""

    def __init__(
        self,
        *,
        cells_rho: int = 16,
        rho_min_m: float = 0.5,
        rho_max_m: float = 6.0,
        azimuth_cells: int = 90,
        elevation_cells: int = 45,
        sigma_m: float = 0.05,
        most_tilt: float = 1.1,
    ) -> None: ...
    @staticmethod
    def simulated(seed: int = 1) -> Head: ...
    def look(
        self,
        depth: npt.NDArray[np.float32] | None = None,
        *,
        focal_px: tuple[float, float] | None = None,
        centre_px: tuple[float, float] | None = None,
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
        time_s: float = 0.0,
    ) -> dict[str, Any]: ...
    @property
    def map(self) -> Map: ...

def _disparities(
    left: npt.NDArray[np.float32],
    right: npt.NDArray[np.float32],
    *,
    most: int,
    matcher: Literal["scanline", "coherence"] = "scanline",
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]: ...
