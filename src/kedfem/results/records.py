"""Contents of a results file: channels of columns over time and drive angle."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from kedfem.arrays import Float
from kedfem.results.channels import ANGLE, NOTHING, Channel, largest_by_unit

Status = Literal["running", "complete", "unreliable", "interrupted", "abandoned"]


@dataclass(frozen=True, slots=True)
class Peak:
    """The highest von Mises stress of a link over all steps.

    stress : [Pa]
    link : its name
    place : (3,) in the reference position [m]
    node : number of the point in the link, in the order of ``envelope.vtu``
    step, time, angle : number of the step, of the finest of several levels in time, [s], and the drive's angle [rad] or
        travel [m]
    near : the singular place near the point, in words: a sharp corner, a point force, a joint; else empty
    away : the highest stress away from such places, where `near` is not empty and there is one
    strength : yield strength of the link's material [Pa]; inf if the scene gives none
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
    strength: float = math.inf

    @property
    def sound(self) -> "Peak | None":
        """The highest stress away from singular places; None if all points with stress are near such ones."""
        return self.away if self.near else self


@dataclass(frozen=True, slots=True)
class FatigueSpot:
    """A place of a link where damage is highest.

    link, place, node, near : as of :class:`Peak`
    criterion : ``signed von Mises``, ``normal stress`` or ``Findley``
    damage : Miner's sum in a period; 1 is failure
    utilisation : of the endurable amplitude for the required life, with the safety factor
    amplitude, mean : of the cycle that does most damage [Pa]
    disproportion : residual of the best proportional history, relative to the highest stress [-]
    support : the factor by which a stress gradient raises the endurable amplitude
    cycles : in a period
    """

    link: str
    place: tuple[float, float, float]
    node: int
    criterion: str
    damage: float
    utilisation: float
    amplitude: float
    mean: float
    disproportion: float
    support: float
    cycles: int
    near: str = ""


@dataclass(frozen=True, slots=True)
class Fatigue:
    """Damage by the stresses of a periodic motion.

    period, revolutions : [s], and revolutions of the drive in it; 0 if the drive does not rotate continuously
    repeats : by how much stresses differ between the last period and the one before, or its beginning, of each link's
        highest
    unreliable : why the numbers are unreliable, else empty
    spots : link → places of the highest damage, apart from each other, the highest first
    strengths : link → fatigue strength of its material, in words
    left_out : link → points of its surface that were not examined, as they are near corners, point forces or joints
    without : elastic links without data
    """

    period: float
    revolutions: float
    repeats: float
    unreliable: str
    spots: Mapping[str, tuple[FatigueSpot, ...]]
    strengths: Mapping[str, str]
    left_out: Mapping[str, int]
    without: tuple[str, ...] = ()

    @property
    def worst(self) -> FatigueSpot | None:
        """The place with the highest utilisation of all links."""
        every = [spot for spots in self.spots.values() for spot in spots]
        return max(every, key=lambda spot: spot.utilisation, default=None)

    @property
    def left_out_words(self) -> str:
        """Links with points that were left out, and how many; "" without any."""
        return ", ".join(f"{n:,} of {name}" for name, n in self.left_out.items() if n)

    def hours(self, spot: FatigueSpot) -> float:
        """Life at a place [h]; infinite without damage."""
        return self.period / spot.damage / 3600 if spot.damage else math.inf

    def cycles(self, spot: FatigueSpot) -> float:
        """Life at a place in revolutions of the drive, or in periods if the drive does not rotate continuously."""
        return (self.revolutions or 1.0) / spot.damage if spot.damage else math.inf


@dataclass(frozen=True, slots=True)
class Results:
    """A results file as it was read.

    time : (n,) moments of the rows, read-only [s]
    angle : (n,) drive angle [rad] or travel [m] from the reference position, as `drive` says, read-only
    channels : name → (channel, values (n, columns) in the channel's unit, read-only), in the order recorded
    status : ``complete``; ``unreliable``: whole, but meaningless by its own estimates; ``interrupted``; ``running``:
        still being written; ``abandoned``: its process was killed
    scene_json, scene_toml : the scene that was analysed; the TOML text is None for a scene made in Python
    notes : what the run reported about itself
    reason : why the run was interrupted or is unreliable, else empty
    version : the kedfem that wrote the file
    warnings : as reported to the user; of a complete run
    seconds : stage → duration [s]; of a complete run
    peaks : link → its highest stress over all steps; of a whole elastic run, of links that have stress
    drive : name and unit of `angle`; of several drives it is the first one's
    links : link → what it was modelled as: `model` in words, `elements`, `unknowns`, and with what is attached `mass
        [kg]`, `centre of mass [m]` in the reference position, `inertia [kg m^2]` about it: xx, yy, zz, xy, yz, zx; of
        an elastic run
    fatigue : damage, of a whole run of a scene that asks for it
    every : rows are those of each so many time points of the run, and of the last one
    largest : name of a channel → rows (k, 2 + columns) of time, drive and values, among which are those in which a
        column, or the length of all of them, is largest of all time points; empty where all of these are rows
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
    fatigue: Fatigue | None = None
    every: int = 1
    largest: Mapping[str, Float[np.ndarray, "k r"]] = field(default_factory=dict)

    @property
    def instants(self) -> Float[np.ndarray, " T"]:
        """All time points of the run, whether or not they are rows [s]."""
        if self.every == 1 or len(self.time) < 2:
            return self.time
        steps = round((self.time[-1] - self.time[0]) / float(self.notes["step [s]"]))
        return np.linspace(self.time[0], self.time[-1], steps + 1)

    def largest_rows(
        self, name: str
    ) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"], Float[np.ndarray, "k c"]]:
        """Time, drive and values of rows of a channel that include its largest values of all time points."""
        if (found := self.largest.get(name)) is not None:
            return found[:, 0], found[:, 1], found[:, 2:]
        return self.time, self.angle, self.channels[name][1]

    def to_xarray(self) -> Any:
        """All channels as an xarray.DataTree, which is laid out as the file: `tree["joints/B/force"].sel(xyz="x")`.

        Every channel has the coordinates time, position of the drive and, of vectors and tensors, names of components;
        `attrs` have units, long_name and frame.

        Raises
        ------
        OutputError
            xarray is not installed.
        """
        from kedfem.results.table import as_data_tree

        return as_data_tree(self)

    def to_pandas(self) -> Any:
        """All channels as a pandas.DataFrame over time [s]; columns have the names of `results.csv`.

        Raises
        ------
        OutputError
            pandas is not installed.
        """
        from kedfem.results.table import as_data_frame

        return as_data_frame(self)


def rounding(results: Results) -> dict[str, float]:
    """Unit → level of rounding beside the largest value; of moments also beside forces times the distance of joints."""
    joints = json.loads(results.scene_json).get("joints", {}).values()
    places = [each["at"] for each in joints if each.get("at")]
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if places else 0.0
    every = ((channel, results.largest_rows(name)[2]) for name, (channel, _) in results.channels.items())
    highest = largest_by_unit(every, size)
    return {unit: NOTHING * value for unit, value in highest.items()}
