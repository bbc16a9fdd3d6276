"""The march: generalised-α, its start, its steps, levels of steps side by side, the monolithic step, what it costs."""
