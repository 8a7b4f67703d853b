"""Models that are sampled: `bp ask` beside PyMC, on the same data and priors: pip install pymc

    cargo build --release && python3 bp-core/benches/sampling_peers.py [--bp PATH] [--limit SECONDS] [MODEL ...]

For each model in turn: PyMC (NUTS, 4 chains of 1000 + 1000 sweeps), then `bp ask --json` with its defaults, the whole process.
Seconds of wall time and, in brackets, of processor time with that of children, which a busy machine disturbs less. "whole" is
PyMC's model, compilation and sampling without its import, "sample" the sampling alone; a second run finds more in PyTensor's cache.
"ratio" is whole / bp. "equal" is the ratio at equal standard errors, for the quantity where it is least: the numbers of draws
differ. Below each model are the posterior means of both, with standard errors, and whether they lie within four combined ones.
After --limit seconds (default 120) bp is interrupted and answers from the draws made so far: `bp` is then that time.
"""

import argparse
import json
import logging
import os
import random
import resource
import signal
import subprocess
import tempfile
import time
import warnings

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
EFFECTS, ERRORS = [28, 8, -3, 7, -1, 1, 18, 12], [15, 10, 16, 11, 9, 11, 10, 18]
# Disasters in British coal mines, 1851 to 1961 (Jarrett 1979).
DISASTERS = [int(digit) for digit in (
    "454014340633402633545314415534252234213221111300101100310322011101010002100011023311211112420014000100000100101")]

LINE = """program Line {
    variables { Intercept, Slope, Sigma : real; Y[row in Rows] : real; }
    decomposition { P(Intercept) P(Slope) P(Sigma) prod(row in Rows) { P(Y[row] | Intercept Slope Sigma) } }
    forms {
        P(Intercept) = normal(0, 10);  P(Slope) = normal(0, 10);  P(Sigma) = half_normal(5);
        P(Y[row] | Intercept Slope Sigma) = normal(Intercept + Slope * x[row], Sigma);
    }
    question posterior { expectation P(Intercept, Slope, Sigma) }
}"""

SCHOOLS = """program EightSchools {
    parameters { deviation[1..=8] : real = %s; }
    variables { Mu, Tau : real; Theta[1..=8], Y[1..=8] : real; }
    decomposition { P(Mu) P(Tau) prod(i) { P(Theta[i] | Mu Tau) P(Y[i] | Theta[i]) } }
    forms {
        P(Mu) = normal(0, 5);  P(Tau) = half_cauchy(5);
        P(Theta[i] | Mu Tau) = normal(Mu, Tau);
        P(Y[i] | Theta[i])   = normal(Theta[i], deviation[i]);
    }
    question posterior { expectation P(Mu, Tau | %s) }
}""" % (ERRORS, ", ".join(f"Y[{at + 1}] = {effect}" for at, effect in enumerate(EFFECTS)))

SCHOOL_ROWS = """program EightSchools {
    variables { Mu, Tau : real; Theta[s in Schools], Y[s in Schools] : real; }
    decomposition { P(Mu) P(Tau) prod(s in Schools) { P(Theta[s] | Mu Tau) P(Y[s] | Theta[s]) } }
    forms {
        P(Mu) = normal(0, 5);  P(Tau) = half_cauchy(5);
        P(Theta[s] | Mu Tau) = normal(Mu, Tau);
        P(Y[s] | Theta[s])   = normal(Theta[s], deviation[s]);
    }
    question posterior { expectation P(Mu, Tau) }
}"""

MIXTURE = """program TwoGroups {
    variables { Mu : real[2]; First[row in Rows] : bool; Y[row in Rows] : real; }
    decomposition { P(Mu) prod(row in Rows) { P(First[row]) P(Y[row] | First[row] Mu) } }
    forms {
        P(Mu) = ordered(normal(0, 5));  P(First[row]) = bernoulli(0.4);
        P(Y[row] | First[row] Mu) = normal(if First[row] { Mu[0] } else { Mu[1] }, 1);
    }
    question posterior { P(Mu) }
}"""

TOSSES = """program Tosses {
    variables { Rate : real; Heads[row in Rows] : bool; }
    decomposition { P(Rate) prod(row in Rows) { P(Heads[row] | Rate) } }
    forms { P(Rate) = beta(1, 1); P(Heads[row] | Rate) = bernoulli(Rate); }
    question posterior { expectation P(Rate) }
}"""

GROUPS = """program Groups {
    parameters { group[Rows] : Groups; }
    variables { Mean, Between, Within : real; Level[g in Groups] : real; Y[row in Rows] : real; }
    decomposition {
        P(Mean) P(Between) P(Within) prod(g in Groups) { P(Level[g] | Mean Between) }
        prod(row in Rows) { P(Y[row] | Level Within) }
    }
    forms {
        P(Mean) = normal(0, 10);  P(Between) = half_normal(5);  P(Within) = half_normal(5);
        P(Level[g] | Mean Between) = normal(Mean, Between);
        P(Y[row] | Level Within)   = normal(Level[group[row]], Within);
    }
    question posterior { expectation P(Mean, Between, Within) }
}"""

COAL = """program Disasters {
    parameters { N : size; }
    variables { Change : 1..=N; Early, Late : real; Count[year in 1..=N] : 0..=20; }
    decomposition { P(Change) P(Early) P(Late) prod(year) { P(Count[year] | Change Early Late) } }
    forms {
        P(Change) = uniform;  P(Early) = exponential(1);  P(Late) = exponential(1);
        P(Count[year] | Change Early Late) = poisson(if year < Change { Early } else { Late });
    }
    question posterior { expectation P(Change, Early, Late) }
}"""


def tables():
    """The columns of each model; what is generated has a seed."""
    draw = random.Random(1)
    x = [round(draw.uniform(-2, 2), 4) for _ in range(1000)]
    levels, group = [draw.gauss(3, 2) for _ in range(20)], [row // 20 for row in range(400)]
    return {
        "line": {"x": x, "Y": [round(1 + 2 * each + draw.gauss(0, 1.5), 4) for each in x]},
        "schools": {"deviation": ERRORS, "Y": EFFECTS},
        "mixture": {"Y": [round(draw.gauss(-1.5 if draw.random() < 0.4 else 1.5, 1), 4) for _ in range(200)]},
        "tosses": {"Heads": [int(draw.random() < 0.3) for _ in range(10_000)]},
        "groups": {"group": group, "Y": [round(draw.gauss(levels[at], 1), 4) for at in group]},
        "coal": {"Count": DISASTERS},
    }


def line(pm, data):
    mean = pm.Normal("Intercept", 0, 10) + pm.Normal("Slope", 0, 10) * data["x"]
    pm.Normal("Y", mean, pm.HalfNormal("Sigma", 5), observed=data["Y"])


def schools(pm, data):
    # Not centred, as PyMC's own example: centred, NUTS diverges.
    mu, tau = pm.Normal("Mu", 0, 5), pm.HalfCauchy("Tau", 5)
    pm.Normal("Y", mu + tau * pm.Normal("Eta", 0, 1, shape=8), data["deviation"], observed=data["Y"])


def mixture(pm, data):
    mu = pm.Normal("Mu", 0, 5, shape=2, transform=pm.distributions.transforms.ordered, initval=[-1, 1])
    pm.NormalMixture("Y", w=[0.4, 0.6], mu=mu, sigma=1, observed=data["Y"])


def tosses(pm, data):
    pm.Bernoulli("Heads", pm.Beta("Rate", 1, 1), observed=data["Heads"])


def groups(pm, data):
    level = pm.Normal("Level", pm.Normal("Mean", 0, 10), pm.HalfNormal("Between", 5), shape=20)
    pm.Normal("Y", level[data["group"]], pm.HalfNormal("Within", 5), observed=data["Y"])


def coal(pm, data):
    change = pm.DiscreteUniform("Change", 1, len(DISASTERS))
    early, late = pm.Exponential("Early", 1), pm.Exponential("Late", 1)
    pm.Poisson("Count", pm.math.switch(change > list(range(1, len(DISASTERS) + 1)), early, late), observed=data["Count"])


# Name: (model of PyMC, quantities, programs and whether each reads rows).
MODELS = {
    "line": (line, ["Intercept", "Slope", "Sigma"], [(LINE, True)]),
    "schools": (schools, ["Mu", "Tau"], [(SCHOOLS, False), (SCHOOL_ROWS, True)]),
    "mixture": (mixture, ["Mu[0]", "Mu[1]"], [(MIXTURE, True)]),
    "tosses": (tosses, ["Rate"], [(TOSSES, True)]),
    "groups": (groups, ["Mean", "Between", "Within"], [(GROUPS, True)]),
    "coal": (coal, ["Change", "Early", "Late"], [(COAL, True)]),
}


def clock():
    """Wall time and processor time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(each.ru_utime + each.ru_stime for each in used)


pair = lambda times: "{:.2f} ({:.2f})".format(*times)
since = lambda start: [now - then for now, then in zip(clock(), start)]


def theirs(build, data, names):
    """Times of the whole, of sampling alone, and {quantity: (mean, standard error)}."""
    import arviz
    import numpy
    import pymc

    start = clock()
    with pymc.Model():
        build(pymc, {name: numpy.array(values) for name, values in data.items()})
        trace = pymc.sample(chains=4, random_seed=1, progressbar=False, compute_convergence_checks=False)
    whole = since(start)
    means, errors = trace.posterior.mean(("chain", "draw")), arviz.mcse(trace)
    found = {}
    for name in names:
        base, _, index = name.rstrip("]").partition("[")
        at = int(index) if index else ()
        found[name] = float(means[base].values[at]), float(errors[base].values[at])
    return whole, trace.posterior.attrs["sampling_time"], found


def ours(command, limit):
    """Times, {quantity: (mean, standard error)}, and what bp wrote beside the answer."""
    start = clock()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        text, message = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        text, message = process.communicate()
    took = since(start)
    answer = json.loads(text) if text.strip() else {"answer": []}
    number = lambda row: row["mean"] if "mean" in row else (row["expectation"], row.get("error", 0.0))
    found = {next(iter(row["values"])): number(row) for row in answer["answer"]}
    return took, found, answer.get("estimate", {}).get("warning", message.strip())


def main(bp, limit, models):
    start, columns = clock(), tables()
    import pymc

    logging.getLogger("pymc").setLevel(logging.ERROR)
    print("PyMC {}, imported in {:.1f} s ({:.1f})".format(pymc.__version__, *since(start)))
    print("model                 whole   sample               bp   ratio   equal", flush=True)
    for model, (build, names, programs) in MODELS.items():
        if models and model not in models:
            continue
        data = columns[model]
        whole, sample, peer = theirs(build, data, names)
        for program, reads in programs:
            with tempfile.TemporaryDirectory() as folder:
                path, table = os.path.join(folder, model + ".bp"), os.path.join(folder, model + ".csv")
                lines = [",".join(data), *(",".join(map(str, row)) for row in zip(*data.values()))]
                for name, text in ((path, program), (table, "\n".join(lines) + "\n")):
                    with open(name, "w") as file:
                        file.write(text)
                took, own, message = ours([bp, "ask", path, "posterior", "--json", *(["--rows", table] if reads else [])], limit)
            line, ratio = f"{model:10} {pair(whole):>16} {sample:8.2f} {pair(took):>16}", whole[0] / took[0]
            gains = [ratio * (peer[name][1] / own[name][1]) ** 2 for name in own if own[name][1] > 0]
            print(line, f"{ratio:7.1f} {min(gains):7.1f}" if gains else "   none", flush=True)
            for name in own:
                (mean, error), (other, beside) = own[name], peer[name]
                agree = abs(mean - other) <= 4 * (error**2 + beside**2) ** 0.5
                both = f"{other:10.4f} ± {beside:.4f}   bp {mean:10.4f} ± {error:.4f}"
                print(f"    {name:10} {both}   {'agree' if agree else 'DIFFER'}")
            for text in message.splitlines()[:3]:
                print("    bp:", text)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    options = argparse.ArgumentParser()
    options.add_argument("--bp", default=os.path.join(ROOT, "target/release/bp"))
    options.add_argument("--limit", type=float, default=120.0)
    options.add_argument("models", nargs="*")
    main(**vars(options.parse_args()))
