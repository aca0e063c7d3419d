"""Every law and kind of tendon by name, shared by the tests."""

import exudyn_muscles as em
from exudyn_muscles.muscle import laws

LAWS = {name: law() for name, law in laws.LAWS.items()} | {
    "DeGrooteFregly2016, damped": em.DeGrooteFregly2016(fiber_damping=0.01),
    "Millard2012, undamped": em.Millard2012(fiber_damping=0.0),
}
