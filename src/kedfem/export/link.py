"""An elastic link as matrices: mass, stiffness, modes, ports."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kedfem.accuracy.plan import plan_for
from kedfem.accuracy.reduction import prepared
from kedfem.arrays import Bool, Float, Int
from kedfem.dynamics.joints.places import surface_of
from kedfem.dynamics.matrices.dense import as_dense
from kedfem.dynamics.model import segments
from kedfem.errors import Fault, MeshError, SceneError
from kedfem.export.files import read_record, write_record
from kedfem.links.record import Link
from kedfem.links.reduced import rigid_modes
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, port_weights, surface_couples
from kedfem.motion.assembly import assembled
from kedfem.results.modelled import element_words
from kedfem.scene import Scene, corotational, rayleigh, require_elastic

MOST = 6000  # unknowns up to which dense matrices are written: 300 MB each
FORMAT = "kedfem link 1"


@dataclass(frozen=True, slots=True)
class ExportedLink:
    """A link alone, in its frame, the world's axes in its reference position: M q'' + (α M + β K) q' + K q = Tᵀ F + Θᵀ N.

    name, model : of the link; what it was made from, in words
    mass, stiffness : (k, k) M [kg], K [N/m]
    damping : (2,) α [1/s], β [s]
    ports : (p,) names of its joints
    places : (p, 3) of the joints in the reference position [m]
    translation : (p, 3, k) T: displacement of each port [-]
    rotation : (p, 3, k) Θ: small rotation of each port [1/m]; zero where `turns` is false
    turns : (p, 3) whether the port's rotation about x, y, z is known: not of a single node, of planar links about z alone
    rigid : (k, r) small motions without strain: 1 m along x, y, z, 1 rad about x, y, z through the origin; of planar
        links along x, y and about z
    nodes : (n, 3) of the mesh in the reference position [m]; none of beams
    modes : (n, s) node a moves by Σ_m modes[a, m] q[d m : d m + d], d = k / s directions
    cells : (e, m) elements, nodes in VTK's order
    """

    name: str
    model: str
    mass: Float[np.ndarray, "k k"]
    stiffness: Float[np.ndarray, "k k"]
    damping: Float[np.ndarray, "2"]
    ports: tuple[str, ...]
    places: Float[np.ndarray, "p 3"]
    translation: Float[np.ndarray, "p 3 k"]
    rotation: Float[np.ndarray, "p 3 k"]
    turns: Bool[np.ndarray, "p 3"]
    rigid: Float[np.ndarray, "k r"]
    nodes: Float[np.ndarray, "n 3"]
    modes: Float[np.ndarray, "n s"]
    cells: Int[np.ndarray, "e m"]


def exported_link(scene: Scene, name: str, stage: Callable[[str], None] = lambda name: None) -> ExportedLink:
    """The matrices that a run of a scene has of one link, with what is attached to it.

    Raises
    ------
    KedfemError
        There is no such elastic link, its frames are co-rotational, it has too many unknowns, or cannot be meshed.
    """
    require_elastic(scene.links, name)
    scene, _ = assembled(scene)
    plan = plan_for(scene, stage)
    scene = plan.scene if plan else scene
    if corotational(scene):
        wanted = (
            "must be rigid-body for the matrices of a link, got co-rotational ones, whose stiffness goes with many "
            'frames: take `frames = "rigid-body"`'
        )
        raise SceneError([Fault(("analysis", "frames"), wanted)])
    ready, _ = prepared(scene, stage, known=plan.links if plan else {})
    found = segments(ready.model)
    if name not in found:
        raise SceneError(f"--link: must be an elastic link, got '{name}', which moves as a rigid body")
    (link,) = found[name]
    if link.unknowns > MOST:
        wanted = f"must have {MOST:,} unknowns at most, as its matrices are dense, got {link.unknowns:,}"
        raise SceneError([Fault(("links", name), f'{wanted}: take `reduction = "modal"`')])
    return _exported(scene, name, link)


def _exported(scene: Scene, name: str, link: Link) -> ExportedLink:
    joints = {key: joint for key, joint in scene.joints.items() if name in joint.links}
    k = link.unknowns
    translation, rotation = np.zeros((2, len(joints), 3, k))
    turns = np.zeros((len(joints), 3), bool)
    for p, (key, joint) in enumerate(joints.items()):
        surface = surface_of(scene, key, link)
        translation[p] = _translation(link, surface, np.asarray(joint.at))
        turns[p], rotation[p] = _rotation(link, surface)
    shown, meshed = link.full or link, link.meshed
    modes = link.Q if link.Q is not None else np.eye(link.n)
    places = np.array([joint.at for joint in joints.values()], float).reshape(-1, 3)
    return ExportedLink(
        name, element_words([link]), _mass(link), as_dense(link.K0), np.array(rayleigh(scene.damping)), tuple(joints),
        places, translation, rotation, turns, _rigid(link), shown.X if meshed else np.zeros((0, 3)),
        modes if meshed else np.zeros((0, link.n)), shown.cells if meshed else np.zeros((0, 0), int),
    )  # fmt: skip


def _mass(link: Link) -> Float[np.ndarray, "k k"]:
    """The scalar mass matrices of all components, dof d·function + component."""
    d, out = link.d, np.zeros((link.unknowns, link.unknowns))
    for c, m in enumerate(link.mass):
        out[c::d, c::d] = as_dense(m)
    return out


def _rigid(link: Link) -> Float[np.ndarray, "k r"]:
    """Its motions without strain, turns in the order x, y, z."""
    found = rigid_modes(link)
    return found if link.planar else found[:, [0, 1, 2, 4, 5, 3]]


def _translation(link: Link, surface: CouplingSurface, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 k"]:
    """Of the affine field of a coupling surface at a joint's place."""
    weights = port_weights(surface, at[None])[0]
    out = np.zeros((3, link.n, link.d))
    for c in range(2 if link.planar else 3):
        out[c, :, c] = weights
    return out.reshape(3, -1)


def _rotation(link: Link, surface: CouplingSurface) -> tuple[Bool[np.ndarray, "3"], Float[np.ndarray, "3 k"]]:
    """Of the affine field of a coupling surface, of a planar beam its section's; about which axes it is known."""
    out = np.zeros((3, link.n, link.d))
    if link.kind == "beam":
        out[2, :, 2] = surface.fit[0]
        return np.array([False, False, True]), out.reshape(3, -1)
    try:
        out[:] = surface_couples(link, surface, "joint")
    except MeshError:
        return np.zeros(3, bool), np.zeros((3, link.unknowns))
    return np.array([not link.planar, not link.planar, True]), out.reshape(3, -1)


def write_link(link: ExportedLink, path: Path) -> None:
    """Write the matrices as `.npz` of NumPy or `.mat` of MATLAB, version 5.

    An OutputError says that the file has another ending, or cannot be written.
    """
    write_record(link, path, FORMAT)


def read_link(path: Path) -> ExportedLink:
    """The matrices of a file that :func:`write_link` wrote; OutputError if it is not such a file."""
    return read_record(path, ExportedLink, FORMAT, "a link")
