"""The reference solver: a system with all its unknowns, to check the compiled steps; it shares none of their code."""
