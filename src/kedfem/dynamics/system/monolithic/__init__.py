"""The monolithic solver: all unknowns of a system in one matrix; it checks the condensed steps with code of its own."""
