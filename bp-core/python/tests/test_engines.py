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


def code(words):
    """The code of the page with these words."""
    page = (ROOT / "docs" / "python.md").read_text()
    (block,) = [one for one in re.findall(r"```python\n(.*?)```", page, re.S) if words in one]
    return block


@pytest.fixture
def names(alarm, tmp_path, monkeypatch):
    """What the code of the page finds: its imports, the network, and a file of cases."""
    import pyarrow.parquet

    pyarrow.parquet.write_table(cases(1000).select(["HR"]), tmp_path / "cases.parquet")
    monkeypatch.chdir(tmp_path)
    return {"__name__": "__main__", "pa": pa, "pyarrow": pa, "alarm": alarm, "bvm": bp.bvm}


def alone(alarm):
    return alarm.batch(cases(1000).select(["HR"]))


def test_duckdb_reads_and_writes(names):
    names["duckdb"] = pytest.importorskip("duckdb")
    exec(code("duckdb.sql"), names)
    hr = np.asarray(cases(1000)["HR"])
    # P(CATECHOL = HIGH | HR) by hand, for each value of HR.
    expected = np.select([hr == "HIGH", hr == "NORMAL"], [0.45 / 0.475, 0.045 / 0.495], 0.01 / 0.06)
    assert names["mean"] == pytest.approx(expected.mean())


def test_datafusion_streams_batches(names, alarm):
    names["datafusion"] = pytest.importorskip("datafusion")
    exec(code("datafusion.SessionContext"), names)
    found = pa.parquet.read_table("found.parquet")
    assert found.num_rows == 1000
    assert sorted(found["CATECHOL=HIGH"].to_pylist()) == sorted(alone(alarm)["CATECHOL=HIGH"].to_pylist())


@pytest.mark.ray
def test_ray_maps_batches(names, alarm, monkeypatch):
    ray = names["ray"] = pytest.importorskip("ray")
    import ray.data

    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    path = {"env_vars": {"PYTHONPATH": os.pathsep.join(sys.path)}}
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, runtime_env=path)
    try:
        exec(code("ray.data"), names)
    finally:
        ray.shutdown()
    assert sorted(names["found"]["CATECHOL=HIGH"]) == sorted(alone(alarm)["CATECHOL=HIGH"].to_pylist())


def test_an_experiment_is_rows_too(names):
    """The function of the page, with fewer looks."""
    exec(code("def runs(").split("seeds = ")[0].replace("steps=20", "steps=2"), names)
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


@pytest.fixture(scope="module")
def spark():
    """Spark with two workers, each with a core and 1 GiB."""
    pyspark = pytest.importorskip("pyspark")
    from pyspark.sql import SparkSession

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SPARK_HOME", str(Path(pyspark.__file__).parent))
        patch.setenv("PYSPARK_PYTHON", sys.executable)
        patch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
        session = (
            SparkSession.builder.master("local-cluster[2,1,1024]")
            .config("spark.ui.enabled", "false")
            .config("spark.driver.host", "127.0.0.1")
            .config("spark.executorEnv.PYTHONPATH", os.pathsep.join(sys.path))
            .config("spark.sql.execution.arrow.maxRecordsPerBatch", "500")
            .getOrCreate()
        )
        yield session
        session.stop()


@pytest.mark.spark
def test_spark_runs_the_code_of_the_page(names, alarm, spark):
    names["spark"] = spark
    # The workers have another folder.
    exec(code("spark.read.parquet").replace("cases.parquet", f"file://{os.getcwd()}/cases.parquet"), names)
    assert sorted(names["found"]["CATECHOL=HIGH"]) == sorted(alone(alarm)["CATECHOL=HIGH"].to_pylist())
    block = code("def runs(").replace("steps=20", "steps=2").replace("range(100)", "range(4)")
    exec(block, names)
    expected = {seed: bp.bvm.experiment(["office"], ["view"], [seed], steps=2)[0]["entropy"] for seed in range(4)}
    assert dict(zip(names["found"]["seed"], names["found"]["entropy"])) == expected


@pytest.mark.spark
def test_spark_loses_a_worker_but_no_rows(alarm, spark):
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
    frame = spark.createDataFrame(numbered.to_pandas()).repartition(20)
    work = frame.mapInArrow(posteriors, ", ".join([*kinds, "id long"]))

    killed = []

    def kill():
        tracker = spark.sparkContext.statusTracker()
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
