"""Linkages at rest with their joints closed: forces of the assembled equations; constraints that repeat others."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.joints.constraint_matrices import ConstraintMatrices, constraint_matrices
from kedfem.dynamics.matrices.bordered import MANY, independent_rows
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.matrices.substructure import Substructure, factored
from kedfem.dynamics.rigid_body import forcings
from kedfem.errors import SolveError
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from
from tests.moving import turned
from tests.spatial_joints import BEAMS, SOLIDS

TURNS = {
    "z": np.eye(3), "x": np.eye(3)[[2, 0, 1]], "oblique": Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(),
}  # fmt: skip
Given = tuple[list[Substructure], list[np.ndarray], ConstraintMatrices, list[np.ndarray]]


def given(ready: Prepared, times: int = 3) -> Given:
    """A linkage at some times: links that are held, their orientations, constraints, P − M R0'' in link frames."""
    model, t = ready.model, np.linspace(0.0, 0.01, times)
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))
    parts = [factored(link, joint, 0.0, 1.0) for link, joint in zip(model.links, model.joints, strict=True)]
    forcing = forcings(model, motion)
    rows = constraint_matrices(model.rows, motion, model.interface_unknowns)
    return parts, [x.R for x in forcing], rows, [x.F @ x.R for x in forcing]


def assembled(parts: list[Substructure], R: list[np.ndarray], rows: ConstraintMatrices, loads: list[np.ndarray]) -> Any:
    """Forces at interface points at the first time: (H + Cᵀ κ C) z = f + Cᵀ m, C z = 0, dense and in extended precision:
    the travel of a slide has no stiffness but rounding of that of hubs."""
    k = parts[0].attachment.unknowns
    H, f, every = np.zeros((k, k), np.longdouble), np.zeros(k, np.longdouble), []
    for part, turn, load in zip(parts, R, loads, strict=True):
        joint, S = part.attachment, part.S.astype(np.longdouble)
        onto = np.zeros((len(joint.weights), joint.components, k), np.longdouble)
        onto.reshape(-1, k)[np.ix_(joint.keep, joint.columns)] = joint.B
        back = np.einsum("ba,pbk->pak", turn[0], onto).reshape(-1, k)[joint.keep]
        RB, v = np.zeros((len(S), k), np.longdouble), load[0].ravel() @ part.Y
        RB[: len(back)] = back
        H += RB.T @ S @ RB
        f += RB.T @ (S @ v)
        every.append((S, RB, v))
    C, rigid = rows.at(0).toarray(), np.isinf(rows.stiffness)
    H += (C[~rigid].T * rows.stiffness[~rigid]) @ C[~rigid]
    C = C[rigid & (np.abs(C).max(axis=1) > 0)]
    scale = 1 / np.sqrt(np.maximum(H.diagonal(), 1e-12 * H.diagonal().max()))
    C = C * scale / np.sqrt(np.sum((C * scale) ** 2, axis=1))[:, None]
    matrix = np.block([[H * np.outer(scale, scale), C.T], [C, np.zeros((len(C), len(C)))]])
    right, x = np.concatenate([scale * f, np.zeros(len(C))]), np.zeros(k + len(C), np.longdouble)
    inverse = np.linalg.pinv(matrix.astype(float), rcond=1e-15)
    for _ in range(4):  # what double precision leaves
        x += inverse @ (right - matrix @ x).astype(float)
    return [(S @ (RB @ (scale * x[:k]) - v)).astype(float) for S, RB, v in every]


@pytest.mark.parametrize(("kind", "turn"), [*product(BEAMS, TURNS), ("cylindrical, bores", "z")])
def test_forces_of_closed_joints_are_those_of_the_assembled_equations(kind: str, turn: str) -> None:
    """Of what constraints hold and bushings bear, whatever the direction; once more beside constraints twice as large."""
    made: dict[str, Callable[[], Any]] = BEAMS | SOLIDS
    parts, R, rows, loads = given(meshed(scene_from(turned(made[kind](), TURNS[turn]))))
    wanted, held = assembled(parts, R, rows, loads), np.isinf(rows.stiffness).sum()
    found = closed(parts, R, rows).forces(loads)
    width = np.diff(rows.row_at)
    twice = replace(
        rows, entries=np.concatenate([rows.entries, 2 * rows.entries], axis=1), columns=np.tile(rows.columns, 2),
        row_at=np.append(0, np.cumsum(np.tile(width, 2))), stiffness=np.tile(rows.stiffness, 2),
    )  # fmt: skip
    again = closed(parts, R, twice).forces(loads) if held == len(width) else found
    size, most = (max(np.abs(x).max() for x in every) for every in (wanted, found))
    for one, other, exact in zip(found, again, wanted, strict=True):
        # beside stiff hubs of beams in space, which cost six digits of sixteen
        assert_allclose(one[0], exact, rtol=0, atol=1e-7 * size)
        assert_allclose(other, one, rtol=0, atol=1e-7 * most)


def test_a_linkage_whose_joints_let_links_move_freely_is_refused() -> None:
    parts, R, rows, loads = given(meshed(scene_from(BEAMS["prismatic"]())))
    none = replace(rows, entries=0.0 * rows.entries)
    with pytest.raises(SolveError, match="common system must be definite"):
        closed(parts, R, none).forces(loads)


@pytest.mark.parametrize("repeated", [False, True])
def test_many_constraints_are_independent_but_for_those_that_repeat_others(repeated: bool) -> None:
    """As many as a sparse factor is asked of first; one that is the sum of two others is left out, laws never are."""
    n = 3 * MANY
    C = sp.lil_array((MANY + 2, n))
    for row in range(MANY + 2):
        C[row, [row, row + 1, 2 * row]] = 1.0, -0.7, 0.3
    if repeated:
        C[MANY] = C[[2]] + C[[5]]
    C[MANY + 1] = C[[7]]
    compliance = np.append(np.zeros(MANY + 1), 1e-5)
    kept = independent_rows(sp.csr_array(C), compliance)
    assert len(kept) == MANY + 2 - repeated
    assert MANY + 1 in kept
    assert np.linalg.matrix_rank(C.toarray()[kept[:-1]]) == len(kept) - 1
