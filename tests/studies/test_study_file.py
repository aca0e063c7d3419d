"""Study files, and the command that runs them."""

import shutil
from pathlib import Path

import pandas
import pytest

import exudyn_muscles as em
from exudyn_muscles import cli
from exudyn_muscles.studies.study_file import load_study, setups_in

from ..opensim import REFERENCE, needs_opensim_files

PENDULUM = Path(__file__).parents[2] / "models" / "pendulum.py"
STUDY = """
[source]
model = "pendulum.py"

[method]
name = "csf"
settings = {step = 0.02}

[samples]
design = "morris"
count = 2
seed = 5

[samples.parameters]
"*.max_isometric_force.factor" = [0.9, 1.1]
"settings.kp" = [300, 600]

[outcomes]
peak = "max(tendon_forces/left)"
"knee load" = "max(joint_forces:size/theta)"

[run]
seed = 7
trajectories = true
"""


@pytest.fixture
def write(tmp_path):
    shutil.copy(PENDULUM, tmp_path)

    def write(text=STUDY):
        file = tmp_path / "study.toml"
        file.write_text(text)
        return file

    return write


def test_a_study_file(write):
    study = load_study(write())
    assert study.size == 6 and study.seed == 7 and study.trajectories
    assert study.samples.design == "morris" and study.samples.seed == 5
    assert study.samples.ranges == {
        "*.max_isometric_force.factor": (0.9, 1.1),
        "settings.kp": (300.0, 600.0),
    }
    run = study.run(2)
    assert run.method.name == "csf" and run.method.settings["step"] == 0.02
    assert [outcome.name for outcome in study.columns] == ["peak", "knee load"]


def test_the_command(write, tmp_path, capsys):
    out = tmp_path / "out"
    command = ["study", str(write()), "--out", str(out), "--quiet"]
    assert cli.main(command) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "6 runs: 6 complete"
    assert printed[1].startswith("peak: ") and printed[2].startswith("knee load: ")
    assert printed[3] == f"wrote {out / 'table.parquet'}"
    table = pandas.read_parquet(out / "table.parquet")
    assert table["peak"].nunique() > 2
    for stem in ("indices_peak", "indices_knee_load"):
        indices = pandas.read_csv(out / f"{stem}.csv", index_col=0)
        assert list(indices.index) == ["*.max_isometric_force.factor", "settings.kp"]
        assert (out / f"{stem}.png").stat().st_size > 5000
    assert len(list((out / "trajectories").glob("*.npz"))) == 6
    written = (out / "table.parquet").read_bytes()
    assert cli.main([*command, "--no-figures"]) == 0  # all is done already
    assert (out / "table.parquet").read_bytes() == written


def test_what_fails_is_told(write, tmp_path, capsys):
    wrong = STUDY.replace("[0.9, 1.1]", "[-0.5, -0.1]").replace("morris", "latin_hypercube")
    file = write(wrong.replace("count = 2", "count = 7"))
    assert cli.main(["study", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "7 runs: 7 failed" and printed[6] == "  and 2 more"
    assert printed[1].startswith("  run 0 failed: ParameterError: muscle 'left': max_isometric_")


def test_samples_of_a_file(write, tmp_path):
    (tmp_path / "runs.csv").write_text('"settings.kp","left.min_control"\n300,0.1\n400,0.2\n')
    text = "[source]\nmodel = 'pendulum.py'\n[samples]\nfile = 'runs.csv'\n"
    study = load_study(write(text))
    assert study.run(1).parameters == {"settings.kp": 400.0, "left.min_control": 0.2}
    (tmp_path / "runs.csv").write_text("speed\n1\n")
    with pytest.raises(em.StudyError, match=r"runs.csv: parameter 'speed': expected MUSCLE"):
        load_study(write(text))


def changed(old, new):
    assert old in STUDY
    return STUDY.replace(old, new)


FAULTS = {
    "syntax": (changed("[method]", "[method"), r"at line 5"),
    "section": (changed("[run]", "[runs]"), r"line 22: runs: expected \[source\], \[method\]"),
    "key": (changed("count = 2", "cuont = 2"), r"line 11: cuont: \[samples\] has design, count"),
    "no count": (changed("count = 2", ""), "count: a positive number was expected, got None"),
    "design": (changed("morris", "monte_carlo"), "line 10: design: expected latin_hypercube"),
    "method": (changed('"csf"', '"rra"'), "line 6: method 'rra' is none of static"),
    "setting": (changed("step =", "stop ="), "line 7: settings: there is no 'stop'"),
    "range": (changed("[300, 600]", "[600, 300]"), "line 16: parameter 'settings.kp': from 600"),
    "pair": (changed("[300, 600]", "[300]"), r"line 16: settings.kp: \[LOWEST, HIGHEST\]"),
    "parameter": (changed("settings.kp", "setting.kp"), "line 16: parameter 'setting.kp': expec"),
    "outcome": (changed("max(tendon", "most(tendon"), "line 19: outcome 'most"),
    "kind": (changed("seed = 7", "seed = 'x'"), "line 23: seed: 'x' is of another kind"),
    "model": (changed('"pendulum.py"', '"arm.py"'), "line 3: model: there is no file"),
    "no source": ("[method]\nname = 'csf'\n", "a study has a "),
    "two": (changed("[source]", "[source]\nfolder = '.'"), "one of model, folder and files"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_wrong_has_its_line(write, fault):
    text, expected = FAULTS[fault]
    file = write(text)
    with pytest.raises(em.StudyError, match=expected) as failure:
        load_study(file)
    assert str(failure.value).startswith(str(file))


def test_a_folder_without_set_ups(tmp_path, capsys):
    (tmp_path / "other.xml").write_text("<OpenSimDocument/>")
    assert cli.main(["study", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "there is no set-up of CMC or static optimization" in capsys.readouterr().err


@needs_opensim_files
def test_published_set_ups_from_one_line(tmp_path, capsys):
    """Two of them; all are run by the line in docs/studies.md."""
    for name in ("arm26", "arm26_emg"):
        shutil.copytree(REFERENCE.parent / "cmc" / name, tmp_path / "setups" / name)
    assert len(setups_in(tmp_path / "setups")) == 2
    out = tmp_path / "out"
    assert cli.main(["study", str(tmp_path / "setups"), "--out", str(out), "--quiet"]) == 0
    assert capsys.readouterr().out.startswith("2 runs: 2 complete")
    table = pandas.read_parquet(out / "table.parquet")
    assert table["source"].str.split("/").str[0].tolist() == ["arm26", "arm26_emg"]
    assert table["max_unmet_torque"].notna().all()
