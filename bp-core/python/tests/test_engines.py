"""`batch` inside the engines that distribute rows. Expected values: the same rows in one process."""

import os
import re
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import bayesian_programs as bp

from conftest import ROOT

pa = pytest.importorskip("pyarrow")

LABELS = np.array(["LOW", "NORMAL", "HIGH"])


def cases(rows):
    random = np.random.default_rng(2)
    return pa.table({"HR": LABELS[random.integers(0, 3, rows)], "HRBP": LABELS[random.integers(0, 3, rows)]})


def test_duckdb_reads_and_writes(alarm):
    duckdb = pytest.importorskip("duckdb")
    observed = cases(500)
    rows = duckdb.sql("SELECT HR FROM observed WHERE HR <> 'LOW'").to_arrow_table()
    found = alarm.batch(rows, only=["CATECHOL"])
    (mean,) = duckdb.sql('SELECT avg("CATECHOL=HIGH") FROM found').fetchall()[0]
    share = (np.asarray(observed["HR"]) == "HIGH").sum() / rows.num_rows
    assert mean == pytest.approx(share * 0.45 / 0.475 + (1 - share) * 0.045 / 0.495)


def test_datafusion_streams_batches(alarm):
    datafusion = pytest.importorskip("datafusion")
    context = datafusion.SessionContext()
    context.register_record_batches("cases", [cases(1000).to_batches(max_chunksize=300)])
    stream = context.sql("SELECT * FROM cases").execute_stream()
    parts = [pa.table(alarm.batch(batch.to_pyarrow(), only=["CATECHOL"])) for batch in stream]
    together = pa.concat_tables(parts)
    assert together.num_rows == 1000
    alone = pa.table(alarm.batch(cases(1000), only=["CATECHOL"]))
    assert sorted(together["CATECHOL=HIGH"].to_pylist()) == sorted(alone["CATECHOL=HIGH"].to_pylist())


def test_an_experiment_is_rows_too():
    """The function of the page, with fewer looks."""
    page = (ROOT / "docs" / "python.md").read_text()
    (block,) = [one for one in re.findall(r"```python\n(.*?)```", page, re.S) if "def runs(" in one]
    names = {"pa": pa, "bvm": bp.bvm}
    exec(block.split("spark.")[0].replace("steps=20", "steps=2"), names)
    (found,) = names["runs"]([pa.RecordBatch.from_pydict({"seed": [1, 2, 1]})])
    first, second, again = found["entropy"].to_pylist()
    assert first == again != second


def executors(driver):
    """The processes of Spark's executors that descend from a process."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text().rpartition(")")[2].split()
                found[int(entry.name)] = (int(stat[1]), (entry / "cmdline").read_bytes())
            except OSError:
                continue
    below = {driver}
    while True:
        more = {pid for pid, (parent, _) in found.items() if parent in below} - below
        if not more:
            break
        below |= more
    return [pid for pid in below if pid in found and b"CoarseGrainedExecutorBackend" in found[pid][1]]


@pytest.mark.spark
def test_spark_loses_a_worker_but_no_rows(alarm, monkeypatch):
    pyspark = pytest.importorskip("pyspark")
    from pyspark.sql import SparkSession

    monkeypatch.setenv("SPARK_HOME", str(Path(pyspark.__file__).parent))
    monkeypatch.setenv("PYSPARK_PYTHON", sys.executable)
    monkeypatch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
    session = (
        SparkSession.builder.master("local-cluster[2,1,1024]")
        .config("spark.ui.enabled", "false")
        .config("spark.driver.host", "127.0.0.1")
        .config("spark.executorEnv.PYTHONPATH", os.pathsep.join(sys.path))
        .config("spark.sql.execution.arrow.maxRecordsPerBatch", "500")
        .getOrCreate()
    )
    try:
        rows = cases(20_000)
        numbered = rows.append_column("id", pa.array(range(20_000)))

        def posteriors(batches):
            for batch in batches:
                time.sleep(0.2)
                evidence = batch.select(["HR", "HRBP"])
                found = pa.table(alarm.batch(evidence, only=["CATECHOL"]))
                yield from found.append_column("id", batch["id"]).to_batches()

        columns = alarm.batch(rows.slice(0, 0), only=["CATECHOL"]).schema
        kinds = [f"`{field.name}` {'string' if field.name == 'error' else 'double'}" for field in columns]
        frame = session.createDataFrame(numbered.to_pandas()).repartition(20)
        work = frame.mapInArrow(posteriors, ", ".join([*kinds, "id long"]))

        killed = []

        def kill():
            tracker = session.sparkContext.statusTracker()
            deadline = time.monotonic() + 60
            while time.monotonic() < deadline and not killed:
                time.sleep(0.2)
                stages = [tracker.getStageInfo(stage) for stage in tracker.getActiveStageIds()]
                if any(stage and stage.numCompletedTasks >= 3 and stage.numTasks >= 20 for stage in stages):
                    killed.append(executors(os.getpid())[0])
                    os.kill(killed[0], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        found = work.toPandas().sort_values("id")
        killer.join()
        assert killed, "no executor was killed: the test has tested nothing"
        assert list(found["id"]) == list(range(20_000))
        alone = alarm.batch(rows.to_pandas(), only=["CATECHOL"])
        # The same bits.
        assert (found["CATECHOL=HIGH"].to_numpy() == alone["CATECHOL=HIGH"].to_numpy()).all()
        assert found["error"].isna().all()
    finally:
        session.stop()
