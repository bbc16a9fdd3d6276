"""What goes wrong, and where: the errors that a user of kedfem can meet."""


class KedfemError(Exception):
    """Base of all errors that kedfem raises on purpose; its text is written for the user."""


class SceneError(KedfemError):
    """The scene cannot be accepted.

    Parameters
    ----------
    faults
        One line per fault: ``where: what was wanted, what was got``.
    """

    def __init__(self, faults: list[str] | str) -> None:
        self.faults = [faults] if isinstance(faults, str) else list(faults)
        super().__init__("\n".join(self.faults))


class MeshError(KedfemError):
    """A link cannot be meshed, or its mesh is not good enough."""


class MotionError(KedfemError):
    """The linkage cannot be assembled, locks, or moves freely without a drive."""


class SolveError(KedfemError):
    """The elastic solution cannot start or go on."""


class OutputError(KedfemError):
    """Results cannot be written or read."""


class PictureError(OutputError):
    """A picture cannot be drawn; the results are what they are without it."""
