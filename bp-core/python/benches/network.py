"""A network of a BIF file as plain tables: what the benchmarks need beside the tools that they measure.

In: a BIF file of finite variables. Out: labels, parents and tables; drawn cases; the program with unknown tables.
"""

import re

import numpy as np


class Network:
    """`labels` and `parents` by name, in the order of the file; `tables` by name: {labels of the parents: row}."""

    def __init__(self, path):
        with open(path) as file:
            text = file.read()
        variable = r"variable (\w+) \{\s*type discrete \[ \d+ \] \{ ([^}]*) \}"
        self.labels = {name: labels.split(", ") for name, labels in re.findall(variable, text)}
        self.parents, self.tables = {}, {}
        for head, body in re.findall(r"probability \( ([^)]*) \) \{(.*?)\}", text, re.S):
            name, *parents = re.split(r" \| |, ", head)
            self.parents[name] = parents
            rows = re.findall(r"(?:\(([^)]*)\)|table) ([^;]*);", body)
            self.tables[name] = {tuple(re.findall(r"\w+", of)): [float(p) for p in row.split(",")] for of, row in rows}

    def order(self):
        """The names, parents first."""
        done = []
        while len(done) < len(self.parents):
            done += [n for n, above in self.parents.items() if n not in done and all(a in done for a in above)]
        return done

    def draw(self, rows, seed):
        """Cases by ancestral sampling: {name: array of labels}."""
        random, drawn = np.random.default_rng(seed), {}
        for name in self.order():
            shape = [len(self.labels[parent]) for parent in self.parents[name]]
            table = np.empty([*shape, len(self.labels[name])])
            for of, row in self.tables[name].items():
                table[tuple(self.labels[p].index(label) for p, label in zip(self.parents[name], of))] = row
            steps = np.cumsum(table, axis=-1)[tuple(drawn[parent] for parent in self.parents[name])]
            drawn[name] = np.minimum((random.random((rows, 1)) > steps).sum(axis=1), table.shape[-1] - 1)
        return {name: np.array(self.labels[name], dtype=object)[drawn[name]] for name in self.labels}

    def program(self):
        """The text of the program of this network, with a table to be learned for each factor."""
        variables = [f"{name} : {{ {', '.join(labels)} }};" for name, labels in self.labels.items()]
        ordered = [(name, " ".join(self.parents[name])) for name in self.order()]
        factors = [f"P({name} | {above})" if above else f"P({name})" for name, above in ordered]
        forms = [f"{factor} = unknown(laplace_succession);" for factor in factors]
        lines = ["program Learned {", "variables {", *variables, "}", "decomposition {", *factors, "}"]
        return "\n".join([*lines, "forms {", *forms, "}", "}"])
