"""Tables in and out. Expected values: by hand, or the same question asked alone."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import bayesian_programs as bp

from conftest import DOOR

HIGH = 0.45 / 0.475


def cases():
    return {"HR": ["HIGH", None, "LOW"]}


def check(found):
    np.testing.assert_allclose(np.asarray(found["CATECHOL=HIGH"], float), [HIGH, 0.5, 0.01 / 0.06])
    np.testing.assert_allclose(np.asarray(found["ln_p_evidence"], float), np.log([0.475, 1.0, 0.03]), atol=1e-15)


def test_columns_in_columns_out(alarm):
    found = alarm.batch(cases(), only=["CATECHOL"])
    assert list(found) == ["ln_p_evidence", "CATECHOL=NORMAL", "CATECHOL=HIGH"]
    assert isinstance(found, bp.Columns) and found.rows == 3 and found.errors == {}
    check(found)


def test_a_file_of_cases(alarm, tmp_path):
    path = tmp_path / "cases.csv"
    path.write_text("HR\nHIGH\n?\nLOW\n")
    check(alarm.batch(path))


def test_pandas(alarm):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(cases(), index=[5, 6, 7])
    found = alarm.batch(frame)
    assert isinstance(found, pandas.DataFrame) and list(found.index) == [5, 6, 7]
    check(found)
    check(alarm.batch(frame.astype("category")))
    assert found["error"].isna().all()


def test_polars(alarm):
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(cases())
    found = alarm.batch(frame)
    assert isinstance(found, polars.DataFrame)
    check(found)
    check(alarm.batch(frame.with_columns(polars.col("HR").cast(polars.Categorical))))


def test_arrow(alarm):
    arrow = pytest.importorskip("pyarrow")
    table = arrow.table(cases())
    found = alarm.batch(table)
    assert isinstance(found, arrow.Table)
    check(found.to_pydict())
    batch = alarm.batch(table.to_batches()[0])
    assert isinstance(batch, arrow.RecordBatch) and batch.schema == found.schema
    # Several batches are one table.
    check(alarm.batch(arrow.concat_tables([table.slice(0, 1), table.slice(1, 2)])).to_pydict())
    empty = alarm.batch(table.slice(0, 0))
    assert empty.num_rows == 0 and empty.schema == found.schema


def test_a_case_without_an_answer_has_its_reason(grass):
    found = grass.batch({"Rain": [True, True], "Wet": [True, False]})
    assert np.isfinite(found["ln_p_evidence"][0]) and np.isnan(found["ln_p_evidence"][1])
    assert list(found.errors) == [1] and "zero" in found.errors[1]


def test_many_rows_are_each_answered_as_if_alone(alarm):
    random = np.random.default_rng(5)
    labels = np.array(["LOW", "NORMAL", "HIGH"])
    rows = {"HR": labels[random.integers(0, 3, 40_000)], "HRBP": labels[random.integers(0, 3, 40_000)]}
    found = alarm.batch(rows, only=["CATECHOL"])
    assert found.rows == 40_000
    by_case = {}
    for hr in labels:
        for hrbp in labels:
            by_case[hr, hrbp] = alarm.marginals({"HR": hr, "HRBP": hrbp}).of("CATECHOL").p("HIGH")
    expected = [by_case[pair] for pair in zip(rows["HR"], rows["HRBP"])]
    np.testing.assert_allclose(found["CATECHOL=HIGH"], expected, rtol=1e-13)


def test_reals_and_booleans_by_their_types(line, grass):
    found = line.batch({"Y": np.array([2.0, np.nan], dtype=np.float64)})
    np.testing.assert_allclose(found["X.mean"], [1.0, 0.0], atol=1e-15)
    found = grass.batch({"Wet": np.array([True, False])}, only=["Rain"])
    np.testing.assert_allclose(found["Rain=true"], [0.3 / 0.93, 0.0])
    strided = np.array([2.0, -1.0, 4.0, -1.0])[::2]
    np.testing.assert_allclose(line.batch({"Y": strided})["X.mean"], [1.0, 2.0])


def test_numbers_of_every_type_and_stride(line, grass):
    expected = [1.0, -0.5]
    for kind in (np.float64, np.float32, np.int64, np.int32, np.int16, np.int8):
        column = np.array([2, -1], dtype=kind)
        np.testing.assert_allclose(line.batch({"Y": column})["X.mean"], expected)
        np.testing.assert_allclose(line.batch({"Y": column[::-1]})["X.mean"], expected[::-1])
    for kind in (np.uint64, np.uint32, np.uint16, np.uint8):
        np.testing.assert_allclose(line.batch({"Y": np.array([2, 4], dtype=kind)})["X.mean"], [1.0, 2.0])
    other_order = np.array([2.0, -1.0]).astype(np.dtype(float).newbyteorder())
    np.testing.assert_allclose(line.batch({"Y": other_order})["X.mean"], expected)
    unaligned = np.frombuffer(b"." + np.array([2.0, -1.0]).tobytes(), np.float64, 2, 1)
    assert not unaligned.flags.aligned
    np.testing.assert_allclose(line.batch({"Y": unaligned})["X.mean"], expected)
    fields = np.array([(2.0, True), (-1.0, False)], dtype=[("y", float), ("wet", bool)])
    np.testing.assert_allclose(line.batch({"Y": fields["y"]})["X.mean"], expected)
    np.testing.assert_allclose(grass.batch({"Wet": fields["wet"]}, only=["Rain"])["Rain=true"], [0.3 / 0.93, 0.0])
    frozen = np.array([2.0, -1.0])
    frozen.flags.writeable = False
    np.testing.assert_allclose(line.batch({"Y": frozen})["X.mean"], expected)


def test_a_frame_of_polars_has_the_reasons_too(grass, line):
    polars = pytest.importorskip("polars")
    found = grass.batch(polars.DataFrame({"Rain": [True, True], "Wet": [True, False]}))
    assert found["error"][0] is None and "zero" in found["error"][1]
    # No row has an answer: they are rows all the same.
    found = grass.batch(polars.DataFrame({"Rain": [True], "Wet": [False]}))
    assert len(found) == 1 and "zero" in found["error"][0]
    # A column without a type observes nothing.
    found = grass.batch(polars.DataFrame({"Wet": [None, None]}), only=["Rain"])
    np.testing.assert_allclose(found["Rain=true"], [0.3, 0.3])


def test_masked_cells_are_missing(grass):
    wet = np.ma.array([1, 0, 0], mask=[0, 0, 1])
    np.testing.assert_allclose(grass.batch({"Wet": wet}, only=["Rain"])["Rain=true"], [0.3 / 0.93, 0.0, 0.3])


def test_types_that_are_kept_as_numbers(line):
    pandas = pytest.importorskip("pandas")
    arrow = pytest.importorskip("pyarrow")
    with pytest.raises(bp.InputError, match="column `Y` has the type pandas.period"):
        line.batch(pandas.DataFrame({"Y": pandas.period_range("2020", periods=1, freq="Y")}))
    from decimal import Decimal

    found = line.batch(arrow.table({"Y": arrow.array([Decimal("2.0"), None], arrow.decimal128(3, 1))}))
    np.testing.assert_allclose(found["X.mean"].to_pylist(), [1.0, 0.0], atol=1e-15)
    found = line.batch(arrow.table({"Y": arrow.array([np.float16(2.0)], arrow.float16())}))
    np.testing.assert_allclose(found["X.mean"].to_pylist(), [1.0])


def test_ignored_columns_may_have_any_type(grass, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"Wet": [True], "when": pandas.to_datetime(["2020-01-01"])})
    with pytest.raises(bp.InputError, match="column `when` has the type"):
        grass.batch(frame, only=["Rain"])
    np.testing.assert_allclose(grass.batch(frame, only=["Rain"], ignore=["when"])["Rain=true"], [0.3 / 0.93])
    path = tmp_path / "cases.csv"
    path.write_text("id,Wet\n7,true\n")
    np.testing.assert_allclose(grass.batch(path, only=["Rain"], ignore=["id"])["Rain=true"], [0.3 / 0.93])


def test_a_text_is_no_list_of_names(grass):
    with pytest.raises(TypeError, match="give a list of names"):
        grass.batch({"Wet": [True]}, only="Rain")


def test_nullable_columns(line, grass):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"Y": pandas.array([2, None, -1], dtype="Int32")})
    np.testing.assert_allclose(line.batch(frame)["X.mean"], [1.0, 0.0, -0.5], atol=1e-15)
    frame = pandas.DataFrame({"Wet": pandas.array([True, None], dtype="boolean")})
    np.testing.assert_allclose(grass.batch(frame, only=["Rain"])["Rain=true"], [0.3 / 0.93, 0.3])


def test_contiguous_numbers_are_not_copied():
    """The memory of a process whose first row is wrong grows by less than the column of 400 MB."""
    program = """
import resource, sys
import numpy as np
import bayesian_programs as bp

coin = bp.program("program Coin { variables { Heads : bool; } decomposition { P(Heads) } forms { P(Heads) = bernoulli(0.5); } }")
column = np.full(50_000_000, 0.5)[:: int(sys.argv[1])]
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    coin.batch({"Heads": column})
except bp.DataError as error:
    assert error.row == 0
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    grown = lambda step: int(subprocess.check_output([sys.executable, "-c", program, step])) / 1024
    assert grown("1") < 50
    # Every second number is copied: the measurement sees a copy.
    assert grown("2") > 150


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"HR": ["HIGH", "HIHG"]}, "row 1, column `HR`: `HIHG` is not a value of `HR`.*did you mean `HIGH`"),
        ({"HRR": ["HIGH"]}, "column `HRR` names no variable; did you mean `HR`"),
        ({"HR": [2.5]}, "`2.5` is not a value of `HR`"),
        ({"HR": ["LOW"], "HRBP": ["LOW", "LOW"]}, "column `HRBP` has 2 rows, but `HR` has 1"),
        ({"HR": np.zeros((2, 2))}, "column `HR` has 2 axes"),
        ({"HR": [object()]}, "of type `object`, which is no value"),
        ({"HR": "HIGH"}, "give a list or an array"),
        ({"HR": np.array([1j])}, "column `HR` has the type complex128"),
        ({"HR": np.array(["2020-01-01"], "M8[D]")}, "column `HR` has the type datetime64"),
        ({"HR": np.array([b"HIGH"])}, "column `HR` has the type"),
        (3, "a table is a path, a frame"),
    ],
)
def test_wrong_tables_say_what_to_mend(alarm, table, message):
    with pytest.raises(bp.Error, match=message):
        alarm.batch(table)


def test_a_wrong_cell_has_its_place(alarm):
    with pytest.raises(bp.DataError) as caught:
        alarm.batch({"HR": ["HIGH"] * 20_000 + ["HIHG"]})
    error = caught.value
    assert (error.row, error.column, error.value) == (20_000, "HR", "HIHG")
    assert (pickle.loads(pickle.dumps(error)).row, str(error)) == (20_000, str(pickle.loads(pickle.dumps(error))))


def test_wrong_types_of_arrow_are_named(alarm):
    arrow = pytest.importorskip("pyarrow")
    table = arrow.table({"HR": arrow.array([0, 1], arrow.timestamp("s"))})
    with pytest.raises(bp.InputError, match="column `HR` has the type Timestamp"):
        alarm.batch(table)


def test_wrong_frames_say_what_to_mend(alarm):
    pandas = pytest.importorskip("pandas")
    with pytest.raises(bp.InputError, match="not a `Series`"):
        alarm.batch(pandas.Series(["HIGH"], name="HR"))
    with pytest.raises(bp.Error, match="[Dd]uplicate|two columns"):
        alarm.batch(pandas.DataFrame([["HIGH", "LOW"]], columns=["HR", "HR"]))
    with pytest.raises(bp.DataError, match="row 1, column `HR`: `HIHG`"):
        alarm.batch(pandas.DataFrame({"HR": pandas.Categorical(["HIGH", "HIHG"])}))


def test_names_of_the_wanted_variables(alarm, line):
    with pytest.raises(bp.Error, match="CATECHOLL"):
        alarm.batch({"HR": ["HIGH"]}, only=["CATECHOLL"])
    with pytest.raises(bp.InputError, match="`Z`.*the variables are `X` and `Y`"):
        line.batch({"Y": [1.0]}, only=["Z"])


def test_a_frame_none_of_whose_rows_has_an_answer(line):
    """It has the rows all the same, each with its reason."""
    pandas = pytest.importorskip("pandas")
    never = bp.program(
        """program Never {
            variables { X : real; A : bool; }
            decomposition { P(X) P(A | X) }
            forms { P(X) = normal(0, 1); P(A | X) = bernoulli(if X > 0 { 0 } else { 0 }); }
        }"""
    )
    found = never.by("weighting").draws(100).batch(pandas.DataFrame({"A": [True, True]}, index=[3, 4]))
    assert list(found.index) == [3, 4] and found["error"].notna().all()


def test_learning_needs_its_columns(grass):
    with pytest.raises(bp.Error, match="Wet"):
        grass.learn({"Rain": [True], "Sprinkler": [False]})
    with pytest.raises(bp.DataError, match="column `Rain`: `maybe`"):
        grass.learn({"Rain": ["maybe"], "Sprinkler": [False], "Wet": [True]})
    with pytest.raises(FileNotFoundError):
        grass.learn("no_such_file.csv")
    with pytest.raises(bp.InputError, match="it has no rows"):
        grass.learn({"Rain": [], "Sprinkler": [], "Wet": []})


def _interrupt_soon(seconds):
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_ctrl_c_stops_a_batch(line):
    """The rows are asked one by one, and sampled: all of them would take minutes."""
    slow = line.by("weighting").draws(20_000)
    _interrupt_soon(0.4)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        slow.batch({"Y": np.zeros(1_000_000)})
    assert time.monotonic() - begun < 5
    # Nothing is lost: the program answers as before.
    assert line.ask("P(X | Y = 2)").mean() == pytest.approx(1.0)


def test_ctrl_c_stops_draws_and_later_draws_are_complete(line):
    slow = line.by("weighting").draws(2_000_000)
    _interrupt_soon(0.4)
    with pytest.raises(KeyboardInterrupt):
        slow.ask("P(X | Y = 2)")
    after = line.by("weighting").draws(5000).ask("P(X | Y = 2)")
    assert after.estimate["particles"] == 5000


def test_ctrl_c_is_not_followed_by_the_answer_of_the_draws_so_far(line):
    """The draws are many: to sort them for quantiles would take seconds."""
    slow = line.by("weighting").draws(20_000_000)
    _interrupt_soon(1.0)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        slow.ask("P(X | Y = 2)")
    assert time.monotonic() - begun < 3


def test_ctrl_c_stops_learning(grass):
    rows = {"Rain": [None] * 200_000, "Sprinkler": [False, True] * 100_000, "Wet": [True] * 200_000}
    slow = bp.program(grass.text)
    _interrupt_soon(0.4)
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        while time.monotonic() - begun < 20:
            slow.learn(rows, iterations=10_000)
    assert time.monotonic() - begun < 5
    assert slow.ask("P(Rain)").p(True) == 0.3


def test_other_threads_run_during_a_batch(line):
    """And two batches of one program at once have the answers of one after the other."""
    slow, counted, ended = line.by("weighting").draws(2000), [0], threading.Event()

    def count():
        while not ended.is_set():
            counted[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    with ThreadPoolExecutor(2) as pool:
        one, other = pool.map(lambda _: slow.batch({"Y": np.arange(1000) / 1000}), range(2))
    ended.set()
    counter.join()
    assert counted[0] > 10
    np.testing.assert_array_equal(one["X.mean"], other["X.mean"])
    np.testing.assert_array_equal(one["X.mean"], slow.batch({"Y": np.arange(1000) / 1000})["X.mean"])
