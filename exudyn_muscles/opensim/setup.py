"""Set-up files of OpenSim's tools."""

from __future__ import annotations

from pathlib import Path

from .cmc_setup import CMCSetup, read_cmc_setup
from .document import read_document
from .setup_files import Asked
from .static_setup import StaticSetup, read_static_setup


def load_setup(
    file: str | Path,
    *,
    initial_time: float | None = None,
    final_time: float | None = None,
    model: str | Path | None = None,
    in_degrees: bool | None = None,
) -> CMCSetup | StaticSetup:
    """Read a set-up file of OpenSim's CMC tool, or of a static optimization, with all files that it
    names.

    The fast optimization target becomes `RigidTendonForce`, the slow one `MaximumIsometricForce`;
    either way the demanded torques are met as long as they are within reach. Excitations have
    OpenSim's limits [0.02, 1] where no file of control constraints says otherwise. Windows are
    predicted as `CMCSettings` does, which tracks better than OpenSim's prediction, shifted by the
    errors (`Prediction.SHIFTED`). Muscles are integrated by the Rosenbrock method.

    Coordinates without a task, which OpenSim leaves to the forces, follow the desired kinematics by
    an ideal actuator that costs next to nothing. Tasks of locked coordinates are left out, and so
    are controls of actuators that are switched off or act on what cannot move. Muscles whose
    activations are tracked are given the excitations that lead there. A cut-off frequency that is
    not positive means no filter; the filter has OpenSim's weights, and the accelerations that the
    motion has at its ends.

    Of an `AnalyzeTool` file the first `StaticOptimization` that is on is read. Forces are divided
    by the rigid-tendon force, or without `use_muscle_physiology` by F0, and their powers by the
    `activation_exponent` are summed; windows are OpenSim's intervals, in parts of 10 ms at most.
    Muscles here have tendons that stretch, passive forces, and excitations that lead from one force
    to the next; OpenSim's have none of these. Without `use_model_force_set` muscles are left out,
    and every coordinate gets an ideal actuator.

    Parameters
    ----------
    file : str or Path
        Other files are looked for from its folder.
    initial_time, final_time : float, optional
        The span [s] in place of the file's; where neither says it, the whole motion. It has to
        lie within the motion, whereas OpenSim cuts it off there.
    model : str or Path, optional
        The model's file in place of the set-up's, which may lack one.
    in_degrees : bool, optional
        What the angles of the desired kinematics are, whatever their file says.

    Returns
    -------
    CMCSetup or StaticSetup
        By the file's class.

    Raises
    ------
    ModelFileError
        A file is damaged, holds what cannot be represented, or names what there is not.
    StorageError, MotionError
        The desired kinematics cannot be used, or not over the span that is asked for.
    ParameterError
        A time that is asked for is no number.
    FileNotFoundError

    Warns
    -----
    MotionWarning
        Angles in the desired kinematics that cannot be radians, or a locked coordinate that moves;
        a start so near to a filtered record's first sample that its accelerations are uncertain.
    SpanWarning
        The file's span is longer than the desired kinematics, whose ends are taken instead, or its
        last part is shorter than a window and left out.
    ModelFileWarning
        Something is left out, or done otherwise than OpenSim does it.
    """
    asked = Asked(initial_time, final_time, model, in_degrees)
    tool = read_document(file, "CMCTool", "AnalyzeTool")
    if tool.tag == "AnalyzeTool":
        return read_static_setup(tool, asked)
    return read_cmc_setup(tool, asked)
