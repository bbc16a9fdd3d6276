"""What a results file holds: channels of columns over time and drive angle."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

Status = Literal["running", "complete", "doubtful", "interrupted", "abandoned"]


@dataclass(frozen=True, slots=True)
class Channel:
    """One group of columns that are recorded together.

    Parameters
    ----------
    name
        Path in the file, e.g. ``probes/rocker_mid/stress``, ``joints/B/force``, ``drive/torque``.
    columns
        Names of the columns, e.g. ``("x", "y", "z")``.
    unit
        Unit of all columns, e.g. ``Pa``.
    frame
        ``link``, ``world``, or empty where there is none.
    description
        A line for titles and readers.
    """

    name: str
    columns: tuple[str, ...]
    unit: str
    frame: str
    description: str


TIME = Channel("time", (), "s", "", "time")
ANGLE = Channel("drive_angle", (), "rad", "", "drive angle from the reference position")
TRAVEL = Channel("drive_travel", (), "m", "", "drive travel from the reference position")


@dataclass(frozen=True, slots=True)
class Peak:
    """The highest von Mises stress of a link over all steps.

    Parameters
    ----------
    stress : [Pa]
    link
        Its name.
    place : (3,) [m]
        As drawn, in the reference position.
    node
        Number of the point in the link, in the order of ``envelope.vtu``.
    step, time, angle
        Number of the step, of the finest of several levels in time, [s], and the drive's angle [rad] or travel [m].
    near
        What is near, in words, where stress is not what it seems: a sharp corner, a point force, a joint; else empty.
    away
        The highest stress away from such places, where `near` is not empty and there is one.
    """

    stress: float
    link: str
    place: tuple[float, float, float]
    node: int
    step: int
    time: float
    angle: float
    near: str = ""
    away: "Peak | None" = None


@dataclass(frozen=True, slots=True)
class Results:
    """A results file as it was read.

    Parameters
    ----------
    time : (n,) [s]
        Moments of the rows, read-only.
    angle : (n,) [rad], or [m] where the drive slides
        Drive angle or travel from the reference position, as `drive` says, read-only.
    channels
        Name → (channel, values (n, columns) in the channel's unit, read-only), in the order recorded.
    status
        ``complete``; ``doubtful``: whole, but meaningless by its own estimates; ``interrupted``; ``running``: still being
        written; ``abandoned``: its process was killed.
    scene_json, scene_toml
        The scene that was analysed; the TOML text is None for a scene made in Python.
    notes
        What the run said about itself.
    reason
        Why the run was interrupted or is doubtful, else empty.
    version
        The kedfem that wrote the file.
    warnings
        What the user was told; of a run that came to its end.
    seconds
        Stage → what it took [s]; of a run that came to its end.
    peaks
        Link → its highest stress over all steps; of a whole elastic run, of links that have stress.
    drive
        Name and unit of `angle`; of several drives it is the first one's.
    links
        Link → what it was modelled as: `model` in words, `elements`, `unknowns`, and with what is attached `mass [kg]`,
        `centre of mass [m]` as drawn, `inertia [kg m^2]` about it: xx, yy, zz, xy, yz, zx; of an elastic run.
    """

    time: Float[np.ndarray, " n"]
    angle: Float[np.ndarray, " n"]
    channels: Mapping[str, tuple[Channel, Float[np.ndarray, "n c"]]]
    status: Status
    scene_json: str
    scene_toml: str | None = None
    notes: Mapping[str, str | float] = field(default_factory=dict)
    reason: str = ""
    version: str = ""
    peaks: Mapping[str, Peak] = field(default_factory=dict)
    drive: Channel = ANGLE
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    links: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def to_xarray(self) -> Any:
        """All channels as an xarray.DataTree, which is laid out as the file: `tree["joints/B/force"].sel(xyz="x")`.

        Every channel has the coordinates time, position of the drive and, of vectors and tensors, names of components;
        `attrs` have units, long_name and frame.

        Raises
        ------
        OutputError
            xarray is not installed.
        """
        from kedfem.results.data_sets import as_data_tree

        return as_data_tree(self)

    def to_pandas(self) -> Any:
        """All channels as a pandas.DataFrame over time [s]; columns have the names of `results.csv`.

        Raises
        ------
        OutputError
            pandas is not installed.
        """
        from kedfem.results.data_sets import as_data_frame

        return as_data_frame(self)
