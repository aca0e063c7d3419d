"""What the command line takes."""

from __future__ import annotations

import argparse
import math
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from ..muscle.laws import LAWS
from ..results.quantities import QUANTITIES
from . import study_options
from .names import CMC_STEPS, KP, METHODS, PROGRAM, STEP, TRACKING


def build_parser() -> argparse.ArgumentParser:
    """All commands with their options."""
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
        "exit status: 0 done, or results agree; 1 results differ; 2 error; 130 interrupted;\n"
        "143 terminated (SIGTERM), as by a cluster at its time limit; what was reached is then in\n"
        "the folder of --out",
    )
    parser.add_argument("--version", action="version", version=_versions())
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(
        name: str, text: str, epilog: str, module: str = "commands"
    ) -> argparse.ArgumentParser:
        added = subparsers.add_parser(
            name, help=text, description=text + ".", epilog=epilog, formatter_class=raw
        )
        added.set_defaults(command=partial(_run, module, name))
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
        _angles(added)
        added.add_argument(
            "--out",
            metavar="DIR",
            type=Path,
            help="folder for results (.npz) and figures (.png), made if needed; nothing is written "
            "without it",
        )
        of_output(added)

    def of_output(added: argparse.ArgumentParser) -> None:
        added.add_argument("--quiet", action="store_true", help="no progress bar")
        added.add_argument(
            "--no-figures", dest="figures", action="store_false", help="results alone, no figures"
        )

    run = command(
        "run",
        "compute one motion by one method and print a summary",
        f"example: {PROGRAM} run models/pendulum.py --method csf --step 0.005 --out out\n"
        "writes out/pendulum_csf.npz and figures of forces, activations, excitations and errors",
    )
    common(run)
    run.add_argument(
        "--method",
        required=True,
        choices=METHODS,
        help="static optimization, computed muscle control, full, simplified or consistent "
        "co-simulation",
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
        help=f"all but static: position gain [1/s^2]; default {KP:g}, by the paper's errors",
    )
    run.add_argument(
        "--kv",
        type=float,
        help="all but static: velocity gain [1/s]; default 2 sqrt(kp), critical damping",
    )

    cmc = command(
        "cmc",
        "run a CMC set-up file of OpenSim with CMC or co-simulation",
        f"example: {PROGRAM} cmc arm26_Setup_CMC.xml --method csf --out out\n"
        "writes out/arm26_csf.npz, OpenSim's .sto files (states, controls, kinematics in degrees,\n"
        "forces, tracking errors) and figures; gains, window and span are the set-up's",
    )
    cmc.add_argument(
        "--method",
        choices=TRACKING,
        default="cmc",
        help="computed muscle control (default), full, simplified or consistent co-simulation",
    )
    static = command(
        "static",
        "run a set-up file of OpenSim's static optimization",
        f"example: {PROGRAM} static arm26_Setup_StaticOptimization.xml --out out\n"
        "writes out/arm26_static.npz, OpenSim's .sto files and figures; tendons stretch and\n"
        "muscles have passive forces, which OpenSim's static optimization leaves out",
    )
    static.set_defaults(method="static")
    for added in (cmc, static):
        _of_setup(added)
        of_output(added)

    compare = command(
        "compare",
        "compute one motion by the paper's four methods, side by side",
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
        "compare a stored result with a stored reference",
        f"quantities:\n{_quantities()}\n\n"
        f"example: {PROGRAM} check pendulum_csf.npz reference.npz --tolerance excitations=1e-3\n"
        "exit status: 0 they agree, 1 they differ, 2 a file cannot be used",
        "check",
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

    report = command(
        "report",
        "write a stored result as one page that opens in any browser",
        f"example: {PROGRAM} report out/leg_csf.npz models/leg.py\n"
        "writes out/leg_csf.html: the moving skeleton with its muscles, and curves beside it;\n"
        "needs k3d and plotly: pip install 'exudyn_muscles[report]'",
    )
    report.add_argument(
        "result", metavar="RESULT", type=Path, help="result (.npz) of run, cmc or compare"
    )
    report.add_argument(
        "model",
        metavar="MODEL",
        type=Path,
        help="model that it is of: Python file, OpenSim model (.osim) or set-up of its CMC (.xml)",
    )
    report.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="page, its folder made if needed; default the result's name with .html",
    )

    report.add_argument(
        "--geometry",
        metavar="DIR",
        type=Path,
        help="OpenSim model: folder with the bones that it names (.vtp, .stl, .obj)",
    )

    curves = command(
        "curves",
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

    study_options.add_options(
        command("study", "make many runs, one table of them", study_options.EPILOG, "study")
    )
    return parser


def _run(module: str, name: str, arguments: argparse.Namespace) -> int:
    """A command, whose module is imported when it is run."""
    return getattr(import_module(f"{__package__}.{module}"), name)(arguments)


def _of_setup(added: argparse.ArgumentParser) -> None:
    """What goes with a set-up file of OpenSim."""
    added.add_argument(
        "model",
        metavar="SETUP",
        type=Path,
        help="set-up file (.xml), with the files that it names",
    )
    for end in ("initial", "final"):
        added.add_argument(
            f"--{end}-time",
            metavar="S",
            type=float,
            help=f"{end} time in place of the set-up's [s]",
        )
    added.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for results, made if needed; default the set-up's results directory",
    )
    added.add_argument(
        "--model",
        metavar="FILE",
        type=Path,
        dest="model_file",
        help="model (.osim) in place of the set-up's, which may lack one",
    )
    _angles(added)
    added.set_defaults(sto=True)


def _angles(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--angles",
        choices=["degrees", "radians"],
        help="what the angles in the motion's file are; default what it says",
    )


def _quantities() -> str:
    """Names of what `check` compares, a line for each unit."""
    units = dict.fromkeys(one.unit for one in QUANTITIES)
    named = {unit: ", ".join(x.name for x in QUANTITIES if x.unit == unit) for unit in units}
    return "\n".join(
        f"  {names} [{unit}]" if unit else f"  {names}" for unit, names in named.items()
    )


def _tolerance(text: str) -> tuple[str, float]:
    quantity, _, value = text.partition("=")
    try:
        size = float(value)
    except ValueError:
        size = math.nan
    if not quantity or not size >= 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not QUANTITY=VALUE with a value >= 0")
    return quantity, size


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive whole number")
    return int(text)


def _versions() -> str:
    return f"{PROGRAM} {version('exudyn_muscles')} (exudyn {version('exudyn')})"
