"""Other engines beside ours, on the same networks and evidence: pip install pyagrum pgmpy

    cargo build --release && python3 bp-core/benches/peers.py [FOLDER] [NETWORK ...]

For each network, one after the other in the same run: `cargo bench --bench networks` on it, then pyAgrum (lazy propagation,
Shafer-Shenoy, variable elimination for each target) and pgmpy (variable elimination for each target, small networks only),
each on a fresh engine; all posteriors, milliseconds, least of several runs. "row" is one of many cases: ours in `answer_cases`,
pyAgrum's fastest engine kept and asked again. MiB is the largest memory of a process that answers once, `bp marginals` and
pyAgrum's lazy propagation. SKIP=link,... leaves networks out.
"""

import json
import os
import subprocess
import sys
import time
import warnings

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "../..")
LIMIT = 10.0


def least(work):
    best, begin, runs = float("inf"), time.perf_counter(), 0
    while runs < 3 or (time.perf_counter() - begin < 0.3 and runs < 1000):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
        runs += 1
        if time.perf_counter() - begin > LIMIT:
            break
    return best * 1e3


# Asked by a small process: what forks from a large one counts the large one's memory as its own.
MEASURE = """import os, sys
quiet = os.open(os.devnull, os.O_WRONLY)
actions = [(os.POSIX_SPAWN_DUP2, quiet, 1), (os.POSIX_SPAWN_DUP2, quiet, 2)]
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=actions)
print(os.wait4(child, 0)[2].ru_maxrss)"""


def memory(command):
    """The largest resident memory of a process, in MiB, or some 9 that measuring takes."""
    found = subprocess.run([sys.executable, "-S", "-c", MEASURE, *command], capture_output=True, text=True, check=True)
    return int(found.stdout) / 1024


def ours(name, folder):
    """{case: (cells, load, ask, whole, row)} in milliseconds, one thread but for the rows."""
    command = ["cargo", "bench", "-q", "-p", "bp-core", "--bench", "networks"]
    environment = os.environ | {"ONLY": name, "NETWORKS": os.path.abspath(folder)}
    text = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in text.splitlines()]
    number = lambda text: float("nan") if text == "-" else float(text)
    return {row[1]: [number(row[at]) for at in (3, 2, 5, 7, 9)] for row in rows if row and row[0] == name}


def agrum(path, evidence, others):
    import pyagrum as gum

    network = gum.loadBN(path)
    nodes = list(network.names())

    def whole(engine):
        inference = engine(network)
        inference.setEvidence(evidence)
        inference.makeInference()
        return [inference.posterior(node) for node in nodes]

    times = {name: least(lambda: whole(getattr(gum, name))) for name in ENGINES}
    rows = []
    for name in ENGINES[:2]:
        inference = getattr(gum, name)(network)
        inference.setEvidence(evidence)

        def ask():
            for case in others:
                for node, value in case.items():
                    inference.chgEvidence(node, value)
                inference.makeInference()
                [inference.posterior(node) for node in nodes]

        rows.append(least(ask) / len(others))
    return times, min(rows)


ENGINES = ("LazyPropagation", "ShaferShenoyInference", "VariableElimination")


def pgmpy(path, evidence):
    """Variable elimination, target by target; only where that ends soon."""
    from pgmpy.inference import VariableElimination
    from pgmpy.readwrite import BIFReader

    network = BIFReader(path).get_model()
    known = {node: network.get_cpds(node).state_names[node][value] for node, value in evidence.items()}
    engine = VariableElimination(network)
    free = [node for node in network.nodes() if node not in known]
    return least(lambda: [engine.query([node], evidence=known, show_progress=False) for node in free])


def hard(case):
    return {node: value["index"] for node, value in case["hard_evidence"].items()}


def main(folder, names):
    files = [name[:-4] for name in os.listdir(folder) if name.endswith(".bif")]
    files.sort(key=lambda name: os.path.getsize(os.path.join(folder, name + ".bif")))
    heads = ("network", "case", "ours", "ask", "best", "by", "ratio", "row", "theirs", "ratio", "MiB", "theirs")
    print("{:11} {:5} {:>8} {:>8} {:>9} {:7} {:>6} {:>8} {:>8} {:>6} {:>5} {:>6}".format(*heads), flush=True)
    for name in files:
        if (names and name not in names) or name in os.environ.get("SKIP", "").split(","):
            continue
        path = os.path.join(folder, name + ".bif")
        with open(os.path.join(folder, "reference", name + ".json")) as reference:
            cases = {case["id"]: case for case in json.load(reference)["cases"]}
        found = ours(name, folder)
        bp = os.path.join(ROOT, "target/release/bp")
        own, their = memory([bp, "marginals", path, "--json"]), memory([sys.executable, __file__, "--once", path])
        for case in ("prior", "ev1"):
            evidence = hard(cases[case])
            others = [hard(cases[other]) for other in (case, case + "b") if other in cases]
            _, _, ask, whole, row = found[case]
            times, theirs = {}, float("nan")
            try:
                times, theirs = agrum(path, evidence, others)
            except Exception as error:
                print(f"{name}: pyAgrum: {str(error).splitlines()[0][:50]}", file=sys.stderr)
            if len(evidence) + len(cases[case]["posteriors"]) < 80:
                try:
                    times["pgmpy"] = pgmpy(path, evidence)
                except Exception as error:
                    print(f"{name}: pgmpy: {str(error).splitlines()[0][:50]}", file=sys.stderr)
            by = min(times, key=times.get)
            line = f"{name:11} {case:5} {whole:8.3f} {ask:8.4f} {times[by]:9.3f} {by[:7]:7} {times[by] / whole:6.1f}"
            # Without evidence every row is the same question.
            if evidence:
                line += f" {row:8.4f} {theirs:8.3f} {theirs / row:6.0f} {own:5.0f} {their:6.0f}"
            print(line, flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    if sys.argv[1:2] == ["--once"]:
        import pyagrum

        engine = pyagrum.LazyPropagation(pyagrum.loadBN(sys.argv[2]))
        engine.makeInference()
        [engine.posterior(node) for node in engine.BN().names()]
    else:
        given = [one for one in sys.argv[1:] if os.path.isdir(one)]
        beside = os.path.join(ROOT, "../shared/data/networks")
        main(given[0] if given else beside, [one for one in sys.argv[1:] if not os.path.isdir(one)])
