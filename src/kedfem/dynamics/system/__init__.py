"""One system, one step: bodies, constraints and force laws of a mechanism, marched by one method whatever they are."""
