"""The stubs tell of what there is: the same names, and the same parameters in the same order."""
import ast
import dataclasses
import inspect
import pathlib

import pytest

import caustica

TREE = ast.parse((pathlib.Path(caustica.__file__).resolve().parent / "__init__.pyi").read_text())
STUBS = {node.name: node for node in TREE.body
         if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_")}


def parameters(node):
    a = node.args
    return [arg.arg for arg in (*a.posonlyargs, *a.args, a.vararg, *a.kwonlyargs, a.kwarg) if arg]


def test_the_names():
    assert set(STUBS) | {"util"} == set(caustica.__all__)


@pytest.mark.parametrize("name", STUBS)
def test_parameters(name):
    there, stub = getattr(caustica, name), STUBS[name]
    if isinstance(stub, ast.FunctionDef):
        assert parameters(stub) == list(inspect.signature(there).parameters)
        return
    for node in stub.body:
        if isinstance(node, ast.FunctionDef) and node.name in vars(there) and callable(vars(there)[node.name]):
            assert parameters(node) == list(inspect.signature(vars(there)[node.name]).parameters), node.name
        elif isinstance(node, ast.FunctionDef):
            assert hasattr(there, node.name), node.name
    if dataclasses.is_dataclass(there):
        assert [n.target.id for n in stub.body if isinstance(n, ast.AnnAssign)] == [f.name for f in dataclasses.fields(there)]
