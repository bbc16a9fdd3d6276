"""`kedfem frequencies`: natural frequencies of frozen linkages, and of single links."""

from kedfem.frequencies.linkage import Crossing, Frequencies, Wanted, crossed, frequencies, frequencies_folder
from kedfem.frequencies.part import Part, PartFrequencies, link_of_scene, part_frequencies, part_from_file

__all__ = [
    "Crossing",
    "Frequencies",
    "Part",
    "PartFrequencies",
    "Wanted",
    "crossed",
    "frequencies",
    "frequencies_folder",
    "link_of_scene",
    "part_frequencies",
    "part_from_file",
]
