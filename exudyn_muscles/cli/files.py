"""Results and figures on disk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import write_figure

if TYPE_CHECKING:
    from ..model import MusculoskeletalModel
    from ..result import Trajectory


def made_folder(path: Path) -> Path:
    """Make a folder before the work begins, not after."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def write(trajectory: Trajectory, model: MusculoskeletalModel, path: Path, sto: bool) -> None:
    """The result and its figures, as storage files too if wanted; `path` is how names begin."""
    from .. import plot

    _save(trajectory, path.with_name(f"{path.name}.npz"))
    if sto:
        from ..storage import write_results

        for file in write_results(trajectory, path, model.reserves):
            print(f"wrote {file}")
    draw: list[Callable] = [plot.forces, plot.activations, plot.excitations]
    if trajectory.method != "static":
        draw.append(plot.tracking_errors)
    for function in draw:
        file = path.with_name(f"{path.name}_{function.__name__}.png")
        save_figure(function, (trajectory,), file)


def _save(trajectory: Trajectory, file: Path) -> None:
    trajectory.save(file)
    print(f"wrote {file}")


def save_figure(draw: Callable, shown: Sequence[Any], file: Path) -> None:
    """Draw what is shown to a file."""
    import matplotlib

    matplotlib.use("Agg")  # no window, whatever the user's settings say
    import matplotlib.pyplot as plt

    drawn = draw(*shown)
    figure = drawn if hasattr(drawn, "savefig") else drawn[0].get_figure(root=True)
    write_figure(figure, file, dpi=200)
    plt.close(figure)
    print(f"wrote {file}")
