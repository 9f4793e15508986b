"""The stubs tell of what there is: the same names, and the same parameters in the same order."""
import ast
import dataclasses
import importlib.util
import inspect
import os
import pathlib
import subprocess
import sys

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


#: What takes the place of methods there, and is called like them.
CHAINED = [f"caustica._transform.ScalarTransform4f.{name}" for name in ("look_at", "rotate", "scale", "translate")]

USE = """
import caustica
import numpy as np

place = caustica.ScalarTransform4f().translate([1, 2, 3]).rotate([0, 0, 1], 45)
mesh = caustica.Mesh(np.zeros((3, 3)), [[0, 1, 2]], to_world=place, copy=False)
scene = caustica.load_dict({"type": "scene", "mesh": mesh})
image = caustica.render(scene, spp=3, integrator={"type": "path"}, sensor=caustica.load_dict({"type": "perspective"}), progress=True)
low, high = image.interval
width: float = (high - low).mean()
error: float = caustica.compare(image, image.rgb, (0, 0, 1, 1))["rmse"]
caustica.measure_noise(scene, 4, counts=[(1, 2)]).recommend("mean")
caustica.util.write_bitmap("x.exr", image)
"""
WRONG = "\nimage.save()\ncaustica.render(scene, sensor='side')\nimage.channels + 1\n"


@pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")
def test_mypy_agrees(tmp_path):
    """With the package as it is, and with a program that uses it."""
    package = pathlib.Path(caustica.__file__).resolve().parent
    (tmp_path / "mypy.ini").write_text("[mypy]\nignore_missing_imports = True\ndisable_error_code = var-annotated\n")
    (tmp_path / "allowed").write_text("\n".join(CHAINED))

    def run(*arguments):
        return subprocess.run([sys.executable, "-m", *arguments], cwd=tmp_path, env={**os.environ, "MYPYPATH": str(package.parent)},
                              capture_output=True, text=True)

    stubs = run("mypy.stubtest", "caustica", "--mypy-config-file", "mypy.ini", "--allowlist", "allowed")
    assert stubs.returncode == 0, stubs.stdout + stubs.stderr
    (tmp_path / "use.py").write_text(USE)
    used = run("mypy", "--strict", "--config-file", "mypy.ini", "use.py")
    assert used.returncode == 0, used.stdout + used.stderr
    (tmp_path / "wrong.py").write_text(USE + WRONG)
    assert run("mypy", "--strict", "--config-file", "mypy.ini", "wrong.py").stdout.count(": error: ") == 3
