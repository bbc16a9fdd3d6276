"""Summary tables of what the commands find, for the terminal."""

from kedfem.output.words import moment
from kedfem.report.assembly import assembly_tables
from kedfem.report.check import check_tables
from kedfem.report.frequencies import frequencies_tables, part_tables
from kedfem.report.kinematics import kinematics_tables
from kedfem.report.mesh import mesh_tables
from kedfem.report.run import run_tables
from kedfem.report.sizes import size_line
from kedfem.report.study import study_tables
from kedfem.report.sweep import sweep_tables

__all__ = [
    "assembly_tables",
    "check_tables",
    "frequencies_tables",
    "kinematics_tables",
    "mesh_tables",
    "moment",
    "part_tables",
    "run_tables",
    "size_line",
    "study_tables",
    "sweep_tables",
]
