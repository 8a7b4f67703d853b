"""How programs, derivations, posteriors, filters and maps show in a notebook.

In: objects of this package. Out: HTML without scripts, and LaTeX. Text of programs is never markup.
"""

from __future__ import annotations

import math
import re
from html import escape
from typing import Any

from . import charts

_MOST_ROWS = 40
_STYLE = "font-family:'STIX Two Text','Latin Modern Roman',Charter,Cambria,Georgia,serif;line-height:1.45"
_CELL = "padding:2px 10px;text-align:left;border:none"
_BRACE = "border-left:2px solid #555;border-radius:10px;padding:2px 0 2px 12px;margin:4px 0 4px 8px"


def _wrapped(*parts: str) -> str:
    return f"<div class='bayesian-program' style=\"{_STYLE}\">{''.join(parts)}</div>"


def _caption(text: str) -> str:
    return f"<div style='color:#5a5a5a;font-size:0.9em;margin:4px 0'>{text}</div>"


def _code(text: str) -> str:
    return f"<code style='background:none'>{escape(text)}</code>"


def _prose(text: str) -> str:
    """A sentence with names in backticks."""
    return "".join(_code(part) if at % 2 else escape(part) for at, part in enumerate(text.split("`")))


def _number(number: float) -> str:
    return f"{number:.6g}"


# Posteriors


def posterior(answer: Any) -> str:
    """A table with bars, densities, or curves over time."""
    document = answer.to_dict()
    rows = document["answer"]
    parts = [f"<div><b>{_code(document['question'])}</b></div>"]
    if answer.instants > 1:
        parts.append(_over_time(document["question"], 1, _of_instants(rows)))
    else:
        parts.append(_table(rows))
        parts += _densities(answer, rows)
    foot = []
    if document.get("ln_evidence") is not None:
        foot.append(f"ln P(evidence) = {_number(document['ln_evidence'])} nats")
    if estimate := document.get("estimate"):
        foot.append(f"estimated by {answer.strategy} from {estimate['particles']} draws, effective {estimate['effective']:.0f}")
    if answer.warning:
        foot.append(f"<b>{_prose(answer.warning)}</b>")
    return _wrapped(*parts, _caption("; ".join(foot)))


def _table(rows: list[dict[str, Any]]) -> str:
    if not rows:
        return _caption("nothing: no value is possible")
    names = list(rows[0]["values"])
    figures = [key for key in rows[0] if key not in ("values", "p", "law", "quantiles")]
    largest = max((row.get("p", 0.0) for row in rows), default=0.0)
    head = [*names, *(["probability", ""] if "p" in rows[0] else []), *figures]
    out = ["<table style='border-collapse:collapse'><thead><tr>"]
    out += [f"<th style='{_CELL};border-bottom:1px solid #333'>{escape(name)}</th>" for name in head]
    out.append("</tr></thead><tbody>")
    for row in rows[:_MOST_ROWS]:
        cells = [escape(str(row["values"].get(name, ""))) for name in names]
        if "p" in row:
            wide = 0 if largest == 0 else 160 * row["p"] / largest
            bar = f"<div class='bar' style='background:{charts.COLOURS[0]};height:0.8em;width:{wide:.1f}px'></div>"
            cells += [_number(row["p"]), bar]
        cells += [_figure(row[key]) for key in figures]
        out.append("<tr>" + "".join(f"<td style='{_CELL}'>{cell}</td>" for cell in cells) + "</tr>")
    out.append("</tbody></table>")
    if len(rows) > _MOST_ROWS:
        out.append(_caption(f"… and {len(rows) - _MOST_ROWS} more rows"))
    return "".join(out)


def _figure(value: Any) -> str:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return _number(value)
    if isinstance(value, list) and len(value) == 2 and all(isinstance(one, (int, float)) for one in value):
        return f"{_number(value[0])} ± {_number(value[1])}"
    return escape(str(value))


def _densities(answer: Any, rows: list[dict[str, Any]]) -> list[str]:
    """The density of each real with a known distribution, or the histogram of its draws."""
    found = []
    for row in rows[:6]:
        if "mean" not in row or not row["values"] and len(rows) > 1:
            continue
        name = next(iter(row["values"]), None) or (answer.variables or [""])[0]
        try:
            own = answer.of(name) if len(answer.variables) > 1 else answer
            if isinstance(row["mean"], list):
                values, weights = own.draws()
                found.append(charts.histogram(f"{name}, given the evidence", name, values.tolist(), weights.tolist()))
                continue
            mean, deviation = row["mean"], row["deviation"]
            if deviation <= 0.0 or not math.isfinite(deviation):
                continue
            points = [mean + deviation * (at - 100) / 25 for at in range(201)]
            values = own.density(points)
            finite = [(x, y) for x, y in zip(points, values.tolist()) if math.isfinite(y)]
            found.append(charts.density(f"{name}, given the evidence", name, finite, own.interval(0.9)))
        except ValueError:
            # Several contexts or instants: the table is all there is.
            continue
    return found


# Over time


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of each value its probability, of each real its 5 % quantile, mean and 95 % quantile."""
    found: dict[str, Any] = {}
    for row in rows:
        values = {name: value for name, value in row["values"].items() if name != "instant"}
        name = ", ".join(f"{name} = {value}" if value not in ("", None) else name for name, value in values.items())
        if "p" in row:
            found[name] = row["p"]
        elif "mean" in row:
            mean, deviation = (row[key][0] if isinstance(row[key], list) else row[key] for key in ("mean", "deviation"))
            if "quantiles" in row:
                ends = [one[0] if isinstance(one, list) else one for one in row["quantiles"]]
                found[name] = (ends[0], mean, ends[2])
            else:
                found[name] = (mean - 1.6449 * deviation, mean, mean + 1.6449 * deviation)
    return found


def _of_instants(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    grouped: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        grouped.setdefault(row["values"].get("instant"), []).append(row)
    return [_summary(own) for own in grouped.values()]


def _over_time(title: str, first: int, summaries: list[dict[str, Any]]) -> str:
    series: dict[str, list[Any]] = {}
    for summary in summaries:
        for name, value in summary.items():
            series.setdefault(name, []).append(value)
    names = list(series)
    # Of two values one determines the other.
    if len(names) == 2 and not isinstance(series[names[0]][0], tuple):
        series.pop(names[0])
    shown = dict(list(series.items())[: len(charts.COLOURS)])
    return charts.over_time(title, first, shown)


def filter(running: Any) -> str:  # noqa: A001
    """The last instants as curves and bands."""
    history = running.history
    title = escape(repr(running)[1:-1])
    if not history:
        return _wrapped(f"<div><b>{title}</b></div>")
    summaries = [_summary(one.to_dict()["answer"]) for one in history]
    first = running.instants - len(history) + 1
    chart = _over_time(f"{history[-1].question}", first, summaries)
    return _wrapped(chart, _caption(f"{title}; ln P(observations) = {_number(running.ln_evidence)} nats"))


def filter_latex(running: Any) -> str | None:
    """The posterior at the last instant."""
    history = running.history
    return posterior_latex(history[-1]) if history else None


# Programs


def _sections(text: str) -> list[tuple[str, str]]:
    """The sections of the last program of a text, as (name, body): `variables`, `forms`, `question rain`, …"""
    bare = re.sub(r"//[^\n]*", lambda found: " " * len(found.group()), text)
    start = [found.end() for found in re.finditer(r"\bprogram\s+\w+\s*\{", bare)]
    if not start:
        return []
    found, at, depth, begin, name = [], start[-1], 0, 0, ""
    head = at
    while at < len(bare):
        if bare[at] == "{":
            if depth == 0:
                name, begin = bare[head:at].strip(), at + 1
            depth += 1
        elif bare[at] == "}":
            depth -= 1
            if depth < 0:
                break
            if depth == 0:
                found.append((name, bare[begin:at]))
                head = at + 1
        at += 1
    return found


def _lines(body: str) -> list[str]:
    """The lines of a section, without their common indent."""
    lines = [line.rstrip() for line in body.splitlines() if line.strip()]
    indent = min((len(line) - len(line.lstrip()) for line in lines if line.startswith(" ")), default=0)
    return [line[indent:] if line.startswith(" " * indent) else line.strip() for line in lines]


_SPECIFICATION = ("sets", "parameters", "variables", "decomposition", "forms")


def _box(name: str, body: str) -> str:
    return f"<div>{escape(name)}<div style='{_BRACE}'>{body}</div></div>"


def _section(name: str, body: str) -> str:
    lines = escape("\n".join(_lines(body)))
    return _box(name.capitalize(), f"<pre style='margin:0;background:none'>{lines}</pre>")


def program(own: Any) -> str:
    """The brace figure of the program and its network."""
    parts = [f"<div><b>{escape(own.name)}</b></div>"]
    if own.documentation:
        parts.append(f"<div style='font-style:italic;color:#444'>{escape(own.documentation)}</div>")
    sections = _sections(own.text or "")
    if sections:
        inside = [_section(name, body) for name, body in sections if name in _SPECIFICATION]
        rest = [_section(name, body) for name, body in sections if name not in _SPECIFICATION]
        asked = [one for one in rest if one.startswith("<div>Question")]
        other = [one for one in rest if not one.startswith("<div>Question")]
        description = _box("Description", _box("Specification", "".join(inside)) + "".join(other))
        parts.append(f"<div style='{_BRACE}'>{description}{''.join(asked)}</div>")
    else:
        names = own.variables
        parts.append(_caption(f"{len(names)} variables: {escape(', '.join(names[:30]))}{' …' if len(names) > 30 else ''}"))
    if len(own.variables) <= 60:
        parts.append(_figure_of(own.diagram()))
    return _wrapped(*parts)


def program_latex(own: Any) -> str | None:
    """The brace figure as LaTeX."""
    sections = _sections(own.text or "")
    if not sections:
        return None
    specification = [_section_latex(name, body) for name, body in sections if name in _SPECIFICATION]
    rest = [(name, body) for name, body in sections if name not in _SPECIFICATION]
    other = [_section_latex(name, body) for name, body in rest if not name.startswith("question")]
    asked = [_section_latex(name, body) for name, body in rest if name.startswith("question")]
    description = r"\text{Description} " + _stacked([r"\text{Specification} " + _stacked(specification), *other])
    return rf"$$\text{{{_latex(own.name)}}} {_stacked([description, *asked])}$$"


def _stacked(rows: list[str]) -> str:
    return r"\left\{\begin{array}{l}" + r"\\ ".join(rows) + r"\end{array}\right."


def _section_latex(name: str, body: str) -> str:
    lines = [rf"\texttt{{{_latex(line)}}}" for line in _lines(body)] or [r"\;"]
    return rf"\text{{{_latex(name.capitalize())}}} {_stacked(lines)}"


def _latex(text: str) -> str:
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", " ": r"\ "}
    return "".join(special.get(one, "\\" + one if one in "_{}&%#$" else one) for one in text)


def _figure_of(own: Any) -> str:
    return f"<figure style='margin:8px 0'>{own.svg}<figcaption>{_caption(escape(own.legend))}</figcaption></figure>"


def diagram(own: Any) -> str:
    """The picture with its legend."""
    return _wrapped(_figure_of(own))


# Derivations


def _mathematics(equation: str) -> str:
    """A line of MathML in pieces, between which it can break: at blanks outside elements."""
    pieces, piece, depth = [], "", 0
    for token in re.findall(r"<[^>]*>|[^<]", equation):
        if token == " " and depth == 0:
            pieces.append(piece)
            piece = ""
            continue
        piece += token
        if token.startswith("</"):
            depth -= 1
        elif token.startswith("<") and not token.endswith("/>"):
            depth += 1
    pieces = [one for one in [*pieces, piece] if one]
    shown = " ".join(f'<math displaystyle="true">{one}</math>' for one in pieces)
    return f"<div style='margin:4px 0 8px 24px;line-height:2'>{shown}</div>"


def derivation(own: Any) -> str:
    """The steps, as mathematics."""
    parts = []
    for question, route, steps, computed in own._parts:
        parts.append(f"<div><b>{escape(own.program)}</b>: {_code(question)}</div><ol>")
        for rule, reason, _, _, mathml in steps:
            parts.append(f"<li><b>{_prose(rule)}.</b> {_prose(reason)}.{_mathematics(mathml)}</li>")
        parts.append(f"</ol><div>Computed, by {_prose(route)}:</div>")
        parts += [_mathematics(mathml) for _, _, mathml in computed]
    return _wrapped(*parts)


def _aligned(equation: str) -> str:
    """With `&` before the relation, outside brackets."""
    depth = 0
    for at, one in enumerate(equation):
        if one in "({[":
            depth += 1
        elif one in ")}]":
            depth -= 1
        elif depth == 0 and (one == "=" or equation.startswith(r"\propto", at)):
            return f"{equation[:at]}&{equation[at:]}"
    return f"& {equation}"


def derivation_latex(own: Any) -> str:
    """The equations of each question as `align*`."""
    blocks = []
    for _, _, steps, _ in own._parts:
        lines = [rf"{_aligned(latex)} && \text{{{_latex(rule)}}}" for rule, _, _, latex, _ in steps]
        blocks.append("\\begin{align*}\n" + " \\\\\n".join(lines) + "\n\\end{align*}")
    return "\n".join(blocks)


def posterior_latex(answer: Any) -> str | None:
    """Probabilities of values, means and standard deviations of reals."""
    rows = answer.to_dict()["answer"]
    lines = []
    for row in rows[:_MOST_ROWS]:
        named = [(rf"\mathit{{{_latex(name)}}}", value) for name, value in row["values"].items()]
        if "p" in row:
            values = ", ".join(rf"{name} = \text{{{_latex(str(value))}}}" for name, value in named)
            lines.append(rf"P({values}) &= {row['p']:.6g}")
        elif "mean" in row and len(named) == 1:
            mean, deviation = (row[key][0] if isinstance(row[key], list) else row[key] for key in ("mean", "deviation"))
            lines.append(rf"\mathrm{{E}}[{named[0][0]}] &= {mean:.6g},\ \sigma[{named[0][0]}] = {deviation:.6g}")
    return "\\begin{align*}\n" + " \\\\\n".join(lines) + "\n\\end{align*}" if lines else None


# The map and mistakes


def volumetric_map(own: Any) -> str:
    """The row of the map at the horizon, from above."""
    row = own.shape[1] // 2
    elevation = math.degrees(own.elevations[row])
    title = f"Occupancy at elevation {elevation:.0f}°"
    occupancy = own.occupancy[:, row, :]
    chart = charts.slice_of_map(title, own.edges_m.tolist(), own.azimuths.tolist(), occupancy)
    return _wrapped(chart, _caption(escape(repr(own)[1:-1])))


def mistakes(error: Any) -> str:
    """The mistakes of a program, each with its lines and carets."""
    return _wrapped(
        "<pre style='background:#fff5f5;border:1px solid #e0b4b4;padding:8px 12px;color:#7a1f1f'>"
        f"{escape(str(error))}</pre>"
    )
