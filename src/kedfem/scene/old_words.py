"""Keys and values of scenes by their former names, with the present ones: messages about unknown words name these."""

KEYS = {
    "functions": "modes",
    "reduction": "reduction_tolerance",
    "port": "coupling",
    "turning_stiffness": "rotational_stiffness",
    "turning_damping": "rotational_damping",
    "spin": "angular_velocity",
    "turns": "revolutions",
    "last_turns": "last_revolutions",
    "steps_per_turn": "steps_per_revolution",
    "frames_per_turn": "frames_per_revolution",
    "levels": "extrapolation_levels",
    "exaggeration": "deformation_scale",
    "ignore": "defeature_size",
}
VALUES = {
    "nominal": "rigid-body",
    "following": "co-rotational",
    "literal": "monolithic",
    "averaged": "distributing",
    "stiff": "rigid",
}
