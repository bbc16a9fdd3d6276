"""Paths of linkages along their drives."""

from kedfem.motion.path.following import MOST_TURNS, path
from kedfem.motion.path.record import Path, aimed, place_on, predicted
