"""Reports of a run: one HTML file for a browser, or one glTF file for 3-D viewers."""

from kedfem.report.gltf import Mechanism, write_gltf
from kedfem.report.page import Report, require_report, write_report
