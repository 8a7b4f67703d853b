"""What is wrong is said with its place."""

import pickle

import numpy as np
import pytest

import bayesian_programs as bp

from conftest import DOOR

WRONG = """program Coin {
    variables { Heads : bool; }
    decomposition { P(Head) }
    forms { P(Heads) = bernoulli(0.5); }
}
"""


def test_a_wrong_program_shows_its_lines():
    with pytest.raises(bp.ProgramError) as caught:
        bp.program(WRONG)
    error = caught.value
    assert (error.line, error.column) == (3, 23)
    first = error.diagnostics[0]
    assert WRONG.splitlines()[first["line"] - 1][first["column"] - 1 : first["end_column"] - 1] == "Head"
    assert "did you mean `Heads`" in str(error) or "Heads" in (first["help"] or "")
    # Under the words: the line of the program, then the mark.
    lines = str(error).splitlines()
    shown = next(at for at, one in enumerate(lines) if "decomposition { P(Head) }" in one)
    assert lines[shown + 1].index("─") == lines[shown].index("Head)")
    assert isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert again.diagnostics == error.diagnostics and str(again) == str(error)


def test_a_wrong_question_shows_its_words(grass):
    with pytest.raises(bp.ProgramError) as caught:
        grass.ask("P(Rain | Wett = true)")
    assert (caught.value.line, caught.value.column) == (1, 10)
    # A word that is no value is the name of a value that is given later.
    with pytest.raises(bp.InputError, match="`maybe`: it was not given"):
        grass.ask("P(Rain | Wet = maybe)")


def test_messages_name_arguments_of_python(grass, line, door):
    few = line.by("weighting").draws(20).ask("P(X | Y = 8)").warning
    assert "`draws(n)`" in few and "--" not in few
    with pytest.raises(bp.Error, match=r'ignore the column: `ignore=\["Snow"\]`'):
        grass.learn({"Rain": [True], "Sprinkler": [False], "Wet": [True], "Snow": [1]})
    with pytest.raises(bp.Error, match=r'declare it: `hidden=\["Sprinkler"\]`'):
        grass.learn({"Rain": [True], "Wet": [True]})
    with pytest.raises(bp.Error, match="`ignore` leaves a column out"):
        grass.batch({"Snow": [1]})
    with pytest.raises(bp.Error, match=r"`question\(…\).over\(instants\)`"):
        door.ask("filter P(Open | Seen)")


def test_files():
    with pytest.raises(FileNotFoundError):
        bp.open("no_such_file.bp")
    with pytest.raises(bp.Error):
        bp.open(DOOR / "lawns.csv")


def test_lookups_list_what_there_is(grass, line):
    rain = grass.ask("P(Rain Wet)")
    with pytest.raises(bp.AnswerError, match="Rain.*Wet"):
        rain.of("Snow")
    with pytest.raises(bp.AnswerError, match="give 2"):
        rain.p(True)
    with pytest.raises(bp.AnswerError, match="write `true` or `false`"):
        rain.p(1, 0)
    with pytest.raises(bp.InputError, match="`X` is a real"):
        line.ask("P(X)").to_numpy()
    with pytest.raises(bp.AnswerError, match="marginal for each variable"):
        grass.marginals().to_numpy()
    with pytest.raises(bp.AnswerError):
        grass.ask("P(Rain)").number()


def test_impossible_evidence(grass):
    with pytest.raises(bp.ImpossibleEvidence, match="zero"):
        grass.ask("P(Sprinkler | Rain = true, Wet = false)")
    with pytest.raises(bp.ImpossibleEvidence):
        grass.marginals({"Rain": True, "Wet": False})


def test_values_of_wrong_kinds(grass, line):
    with pytest.raises(bp.InputError, match="not a value"):
        grass.marginals({"Rain": {"p": 0.5}})
    with pytest.raises(bp.InputError, match="mapping of names"):
        grass.marginals([True])
    with pytest.raises(bp.InputError, match="1.*bool"):
        grass.marginals({"Rain": 1})
    with pytest.raises(bp.InputError, match="likelihood must have 2"):
        grass.marginals({"Rain": bp.likelihood([1.0, 2.0, 3.0])})
    with pytest.raises(bp.Error, match="NaN"):
        line.question("P(X | Y = y)").given(y=float("nan")).ask()
    with pytest.raises(bp.InputError):
        line.question("P(X | Y = y)").given(y=np.zeros(3)).ask()
    with pytest.raises(TypeError):
        grass.ask(3)
    with pytest.raises(bp.InputError, match="at least 1"):
        line.draws(0)


def test_a_filter_answers_one_question(door):
    with pytest.raises(bp.NoAnswer, match="one question"):
        door.filter("P(Open | Seen); entropy P(Open | Seen)")
