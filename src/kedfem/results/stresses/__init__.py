"""The highest stresses of a run, where they are and what they mean there."""
