"""Frames that stations define against offset frames of the same pose, and what is wrong in them."""

import numpy as np
import pytest

import exudyn_muscles as em

from ..opensim_files import JOINT, Loaded, coordinates, frame, write_model

# That of the joint's frame on ground.
POSE = frame([0.4, -0.5, 0.6], [0.1, 0.2, 0.3])
STATION = """<Station name="{}"><socket_parent_frame>{}</socket_parent_frame>
<location>{:.17g} {:.17g} {:.17g}</location></Station>"""
SHIFT = np.array([0.02, -0.01, 0.05])
SHIFTED = """<PhysicalOffsetFrame name="shifted"><socket_parent>/ground</socket_parent>
<translation>0.02 -0.01 0.05</translation></PhysicalOffsetFrame>"""
DEFINED = """<StationDefinedFrame name="place"><socket_point_a>../a</socket_point_a>
<socket_point_b>../b</socket_point_b><socket_point_c>/ground/c</socket_point_c>
<socket_origin_point>/ground/o</socket_origin_point>{}</StationDefinedFrame>"""
# Where the stations are by the frame's axes, whose first two are along ab and ab x ac.
PLACES = {
    "": {"a": [-0.1, 0.0, 0.0], "b": [0.3, 0.0, 0.0], "c": [0.2, 0.0, -0.4]},
    "<ab_axis>-z</ab_axis><ab_x_ac_axis>x</ab_x_ac_axis>": {
        "a": [0.0, 0.1, 0.2], "b": [0.0, 0.1, -0.3], "c": [0.0, 0.4, -0.1],
    },
    "<ab_axis>y</ab_axis><ab_x_ac_axis>-Z</ab_x_ac_axis>": {
        "a": [0.1, 0.0, 0.0], "b": [0.1, 0.2, 0.0], "c": [0.3, 0.1, 0.0],
    },
}  # fmt: skip


def written(file, axes="", **changes):
    """A model whose joint is on a frame of stations."""
    text = ""
    for name, at in (PLACES[axes] | {"o": [0.0, 0.0, 0.0]} | changes).items():
        x = POSE[:3, :3] @ at + POSE[:3, 3]
        parent = "/ground/shifted" if name == "b" else "/ground"
        text += STATION.format(name, parent, *(x - SHIFT if name == "b" else x))
    return write_model(
        file,
        ground=f"<Ground><components>{DEFINED.format(axes)}{text}{SHIFTED}</components></Ground>",
        joints=JOINT.format(kind="PinJoint", coordinates=coordinates("angle"), inside="").replace(
            "frame>before<", "frame>/ground/place<"
        ),
    )


@pytest.mark.parametrize("axes", PLACES)
def test_a_frame_of_stations_is_where_they_are(axes, tmp_path):
    """Their order in the file does not matter, nor which frame of a body they are on."""
    of_stations = Loaded(written(tmp_path / "stations.osim", axes))
    of_offsets = Loaded(write_model(tmp_path / "offsets.osim"))
    for found, expected in zip(
        of_stations.pose([0.3], "body"), of_offsets.pose([0.3], "body"), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("../a<", "../z<", r"socket_point_a: there is no station '../z'"),
        ("</StationDefinedFrame>", "<ab_axis>w</ab_axis></StationDefinedFrame>",
         "ab_axis: expected an axis such as .x, got 'w'"),
        ("</StationDefinedFrame>", "<ab_x_ac_axis>-x</ab_x_ac_axis></StationDefinedFrame>",
         "ab_x_ac_axis: it is the axis of ab_axis as well"),
        ('<Station name="c"><socket_parent_frame>/ground<',
         '<Station name="c"><socket_parent_frame>/bodyset/body<', "on different bodies"),
        ('<Station name="c"><socket_parent_frame>/ground<',
         '<Station name="c"><socket_parent_frame>/ground/place<', "on one another, in a circle"),
        ("/ground/c<", "../a<", "its points a, b and c are on one line"),
    ],
)  # fmt: skip
def test_what_is_wrong(old, new, message, tmp_path):
    file = written(tmp_path / "model.osim")
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(em.ModelFileError, match=message):
        em.opensim.load_model(file)
