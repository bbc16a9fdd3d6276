"""Summary tables of what the commands find, for the terminal."""

from kedfem.output.words import moment
from kedfem.tables.check import check_tables, forecast
from kedfem.tables.mechanism import case_tables, frequencies_tables, kinematics_tables, loads_tables, part_tables
from kedfem.tables.model import assembly_table, mesh_tables, size_line
from kedfem.tables.run import run_tables
from kedfem.tables.several import compare_tables, study_tables, sweep_tables
