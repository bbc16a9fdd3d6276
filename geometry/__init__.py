"""Real-looking parts in millimetres: a module that draws each, and the STEP file that a CAD program would give."""

PARTS = (
    "ball_ended_rod",
    "bell_crank",
    "bent_rocker",
    "clevis",
    "connecting_rod",
    "crank",
    "piston",
    "slider",
    "slotted_link",
    "wishbone",
)
