"""`batch` from a frame to a frame beside the same function in Rust and a loop in pyAgrum, and one answer beside Rust.

    python bp-core/python/benches/batch.py alarm.bif

In: the BIF file of alarm, a number of rows. Out: seconds, processor seconds and memory of each, and whether the numbers
of Python and Rust have the same bits. The least of several runs, which take turns. Rust is `benches/rust.rs`, which
`cargo bench` builds and runs, or a program that was built from it. pyAgrum answers a sample of the rows, and its time is
scaled.
"""

import argparse
import importlib.util
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas

import bayesian_programs as bp
from network import Network
from peers import ASKED, SEEN, Agrum, write

HERE = Path(__file__).resolve().parent
KINDS = [name for name in ["pandas", "polars", "pyarrow"] if importlib.util.find_spec(name)]


def frame(kind, columns):
    if kind == "polars":
        import polars

        return polars.DataFrame(columns)
    if kind == "pyarrow":
        import pyarrow

        return pyarrow.table(columns)
    return pandas.DataFrame(columns)


def timed(work):
    """The result, seconds and processor seconds."""
    begun, busy = time.perf_counter(), time.process_time()
    found = work()
    return found, time.perf_counter() - begun, time.process_time() - busy


def python(arguments):
    """In a process of its own: prints as `rust.rs` does, and writes the numbers to a file."""
    columns = pandas.read_csv(arguments.cases, dtype=str).to_dict("list")
    program, given = bp.read(arguments.network), frame(arguments.kind, columns)
    del columns
    runs = [timed(lambda: program.batch(given, only=ASKED)) for _ in range(arguments.runs)]
    (found, *_), (seconds, busy) = runs[0], min(run[1:] for run in runs)
    names = found.column_names if arguments.kind == "pyarrow" else list(found.columns)
    np.column_stack([np.asarray(found[name], float) for name in names if name != "error"]).astype("<f8").tofile(arguments.numbers)
    print(f"seconds {seconds}\nprocessor {busy}\nmemory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}")
    coin = bp.program("program C { variables { H : bool; } decomposition { P(H) } forms { P(H) = bernoulli(0.5); } }")
    asked = coin.question("P(H)")
    loops = [timed(lambda: [asked.ask() for _ in range(1000)])[1] for _ in range(20)]
    print(f"ask {1e3 * min(loops)}")


def agrum(arguments):
    engine, sample = Agrum(), 2000
    engine.load(arguments.network, None)
    rows = pandas.read_csv(arguments.cases, dtype=str, nrows=sample)
    runs = [timed(lambda: engine.batch(rows))[1:] for _ in range(arguments.runs)]
    seconds, busy = (arguments.rows / sample * one for one in min(runs))
    print(f"seconds {seconds}\nprocessor {busy}")


def asked(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return {name: float(number) for name, number in (line.split() for line in done.stdout.splitlines())}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network", help="the BIF file of alarm")
    parser.add_argument("--rows", type=int, default=1_000_000, help="default: 1 000 000")
    parser.add_argument("--rounds", type=int, default=3, help="turns of each (default: 3)")
    parser.add_argument("--runs", type=int, default=2, help="runs in a turn (default: 2)")
    parser.add_argument("--rust", help="the program of `rust.rs`, compiled as the package is (default: by cargo bench)")
    parser.add_argument("--cases", help=argparse.SUPPRESS)
    parser.add_argument("--numbers", help=argparse.SUPPRESS)
    parser.add_argument("--kind", choices=[*KINDS, "pyAgrum"], help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.kind:
        return agrum(arguments) if arguments.kind == "pyAgrum" else python(arguments)
    with tempfile.TemporaryDirectory() as folder:
        cases, network = f"{folder}/cases.csv", os.path.abspath(arguments.network)
        drawn = Network(network).draw(arguments.rows, 2)
        write(cases, {name: drawn[name] for name in SEEN}, 0.0)
        del drawn
        bench = ["cargo", "bench", "--quiet", "--manifest-path", f"{HERE.parent}/Cargo.toml", "--bench", "rust", "--"]
        bench = [arguments.rust] if arguments.rust else bench
        own = [sys.executable, __file__, network, "--rows", str(arguments.rows), "--runs", str(arguments.runs)]
        commands = {"Rust": [*bench, network, cases, f"{folder}/Rust", str(arguments.runs), *ASKED]}
        for kind in [*KINDS, "pyAgrum"]:
            commands[kind] = [*own, "--cases", cases, "--numbers", f"{folder}/{kind}", "--kind", kind]
        found = {name: [] for name in commands}
        for _ in range(arguments.rounds):
            for name, command in commands.items():
                found[name].append(asked(command))
        print(f"{'':<8} {'s':>8} {'processor s':>12} {'MiB':>6} {'ask, µs':>8}  of Rust")
        rust = min(one["seconds"] for one in found["Rust"])
        for name, turns in found.items():
            best = min(turns, key=lambda one: one["seconds"])
            rest = f"{best['memory']:>6.0f} {min(one['ask'] for one in turns):>8.2f}" if "ask" in best else f"{'':>15}"
            print(f"{name:<8} {best['seconds']:>8.2f} {best['processor']:>12.2f} {rest}  {best['seconds'] / rust:.2f}")
        numbers = {name: np.fromfile(f"{folder}/{name}", "<u8") for name in ["Rust", *KINDS]}
        print("the same bits:", all(np.array_equal(numbers["Rust"], one) for one in numbers.values()))


if __name__ == "__main__":
    main()
