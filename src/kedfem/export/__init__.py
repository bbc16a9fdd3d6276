"""For other programs: an elastic link as matrices, the mechanism as a linear system, rigid motion as a table."""

from kedfem.export.files import require_ending
from kedfem.export.link import ExportedLink, exported_link, read_link, write_link
from kedfem.export.motion import export_motion
from kedfem.export.state_space import StateSpace, read_state_space, state_space, write_state_space

__all__ = [
    "ExportedLink",
    "StateSpace",
    "export_motion",
    "exported_link",
    "read_link",
    "read_state_space",
    "require_ending",
    "state_space",
    "write_link",
    "write_state_space",
]
