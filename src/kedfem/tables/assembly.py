"""How links that were drawn apart have been closed."""

import numpy as np
from rich.table import Table

from kedfem.motion.assembly import Assembly
from kedfem.output.words import with_prefix


def assembly_tables(assembly: Assembly) -> list[Table]:
    """Misfits of joints, and the motions of links that close them; nothing where none were drawn apart."""
    if not assembly.misfits:
        return []
    table = Table(title="Assembly", show_header=False)
    for name, misfit in sorted(assembly.misfits.items(), key=lambda each: -each[1]):
        table.add_row(f"joint {name}", f"drawn {with_prefix(misfit, 'm')} apart")
    for name, (way, turn) in assembly.moved.items():
        table.add_row(f"link {name}", f"moved {with_prefix(way, 'm')}, turned {np.degrees(turn):.3g}°")
    return [table]
