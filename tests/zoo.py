"""Every law and kind of tendon by name, shared by the tests."""

import exudyn_muscles as em
from exudyn_muscles.muscle import laws

RIGID = ("MeyerFregly2016", "SplineLaw")  # for rigid tendons alone
LAWS = {name: law() for name, law in laws.LAWS.items() if name not in RIGID} | {
    "DeGrooteFregly2016, damped": em.DeGrooteFregly2016(fiber_damping=0.01),
    "Millard2012, undamped": em.Millard2012(fiber_damping=0.0),
}
