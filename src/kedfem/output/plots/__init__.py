"""Curves over the drive angle, as PNG and for pages."""

from kedfem.output.plots.files import remove_plots, write_plots
