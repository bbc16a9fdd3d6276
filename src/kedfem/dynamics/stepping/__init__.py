"""Time integration: generalised-α, its start, its steps, extrapolation levels, and the forecast of its time."""
