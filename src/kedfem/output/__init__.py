"""Output: ParaView animation, plots and a picture."""

from kedfem.output.picture import write_picture
from kedfem.output.plots import remove_plots, write_plots
from kedfem.output.vtu import AnimationWriter, LinkField, remove_animation

__all__ = ["AnimationWriter", "LinkField", "remove_animation", "remove_plots", "write_picture", "write_plots"]
