"""Contents of animation frames: links, rigid links and joints, with values at their points."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int

# names of arrays, with their units
STRESS, VON_MISES, DISPLACEMENT = "stress [Pa]", "von Mises [Pa]", "displacement [m]"
LARGEST, SMALLEST = "largest principal stress [Pa]", "smallest principal stress [Pa]"
VELOCITY, ACCELERATION = "velocity [m/s]", "acceleration [m/s^2]"
FORCE, MOMENT = "force [N]", "moment [N m]"
DRIVE_FORCE, DRIVE_TORQUE = "drive force [N]", "drive torque [N m]"
LINK, BODY, SPRING = "link ", "body ", "spring "  # first words of the names of blocks
JOINTS = "joints"  # name of the block of points with the forces of joints


@dataclass(frozen=True, slots=True)
class LinkField:
    """One link in one frame of the animation.

    name : the link's name
    cell_type : meshio's name: ``hexahedron27``, ``hexahedron20``, ``hexahedron``, ``line``, ``line3``
    cells : (e, k) node numbers in VTK's order [-]
    points : (n, 3) positions of the nodes in the picture: rigid-body motion plus the scaled elastic displacement [m]
    displacement : (n, 3) elastic displacement δ, world components, not scaled [m]
    stress : (n, 6) xx, yy, zz, xy, yz, zx in the world's axes [Pa]; nan for beams, which have only axial stress
    von_mises : (n,) [Pa]
    principal : (n, 2) smallest and largest principal stress [Pa]
    section : height and thickness [m] of a planar beam, which is a line, and whether they are diameters of an ellipse
    label : text beside an attached mass, which is a ball; empty for a link
    spring : whether it is a spring or damper instead of a link
    """

    name: str
    cell_type: str
    cells: Int[np.ndarray, "e k"]
    points: Float[np.ndarray, "n 3"]
    displacement: Float[np.ndarray, "n 3"]
    stress: Float[np.ndarray, "n 6"]
    von_mises: Float[np.ndarray, " n"]
    principal: Float[np.ndarray, "n 2"]
    section: tuple[float, float, bool] | None = None
    label: str = ""
    spring: bool = False

    def arrays(self) -> dict[str, np.ndarray]:
        """Values of each node, by names with units."""
        least, most = self.principal.T
        principal = {LARGEST: most, SMALLEST: least}
        return {DISPLACEMENT: self.displacement, VON_MISES: self.von_mises, STRESS: self.stress} | principal


@dataclass(frozen=True, slots=True)
class RigidField:
    """One rigid link in one frame of the animation.

    name, cell_type, cells, points : as of :class:`LinkField`; cells are surfaces, lines or a vertex
    velocity, acceleration : (n, 3) world components [m/s, m/s²]
    label, spring : as of :class:`LinkField`
    """

    name: str
    cell_type: str
    cells: Int[np.ndarray, "e k"]
    points: Float[np.ndarray, "n 3"]
    velocity: Float[np.ndarray, "n 3"]
    acceleration: Float[np.ndarray, "n 3"]
    label: str = ""
    spring: bool = False

    def arrays(self) -> dict[str, np.ndarray]:
        """Values of each node, by names with units."""
        return {VELOCITY: self.velocity, ACCELERATION: self.acceleration}


@dataclass(frozen=True, slots=True)
class JointField:
    """Forces of joints and drives in one frame, at points for arrows.

    names : names of the joints
    points : (n, 3) their positions in the rigid-body motion [m]
    vectors : (n, 3) vectors in world components, by names with units
    """

    names: tuple[str, ...]
    points: Float[np.ndarray, "n 3"]
    vectors: Mapping[str, Float[np.ndarray, "n 3"]]
    name: str = JOINTS
    cell_type: str = "vertex"

    @property
    def cells(self) -> Int[np.ndarray, "n 1"]:
        """Each point is a cell."""
        return np.arange(len(self.points))[:, None]

    def arrays(self) -> dict[str, np.ndarray]:
        """Values of each joint, by names with units."""
        return dict(self.vectors)


Block = LinkField | RigidField | JointField


def numbered(field: Block) -> str:
    """Name of the field that has a block's number in a file."""
    if isinstance(field, JointField):
        return field.name
    if field.spring:
        return f"{SPRING}{field.name}"
    return f"{BODY}{field.label}" if field.label else f"{LINK}{field.name}"
