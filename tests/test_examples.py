"""Every example runs as a script, and one number of each is what it should be."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("[0-9]*.py"))


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(number):
        (script,) = [path for path in EXAMPLES if path.name.startswith(number)]
        variables = runpy.run_path(str(script), run_name="__main__")
        return variables, capsys.readouterr().out

    return run


def test_all_examples_are_tested():
    tested = set(re.findall(r'run\("(\d\d)"\)', Path(__file__).read_text()))
    assert tested == {path.name[:2] for path in EXAMPLES}


def test_shortest_program(run):
    variables, printed = run("01")
    assert np.degrees(variables["result"].tracking_error_rms()[0]) < 0.02
    assert "largest excitations" in printed


def test_bodies_and_joints(run):
    variables, printed = run("02")
    assert (np.degrees(variables["result"].tracking_error_rms()) < 0.05).all()
    assert variables["result"].max_unmet_torque == 0.0
    assert np.degrees(np.ptp(variables["swing"])) == pytest.approx(49.3, abs=0.5)
    assert "the hand swings by 49.3 deg" in printed


def test_in_your_own_script(run):
    variables, _ = run("03")
    result = variables["result"]
    assert (np.degrees(result.tracking_error_rms()) < 0.005).all()
    assert result.max_unmet_torque == 0.0
    np.testing.assert_array_equal(variables["forces"][1:, 1:], result.tendon_forces[1:])
    # The spring is felt: it is stretched between hand and wall all the time.
    distance = np.linalg.norm(variables["hand_path"][:, 1:] - [-0.5, -0.4, 0.0], axis=1)
    assert np.ptp(distance) > 0.1


def test_too_violent(run):
    variables, printed = run("04")
    assert printed.count("falls short in") == 4
    short = [np.abs(result.torques_unmet).max() for result in variables["results"]]
    assert min(short) > 10.0
    assert len({round(x, 3) for x in short}) == 4
    assert printed.count("theta: off the motion from t = 0.1") == 3


def test_look_at_muscles(run, tmp_path):
    run("05")
    pictures = list((tmp_path / "out").glob("*.png"))
    assert pictures and all(picture.stat().st_size > 5000 for picture in pictures)


def test_recorded_motion(run):
    variables, printed = run("06")
    assert np.abs(variables["replay"].coordinates - variables["cmc"].coordinates).max() < 1e-10
    assert "difference from the stored result: None" in printed


def test_help_for_weak_muscles(run):
    variables, printed = run("08")
    alone, helped = variables["alone"], variables["helped"]
    assert alone.max_unmet_torque > 5.0 and "iliopsoas" in alone.unmet_torque_report()
    assert helped.max_unmet_torque == 0.0
    assert (np.abs(helped.reserves).max(axis=0) < 5.0).all()
    late = helped.window_time[1:] > 0.5
    i = helped.muscle_names.index("iliopsoas")
    assert helped.excitation_values[~late, i].max() <= 0.8 and "everything met" in printed


def test_a_law_of_your_own(run, tmp_path):
    variables, printed = run("07")
    assert np.degrees(variables["result"].tracking_error_rms()[0]) < 0.02
    assert variables["result"].max_unmet_torque == 0.0
    assert re.findall(r"^(\S.*\S) *: largest excitation 0.\d", printed, re.M) == [
        "De Groote",
        "frog",
    ]
    for name in ("laws", "left_muscle"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 20_000


def test_person_in_the_loop(run):
    variables, printed = run("10")
    printed = re.findall(r"^(\w+) *: .* takes ([\d.]+) ms \(p50\), ([\d.]+) ms", printed, re.M)
    assert [name for name, *_ in printed] == ["FULL", "CONSISTENT"]
    assert all(0.0 < float(p50) <= float(p99) for _, p50, p99 in printed)
    for result, most in zip(variables["results"].values(), (0.05, 0.01), strict=True):
        assert len(result.time) == 201 and result.max_unmet_torque == 0.0
        assert (np.degrees(result.tracking_error_rms()) < most).all()
        # The target went where it was steered, and the arm with it.
        reached = np.degrees(result.coordinates[[53, 130, 200]])
        np.testing.assert_allclose(reached, [[40, 70], [60, 40], [25, 60]], atol=0.1)


def test_pedalling(run, tmp_path):
    variables, printed = run("09")
    assert np.degrees(variables["result"].tracking_error_rms()[0]) < 0.02
    assert variables["result"].max_constraint_drift < 2e-6
    assert 5e-4 < variables["gaps"][False] < 2e-3 and variables["gaps"][True] < 1e-9
    assert "largest gap in the loop" in printed
    assert (tmp_path / "out" / "pedalling.png").stat().st_size > 5000


def test_studies(run, tmp_path):
    variables, printed = run("11")
    table, (strength, slack) = variables["table"], (variables["STRENGTH"], variables["SLACK"])
    assert (tmp_path / "out" / "study" / "table.parquet").exists()
    assert (table["status"] == "complete").all() and len(table) == 8
    one = {strength: table[strength][3], slack: table[slack][3]}
    assert variables["peak"](one) == table["peak"][3]  # Exudyn's functions see the same runs
    assert list(variables["varied"][strength]) == [0.8, 1.0, 1.2]
    assert sorted(variables["peaks"], reverse=True) == variables["peaks"]  # the stronger, the less
    assert variables["error"] < 0.02 and "the measured peak is met with" in printed
