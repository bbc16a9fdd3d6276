"""Output: ParaView animation, plots, a picture, and files for other programs.

What writes a file raises an OutputError where it cannot be written; the old one is then left as it was.
"""
