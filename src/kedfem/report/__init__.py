"""A run as one HTML file that a browser opens."""

from kedfem.report.page import Report, require_report, write_report

__all__ = ["Report", "require_report", "write_report"]
