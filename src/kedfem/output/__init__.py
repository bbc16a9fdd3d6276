"""Output: ParaView animation, plots, a picture, and files for other programs."""
