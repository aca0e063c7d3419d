"""Figures that are drawn side by side."""

import os
from pathlib import Path

import pytest
from matplotlib.figure import Figure as Drawing
from matplotlib.image import imread

from exudyn_muscles.cli import figures
from exudyn_muscles.cli.figures import Figure, draw_figures
from exudyn_muscles.files.disk import write_figure


def draw(process):
    """A picture, and the number of the process that drew it in a file beside."""
    process.write_text(str(os.getpid()))
    return Drawing(figsize=(1.0, 1.0))


def wanted(folder, count=4):
    return [Figure(draw, [folder / f"{k}.txt"], folder / f"{k}.png") for k in range(count)]


def drawn_by(folder):
    return {int(file.read_text()) for file in folder.glob("*.txt")}


@pytest.mark.parametrize("processors", [1, 2, 3])
def test_figures_are_drawn_by_as_many_processes_as_there_are(
    tmp_path, monkeypatch, capsys, processors
):
    monkeypatch.setattr(figures, "_processors", lambda: processors)
    draw_figures(wanted(tmp_path))
    assert len(drawn_by(tmp_path)) == processors and os.getpid() in drawn_by(tmp_path)
    for k in range(4):
        assert imread(tmp_path / f"{k}.png").shape == (200, 200, 4)
    assert capsys.readouterr().out.split() == [
        word for k in range(4) for word in ("wrote", str(tmp_path / f"{k}.png"))
    ]


def test_what_goes_wrong_in_another_process_is_told_here(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "_processors", lambda: 2)
    one, other = wanted(tmp_path, 2)
    with pytest.raises(FileNotFoundError, match="absent"):
        draw_figures([one, other._replace(file=tmp_path / "absent" / "x.png")])
    assert Path(one.file).exists()


def test_a_page_is_drawn_once(tmp_path, monkeypatch):
    """The layout needs no drawing of its own, and the engine is the figure's own afterwards."""
    figure, count = Drawing(layout="constrained"), []
    figure.subplots()
    original = Drawing.draw
    monkeypatch.setattr(Drawing, "draw", lambda self, r: (count.append(1), original(self, r)))
    engine = figure.get_layout_engine()
    write_figure(figure, tmp_path / "x.png", dpi=50)
    assert len(count) == 1 and figure.get_layout_engine() is engine
