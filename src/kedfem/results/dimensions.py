"""Dimensions and CF texts of a results file, by which xarray, Panoply and other readers of netCDF 4 know its channels.

Dimensions are HDF5's dimension scales in the root group: `time`, and one for the columns of vectors and of tensors, with
their names. kedfem itself reads neither scales nor the references to them, as HDF5 has no checksums for these.

Source: netCDF-4 file format; CF Metadata Conventions 1.11, sections 2.7 (groups), 3.1 (units), 3.2 (long_name),
5 (coordinates).
"""

from collections.abc import Sequence
from typing import Any

from kedfem.results.channels import STRESS, TIME, XYZ, Channel
from kedfem.results.layout import write_facts, write_texts

CONVENTIONS = "CF-1.11"
NAMED = {XYZ: "xyz", XYZ[:2]: "xy", STRESS: "stress_component"}


def columns_dimension(columns: Sequence[str]) -> str:
    """Name of the dimension of a channel's columns; "" of a single column, which has none.

    >>> columns_dimension(("x", "y", "z")), columns_dimension(("loads", "supports")), columns_dimension(("torque",))
    ('xyz', 'loads_supports', '')
    """
    if len(columns) < 2:
        return ""
    return NAMED.get(tuple(columns), "_".join(columns))


def cf_attributes(channel: Channel) -> dict[str, str]:
    """A channel's unit, which is 1 in CF if there is none, and its description."""
    return {"units": channel.unit or "1", "long_name": channel.description}


def lay_dimensions(file: Any, drive: Channel, channels: Sequence[Channel]) -> None:
    """Attach dimensions, units and descriptions to the rows and columns of all existing channels."""
    write_facts(file, {"Conventions": CONVENTIONS, "coordinates": drive.name})
    file[TIME.name].make_scale(TIME.name)
    for channel in channels:
        name = columns_dimension(channel.columns)
        if name and name not in file:
            write_texts(file, name, channel.columns)
            write_facts(file[name], {"long_name": f"components {', '.join(channel.columns)}"})
            file[name].make_scale(name)
    for channel in (TIME, drive, *channels):
        rows = file[channel.name]
        write_facts(rows, cf_attributes(channel) | ({"coordinates": drive.name} if channel.columns else {}))
        if channel is not TIME:
            rows.dims[0].attach_scale(file[TIME.name])
        if name := columns_dimension(channel.columns):
            rows.dims[1].attach_scale(file[name])
