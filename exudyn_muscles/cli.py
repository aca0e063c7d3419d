"""The command line: `exudyn-muscles run`, `cmc`, `compare`, `check` and `curves`.

Angles are in degrees here and nowhere else in the package.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import json
import math
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

# What is slow to import is imported by the command that needs it, so that --help is quick.
if TYPE_CHECKING:
    from tqdm import tqdm

    from .model import MusculoskeletalModel
    from .motion import Motion
    from .muscle.laws.law import MuscleLaw
    from .result import Trajectory

PROGRAM = "exudyn-muscles"
METHODS = {"static": "Static", "cmc": "CMC", "csf": "CSF", "css": "CSS"}
LAWS = (
    "DeGrooteFregly2016", "DeGrooteFregly2016Published", "Thelen2003", "Thelen2003Deprecated",
    "Millard2012", "Schutte1993",
)  # fmt: skip
DIFFER, FAILED, INTERRUPTED = 1, 2, 130

# The paper's step, and the gain that its Table 2 implies.
STEP = 0.01
KP = 534.0
CMC_STEPS = 10  # of the skeleton in a window of CMC

BAR = "{desc} {percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed}<{remaining}]"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0 done, or the results agree; 1 they differ; 2 an error; 130 interrupted.
    """
    arguments = _parser().parse_args(argv)
    try:
        with _one_line_warnings():
            return arguments.command(arguments)
    except (Exception, KeyboardInterrupt) as error:  # a model's own code can raise anything
        if arguments.traceback:
            traceback.print_exc()
        print(f"{PROGRAM}: error: {_in_one_line(error, arguments)}", file=sys.stderr)
        return INTERRUPTED if isinstance(error, KeyboardInterrupt) else FAILED


# The commands.


def _run(arguments: argparse.Namespace) -> int:
    method = arguments.method
    _refuse_foreign_options(arguments)
    out = arguments.out and _folder(arguments.out)
    _announce()
    model, motion = load_model(arguments.model, arguments.motion, arguments.cutoff)
    usual_step = STEP / CMC_STEPS if method == "cmc" else STEP
    compute = _method(
        method,
        step=usual_step if arguments.step is None else arguments.step,
        window=STEP if arguments.window is None else arguments.window,
        kp=KP if arguments.kp is None else arguments.kp,
        kv=arguments.kv,
        predictor=arguments.predictor or "constant",
    )
    with _bar(arguments, METHODS[method], motion.end - motion.start, "s") as bar:
        trajectory = compute(model, motion, lambda t: bar.update(t - motion.start - bar.n))

    print(_summary(arguments.model.stem, trajectory, model))
    if out is not None:
        _write(trajectory, model, out / f"{arguments.model.stem}_{method}", arguments.sto)
    return _finish(trajectory)


def _cmc(arguments: argparse.Namespace) -> int:
    from . import opensim
    from .methods.cmc import computed_muscle_control
    from .methods.cosimulation import Scheme, cosimulate

    _announce()
    setup = opensim.load_setup(
        arguments.model,
        initial_time=arguments.initial_time,
        final_time=arguments.final_time,
    )
    out = arguments.out = _folder(arguments.out or setup.results_directory)
    model, motion, method = setup.model, setup.motion, arguments.method
    compute: Callable[..., Trajectory]
    if method == "cmc":
        compute = partial(computed_muscle_control, settings=setup.settings)
    else:
        compute = partial(cosimulate, settings=setup.cosimulation(Scheme(method)))
    with _bar(arguments, METHODS[method], motion.end - motion.start, "s") as bar:
        trajectory = compute(model, motion, progress=lambda t: bar.update(t - motion.start - bar.n))

    print(_summary(setup.name, trajectory, model))
    _write(trajectory, model, out / f"{setup.name}_{method}", sto=True)
    return _finish(trajectory)


def _compare(arguments: argparse.Namespace) -> int:
    out, step = arguments.out and _folder(arguments.out), arguments.step
    if arguments.json is not None:
        _folder(arguments.json.parent)
    _announce()
    model, motion = load_model(arguments.model, arguments.motion, arguments.cutoff)
    name = arguments.model.stem
    best: dict[str, float] = {}
    results: dict[str, Trajectory] = {}
    runs = 1 + arguments.repeat
    with _bar(arguments, name, len(METHODS) * runs, "runs") as bar:
        for method, label in METHODS.items():
            bar.set_description_str(f"{name}, {label}", refresh=False)
            with _one_line_warnings(label):
                compute = _method(
                    method,
                    step=step / CMC_STEPS if method == "cmc" else step,
                    window=step,
                    kp=arguments.kp,
                    kv=arguments.kv,
                )
                times = []
                for _ in range(runs):  # the first one compiles and fills caches
                    results[method] = compute(model, motion, None)
                    times.append(results[method].cpu_time)
                    bar.update()
            best[method] = min(times[1:])
            if out is not None:
                results[method].save(out / f"{name}_{method}.npz")

    rows = {m: _figures_of_merit(results[m], model, best[m]) for m in METHODS}
    differences = {
        f"{m}_csf": _excitation_difference(results[m], results["csf"]) for m in ("static", "cmc")
    }
    print(_comparison_text(arguments, results, model, motion, rows, differences))
    if arguments.json is not None:
        content = {
            "model": name,
            **{m: {**rows[m], "settings": dict(results[m].settings)} for m in METHODS},
            "max_excitation_difference": differences,
            "settings": {
                "kp": arguments.kp,
                "kv": _velocity_gain(arguments),
                "step": step,
                "cmc_window": step,
                "cmc_step": step / CMC_STEPS,
                "repeat": arguments.repeat,
            },
            "versions": dict(results["csf"].versions),
        }
        arguments.json.write_text(json.dumps(_finite(content), indent=2) + "\n")
        print(f"wrote {arguments.json}")
    if out is not None:
        print(f"wrote {', '.join(str(out / f'{name}_{method}.npz') for method in METHODS)}")
        from . import plot

        everything = tuple(results.values())
        _save_figure(plot.comparison, everything, out / f"{name}_comparison.png")
        _save_figure(plot.forces, (results["csf"],), out / f"{name}_csf_forces.png")
        _save_figure(plot.activations, everything, out / f"{name}_activations.png")
    return max(_finish(trajectory) for trajectory in results.values())


def _check(arguments: argparse.Namespace) -> int:
    from .result import Trajectory

    result = Trajectory.load(arguments.result)
    reference = Trajectory.load(arguments.reference)
    difference = result.compare(reference, dict(arguments.tolerance))
    if difference is None:
        print(f"{arguments.result} agrees with {arguments.reference}")
        return 0
    print(f"{arguments.result} differs from {arguments.reference}: {difference}")
    other = [
        f"{package} {result.versions.get(package)} instead of {made_with}"
        for package, made_with in reference.versions.items()
        if result.versions.get(package) != made_with
    ]
    if other:
        print(f"other versions than the reference's: {', '.join(other)}")
    return DIFFER


def _curves(arguments: argparse.Namespace) -> int:
    law = load_law(arguments.law)
    if arguments.fiber_damping is not None:
        law = _damped(law, arguments.fiber_damping)
    file = arguments.out if arguments.out.suffix else arguments.out.with_suffix(".png")
    _folder(file.parent)
    from . import plot

    _save_figure(partial(plot.curves, elastic=not arguments.rigid), (law,), file)
    return 0


# What they are made of.


def load_model(
    file: Path, motion: Path | None = None, cutoff: float | None = None
) -> tuple[MusculoskeletalModel, Motion]:
    """Model and motion of a Python file that defines `build()` and `motion()`, or the model of an
    `.osim` file with the motion of another file.

    Parameters
    ----------
    file : Path
        A Python file may import modules beside it.
    motion : Path, optional
        The motion's file (`.mot`, `.sto`), with an `.osim` file.
    cutoff : float, optional
        Cut-off frequency [Hz] of the motion's low-pass filter.

    Raises
    ------
    FileNotFoundError
    ModelError
        The file cannot be imported, lacks a function, or one fails or returns something else; or a
        motion is missing or too much.
    ModelFileError, StorageError, MotionError
        An `.osim` file or its motion cannot be used.
    """
    from .errors import ModelError
    from .model import MusculoskeletalModel
    from .motion import Motion

    if file.suffix.lower() == ".osim":
        if motion is None:
            raise ModelError(f"{file}: a model file of OpenSim needs --motion FILE.mot")
        from . import opensim

        model = opensim.load_model(file)
        units = model.skeleton.units
        return model, Motion.from_file(motion, model.coordinates, units, cutoff=cutoff)
    if motion is not None or cutoff is not None:
        raise ModelError(f"{file}: --motion and --cutoff belong to an .osim file")
    parts: list[Any] = []
    with _imported(file, "model") as module:
        for function, kind in (("build", MusculoskeletalModel), ("motion", Motion)):
            if not callable(getattr(module, function, None)):
                raise ModelError(f"{file}: a model file defines {function}() -> {kind.__name__}")
            with _blamed(file, f"{function}()"):
                parts.append(getattr(module, function)())
            if not isinstance(parts[-1], kind):
                raise ModelError(
                    f"{file}: {function}() has to return a {kind.__name__}, it returned "
                    f"{type(parts[-1]).__name__}"
                )
    return parts[0], parts[1]


def load_law(text: str) -> MuscleLaw:
    """A muscle law by its name, with its default numbers, or `FILE.py:NAME`.

    Parameters
    ----------
    text : str
        One of `LAWS`, or a Python file, which may import modules beside it, and a name in it.

    Raises
    ------
    FileNotFoundError
    ParameterError
        There is no law of that name.
    ModelError
        The file cannot be imported, or what it calls by that name is not a law.
    """
    from .errors import ModelError, ParameterError
    from .muscle.laws.law import MuscleLaw

    path, colon, name = text.rpartition(":")
    if not colon:
        if text not in LAWS:
            raise ParameterError(f"--law {text}: expected {', '.join(LAWS)} or FILE.py:NAME")
        import exudyn_muscles

        return getattr(exudyn_muscles, text)()
    file = Path(path)
    with _imported(file, "law") as module:
        law = getattr(module, name, None)
    if not isinstance(law, MuscleLaw):
        raise ModelError(f"{file}: {name} has to be a MuscleLaw, it is {law!r}")
    return law


def _damped(law: MuscleLaw, fiber_damping: float) -> MuscleLaw:
    """The law with another damper."""
    from .errors import ParameterError

    try:
        return dataclasses.replace(law, fiber_damping=fiber_damping)  # type: ignore[type-var]
    except TypeError:
        raise ParameterError(
            f"--fiber-damping {fiber_damping:g}: {type(law).__name__} has no damper"
        ) from None


@contextmanager
def _imported(file: Path, noun: str) -> Iterator[ModuleType]:
    """The module of a user's file, which can import those beside it."""
    from .errors import ModelError

    if not file.is_file():
        raise FileNotFoundError(f"{file}: there is no such {noun} file")
    name = f"_exudyn_muscles_{noun}_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ModelError(f"{file}: a {noun} file is a Python file, ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look it up there
    sys.path.insert(0, str(file.resolve().parent))
    try:
        with _blamed(file, "importing it"):
            spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(file.resolve().parent))


@contextmanager
def _blamed(file: Path, where: str) -> Iterator[None]:
    """Whatever fails within becomes a ModelError that names the file and its line."""
    from .errors import ModelError

    try:
        yield
    except (Exception, SystemExit) as error:
        lines = [
            frame.lineno
            for frame in traceback.extract_tb(error.__traceback__)
            if Path(frame.filename) == file.absolute()
        ]
        line = f", line {lines[-1]}" if lines else ""
        raise ModelError(
            f"{file}{line}: {where} failed: {type(error).__name__}: {error}"
        ) from error


def _method(
    method: str,
    *,
    step: float,
    window: float,
    kp: float,
    kv: float | None,
    predictor: str = "constant",
) -> Callable[..., Trajectory]:
    """The method's function of (model, motion, progress); raises for settings out of range."""
    from .methods.cmc import CMC, computed_muscle_control
    from .methods.cosimulation import Cosimulation, Predictor, Scheme, cosimulate
    from .methods.static import static_optimization

    if method == "static":
        return lambda model, motion, progress: static_optimization(
            model, motion, step=step, progress=progress
        )
    if method == "cmc":
        cmc = CMC(kp=kp, kv=kv, window=window, step=step)
        return lambda model, motion, progress: computed_muscle_control(
            model, motion, settings=cmc, progress=progress
        )
    settings = Cosimulation(
        scheme=Scheme(method), predictor=Predictor(predictor), kp=kp, kv=kv, step=step
    )
    return lambda model, motion, progress: cosimulate(
        model, motion, settings=settings, progress=progress
    )


def _refuse_foreign_options(arguments: argparse.Namespace) -> None:
    """An option that would be ignored is a mistake."""
    from .errors import ParameterError

    if arguments.sto and arguments.out is None:
        raise ParameterError("--sto needs --out DIR, the folder for its files")
    for option, methods in (
        ("kp", ("cmc", "csf", "css")),
        ("kv", ("cmc", "csf", "css")),
        ("window", ("cmc",)),
        ("predictor", ("css",)),
    ):
        if getattr(arguments, option) is not None and arguments.method not in methods:
            raise ParameterError(
                f"--{option} belongs to --method {' or '.join(methods)}, not to {arguments.method}"
            )


def _announce() -> None:
    from .compilation import announce_compilation

    announce_compilation()


def _figures_of_merit(
    trajectory: Trajectory, model: MusculoskeletalModel, cpu_time: float
) -> dict[str, Any]:
    """One method's row of the comparison; the start's recruitment does not count."""
    counts, windows = trajectory.counts, max(len(trajectory.excitation_values), 1)
    rotates = _rotates(model)
    rms = trajectory.tracking_error_rms()[rotates]
    tracks = trajectory.method != "static" and rms.size
    return {
        "rms_error_deg": math.degrees(math.sqrt((rms**2).mean())) if tracks else None,
        "cpu_s": cpu_time,
        "recruitments_per_step": (counts.recruitments - 1) / windows,
        "window_integrations_per_step": counts.window_integrations / windows,
        "newton_iterations_per_step": counts.newton_iterations / max(counts.steps, 1),
        "max_unmet_torque": trajectory.max_unmet_torque,
    }


def _excitation_difference(one: Trajectory, other: Trajectory) -> float:
    """Largest difference in the middle of the windows of `other`."""
    times = 0.5 * (other.window_time[1:] + other.window_time[:-1])
    first, second = one.excitations, other.excitations
    gaps = [abs(first.values[first.window(t)] - second.values[second.window(t)]) for t in times]
    return float(max(gap.max() for gap in gaps))


def _rotates(model: MusculoskeletalModel) -> Any:
    """Which coordinates are angles, (n,) of bool."""
    import numpy as np

    return np.array(model.skeleton.units) == "rad"


# Text.


def _summary(name: str, trajectory: Trajectory, model: MusculoskeletalModel) -> str:
    counts = trajectory.counts
    span = f"t = {trajectory.time[0]:g} to {trajectory.time[-1]:g} s"
    status = trajectory.status.name.lower()
    lines = [
        f"{name}, {METHODS[trajectory.method]}: {status}, {span}, {counts.steps} steps",
        f"CPU time: {trajectory.cpu_time:.3f} s",
    ]
    if trajectory.method != "static":
        lines.append(f"RMS tracking error: {', '.join(_errors(trajectory, model))}")
    lines.append(
        f"{counts.recruitments} recruitments, {counts.window_integrations} window integrations, "
        f"{counts.newton_iterations} Newton iterations, {counts.rejected_steps} rejected steps"
    )
    lines.append(f"unmet torque [N m, or N]: {trajectory.unmet_torque_report() or 'none'}")
    return "\n".join(lines)


def _errors(trajectory: Trajectory, model: MusculoskeletalModel) -> Iterator[str]:
    """RMS tracking errors with their units: degrees, or millimetres of a prismatic joint."""
    rms = trajectory.tracking_error_rms()
    for name, error, rotates in zip(trajectory.coordinate_names, rms, _rotates(model), strict=True):
        if rotates:
            yield f"{name} {math.degrees(error):.4g} deg"
        else:
            yield f"{name} {1e3 * error:.4g} mm"


def _comparison_text(
    arguments: argparse.Namespace,
    results: Mapping[str, Trajectory],
    model: MusculoskeletalModel,
    motion: Motion,
    rows: Mapping[str, Mapping[str, Any]],
    differences: Mapping[str, float],
) -> str:
    head = [
        ("", "CPU", "RMS error", "recruitments", "window integr.", "Newton iter.", "max unmet"),
        ("method", "s", "deg", "per step", "per step", "per step", "torque N m"),
    ]
    body = []
    for method, row in rows.items():
        cpu, error = f"{row['cpu_s']:.3f}", row["rms_error_deg"]
        work = ("recruitments", "window_integrations", "newton_iterations")
        counts = [f"{row[f'{count}_per_step']:.2f}" for count in work]
        unmet = f"{row['max_unmet_torque']:.3g}"
        body.append(
            (METHODS[method], cpu, "-" if error is None else f"{error:.4f}", *counts, unmet)
        )
    table = [*head, *body]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for method, *cells in table:
        right = [cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True)]
        lines.append("  ".join([method.ljust(widths[0]), *right]))
    lines.insert(len(head), "-" * len(lines[0]))

    step = 1e3 * arguments.step
    title = (
        f"{arguments.model.stem}: {_number(len(model.coordinates), 'coordinate')}, "
        f"{_number(len(model.muscles), 'muscle')}, {motion.end - motion.start:g} s of motion; "
        f"kp = {arguments.kp:g} 1/s^2, kv = {_velocity_gain(arguments):.4g} 1/s, step {step:g} ms"
    )
    static, cmc = differences["static_csf"], differences["cmc_csf"]
    inner = f"{step / CMC_STEPS:g} ms"
    notes = [
        f"A step of CMC is its window of {step:g} ms; its Newton iterations are per {inner} step.",
        "Window integrations are those of all muscles together.",
        f"CPU time: the best of {_number(arguments.repeat, 'run')} in a warm process.",
        f"Largest difference of excitations: Static - CSF {static:.4f}, CMC - CSF {cmc:.4f}.",
    ]
    if len(model.coordinates) > 1:
        for method, label in METHODS.items():
            if method != "static":
                errors = ", ".join(_errors(results[method], model))
                notes.append(f"RMS tracking error of {label}: {errors}")
    return "\n".join([title, "", *lines, "", *notes])


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _velocity_gain(arguments: argparse.Namespace) -> float:
    return 2.0 * math.sqrt(arguments.kp) if arguments.kv is None else arguments.kv


def _finish(trajectory: Trajectory) -> int:
    """Exit status of a run; one that was stopped early is not a success."""
    from .result import Status

    if trajectory.status is Status.COMPLETE:
        return 0
    text = f"{METHODS[trajectory.method]} is incomplete: {trajectory.message}"
    print(f"{PROGRAM}: error: {text}", file=sys.stderr)
    return FAILED


def _in_one_line(error: BaseException, arguments: argparse.Namespace) -> str:
    """An exception with its notes; what was computed before it is saved if a folder was named."""
    from .errors import ExudynMusclesError

    text = str(error)
    if isinstance(error, KeyboardInterrupt):
        text = "interrupted"
    elif isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}"
    elif not isinstance(error, (ExudynMusclesError, OSError)):
        text = f"{type(error).__name__}: {error}"
    parts = [text, *getattr(error, "__notes__", ())]
    trajectory, out = getattr(error, "trajectory", None), getattr(arguments, "out", None)
    if trajectory is not None and out is not None:
        file = out / f"{arguments.model.stem}_{trajectory.method}_partial.npz"
        try:
            trajectory.save(file)
            parts.append(f"the result up to then is in {file}")
        except OSError as failure:
            parts.append(f"the result up to then could not be saved: {failure}")
    return "; ".join(" ".join(part.split()) for part in parts)


@contextmanager
def _one_line_warnings(about: str = "") -> Iterator[None]:
    """Every different warning once, without the source line that raised it."""
    from tqdm import tqdm

    shown = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        text = " ".join(str(message).split())
        if text not in shown:
            shown.add(text)
            prefix = f"warning: {about}: " if about else "warning: "
            tqdm.write(prefix + text, file=sys.stderr)

    from .errors import ExudynMusclesWarning

    with warnings.catch_warnings():
        warnings.simplefilter("always", ExudynMusclesWarning)
        warnings.showwarning = show
        yield


def _bar(arguments: argparse.Namespace, text: str, total: float, unit: str) -> tqdm:
    """A progress bar on stderr for what takes longer than a second."""
    from tqdm import tqdm

    hidden = arguments.quiet or not sys.stderr.isatty()
    return tqdm(
        desc=text, total=total, unit=unit, delay=1, leave=False, disable=hidden, bar_format=BAR
    )


# Files.


def _folder(path: Path) -> Path:
    """Make a folder before the work begins, not after."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def _write(trajectory: Trajectory, model: MusculoskeletalModel, path: Path, sto: bool) -> None:
    """The result and its figures, as storage files too if wanted; `path` is how names begin."""
    from . import plot

    _save(trajectory, path.with_name(f"{path.name}.npz"))
    if sto:
        from .storage import write_results

        for file in write_results(trajectory, path, model.reserves):
            print(f"wrote {file}")
    draw: list[Callable] = [plot.forces, plot.activations, plot.excitations]
    if trajectory.method != "static":
        draw.append(plot.tracking_errors)
    for function in draw:
        file = path.with_name(f"{path.name}_{function.__name__}.png")
        _save_figure(function, (trajectory,), file)


def _save(trajectory: Trajectory, file: Path) -> None:
    trajectory.save(file)
    print(f"wrote {file}")


def _save_figure(draw: Callable, shown: Sequence[Any], file: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")  # no window, whatever the user's settings say
    import matplotlib.pyplot as plt

    drawn = draw(*shown)
    figure = drawn if hasattr(drawn, "savefig") else drawn[0].get_figure(root=True)
    figure.savefig(file, dpi=200)
    plt.close(figure)
    print(f"wrote {file}")


def _finite(value: Any) -> Any:
    """JSON knows neither NaN nor infinity: null."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


# Arguments.


def _tolerance(text: str) -> tuple[str, float]:
    quantity, _, value = text.partition("=")
    try:
        size = float(value)
    except ValueError:
        size = math.nan
    if not quantity or not size >= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not QUANTITY=VALUE with a value >= 0")
    return quantity, size


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        formatter_class=raw,
        description="Muscle excitations, activations and forces that produce a motion, by four "
        "methods:\n"
        "static optimization, computed muscle control (CMC), full and simplified co-simulation\n"
        "(CSF, CSS). SI units; angles in degrees.",
        epilog=f"example: {PROGRAM} compare models/pendulum.py --out out\n"
        f"'{PROGRAM} COMMAND --help' explains a command.\n"
        "exit status: 0 done, or results agree; 1 results differ; 2 error; 130 interrupted",
    )
    parser.add_argument("--version", action="version", version=_versions())
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, function: Callable, text: str, epilog: str) -> argparse.ArgumentParser:
        added = commands.add_parser(
            name, help=text, description=text + ".", epilog=epilog, formatter_class=raw
        )
        added.set_defaults(command=function)
        added.add_argument(
            "--traceback", action="store_true", help="show where in the program an error arose"
        )
        return added

    def common(added: argparse.ArgumentParser) -> None:
        added.add_argument(
            "model",
            metavar="MODEL",
            type=Path,
            help="Python file with build() -> MusculoskeletalModel and motion() -> Motion, or "
            "OpenSim model (.osim)",
        )
        added.add_argument(
            "--motion",
            metavar="FILE",
            type=Path,
            help="OpenSim model: motion file (.mot or .sto) with all its coordinates",
        )
        added.add_argument(
            "--cutoff",
            metavar="HZ",
            type=float,
            help="OpenSim model: low-pass filter of the motion; default none",
        )
        added.add_argument(
            "--out",
            metavar="DIR",
            type=Path,
            help="folder for results (.npz) and figures (.png), made if needed; nothing is written "
            "without it",
        )
        added.add_argument("--quiet", action="store_true", help="no progress bar")

    run = command(
        "run",
        _run,
        "compute one motion by one method and print a summary",
        f"example: {PROGRAM} run models/pendulum.py --method csf --step 0.005 --out out\n"
        "writes out/pendulum_csf.npz and figures of forces, activations, excitations and errors",
    )
    common(run)
    run.add_argument(
        "--method",
        required=True,
        choices=METHODS,
        help="static optimization, computed muscle control, full or simplified co-simulation",
    )
    run.add_argument(
        "--sto",
        action="store_true",
        help="write states, controls, kinematics (in degrees), forces and tracking errors as "
        "OpenSim's .sto files too, beside the .npz",
    )
    run.add_argument(
        "--step",
        metavar="S",
        type=float,
        help=f"time step [s]; default {STEP:g}, with cmc {STEP / CMC_STEPS:g}",
    )
    run.add_argument(
        "--window",
        metavar="S",
        type=float,
        help=f"cmc: time over which excitations are held [s]; default {STEP:g}",
    )
    run.add_argument(
        "--predictor",
        choices=["constant", "extrapolated"],
        help="css: acceleration assumed for the state at which muscles are recruited; default "
        "constant; extrapolated is more accurate and less stable",
    )
    run.add_argument(
        "--kp",
        type=float,
        help=f"cmc, csf, css: position gain [1/s^2]; default {KP:g}, implied by the paper's errors",
    )
    run.add_argument(
        "--kv",
        type=float,
        help="cmc, csf, css: velocity gain [1/s]; default 2 sqrt(kp), critical damping",
    )

    cmc = command(
        "cmc",
        _cmc,
        "run a CMC set-up file of OpenSim with CMC or co-simulation",
        f"example: {PROGRAM} cmc arm26_Setup_CMC.xml --method csf --out out\n"
        "writes out/arm26_csf.npz, OpenSim's .sto files (states, controls, kinematics in degrees,\n"
        "forces, tracking errors) and figures; gains, window and span are the set-up's",
    )
    cmc.add_argument(
        "model",
        metavar="SETUP",
        type=Path,
        help="set-up file of OpenSim's CMC tool (.xml), with the files that it names",
    )
    cmc.add_argument(
        "--method",
        choices=["cmc", "csf", "css"],
        default="cmc",
        help="computed muscle control (default), full or simplified co-simulation",
    )
    for end in ("initial", "final"):
        cmc.add_argument(
            f"--{end}-time",
            metavar="S",
            type=float,
            help=f"{end} time in place of the set-up's [s]",
        )
    cmc.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for results, made if needed; default the set-up's results directory",
    )
    cmc.add_argument("--quiet", action="store_true", help="no progress bar")

    compare = command(
        "compare",
        _compare,
        "compute one motion by all four methods, side by side",
        f"example: {PROGRAM} compare models/pendulum.py --out out --json out/pendulum.json\n"
        "prints CPU times [s], RMS tracking errors [deg] and how much work a step took",
    )
    common(compare)
    compare.add_argument(
        "--json", metavar="FILE", type=Path, help="write the numbers of the table to this file"
    )
    compare.add_argument(
        "--step",
        metavar="S",
        type=float,
        default=STEP,
        help="time step of static, csf and css and window of cmc, whose own steps are a "
        f"{CMC_STEPS}th of it [s]; default {STEP:g}, as in the paper",
    )
    compare.add_argument(
        "--kp",
        type=float,
        default=KP,
        help=f"position gain [1/s^2]; default {KP:g}, which the paper's errors imply",
    )
    compare.add_argument(
        "--kv", type=float, help="velocity gain [1/s]; default 2 sqrt(kp), critical damping"
    )
    compare.add_argument(
        "--repeat",
        metavar="N",
        type=_positive,
        default=5,
        help="runs of every method after the one that warms up, of which the fastest is reported; "
        "default 5",
    )

    check = command(
        "check",
        _check,
        "compare a stored result with a stored reference",
        "quantities: coordinates, desired_coordinates [rad or m], speeds [rad/s or m/s],\n"
        "accelerations, excitations, activations, tendon_forces, force_min, force_max,\n"
        "force_optimal [N], musculotendon_lengths, tendon_lengths, fiber_lengths [m],\n"
        "torques_demanded, torques_delivered, torques_unmet, reserves [N m or N]\n\n"
        f"example: {PROGRAM} check pendulum_csf.npz reference.npz --tolerance excitations=1e-3\n"
        "exit status: 0 they agree, 1 they differ, 2 a file cannot be used",
    )
    check.add_argument("result", metavar="RESULT", type=Path, help=".npz file to be checked")
    check.add_argument("reference", metavar="REFERENCE", type=Path, help=".npz file to agree with")
    check.add_argument(
        "--tolerance",
        metavar="QUANTITY=VALUE",
        type=_tolerance,
        nargs="+",
        action="extend",
        default=[],
        help="largest absolute difference allowed in a quantity, instead of its default; angles "
        "are in rad, as in the files",
    )

    curves = command(
        "curves",
        _curves,
        "draw the curves of a muscle law and their derivatives",
        f"example: {PROGRAM} curves --law Millard2012 --fiber-damping 0 --out millard.png\n"
        f"         {PROGRAM} curves --law my_law.py:law",
    )
    curves.add_argument(
        "--law",
        metavar="NAME",
        required=True,
        help=f"{', '.join(LAWS)}, or FILE.py:NAME for a law of your own",
    )
    curves.add_argument(
        "--fiber-damping", metavar="BETA", type=float, help="damping [1]; default: the law's own"
    )
    curves.add_argument("--rigid", action="store_true", help="curves of units with a rigid tendon")
    curves.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        default=Path("curves.png"),
        help="figure, whose ending says its format; default curves.png",
    )
    return parser


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive whole number")
    return int(text)


def _versions() -> str:
    return f"{PROGRAM} {version('exudyn_muscles')} (exudyn {version('exudyn')})"


if __name__ == "__main__":
    sys.exit(main())
