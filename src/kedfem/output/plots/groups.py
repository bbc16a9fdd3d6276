"""The division of channels into pictures, panels and curves."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.results import Channel, Results
from kedfem.results.channels import XYZ
from kedfem.results.records import rounding

Curves = Mapping[str, Float[np.ndarray, " n"]]
SEVERAL = ("drive", "joints", "motors", "springs", "limits", "gears")  # first parts of names that are compared
CURVES = 9  # most curves of a panel, for which its legend has room
SIGNED = {"position", "travel"}  # vectors that are drawn without magnitude
ALONE = 1.05  # ratio to the largest component up to which a magnitude is not drawn
FAINT = 1e-4  # of the largest curve of its kind: a smaller curve is only named in the legend
ENERGY = "energy/"
RIGID = "rigid_"  # first part of the last name of a channel of rigid links
STIFF = ", rigid"  # ending of the name of a curve of rigid links, which is dashed in the colour of the elastic one
MOTIONS = {
    "motion": ("position", "velocity", "acceleration"),
    "rotation": ("rotation", "angular_velocity", "angular_acceleration"),
}
"""Channels of one object that are panels of one picture."""

ALL = {"position": "position, velocity and acceleration", "rotation": "rotation and its rates"}
"""Title of such a picture, by its first channel."""

COORDINATES = {"angle": "Rotations of the joints", "travel": "Travels of the joints"}


@dataclass(frozen=True, slots=True)
class Panel:
    """Curves on one pair of axes.

    limits : ends of the scale if other panels share it; else None
    """

    quantity: str
    unit: str
    curves: Curves
    limits: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture.

    name : name of its file
    channel : the channel of a picture with a single one
    panels : from top to bottom
    together : channels of several objects that it compares; each also has a picture of its own
    """

    name: str
    title: str
    channel: Channel | None
    panels: list[Panel]
    together: tuple[str, ...] = ()

    @property
    def group(self) -> str:
        """Common prefix of the names of its channels."""
        name = self.channel.name if self.channel else self.name.replace("-", "/")
        return (self.together or (name,))[0].split("/")[0]


def pictures(results: Results) -> Iterator[Picture]:
    """All pictures of a results file."""
    channels, least = results.channels, rounding(results)
    grouped: set[str] = set()
    for prefix in dict.fromkeys(name.rpartition("/")[0] for name in channels):
        for what, kinds in MOTIONS.items():
            names = [f"{prefix}/{kind}" for kind in kinds if f"{prefix}/{kind}" in channels]
            if len(names) > 1:
                grouped |= set(names)
                every = [channels[name] for name in names]
                if all(largest(values) <= least.get(channel.unit, 0.0) for channel, values in every):
                    continue  # a slide whose rotation is rounding
                panels = [panel for each in every for panel in _single(*each)]
                yield Picture(_file(f"{prefix}/{what}"), _shared(every[0][0], kinds[0]), None, panels)
    for kind, title in COORDINATES.items():
        curves = _of_joints(results, f"/{kind}")
        if len(curves) > 1:
            grouped |= {f"joints/{name}/{kind}" for name in curves}
            unit = channels[f"joints/{next(iter(curves))}/{kind}"][0].unit
            yield Picture(f"joint_{kind}s", title, None, [readable(kind, unit, curves)])
    beside = _side_by_side(results, grouped)
    energies = _energies(results)
    for name, (channel, values) in channels.items():
        yield from beside.get(name, ())
        if name in grouped or (energies and name.startswith(ENERGY)):
            continue
        prefix, _, what = name.rpartition("/")
        elastic, rigid = f"{prefix}/{what.removeprefix(RIGID)}", f"{prefix}/{RIGID}{what}"
        if what.startswith(RIGID) and elastic in channels:
            continue  # drawn with the elastic one
        both = rigid in channels
        panels = _paired(channel, values, *channels[rigid]) if both else _single(channel, values)
        yield Picture(_file(name), channel.description or name, channel, panels)
    if energies:
        title = "Energies of all links, and the residual"
        yield Picture("energies", title, None, [Panel("energy", "J", energies)])


def _side_by_side(results: Results, others: set[str]) -> dict[str, list[Picture]]:
    """Pictures of one quantity of several joints, drives, …, by their first channel; of vectors the magnitudes.

    More than CURVES joints have a picture for each kind of joint; faint ones are named in the first.
    """
    kinds = {name: each["kind"] for name, each in json.loads(results.scene_json).get("joints", {}).items()}
    least, families = rounding(results), dict[tuple[str, str, str], dict[str, list[str]]]()
    for path, (channel, _) in results.channels.items():
        first, *name, what = path.split("/")
        if first in SEVERAL and name and path not in others:
            family = families.setdefault((first, what.removeprefix(RIGID), channel.unit), {})
            family.setdefault("/".join(name), []).append(path)
    out: dict[str, list[Picture]] = {}
    for (first, what, unit), family in families.items():
        every = {name: max(largest(results.channels[x][1]) for x in paths) for name, paths in family.items()}
        peaks = {name: peak for name, peak in every.items() if peak > least[unit]}
        seen = [name for name in peaks if peaks[name] > FAINT * max(peaks.values())]
        sets = {"": seen}
        if first == "joints" and len(seen) > CURVES and len({kinds.get(x) for x in seen}) > 1:
            sets = {kind: [x for x in seen if kinds[x] == kind] for kind in map(kinds.__getitem__, seen)}
        for k, (kind, names) in enumerate(sets.items()):
            shown = [*names, *(x for x in peaks if k == 0 and x not in seen)]
            if len(shown) > 1:
                made = _beside(results, (first, what, unit, kind), {name: family[name] for name in shown})
                out.setdefault(next(iter(family.values()))[0], []).append(made)
    return out


def _beside(results: Results, key: tuple[str, str, str, str], family: Mapping[str, list[str]]) -> Picture:
    first, what, unit, kind = key
    paths = tuple(path for every in family.values() for path in every)
    vector = any(results.channels[path][1].shape[1] > 1 for path in paths)
    stiff = all(path.rsplit("/", 1)[-1].startswith(RIGID) for path in paths)
    curves = {}
    for name, path in ((name, path) for name, every in family.items() for path in every):
        values = results.channels[path][1]
        rigid = path.rsplit("/", 1)[-1].startswith(RIGID) and not stiff
        curves[f"{name}{STIFF * rigid}"] = np.linalg.norm(values, axis=1) if vector else values[:, 0]
    of, words = first.removesuffix("s"), what.replace("_", " ")
    several = f"{of} {words.removesuffix('y')}{'ies' if words.endswith('y') else 's'}"
    title = f"magnitude of the {several}" if vector else several
    title = f"{title[0].upper()}{title[1:]}{' with all links rigid' * stiff}{f': {kind}' if kind else ''}"
    file = several.replace(" ", "_") + (f"-{kind}" if kind else "")
    return Picture(file, title, None, [readable(words, unit, curves)], paths)


def largest(values: Float[np.ndarray, "..."]) -> float:
    """The largest finite magnitude."""
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def readable(quantity: str, unit: str, curves: Curves) -> Panel:
    """A panel with angles in degrees."""
    if unit != "rad":
        return Panel(quantity, unit, curves)
    return Panel(quantity, "°", {name: np.degrees(y) for name, y in curves.items()})


def _file(name: str) -> str:
    return name.replace("/", "-")


def _shared(channel: Channel, kind: str) -> str:
    """Common description, from that of the first channel: ``motion of the joint …`` from ``position of the joint …``."""
    title = channel.description
    for beginning in ("rotation vector", "turn", kind):
        if title.startswith(beginning):
            return ALL[kind] + title.removeprefix(beginning)
    return title


def _single(channel: Channel, values: Float[np.ndarray, "n c"]) -> list[Panel]:
    """The picture of a single channel."""
    curves = dict(zip(channel.columns, values.T, strict=True))
    quantity = channel.name.rsplit("/", 1)[-1].replace("_", " ")
    if channel.columns == XYZ:
        size = np.linalg.norm(values, axis=1)
        # the distance from the origin has no meaning, and a travel has a sign
        if quantity not in SIGNED and largest(size) > ALONE * largest(values):
            curves["magnitude"] = size
        return [readable(quantity, channel.unit, curves)]
    if "von_mises" in curves:
        equivalent = {"von Mises": curves.pop("von_mises")}
        return [Panel(quantity, channel.unit, curves), Panel("von Mises stress", channel.unit, equivalent)]
    return [readable(quantity, channel.unit, curves)]


def _paired(
    channel: Channel, values: Float[np.ndarray, "n c"], rigid: Channel, there: Float[np.ndarray, "n r"]
) -> list[Panel]:
    """Panels of a channel and its counterpart of rigid links; of vectors the magnitudes, then the components."""
    quantity = channel.name.rsplit("/", 1)[-1]
    both = dict(zip(channel.columns, values.T, strict=True))
    both |= {f"{name}{STIFF}": y for name, y in zip(rigid.columns, there.T, strict=True)}
    if channel.columns != XYZ:
        return [Panel(quantity, channel.unit, both)]
    sizes = (np.linalg.norm(x, axis=1) for x in (values, there))
    of_both = dict(zip(("magnitude", f"magnitude{STIFF}"), sizes, strict=True))
    return [Panel(quantity, channel.unit, of_both), Panel(quantity, channel.unit, both)]


def _energies(results: Results) -> Curves:
    """All energies by name, if there are several."""
    found = {
        f"{name.removeprefix(ENERGY)}{'' if len(channel.columns) == 1 else f' ({column})'}": curve
        for name, (channel, values) in results.channels.items() if name.startswith(ENERGY)
        for column, curve in zip(channel.columns, values.T, strict=True)
    }  # fmt: skip
    return found if len(found) > 1 else {}


def _of_joints(results: Results, ending: str) -> Curves:
    """The only column of each joint's channel of that kind."""
    every = results.channels.items()
    found = {name: x for name, (_, x) in every if x.shape[1] == 1 and name.endswith(ending)}
    joints = {name: x[:, 0] for name, x in found.items() if name.startswith("joints/")}
    return {name.removeprefix("joints/").removesuffix(ending): x for name, x in joints.items()}
