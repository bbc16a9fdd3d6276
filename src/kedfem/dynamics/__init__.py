"""Dynamics: joints as shared points, loads, generalised-α steps (condensed and monolithic), initial states."""
