"""The command line: what it writes and prints, and how it fails."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import cli
from exudyn_muscles.cli import names, report, sources
from exudyn_muscles.muscle.laws import LAWS
from exudyn_muscles.results.quantities import QUANTITIES

PENDULUM = Path(__file__).parents[2] / "models" / "pendulum.py"

# A pendulum whose run ends at 0.3 s by what a user function of its mbs does.
STOPPED = """
import pendulum

motion = pendulum.motion

def build():
    model = pendulum.build()

    def stop(mbs, t):
        if t > 0.305:
            {deed}
        return True

    model.mbs.SetPostStepUserFunction(stop)
    return model
"""


def error_line(capsys):
    """The one line on stderr."""
    (line,) = capsys.readouterr().err.splitlines()
    prefix = "exudyn-muscles: error: "
    assert line.startswith(prefix)
    return line.removeprefix(prefix)


@pytest.fixture
def stopped(tmp_path):
    """Makes a model file beside a copy of the pendulum's."""

    def write(deed):
        shutil.copy(PENDULUM, tmp_path)
        file = tmp_path / "stopped.py"
        file.write_text(STOPPED.format(deed=deed))
        return str(file)

    return write


@pytest.fixture(scope="module")
def csf_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    assert cli.main(["run", str(PENDULUM), "--method", "csf", "--out", str(folder)]) == 0
    return folder / "pendulum_csf.npz"


# run


@pytest.mark.parametrize("method", names.METHODS)
def test_run_writes_result_and_figures(method, tmp_path, capsys):
    out = tmp_path / "new" / "out"
    assert cli.main(["run", str(PENDULUM), "--method", method, "--out", str(out)]) == 0

    printed = capsys.readouterr()
    assert printed.err == ""
    assert "complete" in printed.out
    assert "unmet torque [N m, or N]: none" in printed.out
    assert ("theta 0.0" in printed.out or "theta 0.1" in printed.out) == (method != "static")

    trajectory = em.Trajectory.load(out / f"pendulum_{method}.npz")
    assert trajectory.method == method
    assert trajectory.status is em.Status.COMPLETE
    figures = {"forces", "activations", "excitations"}
    if method != "static":
        figures.add("tracking_errors")
    assert {file.name for file in out.glob("*.png")} == {
        f"pendulum_{method}_{figure}.png" for figure in figures
    }


def test_run_leaves_figures_out_if_asked_to(tmp_path):
    arguments = ["run", str(PENDULUM), "--method", "static", "--out", str(tmp_path)]
    assert cli.main([*arguments, "--no-figures"]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["pendulum_static.npz"]


def test_run_writes_nothing_without_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run", str(PENDULUM), "--method", "static"]) == 0
    assert not list(tmp_path.iterdir())


def test_run_writes_the_files_of_opensim(tmp_path, capsys):
    arguments = ["run", str(PENDULUM), "--method", "csf", "--out", str(tmp_path), "--sto"]
    assert cli.main(arguments) == 0
    printed = capsys.readouterr().out
    stored = em.Trajectory.load(tmp_path / "pendulum_csf.npz")
    endings = {"states", "controls", "Kinematics_q", "Actuation_force", "pErr"}
    files = {tmp_path / f"pendulum_csf_{ending}.sto" for ending in endings}
    assert set(tmp_path.glob("*.sto")) == files
    assert all(f"wrote {file}\n" in printed for file in files)
    q = em.read_storage(tmp_path / "pendulum_csf_Kinematics_q.sto").coordinates(["theta"], ["rad"])
    np.testing.assert_allclose(q, stored.coordinates, rtol=1e-15)


@pytest.mark.parametrize(
    ("method", "options", "settings"),
    [
        ("csf", [], {"kp": 534.0, "kv": None, "step": 0.01, "scheme": "FULL"}),
        ("csf", ["--step", "0.02", "--kp", "100", "--kv", "30"],
         {"kp": 100.0, "kv": 30.0, "step": 0.02}),
        ("css", ["--predictor", "extrapolated"],
         {"scheme": "SIMPLIFIED", "predictor": "EXTRAPOLATED_ACCELERATION"}),
        ("cmc", [], {"window": 0.01, "step": 0.001}),
        ("cmc", ["--window", "0.02", "--step", "0.002"], {"window": 0.02, "step": 0.002}),
    ],
)  # fmt: skip
def test_run_options_are_the_settings(method, options, settings, tmp_path):
    arguments = ["run", str(PENDULUM), "--method", method, "--out", str(tmp_path), *options]
    assert cli.main(arguments) == 0
    stored = em.Trajectory.load(tmp_path / f"pendulum_{method}.npz").settings
    assert {name: stored[name] for name in settings} == settings


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--method", "csf", "--sto"], ["--sto needs --out DIR"]),
        (["--method", "csf", "--step", "0"], ["step"]),
        (["--method", "csf", "--step", "nan"], ["step"]),
        (["--method", "cmc", "--kp", "-1"], ["kp"]),
        (["--method", "css", "--window", "0.01"], ["--window", "cmc", "css"]),
        (["--method", "static", "--kp", "100"], ["--kp", "static"]),
        (["--method", "csf", "--predictor", "constant"], ["--predictor", "css"]),
    ],
)
def test_bad_options_of_run(options, words, capsys):
    assert cli.main(["run", str(PENDULUM), *options]) == 2
    line = error_line(capsys)
    assert all(word in line for word in words)


def test_warnings_are_one_line_without_source(capsys):
    assert cli.main(["run", str(PENDULUM), "--method", "css", "--kp", "4000"]) in (0, 2)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("warning: CSS with CONSTANT_ACCELERATION is unstable at kp = 4000")
    assert all(line.startswith(("warning: ", "exudyn-muscles: error: ")) for line in lines)


# Runs that end early


def test_error_in_the_run_saves_what_was_accepted(stopped, tmp_path, capsys):
    out = tmp_path / "out"
    file = stopped("raise ZeroDivisionError('on purpose')")
    assert cli.main(["run", file, "--method", "csf", "--out", str(out)]) == 2
    line = error_line(capsys)
    partial = out / "stopped_csf_partial.npz"
    assert line.startswith("ZeroDivisionError: on purpose; raised in the simulation at t = 0.31 s")
    assert str(partial) in line
    trajectory = em.Trajectory.load(partial)
    assert trajectory.status is em.Status.INCOMPLETE
    assert trajectory.time[-1] == pytest.approx(0.3)


def test_interrupt(stopped, tmp_path, capsys):
    out = tmp_path / "out"
    file = stopped("raise KeyboardInterrupt")
    assert cli.main(["run", file, "--method", "cmc", "--out", str(out)]) == 130
    line = error_line(capsys)
    assert line.startswith("interrupted; ")
    assert (out / "stopped_cmc_partial.npz").exists()


def test_run_stopped_by_a_user_function_is_no_success(stopped, capsys):
    assert cli.main(["run", stopped("return False"), "--method", "csf"]) == 2
    captured = capsys.readouterr()
    assert "incomplete" in captured.out
    assert captured.err.splitlines()[-1].startswith("exudyn-muscles: error: CSF is incomplete: ")


def test_traceback_on_demand(stopped, capsys):
    file = stopped("raise ZeroDivisionError('on purpose')")
    assert cli.main(["run", file, "--method", "csf", "--traceback"]) == 2
    assert "Traceback (most recent call last)" in capsys.readouterr().err


# Model files


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def build(:", ["line 1", "importing it failed", "SyntaxError"]),
        ("\nimport no_such_module", ["line 2", "no_such_module"]),
        ("raise SystemExit", ["line 1", "SystemExit"]),
        ("motion = None", ["build()", "MusculoskeletalModel"]),
        ("build = 3", ["build()"]),
        ("def build():\n    return 3", ["build()", "MusculoskeletalModel", "int"]),
        ("def build():\n    return 1 / 0", ["line 2", "build()", "ZeroDivisionError"]),
        ("from pendulum import build", ["motion()", "Motion"]),
        ("from pendulum import build\nmotion = build", ["motion()", "MusculoskeletalModel"]),
    ],
)
def test_bad_model_files(source, words, tmp_path, capsys):
    shutil.copy(PENDULUM, tmp_path)
    file = tmp_path / "bad.py"
    file.write_text(source)
    path = list(sys.path)
    assert cli.main(["compare", str(file)]) == 2
    line = error_line(capsys)
    assert str(file) in line
    assert all(word in line for word in words)
    assert sys.path == path


def test_missing_model_file(tmp_path, capsys):
    assert cli.main(["compare", str(tmp_path / "none.py")]) == 2
    assert "none.py" in error_line(capsys)


def test_model_file_that_is_not_python(tmp_path, capsys):
    file = tmp_path / "model.txt"
    file.write_text("")
    assert cli.main(["compare", str(file)]) == 2
    assert "model.txt" in error_line(capsys)


def test_output_folder_that_is_a_file(tmp_path, capsys):
    file = tmp_path / "out"
    file.write_text("")
    arguments = ["run", str(PENDULUM), "--method", "static", "--out", str(file)]
    assert cli.main(arguments) == 2
    assert str(file) in error_line(capsys)


# compare


def test_compare(tmp_path, capsys):
    file = tmp_path / "numbers" / "pendulum.json"
    out = tmp_path / "out"
    arguments = ["compare", str(PENDULUM), "--repeat", "1", "--out", str(out), "--json", str(file)]
    assert cli.main(arguments) == 0

    printed = capsys.readouterr()
    assert printed.err == ""
    for label in names.PAPER.values():
        assert f"\n{label} " in printed.out

    found = json.loads(file.read_text())
    assert found["static"]["rms_error_deg"] is None
    assert found["csf"]["rms_error_deg"] == pytest.approx(0.0186, abs=5e-5)
    assert found["cmc"]["rms_error_deg"] < found["csf"]["rms_error_deg"]
    assert found["css"]["rms_error_deg"] <= 0.1215
    for method in names.PAPER:
        row = found[method]
        assert row["cpu_s"] > 0.0
        assert 1.0 <= row["recruitments_per_step"] <= 2.1
        assert row["window_integrations_per_step"] > 2.0
        assert (row["newton_iterations_per_step"] > 0.0) == (method != "static")
        assert row["max_unmet_torque"] == row["max_constraint_drift"] == 0.0
        assert em.Trajectory.load(out / f"pendulum_{method}.npz").method == method
    assert found["max_excitation_difference"]["static_csf"] < 0.002
    assert found["max_excitation_difference"]["cmc_csf"] < 0.004
    assert found["settings"]["kv"] == pytest.approx(2.0 * np.sqrt(534.0))
    assert found["versions"]["exudyn_muscles"] == em.__version__
    assert {file.name for file in out.glob("*.png")} == {
        "pendulum_comparison.png",
        "pendulum_csf_forces.png",
        "pendulum_activations.png",
    }


def test_a_model_of_bodies_and_joints(tmp_path, capsys):
    """Every command takes it as any other, and tells how far its constraints drifted."""
    model, out = tmp_path / "limb.py", tmp_path / "out"
    model.write_text("from tests.view.test_systems import build, motion\n")
    assert cli.main(["run", str(model), "--method", "css", "--out", str(out), "--sto"]) == 0
    assert "largest violation of constraints" in capsys.readouterr().out
    assert cli.main(["compare", str(model), "--repeat", "1", "--out", str(out)]) == 0
    assert "Largest violation of constraints" in capsys.readouterr().out
    result = str(out / "limb_css.npz")
    assert cli.main(["check", result, result]) == 0
    assert len(list(out.glob("*.png"))) == 7 and len(list(out.glob("*.sto"))) == 5


def test_json_has_no_nan():
    assert report.finite({"a": float("nan"), "b": {"c": float("inf"), "d": 1.0}}) == {
        "a": None,
        "b": {"c": None, "d": 1.0},
    }


# check


def test_check_agrees_with_itself(csf_file, capsys):
    assert cli.main(["check", str(csf_file), str(csf_file)]) == 0
    assert "agrees" in capsys.readouterr().out


def test_check_names_the_first_difference(csf_file, tmp_path, capsys):
    changed = em.Trajectory.load(csf_file)
    changed.excitation_values[7, 1] += 0.25
    file = tmp_path / "changed.npz"
    changed.save(file)
    assert cli.main(["check", str(csf_file), str(file)]) == 1
    assert "excitations differ by 0.25 at t = 0.08 s" in capsys.readouterr().out

    loose = ["--tolerance", "excitations=0.3", "activations=1e-9"]
    assert cli.main(["check", str(csf_file), str(file), *loose]) == 0


def test_check_names_other_versions(csf_file, tmp_path, capsys):
    changed = em.Trajectory.load(csf_file)
    changed.coordinates[3] += 1.0
    changed.versions["numpy"] = "0.1"
    file = tmp_path / "changed.npz"
    changed.save(file)
    assert cli.main(["check", str(csf_file), str(file)]) == 1
    assert f"numpy {np.__version__} instead of 0.1" in capsys.readouterr().out


def test_check_of_unusable_files(csf_file, tmp_path, capsys):
    assert cli.main(["check", str(csf_file), str(tmp_path / "none.npz")]) == 2
    assert "none.npz" in error_line(capsys)
    truncated = tmp_path / "truncated.npz"
    truncated.write_bytes(csf_file.read_bytes()[:1000])
    assert cli.main(["check", str(truncated), str(csf_file)]) == 2
    assert "truncated.npz" in error_line(capsys)


def test_check_of_an_unknown_quantity(csf_file, capsys):
    arguments = ["check", str(csf_file), str(csf_file), "--tolerance", "forces=1"]
    assert cli.main(arguments) == 2
    assert "forces" in error_line(capsys)


@pytest.mark.parametrize("text", ["coordinates", "coordinates=", "=1", "coordinates=-1", "a=nan"])
def test_bad_tolerance_is_a_usage_error(text, capsys):
    with pytest.raises(SystemExit) as exit_info:
        cli.main(["check", "a.npz", "b.npz", "--tolerance", text])
    assert exit_info.value.code == 2
    assert "is not QUANTITY=VALUE" in capsys.readouterr().err


# curves

MY_LAW = """
import exudyn_muscles as em

law = em.CustomLaw(
    "mine",
    active_force_length=lambda x: 1 - (x - 1) ** 2 / 4,
    force_velocity=lambda v: 1 + v,
    passive_force_length=lambda x: max(x - 1, 0),
)
number = 3
"""


@pytest.fixture
def law_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "my_law.py"
    file.write_text(MY_LAW)
    return str(file)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("options", [[], ["--rigid"]])
def test_curves_of_the_built_in_laws(name, options, tmp_path, capsys):
    file = tmp_path / "new" / f"{name}.png"
    assert cli.main(["curves", "--law", name, "--out", str(file), *options]) == 0
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == (f"wrote {file}\n", "")
    assert file.stat().st_size > 20_000


def test_every_law_of_the_package_has_its_curves():
    laws = {name for name in em.__all__ if isinstance(getattr(em, name), type)
            and issubclass(getattr(em, name), em.MuscleLaw)}  # fmt: skip
    assert laws == {*LAWS, "MuscleLaw", "CustomLaw"}


def test_curves_are_written_here_if_no_file_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["curves", "--law", "Millard2012", "--fiber-damping", "0"]) == 0
    assert capsys.readouterr().out == "wrote curves.png\n"
    assert cli.main(["curves", "--law", "Thelen2003", "--out", "thelen"]) == 0
    assert capsys.readouterr().out == "wrote thelen.png\n"
    assert {file.name for file in tmp_path.iterdir()} == {"curves.png", "thelen.png"}


def test_curves_of_a_law_of_ones_own(law_file, tmp_path):
    file = tmp_path / "mine.svg"
    assert cli.main(["curves", "--law", f"{law_file}:law", "--out", str(file)]) == 0
    assert cli.main(["curves", "--law", f"{law_file}:law", "--fiber-damping", "0.2"]) == 0
    assert file.read_text().startswith("<?xml")


def test_damping_of_a_law():
    assert sources.load_law("Millard2012") == em.Millard2012()
    assert sources.damped(em.Millard2012(), 0.0) == em.Millard2012(fiber_damping=0.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--law", "Hill1938"], ["--law Hill1938", "Thelen2003", "FILE.py:NAME"]),
        (["--law", "none.py:law"], ["none.py", "No such file"]),
        (["--law", "{file}:other"], ["my_law.py", "other has to be a MuscleLaw", "None"]),
        (["--law", "{file}:number"], ["my_law.py", "number has to be a MuscleLaw", "3"]),
        (["--law", "Thelen2003", "--fiber-damping", "0.1"], ["Thelen2003 has no damper"]),
        (["--law", "Millard2012", "--fiber-damping", "-1"], ["fiber_damping = -1.0", "[0, 10]"]),
        (["--law", "Millard2012", "--out", "{file}.text"], ["text", "not supported"]),
    ],
)
def test_bad_options_of_curves(options, words, law_file, capsys):
    assert cli.main(["curves", *(option.format(file=law_file) for option in options)]) == 2
    line = error_line(capsys)
    assert all(word in line for word in words)


def test_a_law_that_cannot_be_made_is_named_with_its_line(law_file, capsys):
    source = Path(law_file).read_text()
    Path(law_file).write_text(source.replace("1 + v", "2 + v"))
    assert cli.main(["curves", "--law", f"{law_file}:law"]) == 2
    line = error_line(capsys)
    assert f"{law_file}, line 4: importing it failed: ParameterError: law 'mine': force_v" in line


# Help


def test_help_of_check_names_every_quantity(capsys):
    with pytest.raises(SystemExit):
        cli.main(["check", "--help"])
    text = capsys.readouterr().out.replace(",", " ").split()
    assert {quantity.name for quantity in QUANTITIES} <= set(text)


@pytest.mark.parametrize("arguments", [[], ["run"], ["compare"], ["check"], ["curves"]])
def test_help_has_an_example(arguments, capsys):
    with pytest.raises(SystemExit) as exit_info:
        cli.main([*arguments, "--help"])
    assert exit_info.value.code == 0
    assert "example: exudyn-muscles " in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments", [[], ["run", "model.py"], ["compare", "m.py", "--repeat", "0"], ["curves"]]
)
def test_usage_errors(arguments):
    with pytest.raises(SystemExit) as exit_info:
        cli.main(arguments)
    assert exit_info.value.code == 2


def test_version(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--version"])
    assert em.__version__ in capsys.readouterr().out


def test_as_a_process():
    done = subprocess.run(
        [sys.executable, "-m", "exudyn_muscles.cli", "--help"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "usage: exudyn-muscles" in done.stdout  # Exudyn may print a note before it
    assert done.stderr == ""
