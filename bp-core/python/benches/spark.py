"""`batch` through Spark with two workers beside one process: time, memory, and whether all bits agree.

    python bp-core/python/benches/spark.py alarm.bif

In: a BIF file of alarm, a number of rows. Out: seconds and the largest resident memory, sampled every 50 ms: of the
process, and for Spark of all its Python workers together and of all its processes. The rows are in a Parquet file, from
which both read, and the time of Spark is without its start. Needs pyspark with Java 17, pandas and pyarrow.
"""

import argparse
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

import bayesian_programs as bp
from network import Network
from peers import ASKED, SEEN


def below(parent):
    """A process and its descendants: {process: (MiB, command)}."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text().rpartition(")")[2].split()
                found[int(entry.name)] = (int(stat[1]), int(stat[21]) * os.sysconf("SC_PAGE_SIZE") / 2**20, entry)
            except OSError:
                continue
    own = {parent}
    while more := {process for process, (above, *_) in found.items() if above in own} - own:
        own |= more
    return {process: found[process][1:] for process in own if process in found}


def measured(work):
    """The result, seconds, and the largest memory of: this process, Python workers, all processes, MiB."""
    most, ended = [0.0] * 3, threading.Event()

    def watch():
        while not ended.wait(0.05):
            now = [0.0] * 3
            for process, (size, entry) in below(os.getpid()).items():
                try:
                    command = (entry / "cmdline").read_bytes()
                except OSError:
                    continue
                now[0] += size if process == os.getpid() else 0.0
                now[1] += size if b"pyspark" in command and b"python" in command else 0.0
                now[2] += size
            most[:] = map(max, most, now)

    watcher = threading.Thread(target=watch)
    watcher.start()
    begun = time.perf_counter()
    try:
        return work(), time.perf_counter() - begun, most
    finally:
        ended.set()
        watcher.join()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network", help="the BIF file of alarm")
    parser.add_argument("--rows", type=int, default=1_000_000, help="default: 1 000 000")
    arguments = parser.parse_args()

    import pyspark
    from pyspark.sql import SparkSession

    program = bp.read(arguments.network)
    with tempfile.TemporaryDirectory() as folder:
        drawn = Network(arguments.network).draw(arguments.rows, 2)
        columns = {"id": pa.array(range(arguments.rows))} | {name: pa.array(drawn[name]) for name in SEEN}
        table, size = pa.table(columns), -(-arguments.rows // 8)
        for part in range(8):
            parquet.write_table(table.slice(part * size, size), f"{folder}/{part}.parquet")
        del drawn, columns, table

        def alone():
            return pa.table(program.batch(parquet.read_table(folder).sort_by("id").select(SEEN), only=ASKED))

        one, seconds, memory = measured(alone)
        print(f"{'':<24} {'s':>8} {'MiB':>8}")
        print(f"{'one process':<24} {seconds:>8.1f} {memory[0]:>8.0f}", flush=True)

        os.environ |= {"SPARK_HOME": str(Path(pyspark.__file__).parent), "PYSPARK_PYTHON": sys.executable}
        os.environ["SPARK_LOCAL_IP"] = "127.0.0.1"
        builder = SparkSession.builder.master("local-cluster[2,1,1024]").config("spark.ui.enabled", "false")
        builder = builder.config("spark.driver.host", "127.0.0.1")
        builder = builder.config("spark.executorEnv.PYTHONPATH", os.pathsep.join(sys.path))
        session = builder.config("spark.executorEnv.RAYON_NUM_THREADS", "1").getOrCreate()
        session.sparkContext.setLogLevel("ERROR")

        def posteriors(batches):
            for batch in batches:
                found = pa.table(program.batch(batch.select(SEEN), only=ASKED))
                yield from found.append_column("id", batch["id"]).to_batches()

        kinds = [f"`{name}` {'string' if name == 'error' else 'double'}" for name in one.schema.names]
        frame = session.read.parquet(folder).mapInArrow(posteriors, ", ".join([*kinds, "id long"]))
        spread, seconds, memory = measured(lambda: frame.write.parquet(f"{folder}/found"))
        print(f"{'Spark, two workers':<24} {seconds:>8.1f} {memory[1]:>8.0f}  all processes {memory[2]:.0f}")
        spread = parquet.read_table(f"{folder}/found").sort_by("id")
        session.stop()
        bits = lambda table, name: np.asarray(table[name]).view(np.uint64)
        names = [name for name in one.schema.names if name != "error"]
        print("the same bits:", all((bits(one, name) == bits(spread, name)).all() for name in names))


if __name__ == "__main__":
    main()
