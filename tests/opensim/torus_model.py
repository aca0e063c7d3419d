"""A muscle through a ring, as text of an `.osim` file."""

from ..own_models import LINE, MODEL, THELEN, axes, body, coordinate, joint, muscle

RING = """<WrapObjectSet><objects><WrapTorus name="ring"><inner_radius>0.02</inner_radius>
<outer_radius>0.06</outer_radius><xyz_body_rotation>0.1 0.2 0.3</xyz_body_rotation>
<translation>0.01 0.02 0</translation><quadrant>{}</quadrant></WrapTorus></objects>
</WrapObjectSet>"""
RANGES = {"turn": (-0.5, 0.5), "x": (-0.12, 0.12), "y": (-0.12, 0.12), "z": (-0.15, -0.04)}
SIDES = ("all", "+x", "-y")


def model(side="all"):
    """The text of the model, whose ring turns and whose muscle's end moves."""
    own = {name: coordinate(name, *ends) for name, ends in RANGES.items()}
    return MODEL.format(
        name="ring",
        bodies=body("ring", 1.0, "0.01 0 0", "0.01 0.01 0.01 0 0 0", RING.format(side))
        + body("end", 1.0, "0 0 0", "0.01 0.01 0.01 0 0 0"),
        joints=joint("PinJoint", "pin", "ground", "ring", own["turn"])
        + joint(
            "CustomJoint", "move", "ground", "end", own["x"] + own["y"] + own["z"],
            inside=axes(translation1=("x", LINE), translation2=("y", LINE),
                        translation3=("z", LINE)),
        ),
        constraints="",
        forces=muscle(THELEN, "through", [("ground", "0.05 0.03 0.12"), ("end", "0 0 0")],
                      100, 0.05, 0.1, wraps=["ring"]),
    )  # fmt: skip
