"""Files of every kind with random damage: they are read, or refused by an error of this package,
within a limit of time.

The files are whole before that: a model of a joint and two muscles, a CMC set-up with all that it
names, a motion, and a result.
"""

import re
import tempfile
import zipfile
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np

import exudyn_muscles as em
from models import pendulum

from ..opensim_files import BODY_POINT, GROUND_POINT, muscle, write_model

LIMIT = 10.0  # CPU seconds

NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
NASTY = (
    b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-1", b"1e9", b"9" * 400,
    b"1e", b"0x10", b"1_000", b"", b"one", b"1 2 3", b"\xe2\x88\x9e", b"1,5",
)  # fmt: skip
STRANGE = (b"\x00", b"\xff\xfe", b"<", b">", b"&", b"&#0;", b"<!--", b"]]>", b'"', b"\n", b"\r",
           b"</objects>", b"<objects>", b"\xe2\x80\xa8", b"<![CDATA[", b"%s", b"../")  # fmt: skip
BALL = """<WrapSphere name="ball"><xyz_body_rotation>0.1 0 0</xyz_body_rotation>
<translation>0 0.05 0.1</translation><radius>0.03</radius></WrapSphere>"""
WRAP = """<PathWrap name="over"><wrap_object>ball</wrap_object><range>-1 -1</range></PathWrap>"""
TASK = """<CMC_Joint name="angle"><on>true</on><active>true false false</active><kp>100 1 1</kp>
<kv>20 1 1</kv><coordinate>angle</coordinate></CMC_Joint>"""
ACTUATOR = """<CoordinateActuator name="reserve"><coordinate>angle</coordinate>
<optimal_force>10</optimal_force></CoordinateActuator>"""
SETUP = """<?xml version="1.0"?><OpenSimDocument Version="40000"><CMCTool name="small">
<model_file>model.osim</model_file><replace_force_set>false</replace_force_set>
<force_set_files>reserves.xml</force_set_files><initial_time>0.1</initial_time>
<final_time>0.4</final_time><desired_kinematics_file>motion.mot</desired_kinematics_file>
<task_set_file>tasks.xml</task_set_file><lowpass_cutoff_frequency>-1</lowpass_cutoff_frequency>
<cmc_time_window>0.01</cmc_time_window></CMCTool></OpenSimDocument>"""


def members(kind, inside):
    return f'<{kind} name="set"><objects>{inside}</objects><groups/></{kind}>'


def document(inside):
    return f'<?xml version="1.0"?><OpenSimDocument Version="40000">{inside}</OpenSimDocument>'


@cache
def whole():
    """Name -> bytes of files that are good."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        slack = "<tendon_slack_length>0.45</tendon_slack_length>"
        first = muscle(wraps=WRAP, inside=slack)
        second = muscle("Millard2012EquilibriumMuscle", BODY_POINT + GROUND_POINT, inside=slack)
        second = second.replace('"muscle"', '"second"')
        write_model(
            folder / "model.osim",
            ground=f'<Ground name="ground">{members("WrapObjectSet", BALL)}</Ground>',
            forces=first + second,
        )
        (folder / "tasks.xml").write_text(document(members("CMC_TaskSet", TASK)))
        (folder / "reserves.xml").write_text(members("ForceSet", ACTUATOR))
        (folder / "setup.xml").write_text(SETUP)
        times = np.linspace(0.0, 0.5, 61)
        em.Storage("motion", ("angle",), times, 0.3 * np.sin(times)[:, None]).write(
            folder / "motion.mot"
        )
        source, motion = pendulum.build(), pendulum.motion()
        result = em.static_optimization(source, motion.between(motion.start, motion.start + 0.05))
        result.save(folder / "result.npz")
        for name, read in READERS.items():
            read(folder / name)
        return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def damaged(rng, data):
    """One to three times something cut out, doubled, overwritten, put in, or cut off."""
    for _ in range(rng.integers(1, 4)):
        first, last = np.sort(rng.integers(0, len(data) + 1, 2))
        last = min(last, first + int(10.0 ** rng.uniform(0.0, 3.0)))
        part = data[first:last]
        numbers = list(NUMBER.finditer(data))
        match rng.integers(6):
            case 0:
                data = data[:first] + data[last:]
            case 1:
                data = data[:last] + part * int(rng.choice([1, 2, 50])) + data[last:]
            case 2:
                data = data[:first] + rng.bytes(last - first) + data[last:]
            case 3:
                data = data[:first] + STRANGE[rng.integers(len(STRANGE))] + data[first:]
            case 4:
                data = data[:first]
            case 5 if numbers:
                start, end = numbers[rng.integers(len(numbers))].span()
                data = data[:start] + NASTY[rng.integers(len(NASTY))] + data[end:]
    return data


def damaged_array(rng, array):
    """An array of another shape or kind, or with other values."""
    match rng.integers(7):
        case 0:
            return array[..., :-1] if array.ndim else array[None]
        case 1:
            return np.concatenate([array, array]) if array.ndim else np.array([array, array])
        case 2:
            return array.astype("U") if array.dtype.kind != "U" else np.arange(3)
        case 3:
            return np.full_like(array, rng.choice([np.nan, np.inf, 1e308, -1.0])) if (
                array.dtype.kind == "f"
            ) else np.array("{}")  # fmt: skip
        case 4:
            return np.empty((0, *array.shape[1:]))
        case 5:
            return np.array(["2020-01-01"], dtype="datetime64[D]")
    return array.astype(complex) if array.dtype.kind in "fi" else np.array(b"\x00")


def damaged_archive(rng, data):
    """A result with damaged members, or damaged as a whole."""
    if rng.random() < 0.4:
        return damaged(rng, data)
    with np.load(BytesIO(data)) as archive:
        content = dict(archive)
    names = list(content)
    for _ in range(rng.integers(1, 3)):
        name = names[rng.integers(len(names))]
        if rng.random() < 0.2:
            content.pop(name, None)
        elif name in content and content[name].dtype.kind == "U":
            text = damaged(rng, str(content[name]).encode()).decode(errors="replace")
            content[name] = np.array(text)
        elif name in content:
            content[name] = damaged_array(rng, content[name])
    out = BytesIO()
    np.savez(out, **content)
    if rng.random() < 0.1:
        with zipfile.ZipFile(out, "a") as archive:
            archive.writestr("more.npy", rng.bytes(20))
    return out.getvalue()


READERS = {
    "model.osim": em.opensim.load_model,
    "setup.xml": em.opensim.load_setup,
    "motion.mot": em.read_storage,
    "result.npz": em.Trajectory.load,
}


def check(rng):
    files = dict(whole())
    name = list(files)[rng.integers(len(files))]
    files[name] = (damaged_archive if name.endswith("npz") else damaged)(rng, files[name])
    with tempfile.TemporaryDirectory() as folder:
        for other, data in files.items():
            (Path(folder) / other).write_bytes(data)
        reader = name if name in READERS else "setup.xml"
        try:
            READERS[reader](Path(folder) / reader)
        except (em.ExudynMusclesError, FileNotFoundError):
            return f"{name} refused"
        except Exception as error:
            error.add_note(f"{name}, damaged")
            raise
    return f"{name} read"
