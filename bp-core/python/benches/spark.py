"""`batch` through Spark with two workers beside one process: time, memory, and whether all bits agree.

    python bp-core/python/benches/spark.py alarm.bif

In: a BIF file of alarm, a number of rows. Out: seconds, processor seconds of all processes, and the largest resident
memory, sampled every 50 ms: of the process, and for Spark of all its Python workers together and of all its processes.
Both read the same eight Parquet files and write Parquet; the time of Spark is without its start. A worker of Spark has one
thread, the process as many as there are cores. Needs pyspark with Java 17 and pyarrow.
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
    """A process and its descendants: {process: (MiB, processor seconds, folder in /proc)}."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text().rpartition(")")[2].split()
                size = int(stat[21]) * os.sysconf("SC_PAGE_SIZE") / 2**20
                busy = (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")
                found[int(entry.name)] = (int(stat[1]), size, busy, entry)
            except OSError:
                continue
    own = {parent}
    while more := {process for process, (above, *_) in found.items() if above in own} - own:
        own |= more
    return {process: found[process][1:] for process in own if process in found}


def measured(work):
    """The result, seconds, processor seconds, and the largest memory of: this process, Python workers, all, MiB."""
    most, ended = [0.0] * 3, threading.Event()
    before = {process: busy for process, (_, busy, _) in below(os.getpid()).items()}
    latest = dict(before)

    def watch():
        while not ended.wait(0.05):
            now = [0.0] * 3
            for process, (size, busy, entry) in below(os.getpid()).items():
                latest[process] = busy
                try:
                    command = (entry / "cmdline").read_bytes()
                except OSError:
                    continue
                now[0] += size if process == os.getpid() else 0.0
                now[1] += size if b"pyspark.daemon" in command else 0.0
                now[2] += size
            most[:] = map(max, most, now)

    watcher = threading.Thread(target=watch)
    watcher.start()
    begun = time.perf_counter()
    try:
        found = work()
        seconds = time.perf_counter() - begun
    finally:
        time.sleep(0.1)
        ended.set()
        watcher.join()
    return found, seconds, sum(latest.values()) - sum(before.values()), most


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network", help="the BIF file of alarm")
    parser.add_argument("--rows", type=int, default=1_000_000, help="default: 1 000 000")
    arguments = parser.parse_args()

    import pyspark
    from pyspark.sql import SparkSession

    program = bp.read(arguments.network)
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as out:
        drawn = Network(arguments.network).draw(arguments.rows, 2)
        columns = {"id": pa.array(range(arguments.rows))} | {name: pa.array(drawn[name]) for name in SEEN}
        table, size = pa.table(columns), -(-arguments.rows // 8)
        for part in range(8):
            parquet.write_table(table.slice(part * size, size), f"{folder}/{part}.parquet")
        del drawn, columns, table

        def alone():
            found = program.batch(parquet.read_table(folder, columns=SEEN), only=ASKED)
            parquet.write_table(found, f"{out}/one.parquet")
            return found

        one, seconds, busy, memory = measured(alone)
        print(f"{'':<24} {'s':>8} {'processor s':>12} {'MiB':>8}")
        print(f"{'one process':<24} {seconds:>8.1f} {busy:>12.1f} {memory[0]:>8.0f}", flush=True)

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
        _, seconds, busy, memory = measured(lambda: frame.write.parquet(f"{out}/found"))
        workers = f"{memory[1]:>8.0f}  all processes {memory[2]:.0f}"
        print(f"{'Spark, two workers':<24} {seconds:>8.1f} {busy:>12.1f} {workers}")
        spread = parquet.read_table(f"{out}/found").sort_by("id")
        session.stop()
        names = [name for name in one.schema.names if name != "error"]
        bits = [[np.asarray(table[name]).view(np.uint64) for name in names] for table in (one, spread)]
        print("the same bits:", spread.num_rows == arguments.rows and np.array_equal(*bits))


if __name__ == "__main__":
    main()
