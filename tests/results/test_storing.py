"""Nothing is lost on the way to a file and back; older files are read, damaged ones refused."""

import contextlib
import dataclasses
import json

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results import storing
from exudyn_muscles.results.quantities import QUANTITIES
from models import pendulum

from ..reference.make import FOLDER
from .make_table import FILE, markdown


@pytest.mark.parametrize("which", ["csf", "cmc"])
def test_save_and_load_lose_nothing(which, request, tmp_path):
    trajectory = request.getfixturevalue(which)
    trajectory.save(tmp_path / "result.npz")
    loaded = em.Trajectory.load(tmp_path / "result.npz")
    for field in dataclasses.fields(trajectory):
        before, after = getattr(trajectory, field.name), getattr(loaded, field.name)
        if isinstance(before, np.ndarray):
            np.testing.assert_array_equal(before, after)
            assert before.dtype == after.dtype
        else:
            assert before == after, field.name
    assert loaded.compare(trajectory) is None


def test_a_forward_result_with_nan_survives_and_equals_itself(tmp_path):
    result = em.forward_dynamics(pendulum.build(), em.Excitations([0.0, 0.05], [[0.3, 0.2]]))
    assert np.isnan(result.desired_coordinates).all()
    result.save(tmp_path / "forward.npz")
    assert em.Trajectory.load(tmp_path / "forward.npz").compare(result) is None


def test_a_truncated_file_is_refused(csf, tmp_path):
    file = tmp_path / "cut.npz"
    csf.save(file)
    content = file.read_bytes()
    for size in (0, 10, len(content) // 2, len(content) - 10):
        file.write_bytes(content[:size])
        with pytest.raises(em.ResultFileError, match=r"cut\.npz: not a readable"):
            em.Trajectory.load(file)


def test_a_file_without_an_array_is_refused(csf, tmp_path):
    csf.save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as stored:
        rest = {name: stored[name] for name in stored.files if name != "speeds"}
    np.savez(tmp_path / "part.npz", **rest)
    with pytest.raises(em.ResultFileError, match=r"truncated, without \['speeds'\]"):
        em.Trajectory.load(tmp_path / "part.npz")


def test_another_version_is_refused(csf, tmp_path):
    csf.save(tmp_path / "now.npz")
    with np.load(tmp_path / "now.npz") as stored:
        content = {name: stored[name] for name in stored.files}
    header = json.loads(str(content.pop("header")))
    now, header["version"] = header["version"], 99
    np.savez(tmp_path / "later.npz", header=json.dumps(header), **content)
    with pytest.raises(em.ResultFileError, match=rf"version 1 to {now}, found .* version 99"):
        em.Trajectory.load(tmp_path / "later.npz")


@pytest.mark.parametrize(
    "change",
    [
        lambda header, arrays: header.update(status="NONE"),
        lambda header, arrays: header.update(counts={"wheels": 4}),
        lambda header, arrays: header.update(foreign=1),
        lambda header, arrays: arrays.update(speeds=arrays["speeds"][:5]),
        lambda header, arrays: arrays.update(reserves=arrays["reserves"][:-1]),
        lambda header, arrays: arrays.update(window_time=arrays["window_time"][:3]),
        lambda header, arrays: arrays.update(start_unmet=np.zeros(5)),
        lambda header, arrays: arrays.update(excitation_values=np.array(1.0)),
        lambda header, arrays: arrays.update(coordinates=np.zeros((101, 2))),
    ],
)
def test_a_damaged_content_is_refused(csf, tmp_path, change):
    csf.save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    header = json.loads(str(arrays.pop("header")))
    change(header, arrays)
    np.savez(tmp_path / "damaged.npz", header=json.dumps(header), **arrays)
    with pytest.raises(em.ResultFileError, match=r"damaged\.npz"):
        em.Trajectory.load(tmp_path / "damaged.npz")


# Written by the versions of this package that had these formats; the first of them had no units.
OLDER = ["version_1", "version_1_with_units", "version_2", "version_3", "version_4"]


@pytest.mark.parametrize("name", OLDER)
def test_results_of_older_versions_are_read(name, tmp_path):
    file = FOLDER / "results" / f"{name}.npz"
    with np.load(file) as stored:
        arrays = {name: stored[name] for name in stored.files}
    header = json.loads(str(arrays.pop("header")))
    result = em.Trajectory.load(file)
    for quantity in QUANTITIES:
        found = getattr(result, quantity.field)
        if quantity.since > header["version"]:
            assert quantity.field not in arrays
            assert found.shape == quantity.shape(vars(result))
            np.testing.assert_array_equal(found, quantity.before)
        else:
            np.testing.assert_array_equal(found, arrays[quantity.field])
    assert result.coordinate_units == ("rad",) and result.saturated == ((),)
    assert result.system_names == ()
    assert (result.method, result.status, result.windows) == ("static", em.Status.COMPLETE, 3)
    assert result.settings == header["settings"] and result.versions == header["versions"]
    assert dataclasses.asdict(result.counts) == {"not_preferred": 0, **header["counts"]}
    result.save(tmp_path / "now.npz")
    assert em.Trajectory.load(tmp_path / "now.npz").compare(result) is None


def test_what_an_older_version_had_is_not_made_up(tmp_path):
    with np.load(FOLDER / "results" / "version_1.npz") as stored:
        rest = {name: stored[name] for name in stored.files if name != "fiber_lengths"}
    np.savez(tmp_path / "part.npz", **rest)
    with pytest.raises(em.ResultFileError, match=r"truncated, without \['fiber_lengths'\]"):
        em.Trajectory.load(tmp_path / "part.npz")


def test_a_start_that_was_not_stored_is_not_replayed():
    old = em.Trajectory.load(FOLDER / "results" / "version_1.npz")
    with pytest.raises(em.ParameterError, match="initial l_t must be 2 finite values"):
        em.forward_dynamics(pendulum.build(), old.excitations)


def test_flipped_bytes_are_refused_or_harmless(csf, tmp_path):
    csf.save(tmp_path / "whole.npz")
    content = (tmp_path / "whole.npz").read_bytes()
    generator = np.random.default_rng(0)
    for _ in range(100):
        damaged = bytearray(content)
        damaged[generator.integers(len(content))] ^= 0xFF
        (tmp_path / "flipped.npz").write_bytes(damaged)
        with contextlib.suppress(em.ResultFileError):
            em.Trajectory.load(tmp_path / "flipped.npz")


def test_a_missing_file_and_a_foreign_one(tmp_path):
    with pytest.raises(FileNotFoundError):
        em.Trajectory.load(tmp_path / "none.npz")
    np.savez(tmp_path / "foreign.npz", x=np.zeros(3))
    with pytest.raises(em.ResultFileError, match="not a readable"):
        em.Trajectory.load(tmp_path / "foreign.npz")
    (tmp_path / "text.npz").write_text("time,q\n0,1\n")
    with pytest.raises(em.ResultFileError):
        em.Trajectory.load(tmp_path / "text.npz")


def test_every_array_is_in_the_table_and_every_field_in_files():
    arrays = {one.name for one in dataclasses.fields(em.Trajectory) if one.type == "np.ndarray"}
    others = {one.name for one in dataclasses.fields(em.Trajectory)} - arrays
    assert {one.field for one in QUANTITIES} == arrays and len(QUANTITIES) == len(arrays)
    assert set(storing.KINDS) == others
    assert max(one.since for one in QUANTITIES) <= storing.FORMAT_VERSION
    assert all(f"    {one.field} : {one.symbols} ndarray\n" in em.Trajectory.__doc__
               for one in QUANTITIES)  # fmt: skip


def test_the_documented_table_is_the_one_in_use():
    """Made anew by `python -m tests.results.make_table`."""
    assert markdown() in FILE.read_text()
