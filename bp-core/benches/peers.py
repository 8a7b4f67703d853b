"""Another engine on the same networks and evidence: pyAgrum (pip install pyagrum).

    python3 bp-core/benches/peers.py [FOLDER]

Prints, in milliseconds and as the least of several runs: load, and all posteriors by lazy propagation, by
Shafer-Shenoy, and by variable elimination for each target, each on a fresh engine; "warm" asks an engine again.
"""

import json
import os
import sys
import time

import pyagrum as gum

HERE = os.path.dirname(os.path.abspath(__file__))
FOLDER = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "../../../shared/data/networks")
LIMIT = 20.0


def least(work):
    best, begin, runs = float("inf"), time.perf_counter(), 0
    while runs < 3 or (time.perf_counter() - begin < 0.5 and runs < 1000):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
        runs += 1
        if time.perf_counter() - begin > LIMIT:
            break
    return best * 1e3


def main():
    print(f"{'network':12} {'evidence':>8} {'load':>8} {'lazy':>9} {'shafer':>9} {'VE':>9} {'warm':>9}")
    files = [name for name in os.listdir(FOLDER) if name.endswith(".bif")]
    files.sort(key=lambda name: os.path.getsize(os.path.join(FOLDER, name)))
    for file in files:
        path, name = os.path.join(FOLDER, file), file[:-4]
        try:
            load = least(lambda: gum.loadBN(path))
            network = gum.loadBN(path)
        except Exception as error:
            print(f"{name:12} not read: {str(error).splitlines()[0][:60]}")
            continue
        with open(os.path.join(FOLDER, "reference", name + ".json")) as reference:
            cases = json.load(reference)["cases"]
        nodes = list(network.names())
        for case in cases:
            if case["id"] not in ("prior", "ev1") or name in os.environ.get("SKIP", "").split(","):
                continue
            evidence = {one: value["index"] for one, value in case["hard_evidence"].items()}

            def whole(engine):
                inference = engine(network)
                inference.setEvidence(evidence)
                inference.makeInference()
                return [inference.posterior(node) for node in nodes]

            inference = gum.LazyPropagation(network)

            def warm():
                inference.eraseAllEvidence()
                inference.setEvidence(evidence)
                inference.makeInference()
                return [inference.posterior(node) for node in nodes]

            engines = (gum.LazyPropagation, gum.ShaferShenoyInference, gum.VariableElimination)
            times = [least(lambda: whole(engine)) for engine in engines] + [least(warm)]
            print(f"{name:12} {case['id']:>8} {load:8.2f} " + " ".join(f"{one:9.3f}" for one in times), flush=True)


main()
