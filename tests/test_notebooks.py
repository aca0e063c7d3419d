"""Every notebook runs from the first cell to the last, and its numbers are what its text says."""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "examples"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def run(file, monkeypatch):
    """The variables after all cells of code, one after the other as a kernel has them."""
    monkeypatch.chdir(file.parent)
    notebook = json.loads(file.read_text())
    assert notebook["nbformat"] == 4
    variables = {"__name__": "__main__"}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            exec(compile("".join(cell["source"]), f"{file.name}: {cell['id']}", "exec"), variables)
    plt.close("all")
    return variables


def test_all_notebooks_are_tested():
    assert [file.name for file in NOTEBOOKS] == ["joint_loads.ipynb"]


def test_from_a_recorded_motion_to_joint_loads(monkeypatch, capsys):
    variables = run(FOLDER / "joint_loads.ipynb", monkeypatch)
    printed = capsys.readouterr().out
    assert (variables["error"] < 0.05).all() and variables["result"].max_unmet_torque == 0.0
    assert variables["size"]["knee"].max() > 3.0 * variables["net_size"].max()
    torque = variables["loads"]["torque/hip"]  # which muscles alone drive
    assert np.abs(torque).max() < 1e-6 * variables["size"]["hip"].max()
    assert "body weights" in printed and "mean metabolic power" in printed
    assert variables["net_size"].max() == pytest.approx(100.0, rel=0.5)
