"""A muscle between two points that move freely about a cylinder, as text of an `.osim` file."""

from ..own_models import LINE, MODEL, THELEN, axes, body, coordinate, joint, muscle

RADIUS = 0.04
SIDES = ("z", "-z")
# Of the two points [m]: nearly in one plane, where OpenSim's tangent points are exact.
SPREAD = (0.15, 0.15, 0.003)
SURFACE = """<WrapObjectSet><objects><WrapCylinder name="cylinder"><quadrant>{}</quadrant>
<radius>{}</radius><length>2</length></WrapCylinder></objects></WrapObjectSet>"""
POINTS = {"one": "abc", "two": "uvw"}


def model(side):
    """The text of the model whose cylinder has this side."""
    bodies = joints = ""
    for name, three in POINTS.items():
        own = "".join(coordinate(each, -1, 1) for each in three)
        moves = {f"translation{k}": (each, LINE) for k, each in enumerate(three, 1)}
        bodies += body(name, 1.0, "0 0 0", "1 1 1 0 0 0")
        joints += joint("CustomJoint", f"to_{name}", "ground", name, own, inside=axes(**moves))
    return MODEL.format(
        name="cylinder",
        bodies=bodies
        + body("turned", 1.0, "0 0 0", "1 1 1 0 0 0", SURFACE.format(side, RADIUS)),
        joints=joints
        + joint("PinJoint", "pin", "ground", "turned", coordinate("turn", -1, 1)),
        constraints="",
        forces=muscle(
            THELEN, "muscle", [("one", "0 0 0"), ("two", "0 0 0")], 700, 0.1, 0.1,
            wraps=["cylinder"],
        ),
    )  # fmt: skip
