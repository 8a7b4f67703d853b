"""Batches of a program with reals: columns known in advance, plans that rows share. Expected values: by hand."""

import numpy as np
import pytest

import bayesian_programs as bp


@pytest.fixture(scope="module")
def yard():
    """Depth is normal(2, 1) after rain, else normal(0, 1): P(Rain | Depth = 2) = 1 / (1 + 3 e^-2) by the ratio of densities."""
    return bp.program(
        """program Yard {
            variables { Rain, Wet : bool; Depth : real; }
            decomposition { P(Rain) P(Wet | Rain) P(Depth | Rain) }
            forms {
                P(Rain) = bernoulli(0.25);
                P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 });
                P(Depth | Rain) = normal(if Rain { 2 } else { 0 }, 1);
            }
        }"""
    )


YARD = ["ln_p_evidence", "Rain=false", "Rain=true", "Wet=false", "Wet=true", "Depth.mean", "Depth.deviation"]


def test_columns_do_not_depend_on_cells(yard):
    deep = 1 / (1 + 3 * np.exp(-2))
    found = yard.batch({"Wet": [None, True, None, True], "Depth": [2.0, None, None, None]})
    assert list(found) == YARD and found.errors == {}
    assert yard.batch_columns() == [*YARD, "error"]
    # An observed real has no numbers.
    np.testing.assert_allclose(found["Depth.mean"], [np.nan, 1.5, 0.5, 1.5], rtol=1e-12)
    np.testing.assert_allclose(found["Depth.deviation"][1:], np.sqrt([1.75, 1.75, 1.75]), rtol=1e-12)
    np.testing.assert_allclose(found["Rain=true"], [deep, 0.75, 0.25, 0.75], rtol=1e-12)
    np.testing.assert_allclose(found["Wet=true"], [0.1 + 0.8 * deep, 1.0, 0.3, 1.0], rtol=1e-12)
    normal = lambda x: np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi)
    expected = np.log([0.25 * normal(0) + 0.75 * normal(2), 0.3, 1.0, 0.3])
    np.testing.assert_allclose(found["ln_p_evidence"], expected, atol=1e-12)
    for rows in ({"Wet": [None]}, {"Depth": [2.0]}, {"Wet": [True], "Depth": [0.0]}, {"Wet": []}):
        assert list(yard.batch(rows)) == YARD
    # The parts of a table have the columns of the whole.
    assert list(yard.batch({"Wet": [None] * 70 + [True] * 70})) == YARD


def test_columns_of_the_named_variables(yard):
    found = yard.batch({"Wet": [True]}, only=["Depth", "Rain"])
    assert list(found) == ["ln_p_evidence", "Depth.mean", "Depth.deviation", "Rain=false", "Rain=true"]
    assert yard.batch_columns(only=["Rain"]) == ["ln_p_evidence", "Rain=false", "Rain=true", "error"]


def test_many_rows_that_observe_the_same_are_those_of_single_questions(yard):
    """They share a plan, whose inputs are their values."""
    depths = np.linspace(-1.0, 3.0, 40)
    found = yard.batch({"Wet": [True, False] * 20, "Depth": depths})
    odds = np.exp(2 * depths - 2) / 3 * np.where(np.arange(40) % 2 == 0, 9.0, 1 / 9)
    np.testing.assert_allclose(found["Rain=true"], odds / (1 + odds), rtol=1e-12)


def test_a_real_that_does_not_matter(yard):
    found = yard.batch({"Wet": [True, False, None]}, only=["Rain"])
    np.testing.assert_allclose(found["Rain=true"], [0.75, 0.025 / 0.7, 0.25], rtol=1e-13)
    np.testing.assert_allclose(found["ln_p_evidence"], np.log([0.3, 0.7, 1.0]), rtol=1e-13)


def test_families_that_are_observed_in_part():
    """M is normal(0, 1), and each of three readings M with unit noise: of k readings with sum s the mean is s / (k + 1)."""
    pool = bp.program(
        """program Pool {
            variables { M : real; Y[k in 1..=3] : real; }
            decomposition { P(M) prod(k in 1..=3) { P(Y[k] | M) } }
            forms { P(M) = normal(0, 1); P(Y[k] | M) = normal(M, 1); }
        }"""
    )
    columns = {"Y[1]": [1.0, 1.0, None], "Y[2]": [2.0, None, None], "Y[3]": [3.0, None, None]}
    found = pool.batch(columns, only=["M"])
    assert list(found) == ["ln_p_evidence", "M.mean", "M.deviation"] and found.errors == {}
    np.testing.assert_allclose(found["M.mean"], [1.5, 0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["M.deviation"], 1 / np.sqrt([4, 2, 1]), rtol=1e-12)
    assert pool.marginals({"Y": [1.0, None, None]}, only=["M"]).of("M").mean() == pytest.approx(0.5)
    with pytest.raises(bp.InputError, match="`Y\\[1\\]` to `Y\\[3\\]`"):
        pool.batch({"Y": [1.0]}, only=["M"])
