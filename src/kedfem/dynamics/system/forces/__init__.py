"""Forces of a system: those of constraints and laws, efforts of supports and drives, stiffening, loads that rotate."""
