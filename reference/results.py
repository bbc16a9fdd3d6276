"""docs/results.md: every channel of a results file, its sign, frame and unit.

Regenerate it with ``python -m reference.results > docs/results.md``.
"""

import re
import sys
from dataclasses import dataclass

from kedfem.results.channels import Channel
from kedfem.results.dimensions import columns_dimension

XYZ = ("x", "y", "z")
STRESS = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")
FLAT = "of planar links x and y alone"


@dataclass(frozen=True, slots=True)
class Entry:
    """What the reference says of channels.

    path : their names; NAME is a name of the scene, a bar parts the last words that there may be
    columns, unit, frame : as they are; of several units one for each word; frame "either" as the probe asks
    text : meaning and sign
    """

    path: str
    columns: tuple[str, ...]
    unit: str
    frame: str
    text: str

    def words(self) -> dict[str, str]:
        """Last word of the path → unit."""
        words, units = self.path.rpartition("/")[2].split("|"), self.unit.split("|")
        return dict(zip(words, units * (len(words) // len(units)), strict=True))

    def fits(self, channel: Channel) -> bool:
        """Whether a channel is one of these: its name, columns, unit and frame."""
        group = self.path.rpartition("/")[0]
        kinds, slash, rest = group.partition("/")
        paths = [f"{kind}{slash}{rest}/{word}" for kind in kinds.split("|") for word, unit in self.words().items()
                 if unit == channel.unit]  # fmt: skip
        named = any(re.fullmatch(re.escape(path).replace("NAME", "[^/]+"), channel.name) for path in paths)
        framed = channel.frame == self.frame or (self.frame == "either" and channel.frame in {"link", "world"})
        return named and framed and _among(channel.columns, self.columns)


def _among(found: tuple[str, ...], known: tuple[str, ...]) -> bool:
    """Vectors may have fewer components; "*" is one column that is called as the path ends, but for `rigid_`."""
    fewer = known == XYZ and 0 < len(found) < 3 and set(found) <= set(XYZ)
    return found == known or fewer or (known == ("*",) and len(found) == 1)


CHANNELS: dict[str, tuple[Entry, ...]] = {
    "Probes": (
        Entry("probes/NAME/displacement|velocity|acceleration", XYZ, "m|m/s|m/s^2", "either",
             f"Elastic motion of the point against the rigid motion of its link; without a drive against the free motions held in the reference position; {FLAT}."),
        Entry("probes/NAME/position|travel", XYZ, "m", "world",
             f"Where the point is; how far it is from its reference position. Rigid and elastic motion together; {FLAT}."),
        Entry("probes/NAME/total_velocity|total_acceleration", XYZ, "m/s|m/s^2", "world",
             f"Of rigid and elastic motion together; {FLAT}."),
        Entry("probes/NAME/deflection", XYZ, "m", "either",
             f"From the chord of the link's joints, which goes with them, or the link's mean rigid motion, as the description says; {FLAT}."),
        Entry("probes/NAME/stress", STRESS, "Pa", "link",
             "Axes of the link in the reference position, of a beam those of its section: x along it, y along its width, z along its thickness. Tension is positive; xy, yz, zx are shear stresses, not twice; von_mises is never negative. Of beams in space shear stresses are those of torsion, of planar ones there are none: none knows those of a shear force."),
    ),
    "Joints": (
        Entry("joints/NAME/force|rigid_force", XYZ, "N", "world",
             "What the joint exerts on the link that the description names first, not on the other. rigid_: with all links rigid, in "
             "scenes whose drives move all of them; it may lack components that statics leave open."),
        Entry("joints/NAME/moment|rigid_moment", XYZ, "N m", "world",
             "On the same link, about the joint's point as it moves with the rigid-body motion, of a slot about the pin. "
             "The torque of a drive on a hinge is in it, as the force of one on a slide is in the joint's force."),
        Entry("joints/NAME/angle|angle_about_NAME", ("angle",), "rad", "",
             "Of the link that the description names first against the other, from the reference position, by the right hand about "
             "the joint's axis; of a universal joint about the axis of link NAME, of the other link against this one; counted on "
             "over turns."),
        Entry("joints/NAME/travel|travel_1|travel_2|travel_3", ("travel",), "m", "",
             "Of the link that the description names first against the other along the joint's axis, of a planar joint along the two "
             "directions across it that the description names, from the reference position."),
    ),
    "Drive": (
        Entry("drive/torque|rigid_torque|force|rigid_force", ("*",), "N m|N m|N|N", "world",
             "What the drive exerts on its link along the driven joint's axis; times the drive's rate it is the power that the drive gives, "
             "positive where it drives."),
        Entry("drive/NAME/torque|rigid_torque|force|rigid_force", ("*",), "N m|N m|N|N", "world",
             "The same, where there are several drives, of the drive of that joint; of several on one joint NAME is JOINT.DRIVE."),
    ),
    "Gears, motors, springs and limits": (
        Entry("gears/NAME/torque", ("torque",), "N m", "world",
             "On the link whose rotation the first joint's angle is, about that joint's axis."),
        Entry("motors|springs|limits/NAME/angle|travel", ("*",), "rad|m", "",
             "Coordinate of their joint, from the reference position."),
        Entry("motors/NAME/speed", ("speed",), "rad/s", "", "Rate of a hinge's angle."),
        Entry("motors/NAME/speed", ("speed",), "m/s", "", "Rate of a slide's travel."),
        Entry("motors|springs|limits/NAME/torque|force", ("*",), "N m|N", "",
             "Along the coordinate: positive where it pushes angle or travel up. Of a spring between two points with its damper: its pull, "
             "positive in tension."),
        Entry("springs/NAME/length", ("length",), "m", "", "Distance of its points."),
    ),
    "Energy": (
        Entry("energy/kinetic|strain", ("*",), "J", "", "Of all links; strain energy of springs in joints too."),
        Entry("energy/work", ("loads", "supports"), "J", "",
             "Done on the links since the beginning: by loads, motors and springs; by the drive and other supports."),
        Entry("energy/dissipated", ("dissipated",), "J", "", "Energy dissipated by damping since the beginning; it grows."),
        Entry("energy/neglected|residual", ("*",), "J", "",
             "Work that the equation neglects on bent links; what is left of the balance, the integration's error."),
    ),
    "Rigid motion (`kedfem kinematics`)": (
        Entry("links/NAME/position|velocity|acceleration", XYZ, "m|m/s|m/s^2", "world",
             "Of the centre of mass, of a link without mass its first joint."),
        Entry("joints/NAME/position|velocity|acceleration", XYZ, "m|m/s|m/s^2", "world",
             "Of the joint's point on the link that the description names; joints to the ground have none."),
        Entry("probes/NAME/position|velocity|acceleration", XYZ, "m|m/s|m/s^2", "world", "Of the probe's point."),
        Entry("links/NAME/rotation|angular_velocity|angular_acceleration", XYZ, "rad|rad/s|rad/s^2", "world",
             "In space: rotation vector from the reference position, of 0 to π; its rates ω and α."),
        Entry("links/NAME/rotation", ("angle",), "rad", "",
             "In a plane: angle about the normal that the description names, counted on over turns."),
        Entry("links/NAME/angular_velocity|angular_acceleration", ("rate",), "rad/s|rad/s^2", "", "In a plane: about the same normal."),
        Entry("links/NAME/transmission_angle", ("angle",), "rad", "",
             "Between coupler and driven link, 0 to π; best at π/2."),
    ),
}  # fmt: skip
INTRODUCTION = """\
# Results

`results.h5` holds time series: `time` [s], `drive_angle` [rad] or `drive_travel` [m] from the reference position, of several
drives the first one's, and the channels below, each with `units`, `long_name` and `frame` (`world`, or `link`: axes of the
link in the reference position, which go with it). NAME is a name of the scene; all units are SI. xarray, Panoply and other readers of
netCDF 4 open the file: dimension `time`, and of vectors and tensors one with the names of their components (below, in
brackets). Energies apart, nothing is summed up over time.

| group | attributes |
|---|---|
| `/` | `status` (`complete`, `unreliable`, `interrupted`, `running`), `reason`, `kedfem_version`, `Conventions` |
| `/notes` | notes of the run: unknowns, step, estimated errors (`error of mesh, stress` ...), the residual of energy; `steps between rows` of a file without all |
| `/notes/LINK` | what a link was modelled as: `model`, `elements`, `unknowns`; with what is attached `mass [kg]`, `centre of mass [m]` in the reference position, `inertia [kg m^2]` about it: xx, yy, zz, xy, yz, zx |
| `/warnings`, `/timing` | what was reported to the user; seconds of each stage; both of a run that came to its end |
| `/peaks/LINK` | highest von Mises stress over all steps, its place in the reference position, time, step and drive; `away` from places where it means little; the `yield_strength` of its material |
| `/fatigue/LINK/RANK` | of a scene with `[fatigue]`: damage in a period, utilisation, worst cycle, criterion, place of the highest damage of each link, the worst first; period and `unreliable` are those of `/fatigue` |
| `/scene` | the scene that was analysed, as `json` and `toml` |

`peaks.csv` has the ten highest von Mises stresses of each link over all steps, each at least 2 % of the link's size from
those before, with place in the reference position, time, drive and what is near; `envelope.csv` (`output.csv = true`) and `envelope.vtu`
have the highest von Mises and extreme principal stresses of every point, each with its time and drive.

**Small files.** Rows are those of every time step, or with `output.every = n` of each n-th, the first and the last among
them (of a run that was interrupted the last it came to): bit by bit those of the whole run, and about an n-th of the file. All steps stay in energies (sums go on from step to step), peaks,
envelope, damage, warnings, estimated errors, states to resume from and frames of the animation. The attribute `largest_rows` of each channel has what is
largest of all steps, rows of time, drive and columns one after the other (`Results.largest_rows`): tables and reports show these. `kedfem loads` (means,
lives of bearings) and `kedfem sweep --keep` need all rows and refuse others; `kedfem compare` compares at rows that are there, and says so; load cases find every step. Plots
and tables have the rows alone. A short analysis is estimated from its own rows, with `every` from another run of it. `kedfem kinematics` writes all rows.

Rows are double precision, with checksums. Fields for ParaView (`animation/`, `worst.vtu`, `envelope.vtu`, `fatigue.vtu`, `mesh_error.vtu`) are single precision, seven digits (points of the last three are double); frames of
`animation.pvd` are files of their own, each with its elements, compressed; `animation.vtkhdf` (`output.animation.vtkhdf = true`) stores the elements once.

`results.csv` (`output.csv = true`) has all channels with nine digits, `results.parquet` (`output.parquet = true`, needs
`pip install 'kedfem[data]'`) with all. From Python: [python.md](python.md).

The page is made by `python -m reference.results > docs/results.md`.
"""


def results_page() -> str:
    """The text of docs/results.md."""
    parts = [INTRODUCTION]
    for title, every in CHANNELS.items():
        lines = [f"## {title}\n", "| channel | columns | unit | frame | meaning and sign |", "|---|---|---|---|---|"]
        parts.append("\n".join([*lines, *map(_line, every)]) + "\n")
    return "\n".join(parts)


def _line(each: Entry) -> str:
    group, _, _ = each.path.rpartition("/")
    kinds, slash, rest = group.partition("/")
    first, *others = each.words()
    names = [f"{kind}{slash}{rest}/{first}" for kind in kinds.split("|")] + others
    dimension = columns_dimension(each.columns)
    columns = f"{', '.join(each.columns)} (`{dimension}`)" if dimension else ""
    units = ", ".join(dict.fromkeys(each.unit.split("|")))
    frame = {"either": "link or world", "": "–"}.get(each.frame, each.frame)
    return f"| {', '.join(f'`{name}`' for name in names)} | {columns} | {units} | {frame} | {each.text} |"


def entries(channel: Channel) -> list[Entry]:
    """What the reference says of a channel: of a run, of the rigid motion or of both; empty where it is unknown."""
    return [each for every in CHANNELS.values() for each in every if each.fits(channel)]


if __name__ == "__main__":
    sys.stdout.write(results_page())
