"""OpenSim's static optimization, solved here: what this package's differs from."""

import dataclasses
from typing import NamedTuple

import numpy as np

from exudyn_muscles.recruitment.demand import Demand
from exudyn_muscles.recruitment.limits import Limits
from exudyn_muscles.recruitment.optimization import Recruiter
from exudyn_muscles.recruitment.steady import steady_bounds, steady_state

from .opensim_models import rebuilt


class Course(NamedTuple):
    """Activations (k, m) and forces along the tendons (k, m) [N] at times (k,) [s]."""

    time: np.ndarray
    activation: np.ndarray
    force: np.ndarray


def simplified(setup, times, passive):
    """The same problem at single instants: of muscles with rigid tendons whose forces are their
    activations times what they can do, with or without their passive forces."""
    rigid = [
        dataclasses.replace(each, ignore_tendon_compliance=True) for each in setup.model.muscles
    ]
    model = rebuilt(setup.model, rigid, setup.model.reserves)
    m, skeleton, settings = len(rigid), model.skeleton, setup.settings
    limits = Limits(settings.control_limits, model.muscles, model.reserves)
    recruiter = Recruiter(problem_of=settings.criterion.prepare(model))
    optimal = np.array([each.optimal_force for each in model.reserves])
    activations, forces = [], []
    with skeleton.opened():
        for t in times:
            q, v, a = setup.motion(t)
            M, bias, place = skeleton.dynamics_at(q, v, t)
            geometry = model.geometry(*place)
            u, ideal = limits.at(t)
            full = settings.normalizer(model.muscles, np.ones(m), geometry)
            low, high = u * full
            if passive:
                low, high = steady_bounds(
                    model.muscles, u, geometry.length, geometry.lengthening_speed
                )
            demand = Demand(
                np.vstack([geometry.moment_arms, geometry.columns.T.reshape(-1, q.size)]),
                M @ a + bias,
                np.concatenate((low, ideal[0])), np.concatenate((high, ideal[1])),
                np.concatenate((full, optimal)),
            )  # fmt: skip
            F = recruiter.solve(demand).force[:m]
            activation = F / full
            if passive:
                activation = steady_state(
                    model.muscles, u, F, geometry.length, geometry.lengthening_speed
                )[0]
            activations.append(activation)
            forces.append(F)
    return Course(times, np.array(activations), np.array(forces))
