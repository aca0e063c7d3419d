"""Joints that no other model has, between ground and a body that bears another one, as text of
`.osim` files."""

from ..own_models import LINE, MODEL, SPLINE, axes, body, coordinate, joint

LIMIT = """<CoordinateLimitForce name="limit_{0}"><coordinate>{0}</coordinate>
<upper_stiffness>20</upper_stiffness><upper_limit>0.1</upper_limit>
<lower_stiffness>15</lower_stiffness><lower_limit>-0.1</lower_limit><damping>0.7</damping>
<transition>0.2</transition></CoordinateLimitForce>"""
TWICE = LINE.replace("1 0<", "2 0.1<")
TIMES_ONE = f"<MultiplierFunction><function>{LINE}</function><scale>1</scale></MultiplierFunction>"
POLYNOMIAL = """<MultivariatePolynomialFunction><coefficients>{}</coefficients>
<dimension>2</dimension><order>2</order></MultivariatePolynomialFunction>"""
# Of a custom joint none of whose coordinates OpenSim takes for an angle.
COUPLED = axes(
    rotation1=("b", SPLINE.format("-2 -1 0 1 2", "-1.5 -0.8 0.1 0.9 2")),
    rotation2=("c", LINE),
    rotation3=("a", TWICE),
    translation1=("d", SPLINE.format("-2 -1 0 1 2", "0.1 0.05 0 0.02 0.1")),
    translation2=("c", LINE),
    translation3=("e", TIMES_ONE),
)
# Axes by functions of several coordinates.
SEVERAL = axes(
    rotation1=("a", LINE),
    rotation2=("a b", POLYNOMIAL.format("0.1 0.3 -0.2 0.4 0.25 -0.15")),
    rotation3=("b", LINE),
    translation1=("b c", POLYNOMIAL.format("0.05 0.02 0.3 -0.04 0.1 0.2")),
    translation2=(
        "a c",
        "<LinearFunction><coefficients>0.1 1 0.02</coefficients></LinearFunction>",
    ),
    translation3=("c", LINE),
)
CURVED = "<neutral_angle_x_z_y>{}</neutral_angle_x_z_y><length>0.4</length>"
ELLIPSOID = "<radii_x_y_z>{}</radii_x_y_z>"
SCAPULA = """<thoracic_ellipsoid_radii_x_y_z>0.12 0.17 0.09</thoracic_ellipsoid_radii_x_y_z>
<scapula_winging_axis_origin>0.03 -0.02</scapula_winging_axis_origin>
<scapula_winging_axis_direction>0.4</scapula_winging_axis_direction>"""
# Class, coordinates, and what is in the joint.
JOINTS = {
    "coupled": ("CustomJoint", "abcde", COUPLED),
    "several": ("CustomJoint", "abc", SEVERAL),
    "curved": ("ConstantCurvatureJoint", "abc", CURVED.format("0.1 -0.15 0.2")),
    "ellipsoid": ("EllipsoidJoint", "abc", ELLIPSOID.format("0.3 0.2 0.25")),
    "mirrored": ("EllipsoidJoint", "abc", ELLIPSOID.format("-0.3 -0.2 -0.25")),
    "disk": ("EllipsoidJoint", "abc", ELLIPSOID.format("0.25 0.4 0.25")),
    "scapula": ("ScapulothoracicJoint", "abcd", SCAPULA),
}  # fmt: skip

# At rest: OpenSim 4.6 takes first derivatives of such polynomials for the second ones.
AT_REST = ("several",)
# OpenSim's velocities are not the rates of its own poses: it gives Simbody the joint's velocities
# in the child's frame, not the parent's, and no H' u.
WITHOUT_VELOCITIES = ("curved",)


def model(name):
    """The text of a model with one of the joints."""
    kind, names, inside = JOINTS[name]
    own = "".join(coordinate(each, -0.6, 0.6) for each in names)
    # Forces on coordinates of the others act on OpenSim's speeds, which are none of the angles'.
    own_speeds = ("CustomJoint", "ConstantCurvatureJoint")
    limited = (*names, "z") if kind in own_speeds else "z"
    return MODEL.format(
        name=name,
        bodies=body("one", 1.2, "0.02 -0.1 0.05", "0.02 0.03 0.04 0.001 0 0.002")
        + body("two", 3.1, "0.01 -0.2 0.01", "0.04 0.005 0.04 0 0.0003 0"),
        joints=joint(
            kind, "own", "ground", "one", own, at="0.1 0.2 0", turned="0.3 -0.2 0.1",
            at_child="0.02 0.01 -0.03", turned_child="0.1 0.2 -0.3", inside=inside,
        )
        + joint("PinJoint", "pin", "one", "two", coordinate("z", -0.6, 0.6), at="0 -0.2 0.03"),
        constraints="",
        forces="".join(LIMIT.format(each) for each in limited),
    )  # fmt: skip
