"""The commands; each returns its exit status."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from .. import opensim, plot
from ..errors import ModelError
from ..files.disk import write_file
from ..methods.cmc import computed_muscle_control
from ..methods.cosimulation import cosimulate
from ..methods.cosimulation_settings import Scheme
from ..methods.static import static_optimization
from ..results.trajectory import Trajectory
from ..studies.source import Subject
from .figures import Figure, draw_figures
from .files import draw_all, made_folder, result_file, save
from .names import CMC_STEPS, KP, METHODS, PAPER, PROGRAM, STEP
from .report import (
    comparison_text,
    excitation_difference,
    exit_status,
    figures_of_merit,
    finite,
    summary,
)
from .settings import method_function, refuse_foreign_options, velocity_gain
from .sources import damped, load_law, load_model, load_skeleton
from .terminal import one_line_warnings, progress_bar


def run(arguments: argparse.Namespace) -> int:
    """One motion by one method."""
    method = arguments.method
    refuse_foreign_options(arguments)
    out = arguments.out and made_folder(arguments.out)
    source = load_model(arguments.model, arguments.motion, arguments.cutoff, _in_degrees(arguments))
    usual_step = STEP / CMC_STEPS if method == "cmc" else STEP
    compute = method_function(
        method,
        step=usual_step if arguments.step is None else arguments.step,
        window=STEP if arguments.window is None else arguments.window,
        kp=KP if arguments.kp is None else arguments.kp,
        kv=arguments.kv,
        predictor=arguments.predictor or "constant",
    )
    return _result(arguments, arguments.model.stem, compute, source, out)


def cmc(arguments: argparse.Namespace) -> int:
    """A set-up file of OpenSim's CMC."""
    setup = _setup(arguments)
    if not isinstance(setup, opensim.CMCSetup):
        raise ModelError(f"{arguments.model}: a static optimization is run by {PROGRAM} static")
    compute: Callable[..., Trajectory]
    if arguments.method == "cmc":
        compute = partial(computed_muscle_control, settings=setup.settings)
    else:
        compute = partial(cosimulate, settings=setup.cosimulation(Scheme(arguments.method)))
    return _result_of_setup(arguments, setup, compute)


def static(arguments: argparse.Namespace) -> int:
    """A set-up file of OpenSim's static optimization."""
    setup = _setup(arguments)
    if not isinstance(setup, opensim.StaticSetup):
        raise ModelError(f"{arguments.model}: a set-up of CMC is run by {PROGRAM} cmc")
    compute = partial(static_optimization, settings=setup.settings)
    return _result_of_setup(arguments, setup, compute)


def _setup(arguments: argparse.Namespace) -> opensim.CMCSetup | opensim.StaticSetup:
    return opensim.load_setup(
        arguments.model,
        initial_time=arguments.initial_time,
        final_time=arguments.final_time,
        model=arguments.model_file,
        in_degrees=_in_degrees(arguments),
    )


def _result_of_setup(
    arguments: argparse.Namespace,
    setup: opensim.CMCSetup | opensim.StaticSetup,
    compute: Callable[..., Trajectory],
) -> int:
    out = arguments.out = made_folder(arguments.out or setup.results_directory)
    source = Subject(setup.model, setup.motion, setup.coordinates)
    return _result(arguments, setup.name, compute, source, out)


def _in_degrees(arguments: argparse.Namespace) -> bool | None:
    return None if arguments.angles is None else arguments.angles == "degrees"


def _result(
    arguments: argparse.Namespace,
    name: str,
    compute: Callable[..., Trajectory],
    source: Subject,
    out: Path | None,
) -> int:
    """Compute a result, save it before anything else can fail, and tell about it."""
    method, (model, motion, described, _) = arguments.method, source
    start = motion.start
    path = out and out / f"{name}_{method}"
    with progress_bar(arguments, METHODS[method], motion.end - start, "s") as bar:
        trajectory = compute(model, motion, progress=lambda t: bar.update(t - start - bar.n))
        if path is not None:
            save(trajectory, result_file(path))
    print(summary(name, trajectory))
    if path is not None:
        print(f"wrote {result_file(path)}")
        if arguments.sto:
            for file in opensim.write_results(trajectory, path, model=model, described=described):
                print(f"wrote {file}")
        if arguments.figures:
            draw_all(trajectory, path)
    return exit_status(trajectory)


def compare(arguments: argparse.Namespace) -> int:
    """One motion by all methods, side by side."""
    out, step = arguments.out and made_folder(arguments.out), arguments.step
    if arguments.json is not None:
        made_folder(arguments.json.parent)
    model, motion, _, _ = load_model(
        arguments.model, arguments.motion, arguments.cutoff, _in_degrees(arguments)
    )
    name = arguments.model.stem
    best: dict[str, float] = {}
    results: dict[str, Trajectory] = {}
    runs = 1 + arguments.repeat
    with progress_bar(arguments, name, len(PAPER) * runs, "runs") as bar:
        for method, label in PAPER.items():
            bar.set_description_str(f"{name}, {label}", refresh=False)
            with one_line_warnings(label):
                compute = method_function(
                    method,
                    step=step / CMC_STEPS if method == "cmc" else step,
                    window=step,
                    kp=arguments.kp,
                    kv=arguments.kv,
                )
                times = []
                for _ in range(runs):  # the first one compiles and fills caches
                    results[method] = compute(model, motion)
                    times.append(results[method].cpu_time)
                    bar.update()
            best[method] = min(times[1:])
            if out is not None:
                save(results[method], out / f"{name}_{method}.npz")

    rows = {m: figures_of_merit(results[m], best[m]) for m in PAPER}
    differences = {
        f"{m}_csf": excitation_difference(results[m], results["csf"]) for m in ("static", "cmc")
    }
    print(comparison_text(arguments, results, model, motion, rows, differences))
    if arguments.json is not None:
        content = {
            "model": name,
            **{m: {**rows[m], "settings": dict(results[m].settings)} for m in PAPER},
            "max_excitation_difference": differences,
            "settings": {
                "kp": arguments.kp,
                "kv": velocity_gain(arguments),
                "step": step,
                "cmc_window": step,
                "cmc_step": step / CMC_STEPS,
                "repeat": arguments.repeat,
            },
            "versions": dict(results["csf"].versions),
        }
        write_file(arguments.json, (json.dumps(finite(content), indent=2) + "\n").encode())
        print(f"wrote {arguments.json}")
    if out is not None:
        print(f"wrote {', '.join(str(out / f'{name}_{method}.npz') for method in PAPER)}")
    if out is not None and arguments.figures:
        everything = tuple(results.values())
        draw_figures(
            [
                Figure(plot.comparison, everything, out / f"{name}_comparison.png"),
                Figure(plot.forces, (results["csf"],), out / f"{name}_csf_forces.png"),
                Figure(plot.activations, everything, out / f"{name}_activations.png"),
            ]
        )
    return max(exit_status(trajectory) for trajectory in results.values())


def report(arguments: argparse.Namespace) -> int:
    """A stored result as a page."""
    from ..report import report as write_report

    trajectory = Trajectory.load(arguments.result)
    file = arguments.out or arguments.result.with_suffix(".html")
    made_folder(file.parent)
    folder = arguments.geometry
    if folder is not None and Path(arguments.model).suffix.lower() not in (".osim", ".xml"):
        raise ModelError(
            f"--geometry is that of an OpenSim model or set-up, not of {arguments.model}"
        )
    meshes = None if folder is None else opensim.load_meshes(arguments.model, folder)
    write_report(trajectory, file, model=load_skeleton(arguments.model), meshes=meshes)
    print(f"wrote {file}")
    return 0


def curves(arguments: argparse.Namespace) -> int:
    """A law's curves as a figure."""
    law = load_law(arguments.law)
    if arguments.fiber_damping is not None:
        law = damped(law, arguments.fiber_damping)
    file = arguments.out if arguments.out.suffix else arguments.out.with_suffix(".png")
    made_folder(file.parent)
    draw_figures([Figure(partial(plot.curves, elastic=not arguments.rigid), (law,), file)])
    return 0
