"""Which curves are in one picture, and on which scale."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure

from kedfem.output.abscissa import Abscissa, draw_abscissa
from kedfem.output.plots.drawing import draw_curves, drawn_over, worth_drawing
from kedfem.output.plots.files import shown
from kedfem.output.plots.groups import STIFF, Picture
from kedfem.report.curves import cursor_places
from kedfem.results import Channel, Results
from kedfem.results.channels import ANGLE, TRAVEL

LIMBS = {"foot": "universal", "slide": "prismatic", "head": "spherical"}


def test_a_joint_counts_once_whatever_it_has_of_rigid_links() -> None:
    """Twelve joints of one kind with their rigid counterparts: nine of twelve, each with both curves."""
    time = np.linspace(0.0, 1.0, 5)
    names = [f"joints/{k}/{rigid}force" for k in range(12) for rigid in ("", "rigid_")]
    channels = {
        name: (Channel(name, ("x", "y", "z"), "N", "world", "force"), np.full((5, 3), 1.0 + k // 2))
        for k, name in enumerate(names)
    }
    pages = {x.name: x for x in worth_drawing(Results(time, time, channels, "complete", "{}"))}
    title, panel = shown(pages["joint_forces"])
    assert title == "Magnitude of the joint forces: the largest 9 of 12"
    assert list(panel.curves) == [f"{k}{rigid}" for k in range(3, 12) for rigid in ("", STIFF)]


def test_efforts_of_several_drives_are_in_one_panel_and_limbs_in_one_for_each_kind() -> None:
    """Six legs as of a Stewart platform: their drives beside each other, feet, slides and heads on one scale."""
    time = np.linspace(0.0, 1.0, 5)
    kinds = {f"{what}_{k}": kind for what, kind in LIMBS.items() for k in range(6)}
    scene = json.dumps({"joints": {name: {"kind": kind, "at": [0, 0, 0]} for name, kind in kinds.items()}})
    values = {f"joints/{name}/force": (k + 10.0) * np.ones((5, 3)) for k, name in enumerate(kinds)}
    values |= {f"drive/slide_{k}/force": (k + 10.0) * np.ones((5, 1)) for k in range(6)}
    channels = {name: (Channel(name, ("x", "y", "z")[: y.shape[1]], "N", "world", name), y) for name, y in values.items()}
    every = worth_drawing(Results(time, time, channels, "complete", scene))
    pages = {x.name: x.panels[0] for x in every if x.together}
    assert list(pages) == [*(f"joint_forces-{kind}" for kind in LIMBS.values()), "drive_forces"]
    assert list(pages["drive_forces"].curves) == [f"slide_{k}" for k in range(6)]
    assert list(pages["joint_forces-spherical"].curves) == [f"head_{k}" for k in range(6)]
    (scale,) = {pages[f"joint_forces-{kind}"].limits for kind in LIMBS.values()}
    assert scale == (0.0, pytest.approx(27.0 * np.sqrt(3.0)))  # the largest force of 18 joints


def test_panels_of_one_quantity_share_a_scale_unless_one_would_be_flat_there() -> None:
    time = np.linspace(0.0, 1.0, 5)
    sizes = {"a": 1.0, "b": 0.2, "c": 0.01}
    channels = {
        f"probes/{x}/speed": (Channel(f"probes/{x}/speed", ("speed",), "m/s", "", ""), np.full((5, 1), size))
        for x, size in sizes.items()
    }
    every = worth_drawing(Results(time, time, channels, "complete", "{}"))
    assert [x.panels[0].limits for x in every] == [(0.0, 1.0), (0.0, 1.0), None]


def test_faint_moments_are_named_but_not_drawn() -> None:
    """20 µN m beside 1.4 N m, and 1 nN m beside 500 N on arms of 0.5 m."""
    time = np.linspace(0.0, 1.0, 5)
    one = {"kind": "revolute", "at": [0.5, 0, 0]}
    scene = json.dumps({"joints": {"A": one | {"at": [0, 0, 0]}, "B": one, "C": one}})

    def drawn(moments: dict[str, float]) -> dict[str, Picture]:
        every = {f"joints/{x}/moment": ("N m", size) for x, size in moments.items()}
        every |= {f"joints/{x}/force": ("N", 500.0) for x in moments}
        channels = {
            name: (Channel(name, ("z",), unit, "world", ""), np.full((5, 1), size))
            for name, (unit, size) in every.items()
        }
        return {x.name: x for x in worth_drawing(Results(time, time, channels, "complete", scene))}

    found = drawn({"A": 1.4, "B": 2e-5, "C": 1.0})
    assert {name for name in found if "moment" in name} == {
        "joint_moments", "joints-A-moment", "joints-C-moment",
    }  # fmt: skip
    ax = Figure().add_subplot()
    draw_curves(ax, Abscissa(time), found["joint_moments"].panels[0])
    assert ax.get_legend_handles_labels()[1] == ["A", "C", "B: < 0.01 %"]
    assert not any("moment" in name for name in drawn({"A": 1e-9, "B": 2e-10}))


def static(angle: np.ndarray, drive: Channel, kind: str = "static") -> Results:
    time = np.linspace(0.0, 4.0, len(angle))
    scene = json.dumps({"analysis": {"kind": kind}, "drive": {"joint": "road"}})
    force = Channel("drive/force", ("force",), "N", "", "force")
    return Results(time, angle, {"drive/force": (force, angle[:, None])}, "complete", scene, drive=drive)


def test_static_positions_are_drawn_over_the_drive() -> None:
    """Its travel in mm, its angle in degrees, there and back on one scale; at rest, and in motion, over time."""
    up, back = np.array([-0.05, 0.0, 0.05]), np.array([0.0, 0.05, 0.0])
    along = drawn_over(static(up, TRAVEL))
    np.testing.assert_allclose(along.values, [-50, 0, 50])
    np.testing.assert_allclose(drawn_over(static(up, ANGLE)).values, np.degrees(up))
    np.testing.assert_allclose(drawn_over(static(up[::-1], TRAVEL)).ends, [50, -50])
    assert drawn_over(static(back, TRAVEL)).ends == (0, 50)
    np.testing.assert_allclose(cursor_places(static(back, TRAVEL), np.array([0, 1, 2, 4.0])), [0, 0.5, 1, 0])
    assert drawn_over(static(0 * up, TRAVEL)).over_time
    assert drawn_over(static(up, TRAVEL, "transient")).over_time
    top = Figure().subplots()
    draw_abscissa(top, top, along)
    assert top.get_xlabel() == "drive travel (mm)"
    assert top.get_xlim() == (-50, 50)


@pytest.mark.parametrize(
    ("quantity", "rows", "told"),
    [("travel", [3.0, 4, 0], False), ("displacement", [0.1, 4, 0], False), ("displacement", [3, 4, 0], True),
     ("position", [3, 4, 0], False), ("force", [3, 4, 0], True), ("force", [0, -4, 0.2], False)],
)  # fmt: skip
def test_magnitudes_are_drawn_where_they_tell_more_than_a_component(quantity: str, rows: list[float], told: bool) -> None:
    channel = Channel(f"probes/p/{quantity}", ("x", "y", "z"), "m", "world", quantity)
    time = np.linspace(0.0, 1.0, 3)
    values = np.outer(time, rows)
    (page,) = worth_drawing(Results(time, time, {channel.name: (channel, values)}, "complete", "{}"))
    assert ("magnitude" in page.panels[0].curves) == told
    assert {"x", "y", "z"} <= set(page.panels[0].curves)


def test_rotations_that_are_rounding_are_not_drawn_and_titles_name_what_is_shown() -> None:
    """The guided ram of a press: 1e-38° filled its panel, under a title that promised velocities too."""
    time = np.linspace(0.0, 1.0, 5)
    kinds = {"rotation": "rad", "angular_velocity": "rad/s", "angular_acceleration": "rad/s^2"}
    sizes = {"crank": 1.0, "ram": 1e-38}
    channels = {
        f"links/{link}/{kind}": (
            Channel(f"links/{link}/{kind}", ("z",), unit, "", f"{kind} of link {link}"),
            size * time[:, None],
        )
        for link, size in sizes.items() for kind, unit in kinds.items()
    }  # fmt: skip
    pages = worth_drawing(Results(time, time, channels, "complete", "{}"))
    assert [each.title for each in pages] == ["rotation and its rates of link crank"]
    assert shown(pages[0])[0] == "rotation of link crank"
