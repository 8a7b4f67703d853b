"""Six tasks on a network, with this package and with pyAgrum and pgmpy where they are installed.

    python bp-core/python/benches/peers.py alarm.bif
    python bp-core/python/benches/peers.py alarm.bif --ask

The tasks: all marginals, the most probable state of all, learning every table from 300 cases of which a tenth of the
cells is missing (at most 20 iterations of EM, one added to each count), the marginals with soft evidence, three
posteriors for each case of a frame, and reading a file of cases with a mistake. Each task of each tool runs in a process
of its own. "first" is the first call, "ms" the least of several; lines are those of the function in this file;
"answer" is the largest difference from this package's answer. The batch of a peer is a loop over a sample, whose time is
scaled to all rows.
"""

import argparse
import csv
import importlib.metadata
import inspect
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np

from network import Network

EVIDENCE = {"HRBP": "HIGH", "CVP": "LOW", "EXPCO2": "LOW", "BP": "LOW"}
SOFT = ("HRBP", [0.05, 0.15, 0.8])
SEEN = ["HISTORY", "CVP", "PCWP", "HRBP", "HREKG", "EXPCO2", "BP", "MINVOL"]
ASKED = ["HYPOVOLEMIA", "LVFAILURE", "DISCONNECT"]
ITERATIONS = 20


class Ours:
    package = "bayesian-programs"

    def load(self, path, network):
        import bayesian_programs as bp

        self.bp, self.program, self.unknown = bp, bp.read(path), bp.program(network.program())

    def marginals(self):
        return self.program.marginals(EVIDENCE)

    def most_probable(self):
        return self.program.most_probable(EVIDENCE).mode()

    def learning(self, path):
        return self.unknown.learn(path, iterations=ITERATIONS)

    def soft(self):
        name, weights = SOFT
        return self.program.marginals({name: self.bp.likelihood(weights)})

    def batch(self, frame):
        return self.program.batch(frame, only=ASKED)

    def dirty(self, path):
        return self.program.batch(path, only=ASKED)

    def numbers(self, task, found, network):
        if task == "learning":
            found = found.marginals()
        if task == "batch":
            return {f"{n}={v}": found[f"{n}={v}"][:20].tolist() for n in ASKED for v in network.labels[n]}
        hidden = [n for n in network.labels if not (task == "marginals" and n in EVIDENCE)]
        label = {"TRUE": True, "FALSE": False}
        return {n: [found.of(n).p(self.value(found.of(n), v, label)) for v in network.labels[n]] for n in hidden}

    def value(self, found, label, booleans):
        """Labels TRUE and FALSE may be a boolean variable of the program."""
        (_, values), = found.axes
        return label if label in values else booleans[label]


class Agrum:
    package = "pyagrum"

    def load(self, path, network):
        import pyagrum

        self.gum, self.network = pyagrum, pyagrum.loadBN(path)

    def marginals(self):
        engine = self.gum.LazyPropagation(self.network)
        engine.setEvidence(EVIDENCE)
        engine.makeInference()
        return {n: engine.posterior(n).tolist() for n in self.network.names() if n not in EVIDENCE}

    def most_probable(self):
        engine = self.gum.LazyPropagation(self.network)
        engine.setEvidence(EVIDENCE)
        return engine.mpe().todict(withLabels=True)

    def learning(self, path):
        learner = self.gum.BNLearner(path, self.network, ["?"])
        learner.useSmoothingPrior(1)
        learner.useEM(1e-10)
        learner.EMsetMaxIter(ITERATIONS)
        return learner.learnParameters(self.network.dag())

    def soft(self):
        engine = self.gum.LazyPropagation(self.network)
        engine.setEvidence(dict([SOFT]))
        engine.makeInference()
        return {n: engine.posterior(n).tolist() for n in self.network.names()}

    def batch(self, frame):
        engine = self.gum.LazyPropagation(self.network)
        engine.setTargets(set(ASKED))
        found = []
        for row in frame.to_dict("records"):
            engine.setEvidence(row)
            engine.makeInference()
            found.append([engine.posterior(n).tolist() for n in ASKED])
        return found

    def dirty(self, path):
        return self.gum.BNLearner(path, self.network, ["?"]).learnParameters(self.network.dag())

    def numbers(self, task, found, network):
        if task == "learning":
            engine = self.gum.LazyPropagation(found)
            engine.makeInference()
            labels = lambda n: list(found.variable(n).labels())
            of = lambda n: dict(zip(labels(n), engine.posterior(n).tolist()))
            return {n: [of(n)[label] for label in network.labels[n]] for n in network.labels}
        return of_rows(found, network) if task == "batch" else found


class Pgmpy:
    package = "pgmpy"

    def load(self, path, network):
        from pgmpy.factors.discrete import TabularCPD
        from pgmpy.inference import VariableElimination
        from pgmpy.readwrite import BIFReader

        self.table, self.engine = TabularCPD, VariableElimination
        self.network, self.labels = BIFReader(path).get_model(), network.labels

    def marginals(self):
        engine, names = self.engine(self.network), [n for n in self.network.nodes() if n not in EVIDENCE]
        return {n: engine.query([n], evidence=EVIDENCE, show_progress=False) for n in names}

    def most_probable(self):
        names = [n for n in self.network.nodes() if n not in EVIDENCE]
        return self.engine(self.network).map_query(names, evidence=EVIDENCE, show_progress=False)

    def learning(self, path):
        import pandas
        from pgmpy.estimators import ExpectationMaximization

        frame = pandas.read_csv(path, dtype=str, na_values="?")
        return ExpectationMaximization(self.network, frame).get_parameters(max_iter=ITERATIONS)

    def soft(self):
        name, weights = SOFT
        seen = [self.table(name, 3, [[w] for w in weights], state_names={name: self.labels[name]})]
        engine = self.engine(self.network)
        return {n: engine.query([n], virtual_evidence=seen, show_progress=False) for n in self.network.nodes()}

    def batch(self, frame):
        engine, found = self.engine(self.network), []
        for row in frame.to_dict("records"):
            found.append([engine.query([n], evidence=row, show_progress=False) for n in ASKED])
        return found

    def dirty(self, path):
        import pandas

        return self.batch(pandas.read_csv(path, dtype=str))

    def numbers(self, task, found, network):
        if task == "learning":
            learned = self.network.copy()
            learned.add_cpds(*found)
            engine = self.engine(learned)
            found = {n: engine.query([n], show_progress=False) for n in network.labels}
        # A label that no case had is not in a learned table.
        known = lambda n, table, label: table.get_value(**{n: label}) if label in table.state_names[n] else 0.0
        of = lambda n, table: [known(n, table, label) for label in network.labels[n]]
        if task == "batch":
            return of_rows([[of(n, table) for n, table in zip(ASKED, row)] for row in found], network)
        return {n: of(n, table) for n, table in found.items()}


TOOLS = {"ours": Ours, "pyAgrum": Agrum, "pgmpy": Pgmpy}
TASKS = ["marginals", "most_probable", "learning", "soft", "batch", "dirty"]
SAMPLE = {"pyAgrum": 1000, "pgmpy": 10}


def of_rows(found, network):
    rows = found[:20]
    places = [(n, at, v, i) for at, n in enumerate(ASKED) for i, v in enumerate(network.labels[n])]
    return {f"{n}={v}": [row[at][i] for row in rows] for n, at, v, i in places}


def write(path, columns, missing, mistake=None):
    """A CSV file; `missing` is the share of cells that are `?`, `mistake` the row in which a label is mistyped."""
    random, names = np.random.default_rng(7), list(columns)
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(names)
        for row in range(len(columns[names[0]])):
            cells = ["?" if random.random() < missing else columns[name][row] for name in names]
            if row == mistake:
                cells[names.index("HRBP")] = "HIHG"
            out.writerow(cells)


def timed(work, seconds):
    """The result, the first time and the least time, ms."""
    times, begun, found = [], time.perf_counter(), None
    while not times or (time.perf_counter() - begun < seconds and len(times) < 1000):
        start = time.perf_counter()
        found = work()
        times.append(1e3 * (time.perf_counter() - start))
    return found, times[0], min(times)


def one(path, tool, task, rows, seconds, memory):
    """One task with one tool, in this process, whose memory is limited."""
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (int(memory * 2**30), int(memory * 2**30)))
    network, engine = Network(path), TOOLS[tool]()
    engine.load(path, network)
    with tempfile.TemporaryDirectory() as folder:
        file, arguments, scale = os.path.join(folder, "cases.csv"), [], 1.0
        if task == "learning":
            write(file, network.draw(300, 1), 0.1)
            arguments = [file]
        elif task == "dirty":
            drawn = network.draw(300, 1)
            write(file, drawn if tool == "pyAgrum" else {n: drawn[n] for n in SEEN}, 0.0, mistake=150)
            arguments = [file]
        elif task == "batch":
            import pandas

            drawn, count = network.draw(rows, 2), min(rows, SAMPLE.get(tool, rows))
            arguments, scale = [pandas.DataFrame({n: drawn[n] for n in SEEN})[:count]], rows / count
        try:
            found, first, least = timed(lambda: getattr(engine, task)(*arguments), seconds)
            numbers = found if task in ("most_probable", "dirty") else engine.numbers(task, found, network)
            numbers = "read without an error" if task == "dirty" else numbers
            print(json.dumps({"first": first * scale, "ms": least * scale, "numbers": numbers}, default=str))
        except Exception as error:
            print(json.dumps({"error": f"{type(error).__name__}: {' '.join(str(error).split())}"}))


def answer(task, numbers, ours):
    if task == "most_probable":
        true = lambda state: {n: str(v).upper() for n, v in state.items() if n not in EVIDENCE}
        other, own = true(numbers), true(ours)
        return "same state" if other == own else f"{sum(other.get(n) != own[n] for n in own)} variables differ"
    differences = (np.abs(np.subtract(numbers[n], ours[n][: len(numbers[n])])) for n in ours)
    return f"{max(float(np.max(one)) for one in differences):.0e}"


def table(arguments):
    print(f"{'task':<14} {'tool':<8} {'first ms':>11} {'ms':>11} {'lines':>5}  answer")
    for task in TASKS:
        ours = None
        for tool, engine in TOOLS.items():
            try:
                importlib.metadata.version(engine.package)
            except importlib.metadata.PackageNotFoundError:
                if tool != "ours":
                    continue
            lines = len(inspect.getsource(getattr(engine, task)).split("\n\n    def")[0].strip().splitlines()) - 1
            options = ["--tool", tool, "--task", task, "--rows", str(arguments.rows), "--seconds", str(arguments.seconds)]
            options += ["--memory", str(arguments.memory)]
            command = [sys.executable, __file__, arguments.network, *options]
            begin = f"{task.replace('_', ' '):<14} {tool:<8}"
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=arguments.limit)
                found = json.loads(done.stdout.splitlines()[-1])
            except subprocess.TimeoutExpired:
                print(f"{begin} {'more than ' + str(1000 * arguments.limit):>23} {lines:>5}  stopped", flush=True)
                continue
            except (IndexError, ValueError):
                print(f"{begin} {'':>23} {lines:>5}  {done.stderr.splitlines()[-1][:30]}", flush=True)
                continue
            if "error" in found:
                print(f"{begin} {'':>23} {lines:>5}  an error:\n    {found['error'][:180]}", flush=True)
                continue
            said = found["numbers"]
            if task != "dirty":
                ours, said = (said, "") if tool == "ours" else (ours, answer(task, said, ours) if ours else "")
            print(f"{begin} {found['first']:>11.4g} {found['ms']:>11.4g} {lines:>5}  {said}", flush=True)


def ask():
    """The whole time of one answer from Python, an upper bound of what Python adds to it, and of one attribute."""
    import bayesian_programs as bp

    text = "program Coin { variables { Heads : bool; } decomposition { P(Heads) } forms { P(Heads) = bernoulli(0.5); } }"
    program = bp.program(text)
    question = program.question("P(Heads)")
    posterior = question.ask()
    calls = {
        "question.ask()": question.ask,
        'program.ask("P(Heads)")': lambda: program.ask("P(Heads)"),
        "posterior.p(True)": lambda: posterior.p(True),
        "program.name": lambda: program.name,
    }
    for name, call in calls.items():
        best = float("inf")
        for _ in range(20):
            begun = time.perf_counter()
            for _ in range(1000):
                call()
            best = min(best, time.perf_counter() - begun)
        print(f"{name:<26} {best * 1e3:8.2f} µs")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network", help="the BIF file of alarm")
    parser.add_argument("--rows", type=int, default=1_000_000, help="cases of the batch (default: 1 000 000)")
    parser.add_argument("--seconds", type=float, default=1.0, help="time to repeat a task (default: 1)")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds after which a task is stopped (default: 60)")
    parser.add_argument("--memory", type=float, default=8.0, help="GiB that a task may take (default: 8)")
    parser.add_argument("--ask", action="store_true", help="measure single calls instead")
    parser.add_argument("--tool", choices=TOOLS, help="with --task: one task in this process, as JSON")
    parser.add_argument("--task", choices=TASKS, help="see --tool")
    arguments = parser.parse_args()
    if arguments.ask:
        ask()
    elif arguments.tool and arguments.task:
        one(arguments.network, arguments.tool, arguments.task, arguments.rows, arguments.seconds, arguments.memory)
    else:
        table(arguments)


if __name__ == "__main__":
    main()
