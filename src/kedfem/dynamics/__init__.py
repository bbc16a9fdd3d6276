"""Dynamics: joints, loads, generalised-α steps (condensed and monolithic), initial states."""
