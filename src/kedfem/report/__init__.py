"""A run as one HTML file that a browser opens, or as one glTF file that 3-D viewers open."""

from kedfem.report.gltf import Mechanism, write_gltf
from kedfem.report.page import Report, require_report, write_report
