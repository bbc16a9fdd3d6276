"""Which channels are drawn in one picture, and as which curves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.results import Channel, Results
from kedfem.results.records import XYZ

Curves = Mapping[str, Float[np.ndarray, " n"]]
Panel = tuple[str, str, Curves]  # quantity, unit, curves
ENERGY = "energy/"
RIGID = "rigid_"  # how the name of a channel begins that has the same of rigid links
# what is added to the name of a curve of rigid links; it is drawn dashed, in the colour of the elastic one
STIFF = ", rigid"
MOTIONS = {
    "motion": ("position", "velocity", "acceleration"),
    "rotation": ("rotation", "angular_velocity", "angular_acceleration"),
}
"""Channels of one thing that are drawn above each other."""

COORDINATES = {"angle": "Turns of the joints", "travel": "Travels of the joints"}


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture: name of its file, title, its channel if there is one, panels from top to bottom."""

    name: str
    title: str
    channel: Channel | None
    panels: list[Panel]


def pictures(results: Results) -> Iterator[Picture]:
    """All pictures of a results file."""
    channels = results.channels
    grouped: set[str] = set()
    for prefix in dict.fromkeys(name.rpartition("/")[0] for name in channels):
        for what, kinds in MOTIONS.items():
            names = [f"{prefix}/{kind}" for kind in kinds if f"{prefix}/{kind}" in channels]
            if len(names) > 1:
                grouped |= set(names)
                yield Picture(_file(f"{prefix}/{what}"), _shared(channels[names[0]][0], kinds[0]), None,
                              [panel for name in names for panel in _single(*channels[name])])  # fmt: skip
    for kind, title in COORDINATES.items():
        curves = _of_joints(results, f"/{kind}")
        if len(curves) > 1:
            grouped |= {f"joints/{name}/{kind}" for name in curves}
            unit = channels[f"joints/{next(iter(curves))}/{kind}"][0].unit
            yield Picture(f"joint_{kind}s", title, None, [readable(kind, unit, curves)])
    energies = _energies(results)
    for name, (channel, values) in channels.items():
        if name in grouped or (energies and name.startswith(ENERGY)):
            continue
        prefix, _, what = name.rpartition("/")
        elastic, rigid = f"{prefix}/{what.removeprefix(RIGID)}", f"{prefix}/{RIGID}{what}"
        if what.startswith(RIGID) and elastic in channels:
            continue  # beside that
        both = rigid in channels
        panels = _paired(channel, values, *channels[rigid]) if both else _single(channel, values)
        yield Picture(_file(name), channel.description or name, channel, panels)
    if energies:
        title = "Energies of all links, and the residual"
        yield Picture("energies", title, None, [("energy", "J", energies)])
    forces = _joint_forces(results)
    if len(forces) > 1:
        rigid = "" if _values(results, "/force") else " were all links rigid"
        yield Picture("joint_forces", f"Magnitude of the joint forces{rigid}", None, [("force", "N", forces)])


def readable(quantity: str, unit: str, curves: Curves) -> Panel:
    """A panel with angles in degrees."""
    if unit != "rad":
        return quantity, unit, curves
    return quantity, "°", {name: np.degrees(y) for name, y in curves.items()}


def _file(name: str) -> str:
    return name.replace("/", "-")


def _shared(channel: Channel, kind: str) -> str:
    """What a description of the first says of all: ``position of the joint …`` → ``motion of the joint …``."""
    words = {"position": "position, velocity and acceleration", "rotation": "rotation and its rates"}
    title = channel.description
    for beginning in ("rotation vector", "turn", kind):
        if title.startswith(beginning):
            return words[kind] + title.removeprefix(beginning)
    return title


def _single(channel: Channel, values: Float[np.ndarray, "n c"]) -> list[Panel]:
    """What is drawn of a channel on its own."""
    curves = dict(zip(channel.columns, values.T, strict=True))
    quantity = channel.name.rsplit("/", 1)[-1].replace("_", " ")
    if channel.columns == XYZ:
        if quantity != "position":  # how far off the origin means nothing
            curves["magnitude"] = np.linalg.norm(values, axis=1)
        return [readable(quantity, channel.unit, curves)]
    if "von_mises" in curves:
        equivalent = {"von Mises": curves.pop("von_mises")}
        return [(quantity, channel.unit, curves), ("von Mises stress", channel.unit, equivalent)]
    return [readable(quantity, channel.unit, curves)]


def _paired(
    channel: Channel, values: Float[np.ndarray, "n c"], rigid: Channel, there: Float[np.ndarray, "n r"]
) -> list[Panel]:
    """A channel with its counterpart of rigid links; of a vector the magnitudes, and below the components."""
    quantity = channel.name.rsplit("/", 1)[-1]
    both = dict(zip(channel.columns, values.T, strict=True))
    both |= {f"{name}{STIFF}": y for name, y in zip(rigid.columns, there.T, strict=True)}
    if channel.columns != XYZ:
        return [(quantity, channel.unit, both)]
    sizes = (np.linalg.norm(x, axis=1) for x in (values, there))
    of_both = dict(zip(("magnitude", f"magnitude{STIFF}"), sizes, strict=True))
    return [(quantity, channel.unit, of_both), (quantity, channel.unit, both)]


def _energies(results: Results) -> Curves:
    """All energies by name, if there are several."""
    found = {
        f"{name.removeprefix(ENERGY)}{'' if len(channel.columns) == 1 else f' ({column})'}": curve
        for name, (channel, values) in results.channels.items() if name.startswith(ENERGY)
        for column, curve in zip(channel.columns, values.T, strict=True)
    }  # fmt: skip
    return found if len(found) > 1 else {}


def _joint_forces(results: Results) -> Curves:
    """Joint → magnitude of its force [N], elastic and rigid."""
    if not _values(results, "/force"):
        return {x: np.linalg.norm(y, axis=1) for x, y in _values(results, f"/{RIGID}force").items()}
    return {
        f"{name}{added}": np.linalg.norm(values, axis=1)
        for ending, added in (("/force", ""), (f"/{RIGID}force", STIFF))
        for name, values in _values(results, ending).items()
    }


def _of_joints(results: Results, ending: str) -> Curves:
    """Joint → the only column of its channel of that kind."""
    return {name: values[:, 0] for name, values in _values(results, ending).items() if values.shape[1] == 1}


def _values(results: Results, ending: str) -> dict[str, Float[np.ndarray, "n c"]]:
    return {
        name.removeprefix("joints/").removesuffix(ending): values
        for name, (_, values) in results.channels.items()
        if name.startswith("joints/") and name.endswith(ending)
    }
