"""Output: ParaView animation, plots, a picture, and files for other programs.

A function that cannot write its file raises an OutputError and leaves an older file unchanged.
"""
