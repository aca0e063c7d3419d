"""A chain of three bodies whose end is held in one way or another, as text of an `.osim` file."""

from ..own_models import MODEL, THELEN, body, coordinate, joint, muscle

# Where the chain's end is in ground at its default pose, and how it is turned there.
END = "-0.17244555278892307 -0.6027086417450473 -0.5987537535065193"
TURNED = "2.5304485162217656 0.9403164840107674 -1.4095462114786603"
POINTS = """<socket_body_1>/bodyset/three</socket_body_1><socket_body_2>/ground</socket_body_2>
<location_body_1>0.02 -0.3 0.01</location_body_1><location_body_2>{}</location_body_2>"""
POINT = f'<PointConstraint name="{{}}">{POINTS.format(END)}</PointConstraint>'
WELD = f"""<WeldConstraint name="weld"><frames><PhysicalOffsetFrame name="end">
<socket_parent>/bodyset/three</socket_parent><translation>0.02 -0.3 0.01</translation>
</PhysicalOffsetFrame><PhysicalOffsetFrame name="place"><socket_parent>/ground</socket_parent>
<translation>{END}</translation><orientation>{TURNED}</orientation></PhysicalOffsetFrame></frames>
<socket_frame1>end</socket_frame1><socket_frame2>place</socket_frame2></WeldConstraint>"""
DISTANCE = f"""<ConstantDistanceConstraint name="rod">{POINTS.format("0.3 -0.2 0.1")}
<constant_distance>{{}}</constant_distance></ConstantDistanceConstraint>"""
COUPLER = """<CoordinateCouplerConstraint name="coupler"><coupled_coordinates_function>
<SimmSpline><x>-2 -1 0 1 2</x><y>0.5 0.1 0.2 0.15 0.6</y></SimmSpline>
</coupled_coordinates_function><independent_coordinate_names>c</independent_coordinate_names>
<dependent_coordinate_name>g</dependent_coordinate_name></CoordinateCouplerConstraint>"""
SEVERAL = """<CoordinateCouplerConstraint name="several"><coupled_coordinates_function>
{}</coupled_coordinates_function><independent_coordinate_names>{}</independent_coordinate_names>
<dependent_coordinate_name>{}</dependent_coordinate_name><scale_factor>{}</scale_factor>
</CoordinateCouplerConstraint>"""
POLYNOMIAL = SEVERAL.format(
    """<MultivariatePolynomialFunction><coefficients>0.05 0.25 -0.15 0.2 0.1 -0.216</coefficients>
    <dimension>2</dimension><order>2</order></MultivariatePolynomialFunction>""", "c d", "g", 2,
)  # fmt: skip
CHAIN = SEVERAL.format(
    "<LinearFunction><coefficients>0.7 -0.2 0.42</coefficients></LinearFunction>", "a c", "f", 1
) + SEVERAL.format(
    "<SimmSpline><x>-2 -1 0 0.6 2</x><y>0.5 0.1 0.2 0.3 0.6</y></SimmSpline>", "f", "g", 1
)
STRAIGHT = SEVERAL.format(
    """<PiecewiseLinearFunction><x>-2 0 1 2</x><y>0.5 0.1 0.5 0.6</y></PiecewiseLinearFunction>""",
    "c", "g", 1,
)  # fmt: skip
LINE = f"""<PointOnLineConstraint name="line"><socket_line_body>/ground</socket_line_body>
<socket_follower_body>/bodyset/three</socket_follower_body>
<line_direction_vec>1 2 -0.5</line_direction_vec><point_on_line>{END}</point_on_line>
<point_on_follower>0.02 -0.3 0.01</point_on_follower></PointOnLineConstraint>"""
CONSTRAINTS = {
    "distance": DISTANCE.format(0.9346848979873492),
    "distance_and_coupler": DISTANCE.format(0.9350560552258845) + COUPLER,
    "point": POINT.format("pin"),
    "redundant": POINT.format("pin") + POINT.format("pin_again") + LINE,
    "line": LINE,
    "weld": WELD,
    "polynomial": POLYNOMIAL,
    "chain": CHAIN,
    "piecewise": STRAIGHT,
    "distance_and_polynomial": DISTANCE.format(0.9346848979873492) + POLYNOMIAL,
}
# OpenSim 4.6 takes first derivatives of such polynomials for the second ones, which matter as
# soon as they move.
AT_REST = ("polynomial", "distance_and_polynomial")
DEFAULTS = {"a": 0.4, "b": -0.3, "c": 0.5, "d": 0.2, "e": -0.4, "f": 0.6, "g": 0.3}
SPAN, ROWS = 0.15, 6  # of the runs [s], and their rows


def model(name=None, *, muscles=True):
    """The text of the model with these constraints, or with none, and with its muscles or not."""
    own = {
        each: coordinate(each, -2, 2, f"<default_value>{value}</default_value>")
        for each, value in DEFAULTS.items()
    }
    pulling = muscle(
        THELEN, "long", [("ground", "0.1 0 0.05"), ("three", "0.03 -0.1 0")], 700, 0.3, 0.42
    ) + muscle(THELEN, "short", [("one", "0.05 -0.2 0"), ("two", "0.04 -0.1 0.01")], 400, 0.1, 0.13)
    return MODEL.format(
        name="loop",
        bodies=body("one", 2.0, "0.01 -0.15 0", "0.02 0.004 0.02 0.001 0 0")
        + body("two", 1.5, "0 -0.12 0.02", "0.015 0.003 0.014 0 0.0005 0")
        + body("three", 1.0, "0.02 -0.1 0", "0.01 0.002 0.011 0 0 0.0004"),
        joints=joint("UniversalJoint", "first", "ground", "one", own["a"] + own["b"])
        + joint(
            "GimbalJoint", "second", "one", "two", own["c"] + own["d"] + own["e"],
            at="0.01 -0.35 0", turned="0.1 0 0.2",
        )
        + joint(
            "UniversalJoint", "third", "two", "three", own["f"] + own["g"], at="0 -0.3 0.02",
            turned="0 1.2 0",
        ),
        constraints="" if name is None else CONSTRAINTS[name],
        forces=pulling if muscles else "",
    )  # fmt: skip
