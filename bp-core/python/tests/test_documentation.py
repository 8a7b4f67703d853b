"""The stub lists what there is, everything has a docstring, and the code of the page runs."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import bayesian_programs as bp
from bayesian_programs import _native

from conftest import ROOT

STUB = Path(bp.__file__).with_name("_native.pyi")


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_the_stub_lists_what_there_is():
    classes = {node.name: node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef)}
    kinds = {name: one for name, one in vars(_native).items() if inspect.isclass(one)}
    assert set(classes) == set(kinds)
    for name, node in classes.items():
        listed = {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
        listed |= {one.target.id for one in node.body if isinstance(one, ast.AnnAssign)}
        assert public(listed) == public(vars(kinds[name])), name


def test_parameters_of_the_stub_are_those_of_the_methods():
    for node in ast.parse(STUB.read_text()).body:
        if not isinstance(node, ast.ClassDef):
            continue
        for method in node.body:
            if not isinstance(method, ast.FunctionDef) or method.name.startswith("__"):
                continue
            own = vars(getattr(_native, node.name))[method.name]
            if not callable(own) and not isinstance(own, staticmethod):
                continue
            of = getattr(own, "__func__", own)
            found = [name for name in inspect.signature(of).parameters if name != "self"]
            given = method.args
            stub = [one.arg for one in [*given.posonlyargs, *given.args] if one.arg != "self"]
            stub += [given.vararg.arg] if given.vararg else []
            stub += [one.arg for one in given.kwonlyargs]
            stub += [given.kwarg.arg] if given.kwarg else []
            assert found == stub, f"{node.name}.{method.name}"


def test_everything_has_a_docstring():
    for name, kind in vars(_native).items():
        if inspect.isclass(kind):
            assert kind.__doc__, name
            for member, one in vars(kind).items():
                assert member.startswith("_") or one.__doc__, f"{name}.{member}"


@pytest.mark.parametrize("words", ["bp.open(", "bvm.Head()"])
def test_the_code_of_the_page_runs(words, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", Path("docs/python.md").read_text(), re.S)
    (block,) = [block for block in blocks if words in block]
    names = {}
    exec(block, names)
    if words == "bp.open(":
        assert names["rain"].p(True) == pytest.approx(0.2 / 0.92)
        assert "probability" in capsys.readouterr().out
    else:
        assert names["look"]["number"] == 1 and names["head"].map.occupancy.max() > 0.5


def test_types_are_complete(tmp_path):
    """The package passes mypy's strict checks, and the stub is that of the compiled part."""
    pytest.importorskip("mypy")
    checks = [
        ["-m", "mypy", "--strict", "--ignore-missing-imports", "-p", "bayesian_programs"],
        ["-m", "mypy.stubtest", "bayesian_programs._native", "--ignore-disjoint-bases"],
    ]
    for check in checks:
        done = subprocess.run([sys.executable, *check], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
