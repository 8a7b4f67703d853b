"""Charts as SVG, without a plotting library: densities, histograms, bands over time, a slice of the map.

Each chart has a title, labels of its axes, and a legend where there are several curves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

COLOURS = ["#4c78a8", "#e45756", "#54a24b", "#f58518", "#b279a2", "#72b7b2", "#9d755d", "#bab0ac"]
_INK, _GREY = "#222222", "#8a94a0"
_FONT = "font-family='STIX Two Text, Latin Modern Roman, Cambria, Georgia, serif'"

Points = Sequence[tuple[float, float]]
# Of each instant a probability, or 5 % quantile, mean and 95 % quantile.
Series = Sequence[float] | Sequence[tuple[float, float, float]]


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers between two numbers, `most` at most."""
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return [low]
    rough = (high - low) / most
    unit = 10.0 ** math.floor(math.log10(rough))
    step = next(unit * times for times in (1, 2, 5, 10, 20) if unit * times >= rough)
    first = math.ceil(low / step - 1e-9)
    return [step * at for at in range(first, math.floor(high / step + 1e-9) + 1)]


class Chart:
    """A chart in data coordinates; the frame is drawn by `svg`."""

    def __init__(
        self,
        title: str,
        across: tuple[float, float],
        up: tuple[float, float],
        labels: tuple[str, str],
        size: tuple[int, int] = (460, 220),
    ) -> None:
        self._title, self._labels, self._size = title, labels, size
        self._across = across if across[1] > across[0] else (across[0] - 0.5, across[0] + 0.5)
        self._up = up if up[1] > up[0] else (up[0] - 0.5, up[0] + 0.5)
        self._left, self._right, self._top, self._bottom = 58, 14, 28, 42
        self._marks: list[str] = []
        self._legend: list[tuple[str, str]] = []

    def _x(self, x: float) -> float:
        low, high = self._across
        return self._left + (x - low) / (high - low) * (self._size[0] - self._left - self._right)

    def _y(self, y: float) -> float:
        low, high = self._up
        return self._size[1] - self._bottom - (y - low) / (high - low) * (self._size[1] - self._top - self._bottom)

    def _path(self, points: Points) -> str:
        return " ".join(f"{'ML'[at > 0]}{self._x(x):.1f} {self._y(y):.1f}" for at, (x, y) in enumerate(points))

    def line(self, points: Points, colour: str, name: str | None = None) -> None:
        """A curve, with a name in the legend."""
        self._marks.append(f"<path d='{self._path(points)}' fill='none' stroke='{colour}' stroke-width='1.8'/>")
        if len(points) == 1:
            (x, y), *_ = points
            self._marks.append(f"<circle cx='{self._x(x):.1f}' cy='{self._y(y):.1f}' r='2.5' fill='{colour}'/>")
        if name is not None:
            self._legend.append((colour, name))

    def band(self, low: Points, high: Points, colour: str, name: str | None = None) -> None:
        """The area between two curves."""
        outline = self._path([*low, *reversed(list(high))])
        self._marks.append(f"<path class='band' d='{outline} Z' fill='{colour}' fill-opacity='0.22'/>")
        if name is not None:
            self._legend.append((colour, name))

    def bar(self, left: float, right: float, height: float, colour: str) -> None:
        """A bar from zero."""
        x, y = self._x(left), self._y(height)
        wide, high = self._x(right) - x, self._y(0.0) - y
        self._marks.append(
            f"<rect class='bar' x='{x:.1f}' y='{y:.1f}' width='{wide:.1f}' height='{high:.1f}' fill='{colour}'"
            " fill-opacity='0.75'/>"
        )

    def svg(self) -> str:
        """The chart as one `svg` element."""
        width, height = self._size
        rows = math.ceil(len(self._legend) / 3)
        whole = height + 17 * rows
        out = [
            f"<svg xmlns='http://www.w3.org/2000/svg' role='img' width='{width}' height='{whole}'"
            f" viewBox='0 0 {width} {whole}' {_FONT} font-size='12' fill='{_INK}'>",
            f"<title>{escape(self._title)}</title>",
            f"<text x='{self._left}' y='17' font-size='14'>{escape(self._title)}</text>",
        ]
        base, left = height - self._bottom, self._left
        for x in ticks(*self._across):
            at = self._x(x)
            out.append(f"<path d='M{at:.1f} {base} v4' stroke='{_GREY}'/>")
            out.append(f"<text x='{at:.1f}' y='{base + 16}' text-anchor='middle'>{x:.4g}</text>")
        for y in ticks(*self._up, most=4):
            at = self._y(y)
            out.append(f"<path d='M{left} {at:.1f} H{width - self._right}' stroke='#e3e6ea'/>")
            out.append(f"<text x='{left - 6}' y='{at + 4:.1f}' text-anchor='end'>{y:.4g}</text>")
        out.append(f"<path d='M{left} {base} H{width - self._right}' stroke='{_GREY}'/>")
        out += self._marks
        out.append(
            f"<text x='{(left + width - self._right) / 2:.0f}' y='{height - 8}' text-anchor='middle'"
            f" font-style='italic'>{escape(self._labels[0])}</text>"
        )
        middle = (self._top + base) / 2
        out.append(
            f"<text transform='translate(13 {middle:.0f}) rotate(-90)' text-anchor='middle'"
            f" font-style='italic'>{escape(self._labels[1])}</text>"
        )
        for at, (colour, name) in enumerate(self._legend):
            x, y = left + (at % 3) * (width - left) / 3, height + 17 * (at // 3) + 6
            out.append(f"<rect x='{x:.0f}' y='{y - 8:.0f}' width='10' height='10' fill='{colour}'/>")
            out.append(f"<text x='{x + 15:.0f}' y='{y + 1:.0f}'>{escape(name)}</text>")
        out.append("</svg>")
        return "\n".join(out)


def density(title: str, name: str, points: Points, interval: tuple[float, float]) -> str:
    """A density, with the central 90 % shaded."""
    chart = Chart(title, (points[0][0], points[-1][0]), (0.0, 1.08 * max(y for _, y in points)), (name, "density"))
    inside = [(x, y) for x, y in points if interval[0] <= x <= interval[1]]
    if inside:
        chart.band([(x, 0.0) for x, _ in inside], inside, COLOURS[0], "central 90 %")
    chart.line(points, COLOURS[0])
    return chart.svg()


def histogram(title: str, name: str, values: Sequence[float], weights: Sequence[float], bins: int = 40) -> str:
    """Weighted draws as a histogram whose area is 1."""
    low, high = min(values), max(values)
    if high <= low:
        low, high = low - 0.5, high + 0.5
    wide, heights = (high - low) / bins, [0.0] * bins
    for value, weight in zip(values, weights):
        heights[min(int((value - low) / wide), bins - 1)] += weight / wide
    chart = Chart(title, (low, high), (0.0, 1.08 * max(heights)), (name, "density of the draws"))
    for at, height in enumerate(heights):
        chart.bar(low + at * wide, low + (at + 1) * wide, height, COLOURS[0])
    return chart.svg()


def over_time(title: str, first: int, series: Mapping[str, Series]) -> str:
    """Probabilities as lines, reals as means with their central 90 % as bands, over the instants from `first`."""
    numbers = [y for values in series.values() for value in values for y in (value if isinstance(value, tuple) else (value,))]
    real = any(isinstance(value, tuple) for values in series.values() for value in values)
    low, high = min(numbers, default=0.0), max(numbers, default=1.0)
    up = (low - 0.05 * (high - low), high + 0.05 * (high - low)) if real else (0.0, 1.0)
    count = max((len(values) for values in series.values()), default=1)
    chart = Chart(title, (first, first + count - 1), up, ("instant", "mean, 5 % to 95 %" if real else "probability"))
    for at, (name, values) in enumerate(series.items()):
        colour = COLOURS[at % len(COLOURS)]
        times = range(first, first + len(values))
        bands = [(t, value) for t, value in zip(times, values) if isinstance(value, tuple)]
        if bands:
            chart.band([(t, low) for t, (low, _, _) in bands], [(t, high) for t, (_, _, high) in bands], colour)
        middle = [value[1] if isinstance(value, tuple) else value for value in values]
        chart.line(list(zip(times, middle)), colour, name)
    return chart.svg()


def slice_of_map(title: str, edges: Sequence[float], azimuths: Sequence[float], occupancy: Any) -> str:
    """P(O = 1) of one row of the map, seen from above: ahead is up, left is left."""
    size, reach = 320, edges[-1]
    scale, half = (size / 2 - 26) / reach, math.pi / len(azimuths)

    def place(r: float, azimuth: float) -> tuple[float, float]:
        return size / 2 - scale * r * math.sin(azimuth), size / 2 - scale * r * math.cos(azimuth)

    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' role='img' width='{size}' height='{size + 46}'"
        f" viewBox='0 -24 {size} {size + 46}' {_FONT} font-size='12' fill='{_INK}'>",
        f"<title>{escape(title)}</title><text x='{size / 2}' y='-8' font-size='14' text-anchor='middle'>{escape(title)}</text>",
    ]
    for shell in range(len(edges) - 1):
        for column, azimuth in enumerate(azimuths):
            corners = [(edges[shell], -half), (edges[shell + 1], -half), (edges[shell + 1], half), (edges[shell], half)]
            path = " ".join("{:.1f},{:.1f}".format(*place(r, azimuth + side)) for r, side in corners)
            grey = round(255 * (1.0 - float(occupancy[shell][column])))
            out.append(f"<polygon points='{path}' fill='rgb({grey},{grey},{grey})'/>")
    out.append(f"<text x='{size / 2}' y='12' text-anchor='middle'>ahead, {reach:g} m</text>")
    for at in range(5):
        p = at / 4
        grey, x = round(255 * (1 - p)), size / 2 - 80 + 32 * at
        out.append(f"<rect x='{x}' y='{size - 6}' width='32' height='10' fill='rgb({grey},{grey},{grey})' stroke='{_GREY}'/>")
        out.append(f"<text x='{x + 16}' y='{size + 16}' text-anchor='middle'>{p:g}</text>")
    out.append(f"<text x='{size / 2 - 90}' y='{size + 4}' text-anchor='end'>P(O = 1)</text></svg>")
    return "\n".join(out)
