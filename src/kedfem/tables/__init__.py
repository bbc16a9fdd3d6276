"""Summary tables of what the commands find, for the terminal."""

from kedfem.output.words import moment
from kedfem.tables.assembly import assembly_tables
from kedfem.tables.check import check_tables
from kedfem.tables.frequencies import frequencies_tables, part_tables
from kedfem.tables.kinematics import kinematics_tables
from kedfem.tables.mesh import mesh_tables
from kedfem.tables.run import run_tables
from kedfem.tables.sizes import size_line
from kedfem.tables.study import study_tables
from kedfem.tables.sweep import sweep_tables
