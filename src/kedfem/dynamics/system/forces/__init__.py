"""Forces of a system: what constraints and laws exert, efforts of supports and drives, stiffening and turning loads."""
