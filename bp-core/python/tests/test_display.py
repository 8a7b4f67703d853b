"""What a notebook shows: well-formed, complete, and text of programs is never markup."""

import re
import xml.etree.ElementTree as xml

import pytest

import bayesian_programs as bp
from bayesian_programs import bvm, charts
from bayesian_programs.display import _sections

from conftest import DOOR

ENTITIES = '<!DOCTYPE r [<!ENTITY nbsp "&#160;">]>'


def parsed(html):
    return xml.fromstring(f"{ENTITIES}<r>{html}</r>")


def text_of(html):
    return "".join(parsed(html).itertext())


def test_a_posterior_is_a_table_with_bars(grass):
    html = grass.ask("P(Rain | Wet = true)")._repr_html_()
    page = parsed(html)
    bars = [float(re.search(r"width:([\d.]+)px", one.get("style")).group(1)) for one in page.iter("div") if one.get("class") == "bar"]
    # The longest bar is 160 pixels; 0.3 / 0.63 of it is the other.
    assert bars == pytest.approx([160.0, 160 * 0.3 / 0.63], abs=0.1)
    assert "0.322581" in text_of(html) and "-0.0725707 nats" in text_of(html)
    assert r"P(\mathit{Rain} = \text{true}) &= 0.322581" in grass.ask("P(Rain | Wet = true)")._repr_latex_()


def test_a_real_shows_its_density(line):
    page = parsed(line.ask("P(X | Y = 2)")._repr_html_())
    assert [one.text for one in page.iter("{http://www.w3.org/2000/svg}title")] == ["X, given the evidence"]
    # P(X | Y = 2) is normal(1, √½).
    assert r"\mathrm{E}[\mathit{X}] &= 1,\ \sigma[\mathit{X}] = 0.707107" in line.ask("P(X | Y = 2)")._repr_latex_()
    drawn = parsed(line.by("weighting").draws(500).ask("P(X | Y = 2)")._repr_html_())
    assert sum(one.get("class") == "bar" for one in drawn.iter("{http://www.w3.org/2000/svg}rect")) == 40


def test_smoothing_and_filters_show_curves_over_time(door):
    smooth = door.question("smooth P(Open | Seen)").over([{"Seen": True}, {}, {"Seen": False}])
    assert "instant" in text_of(smooth._repr_html_()) and "Open = true" in text_of(smooth._repr_html_())
    running = door.filter("P(Open | Seen)", keep=5)
    assert "0 instants" in running._repr_html_()
    for _ in range(8):
        running.step(Seen=True)
    assert running._repr_latex_() == running.history[-1]._repr_latex_() and "Open" in running._repr_latex_()
    assert len(running.history) == 5
    # The last five instants are 4 to 8.
    assert "8 instants" in text_of(running._repr_html_())


def test_a_filter_of_a_real_shows_bands():
    walk = bp.program(
        """program Walk {
            variables { X, X^-1, Z : real; }
            decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
            forms {
                P(X^-1) = previous(X) else normal(0, 1);
                P(X | X^-1) = normal(X^-1, 1);
                P(Z | X) = normal(X, 1);
            }
        }"""
    )
    running = walk.filter("P(X | Z)")
    for z in (0.1, 0.4, -0.3):
        running.step(Z=z)
    page = parsed(running._repr_html_())
    assert sum(one.get("class") == "band" for one in page.iter("{http://www.w3.org/2000/svg}path")) == 1


def test_a_program_shows_its_braces_and_its_network(grass):
    text = text_of(grass._repr_html_())
    for word in ("Description", "Specification", "Variables", "Decomposition", "Forms", "Identification", "Question rain"):
        assert word in text
    assert "bernoulli(rate)" in text and "<svg" in grass._repr_html_()
    latex = grass._repr_latex_()
    assert latex.count(r"\left\{") == latex.count(r"\right.") == latex.count(r"\begin{array}{l}")
    assert r"\text{Specification}" in latex
    names = [name for name, _ in _sections((DOOR / "grass.bp").read_text())]
    assert names == ["parameters", "variables", "decomposition", "forms", "identification", "question rain"]


def test_a_network_shows_its_variables(alarm):
    assert "3 variables: CATECHOL" in text_of(alarm._repr_html_())
    assert alarm._repr_latex_() is None
    assert "shaded is observed" in text_of(alarm.diagram(evidence={"HR": "HIGH"})._repr_html_())


def test_a_derivation_shows_mathematics(grass):
    derived = grass.explain("P(Rain | Wet = true)")
    html = derived._repr_html_()
    assert html.count("<li>") == len(derived.steps)
    assert "<math" in html
    parsed(html)


def test_text_of_programs_is_not_markup():
    odd = bp.program(
        """/// <script>alert(1)</script>
        program Odd {
            variables { A : { "<b>", "&amp;" }; }
            decomposition { P(A) }
            forms { P(A) = categorical(0.5, 0.5); }
        }"""
    )
    for html in (odd._repr_html_(), odd.ask("P(A)")._repr_html_(), odd.diagram(evidence={})._repr_html_()):
        assert "<script>" not in html and "<b><b>" not in html
        assert "<b>" in text_of(html) or "<script>" in text_of(html)


def test_the_map_shows_a_slice():
    small = bvm.Map(cells_rho=3, rho_max_m=2.0, azimuth_cells=8, elevation_cells=4)
    page = parsed(small._repr_html_())
    cells = list(page.iter("{http://www.w3.org/2000/svg}polygon"))
    assert len(cells) == 3 * 8 and {one.get("fill") for one in cells} == {"rgb(128,128,128)"}


def test_ticks_are_round():
    assert charts.ticks(0.0, 1.0) == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    assert charts.ticks(-3.2, 7.0) == pytest.approx([-2.0, 0.0, 2.0, 4.0, 6.0])
    assert charts.ticks(1.0, 1.0) == [1.0]


def test_the_cell_magic(grass):
    ipython = pytest.importorskip("IPython")
    shell = ipython.core.interactiveshell.InteractiveShell.instance()
    bp.load_ipython_extension(shell)
    made = shell.run_cell_magic("bp", "lawn", (DOOR / "grass.bp").read_text())
    assert shell.user_ns["lawn"] is made and made.ask("P(Rain)").p(True) == 0.3
    shell.run_cell_magic("bp", "", (DOOR / "grass.bp").read_text())
    assert shell.user_ns["grass"].name == "Grass"
    with ipython.utils.capture.capture_output() as shown, pytest.raises(bp.ProgramError):
        shell.run_cell_magic("bp", "", "program Coin {\n    variables { Heads : boolean; }\n}")
    (mistakes,) = [output.data["text/html"] for output in shown.outputs]
    lines = text_of(mistakes).splitlines()
    at = next(at for at, line in enumerate(lines) if "variables { Heads : boolean; }" in line)
    assert lines[at + 1].index("─") == lines[at].index("boolean")
    with pytest.raises(ValueError, match="name of a variable"):
        shell.run_cell_magic("bp", "two words", "program")
