"""One system and one time step for all mechanisms: bodies, constraints and force laws, integrated by one method."""
