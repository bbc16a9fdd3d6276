"""Paths of linkages along their drives."""

from kedfem.motion.path.following import MOST_TURNS, path
from kedfem.motion.path.record import Path, place_on, predicted, target_on_path
