"""The code of docs/python.md runs, from top to bottom."""
import pathlib
import re

DOCUMENT = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python.md"


def test_document(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", DOCUMENT.read_text(), flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 8
    names = {}
    for block in blocks:
        exec(compile(block, DOCUMENT.name, "exec"), names)
    assert (tmp_path / "ball.png").stat().st_size > 1000
    assert "ball.radus: unused parameter" in capsys.readouterr().out
