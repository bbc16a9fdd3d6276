"""Rigid motion of the linkage: constraint equations of joints, continuation along the drive, accelerations."""
