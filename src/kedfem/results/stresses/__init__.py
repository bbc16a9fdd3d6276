"""The highest stresses of a run, their places, and whether they are singular there."""
