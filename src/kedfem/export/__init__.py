"""For other programs: an elastic link as matrices, the mechanism as a linear system, rigid motion as a table."""

from kedfem.export.files import require_ending
from kedfem.export.linear_system import StateSpace, read_state_space, state_space, write_state_space
from kedfem.export.link import ExportedLink, exported_link, read_link, write_link
from kedfem.export.motion import export_motion
