"""Programs, questions and answers. Expected values: by hand."""

import copy
import math
import os
import pickle
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import bayesian_programs as bp

from conftest import DOOR, ROOT


def test_the_first_program():
    grass = bp.open(ROOT / "tests" / "programs" / "wet_grass.bp")
    rain = grass.ask("P(Rain | Wet = true)")
    # Wet is certain with rain (0.3) and with the sprinkler, 0.9 of the other days.
    assert rain.p(True) == pytest.approx(0.3 / 0.93, abs=1e-15)
    assert rain.ln_evidence == pytest.approx(math.log(0.93), abs=1e-15)
    assert rain.mode() == {"Rain": False}
    p = np.array([0.63, 0.3]) / 0.93
    assert rain.entropy() == pytest.approx(-(p * np.log(p)).sum(), abs=1e-15)
    assert "probability" in str(rain) and "0.322581" in str(rain)
    assert rain.values() == [({"Rain": False}, rain.p(False)), ({"Rain": True}, rain.p(True))]
    assert grass.ask("rain").given(Wet=True).p(True) == rain.p(True)
    assert (grass.name, grass.questions) == ("WetGrass", ["rain"])
    assert grass.documentation == "Is it the rain or the sprinkler?"


def test_settings_make_new_programs(grass):
    drier = grass.with_(rate=0.2)
    assert drier.ask("P(Rain | Wet = true)").p(True) == pytest.approx(0.2 / (0.2 + 0.8 * 0.9))
    assert grass.ask("P(Rain)").p(True) == 0.3
    assert grass.with_({"rate": np.float32(0.5)}).ask("P(Rain)").p(True) == 0.5
    with pytest.raises(bp.InputError, match="rate.*1.5"):
        grass.with_(rate=1.5)
    with pytest.raises(bp.InputError, match="did you mean `rate`"):
        grass.with_(rat=0.5)
    with pytest.raises(bp.InputError, match="`rate` is None"):
        grass.with_(rate=None)


def test_a_question_is_compiled_once_and_takes_values(grass):
    asked = grass.question("P(Rain | Wet = wet)")
    assert asked.given(wet=True).ask().p(True) == pytest.approx(0.3 / 0.93)
    # Dry grass: no rain, for rain wets it.
    assert asked.given({"wet": False}).ask().p(True) == 0.0
    assert [one.ask().p(False) for one in [asked.given(wet=np.bool_(False))] * 3] == [1.0] * 3


def test_joint_distributions_are_arrays_with_axes(grass):
    both = grass.ask("P(Rain Sprinkler)")
    assert both.axes == [("Rain", [False, True]), ("Sprinkler", [False, True])]
    table = both.to_numpy()
    assert table.dtype == np.float64
    np.testing.assert_allclose(table, [[0.7 * 0.1, 0.7 * 0.9], [0.3 * 0.9, 0.3 * 0.1]], atol=1e-15)
    assert both.p(True, False) == both.p((True, False)) == table[1, 0]
    assert both.of("Sprinkler").p(True) == pytest.approx(0.66)
    conditional = grass.ask("P(Rain | Wet)")
    assert [name for name, _ in conditional.axes] == ["Wet", "Rain"]
    np.testing.assert_allclose(conditional.to_numpy()[1], [0.63 / 0.93, 0.3 / 0.93])
    assert conditional.given(Wet=True).p(True) == pytest.approx(0.3 / 0.93)


def test_reals(line):
    x = line.ask("P(X | Y = 2)")
    assert (x.mean(), x.variance()) == pytest.approx((1.0, 0.5))
    assert x.deviation() == pytest.approx(math.sqrt(0.5))
    half = 1.959963984540054 * math.sqrt(0.5)
    assert x.interval(0.95) == pytest.approx((1.0 - half, 1.0 + half))
    np.testing.assert_allclose(x.density([1.0, 1.0 + math.sqrt(0.5)]), np.exp([0.0, -0.5]) / math.sqrt(math.pi))
    assert line.ask("P(X Y)").covariance("X", "Y") == pytest.approx(1.0)
    assert x.mean_and_error()[1] == 0.0 and x.estimate is None


def test_draws_have_weights_and_go_to_arviz(line):
    x = line.by("weighting").draws(4000).seed(7).ask("P(X | Y = 2)")
    values, weights = x.draws()
    assert values.shape == weights.shape == (4000,)
    assert weights.sum() == pytest.approx(1.0)
    mean, error = x.mean_and_error()
    assert mean == pytest.approx((values * weights).sum()) and abs(mean - 1.0) < 5 * error
    assert x.estimate["particles"] == 4000 and x.estimate["seed"] == 7
    groups = x.to_arviz()
    assert groups["posterior"]["X"].shape == groups["sample_stats"]["weight"].shape == (1, 4000)
    assert abs(groups["posterior"]["X"].mean() - 1.0) < 0.1
    again = line.by("weighting").draws(4000).seed(7).ask("P(X | Y = 2)")
    assert (again.draws()[0] == values).all()
    with pytest.raises(bp.AnswerError, match="exact"):
        line.ask("P(X | Y = 2)").to_arviz()


def test_arviz_reads_the_draws(line):
    arviz = pytest.importorskip("arviz")
    groups = line.by("weighting").draws(1000).ask("P(X | Y = 2)").to_arviz()
    try:
        found = arviz.from_dict(**groups)
    except TypeError:
        found = arviz.from_dict(groups)
    assert found["posterior"]["X"].shape == (1, 1000)
    assert "weight" in found["sample_stats"]


def test_a_filter_steps_and_predicts(door):
    running = door.filter("P(Open | Seen)")
    # 0.1 · 0.7 / (0.1 · 0.7 + 0.9 · 0.1); then nothing is seen.
    assert running.step(Seen=True).p(True) == pytest.approx(0.4375)
    assert running.step().p(True) == pytest.approx(0.4375 * 0.8 + 0.5625 * 0.1)
    assert running.ln_evidence == pytest.approx(math.log(0.16))
    ahead = 0.40625
    for _ in range(3):
        ahead = 0.8 * ahead + 0.1 * (1 - ahead)
    assert running.predict(3).p(True) == pytest.approx(ahead)
    assert running.instants == 2 and len(running.history) == 2
    with pytest.raises(bp.InputError):
        running.step(Smelt=True)
    assert running.instants == 2


def test_smoothing_from_a_list_and_from_columns(door):
    smooth = door.question("smooth P(Open | Seen)")
    from_list = smooth.over([{"Seen": True}, {}, {"Seen": False}])
    from_columns = smooth.over({"Seen": [True, None, False]})
    assert from_list.instants == 3
    np.testing.assert_array_equal(from_list.to_numpy(), from_columns.to_numpy())
    assert from_list.axes[0] == ("instant", [1, 2, 3])
    # By enumeration of the four histories.
    go, see = {False: [0.9, 0.1], True: [0.2, 0.8]}, {False: [0.9, 0.1], True: [0.3, 0.7]}
    total, first_open = 0.0, 0.0
    for a in (False, True):
        for b in (False, True):
            for c in (False, True):
                p = go[False][a] * see[a][1] * go[a][b] * go[b][c] * see[c][0]
                total, first_open = total + p, first_open + p * a
    assert from_list.at(1).p(True) == pytest.approx(first_open / total)


def test_networks(alarm):
    found = alarm.marginals({"HR": "HIGH"})
    assert found.of("CATECHOL").p("HIGH") == pytest.approx(0.45 / 0.475)
    assert alarm.most_probable({"HR": "HIGH"}).mode()["CATECHOL"] == "HIGH"
    soft = alarm.marginals({"CATECHOL": bp.likelihood([1, 3])})
    assert soft.of("CATECHOL").p("HIGH") == pytest.approx(0.75)
    joint = alarm.joint(["CATECHOL", "HR"])
    assert joint.p("HIGH", "HIGH") == pytest.approx(0.45)
    entropy, gains = alarm.observations(["CATECHOL"])
    assert entropy == pytest.approx(math.log(2))
    assert gains[0][0] == "HR" and gains[0][1] > gains[1][1] > 0


def test_learning(grass, tmp_path):
    learned = grass.learn(DOOR / "lawns.csv")
    assert learned.ask("P(Rain)").p(True) == pytest.approx(0.25)
    assert learned.report["cases"] == 4 and "rate" in learned.text
    columns = {"Rain": [True, False, False, False], "Sprinkler": [False, True, False, True], "Wet": [True, True, False, True]}
    assert grass.learn(columns).ask("P(Rain)").p(True) == pytest.approx(0.25)


def test_learning_with_missing_values(grass):
    rows = {"Rain": [True, False, None], "Sprinkler": [False, True, True], "Wet": [True, True, True]}
    rate = 0.5
    for _ in range(500):
        weight = rate * 0.1 / (rate * 0.1 + (1 - rate) * 0.9)
        rate = (1 + weight) / 3
    assert grass.learn(rows, iterations=1000).ask("P(Rain)").p(True) == pytest.approx(rate, abs=1e-5)


def test_rows_of_a_table_are_a_plate():
    line = bp.program(
        """program Line {
            variables { A : real; Y[row in Rows] : real; }
            decomposition { P(A) prod(row in Rows) { P(Y[row] | A) } }
            forms { P(A) = normal(0, 1); P(Y[row] | A) = normal(A * x[row], 1); }
        }""".replace("variables {", "parameters { x[Rows] : real; } variables {", 1)
    )
    line = line.rows({"x": np.array([1.0, 2.0, 3.0]), "Y": np.array([1.0, 2.0, np.nan])})
    # Precision 1 + 1 + 4, information 1 + 4; the third row is missing.
    assert line.ask("P(A)").mean() == pytest.approx(5 / 6)
    (cell,) = line.missing()
    assert cell.mean() == pytest.approx(15 / 6)
    with pytest.raises(TypeError, match="not pickled"):
        pickle.dumps(line)


def test_fields_are_arrays_of_any_stride():
    field = bp.program(
        """program Field {
            parameters { level[Places] : real; }
            variables { A : real; Y[place in Places] : real; }
            decomposition { P(A) prod(place in Places) { P(Y[place] | A) } }
            forms { P(A) = normal(0, 1); P(Y[place] | A) = normal(A + level[place], 1); }
        }"""
    )
    levels = np.array([1.0, -9.0, 2.0, -9.0, 3.0])
    for given in (levels[::2], [1.0, 2.0, 3.0], levels[::2].astype(np.float32)):
        found = field.with_(level=given).ask("P(Y[2])")
        assert found.mean() == pytest.approx(3.0)


def test_rows_of_two_tables():
    pupils = bp.open(ROOT / "examples" / "pupils.bp")
    path = ROOT / "examples" / "data" / "pupils.csv"
    pandas = pytest.importorskip("pandas")
    by_path, by_frame = pupils.rows(path), pupils.rows(pandas.read_csv(path), of=["Rows"])
    assert by_frame.ask("effect").mean() == by_path.ask("effect").mean()
    with pytest.raises(bp.InputError, match="names 2 sets"):
        pupils.rows(path, of=["Rows", "Schools"])


def test_programs_are_pickled_as_their_text(grass, alarm):
    again = pickle.loads(pickle.dumps(grass.with_(rate=0.2).by("sums").seed(3)))
    assert again.ask("P(Rain)").p(True) == 0.2
    network = pickle.loads(pickle.dumps(alarm))
    assert network.marginals({"HR": "HIGH"}).of("CATECHOL").p("HIGH") == pytest.approx(0.45 / 0.475)


def asked(program, question):
    """In another process."""
    return program.ask(question), program.explain(question)


def test_answers_are_pickled(grass, line, door, alarm):
    answers = [
        grass.ask("P(Rain | Wet = true)"),
        grass.ask("P(Rain | Wet)"),
        grass.ask("entropy P(Rain)"),
        grass.ask("best(2) P(Rain Sprinkler)"),
        grass.ask("argmax P(Rain | Wet = true)"),
        grass.marginals({"Wet": True}).of("Rain"),
        grass.most_probable({"Wet": True}),
        alarm.joint(["HR", "CATECHOL"]),
        line.ask("P(X | Y = 2)"),
        line.ask("P(X > 1 | Y = 2)"),
        line.by("weighting").draws(500).ask("P(X | Y = 2)"),
        line.by("gibbs").draws(500).ask("P(X | Y = 2)"),
        door.question("smooth P(Open | Seen)").over([{"Seen": True}, {}]),
        door.filter("P(Open | Seen)").step(Seen=True),
    ]
    for answer in answers:
        again = pickle.loads(pickle.dumps(answer))
        assert (str(again), again.to_json()) == (str(answer), answer.to_json())
        assert (again.ln_evidence, again.strategy, again.estimate) == (
            answer.ln_evidence,
            answer.strategy,
            answer.estimate,
        )
        assert copy.deepcopy(answer) is answer
    rain = pickle.loads(pickle.dumps(answers[1]))
    np.testing.assert_array_equal(rain.to_numpy(), answers[1].to_numpy())
    assert rain.given(Wet=True).p(True) == answers[0].p(True)
    x = pickle.loads(pickle.dumps(answers[8]))
    assert (x.mean(), x.p(0.5), x.interval()) == (answers[8].mean(), answers[8].p(0.5), answers[8].interval())
    for one, other in zip(pickle.loads(pickle.dumps(answers[10])).draws(), answers[10].draws()):
        np.testing.assert_array_equal(one, other)


def test_what_else_is_pickled(grass, door):
    for one in (grass.explain("P(Rain | Wet = true)"), grass.print()):
        assert str(pickle.loads(pickle.dumps(one))) == str(one)
    picture = grass.diagram(evidence={"Wet": True})
    assert pickle.loads(pickle.dumps(picture)).svg == picture.svg
    asked = grass.question("P(Rain | Wet = wet)").given(wet=True)
    assert pickle.loads(pickle.dumps(asked)).ask().p(True) == asked.ask().p(True)
    weights = pickle.loads(pickle.dumps(bp.likelihood([0.2, 0.8]))).weights
    assert weights == [0.2, 0.8]
    learned = grass.learn({"Rain": [True, False], "Sprinkler": [False, True], "Wet": [True, True]})
    assert pickle.loads(pickle.dumps(learned)).report == learned.report is not None
    assert copy.deepcopy(grass) is grass
    with pytest.raises(TypeError, match="a filter is not pickled"):
        pickle.dumps(door.filter("P(Open | Seen)"))


def test_answers_come_back_from_other_processes(grass):
    import multiprocessing

    with multiprocessing.get_context("spawn").Pool(1) as pool:
        rain, derivation = pool.apply(asked, (grass, "P(Rain | Wet = true)"))
    assert rain.p(True) == pytest.approx(0.3 / 0.93)
    assert str(derivation) == str(grass.explain("P(Rain | Wet = true)"))


def test_likelihoods_are_evidence_everywhere(grass, door):
    # P(Wet) = 0.93, and rain wets for certain.
    expected = 0.3 * 0.8 / (0.93 * 0.8 + 0.07 * 0.2)
    seen = bp.likelihood([0.2, 0.8])
    assert grass.marginals({"Wet": seen}).of("Rain").p(True) == pytest.approx(expected, rel=1e-14)
    assert grass.question("P(Rain | Wet)").given(Wet=seen).ask().p(True) == pytest.approx(expected, rel=1e-14)
    assert grass.question("P(Rain | Wet = wet)").given(wet=seen).ask().p(True) == pytest.approx(expected, rel=1e-14)
    with pytest.raises(bp.InputError, match="leaves open"):
        grass.question("P(Rain)").given(Wet=seen)
    with pytest.raises(bp.InputError, match="must have 2 numbers"):
        grass.question("P(Rain | Wet)").given(Wet=bp.likelihood([1, 2, 3]))
    # The door opens with 0.1; it is seen open with 0.7, shut with 0.1: 0.3 + 3 · 0.7 and 0.9 + 3 · 0.1.
    seen = bp.likelihood([1, 3])
    first = 0.1 * 2.4 / (0.1 * 2.4 + 0.9 * 1.2)
    opens = 0.8 * first + 0.1 * (1 - first)
    second = 0.7 * opens / (0.7 * opens + 0.1 * (1 - opens))
    filter = door.filter("P(Open | Seen)")
    assert filter.step(Seen=seen).p(True) == pytest.approx(first, rel=1e-14)
    assert filter.ln_evidence == pytest.approx(math.log(1.32), rel=1e-14)
    assert filter.step(Seen=True).p(True) == pytest.approx(second, rel=1e-14)
    found = door.question("filter P(Open | Seen)").over([{"Seen": seen}, {"Seen": True}])
    assert found.p(True) == pytest.approx(second, rel=1e-14)
    # Seen later: of a shut door at both instants, and the other three.
    paths = {
        (now, then): (0.1 if now else 0.9) * (2.4 if now else 1.2) * go * (0.7 if then else 0.1)
        for (now, then), go in {(0, 0): 0.9, (0, 1): 0.1, (1, 0): 0.2, (1, 1): 0.8}.items()
    }
    smooth = door.question("smooth P(Open | Seen)").over([{"Seen": seen}, {"Seen": True}])
    opened = (paths[1, 0] + paths[1, 1]) / sum(paths.values())
    assert smooth.at(1).p(True) == pytest.approx(opened, rel=1e-14)
    assert smooth.ln_evidence == pytest.approx(math.log(sum(paths.values())), rel=1e-14)
    with pytest.raises(bp.InputError, match="give a value"):
        door.by("particles").filter("P(Open | Seen)").step(Seen=seen)


def test_a_step_that_is_interrupted_is_not_taken(door):
    slow = door.by("particles").draws(400_000)
    filter = slow.filter("P(Open | Seen)")
    filter.step(Seen=True)
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    taken = 1
    with pytest.raises(KeyboardInterrupt):
        while True:
            filter.step(Seen=False)
            taken += 1
    assert (filter.instants, len(filter.history)) == (taken, taken)
    fresh = slow.filter("P(Open | Seen)")
    for seen in [True] + [False] * (taken - 1):
        last = fresh.step(Seen=seen)
    assert (filter.ln_evidence, filter.history[-1].p(True)) == (fresh.ln_evidence, last.p(True))
    assert filter.step(Seen=True).p(True) == fresh.step(Seen=True).p(True)


def test_threads_share_a_program(grass, door):
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda rate: grass.with_(rate=rate).ask("P(Rain)").p(True), np.linspace(0, 1, 40)))
        same = list(pool.map(lambda _: grass.ask("P(Rain | Wet = true)").p(True), range(200)))
    np.testing.assert_allclose(found, np.linspace(0, 1, 40))
    assert set(same) == {grass.ask("P(Rain | Wet = true)").p(True)}
    running = door.filter("P(Open | Seen)")
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: running.step(Seen=True), range(100)))
    alone = door.filter("P(Open | Seen)")
    for _ in range(100):
        last = alone.step(Seen=True)
    assert running.instants == 100 and running.predict().p(True) == alone.predict().p(True)
    assert last.p(True) == running.history[-1].p(True)


def test_derivations(grass):
    derived = grass.explain("P(Rain | Wet = true)")
    assert derived.questions == ["P(Rain | Wet = true)"]
    rules = [rule for rule, _, _ in derived.steps]
    assert len(rules) >= 3 and "P(Rain" in str(derived)
    assert r"\sum" in derived.to_latex() and derived.to_latex().startswith(r"\begin{align*}")
    with pytest.raises(bp.InputError, match="declares none"):
        bp.program(
            "program Coin { variables { H : bool; } decomposition { P(H) } forms { P(H) = bernoulli(0.5); } }"
        ).explain()


def test_sheets_and_lists(grass, alarm):
    sheet = grass.print()
    for word in ("Specification", "Description", "Question"):
        assert word in str(sheet)
    assert sheet.svg.startswith("<svg") and "Specification" in sheet.to_latex()
    assert "CATECHOL" in str(alarm.print())
    best = grass.ask("best(2) P(Rain Sprinkler | Wet = true)").listed()
    assert best[0] == {"Rain": False, "Sprinkler": True} and len(best) == 2


def test_pictures(alarm, grass, tmp_path):
    plain = grass.diagram("P(Rain | Wet = true)")
    assert "shaded is known" in plain.legend and plain.svg.count("class=\"node\"") == 4
    with_posteriors = alarm.diagram(evidence={"HR": "HIGH"})
    assert "94.7%" in with_posteriors.svg and "100.0%" in with_posteriors.svg
    assert with_posteriors.svg.count("class=\"bar\"") == 2 + 3 + 3
    with_posteriors.save(tmp_path / "alarm.svg")
    assert (tmp_path / "alarm.svg").read_text() == with_posteriors.svg
