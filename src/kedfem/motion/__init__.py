"""Rigid motion of the linkage: joints as rows, continuation along the drive, accelerations at any times."""
