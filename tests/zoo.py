"""Every law and kind of tendon by name, shared by the tests."""

import exudyn_muscles as em

LAWS = {
    "DeGrooteFregly2016": em.DeGrooteFregly2016(),
    "DeGrooteFregly2016, damped": em.DeGrooteFregly2016(fiber_damping=0.01),
    "DeGrooteFregly2016Published": em.DeGrooteFregly2016Published(),
    "Thelen2003": em.Thelen2003(),
    "Millard2012": em.Millard2012(),
    "Millard2012, undamped": em.Millard2012(fiber_damping=0.0),
    "Thelen2003Deprecated": em.Thelen2003Deprecated(),
    "Schutte1993": em.Schutte1993(),
}
