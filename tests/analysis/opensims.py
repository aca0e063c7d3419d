"""OpenSim's models with all that acts on them, and trajectories that are at its states."""

import dataclasses
import warnings

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.counts import Counts, Status
from exudyn_muscles.results.quantities import QUANTITIES
from exudyn_muscles.results.trajectory import Trajectory

from ..make_analyses import FILES, PIPELINES
from ..opensim import needs_opensim_files
from ..own_models import FOLDER, OWN

NAMES = ["arm", *(pytest.param(name, marks=needs_opensim_files) for name in FILES)]


def opensims(name, folder):
    """A model, and OpenSim's numbers for it."""
    numbers = dict(np.load(FOLDER / f"analyses_{name}.npz"))
    if name in OWN:
        file = folder / f"{name}.osim"
        file.write_text(OWN[name]())
        return em.opensim.load_model(file), numbers
    file, actuators, loads, _ = FILES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ModelFileWarning)
        model = em.opensim.load_model(
            PIPELINES / file,
            force_sets=[] if actuators is None else [PIPELINES / actuators],
            external_loads=None if loads is None else PIPELINES / loads,
        )
    return model, numbers


def ordered(model, numbers):
    """The numbers' coordinates and muscles in the model's order."""
    coordinates, muscles = (
        [numbers[key].tolist().index(name) for name in names]
        for key, names in (
            ("coordinate_names", model.coordinates),
            ("muscle_names", model.muscles.names),
        )
    )
    return coordinates, muscles


def at_states(model, numbers):
    """A trajectory whose windows end at OpenSim's states, with the first of them twice: fibres are
    as long as there."""
    coordinates, muscles = ordered(model, numbers)
    rows = [0, *range(len(numbers["time"]))]
    q, v = (numbers[key][rows][:, coordinates] for key in ("coordinates", "speeds"))
    a, l_m, alpha = (
        numbers[key][rows][:, muscles] for key in ("activations", "fiber_length", "pennation_angle")
    )
    places = [model.geometry(*row) for row in zip(q, v, strict=True)]
    length = np.array([place.length for place in places])
    l_t = length - l_m * np.cos(alpha)
    force = np.array([model.tendon_forces(*each) for each in zip(places, a, l_t, strict=True)])
    time = np.append(2 * numbers["time"][0] - numbers["time"][1], numbers["time"])
    known = {
        "time": time, "window_time": time, "coordinates": q, "speeds": v, "activations": a,
        "tendon_lengths": l_t, "fiber_lengths": l_m, "musculotendon_lengths": length,
        "tendon_forces": force, "excitation_values": numbers["excitations"][:, muscles],
    }  # fmt: skip
    names = {
        "coordinate_names": model.coordinates, "muscle_names": model.muscles.names,
        "reserve_names": tuple(f"reserve {k}" for k in range(len(model.reserves))),
        "system_names": (),
    }  # fmt: skip
    other = {
        one.field: np.zeros(one.shape(names | known))
        for one in QUANTITIES
        if one.field not in known
    }
    rest = {
        "method": "given", "coordinate_units": model.skeleton.units, "saturated": (),
        "status": Status.COMPLETE, "message": "", "counts": Counts(), "cpu_time": 0.0,
        "settings": {}, "versions": {},
    }  # fmt: skip
    assert {*names, *known, *other, *rest} == {one.name for one in dataclasses.fields(Trajectory)}
    return Trajectory(**names, **known, **other, **rest)
