"""The shortest way of a muscle from a point P to a point Q over a surface, in the surface's frame.

It is straight from P to a tangent point, a geodesic from there to another one, and straight again
to Q; all of it is smooth. The geodesic begins with no length where the straight line from P to Q
touches the surface, so that l and r are continuous there. As in OpenSim nothing wraps while P or Q
is inside the surface.

A side works as in OpenSim: a muscle whose straight line passes the center on the wrong side goes
around the long way. Over a cylinder it does so wherever the line is, over a sphere while the line
cuts it, over an ellipsoid while the line cuts it and passes more than 45 deg off the right side.
Through a torus it goes by the hole.
"""

from __future__ import annotations

from ..numerics.kernel import kernel
from .cylinder import CUT, FREE, wrap_over_cylinder
from .geodesic import wrap_over_ellipsoid
from .great_circle import ROUNDING, plane_of_arc
from .surfaces import AXIS, CYLINDER, ELLIPSOID, HALF_LENGTH, RADII, SHAPE, TORUS
from .torus import wrap_over_torus

START, END = RADII.start, RADII.stop


@kernel
def wrap_over(wraps, w, side, around, P, Q, contact, work):
    """Write the contact (4, 3) of wrap `w` and return FREE, WRAPPED or CUT, and the arc [m].

    `around` (3,) is zero, or about what the muscle is to turn, whatever the side is.
    """
    radius, axis = wraps[w, START], int(wraps[w, AXIS])
    if wraps[w, SHAPE] == CYLINDER:
        return wrap_over_cylinder(
            radius, wraps[w, HALF_LENGTH], axis, side, around[2], P, Q, contact
        )
    if wraps[w, SHAPE] == TORUS:
        return wrap_over_torus(radius, wraps[w, START + 1], axis, side, P, Q, contact, work)
    if wraps[w, SHAPE] == ELLIPSOID:
        cut, arc = wrap_over_ellipsoid(wraps[w, START:END], axis, side, around, P, Q, contact, work)
    else:
        cut, arc, _ = plane_of_arc(radius, axis, side, ROUNDING, around, P, Q, contact)
        arc *= radius
    return CUT if cut else FREE, arc
