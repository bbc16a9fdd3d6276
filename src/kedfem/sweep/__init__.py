"""Sweeps: a scene run at many values of some of its keys, and the extremes of each run in one file."""

from kedfem.sweep.axes import Axis, axes_of
from kedfem.sweep.points import BaseScene, Row
from kedfem.sweep.run import SweepOptions, SweepResult, sweep, sweep_folder
