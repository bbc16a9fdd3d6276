"""`kedfem frequencies`: natural frequencies of frozen linkages, and of single links."""

from kedfem.frequencies.campbell import Campbell, Crossing, crossed
from kedfem.frequencies.linkage import Frequencies, Wanted, frequencies, frequencies_folder
from kedfem.frequencies.part import Part, PartFrequencies, link_of_scene, part_frequencies, part_from_file
