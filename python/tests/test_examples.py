"""The notebooks of examples/ run, and each ends with a picture."""
import pathlib

import pytest

nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
pytest.importorskip("matplotlib")

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.ipynb")))
def test_notebook(name):
    notebook = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    shown = [output for output in notebook.cells[-1].outputs if "image/png" in output.get("data", {})]
    assert shown, "the last cell shows no picture"


def test_there_are_five():
    assert len(list(EXAMPLES.glob("*.ipynb"))) >= 5
