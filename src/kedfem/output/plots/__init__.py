"""Plots of curves over the drive angle, as PNG files and as SVG for pages."""

from kedfem.output.plots.files import remove_plots, write_plots
