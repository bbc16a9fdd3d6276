"""Joints between links that both move: rows with directions that vary in time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared
from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.dense import DenseSteps
from kedfem.dynamics.first_rows import interface_values
from kedfem.dynamics.joint_rows import joint_rows
from kedfem.dynamics.literal import LiteralSteps
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.errors import MeshError
from kedfem.links.record import in_space
from kedfem.scene import time_grid
from tests.moving import bar, cardan, channels, inverted, ran, state

KINDS = {
    "block on a beam": lambda: inverted("beam", "prismatic", turns=0.05),
    "pin in a beam's slot": lambda: inverted("beam", "slot", turns=0.05),
    "block on a plane link": lambda: inverted("plane", "prismatic", turns=0.03),
    "pin in a plane link's slot": lambda: inverted("plane", "slot", turns=0.03),
    "pin in a solid's slot": lambda: inverted("solid", "slot", turns=0.02),
    "universal joint": lambda: cardan(turns=0.05),
}


@pytest.mark.parametrize("kind", list(KINDS))
def test_condensed_and_dense_steps_are_the_literal_ones(kind: str) -> None:
    """Three ways to one number; beams in space are left to the first two: their stiff hubs cost digits."""
    found = []
    for solver in (LiteralSteps, CondensedSteps, DenseSteps):
        ready, blocks = ran(KINDS[kind](), solver)
        links = range(len(ready.model.links))
        found.append([state(blocks, k, name) for name in ("u", "v", "port_forces") for k in links])
    tolerance = 2e-5 if kind == "universal joint" else 1e-7
    for other in found[1:]:
        for x, y in zip(other, found[0], strict=True):
            assert_allclose(x, y, atol=tolerance * np.abs(y).max())


@pytest.mark.parametrize("kind", list(KINDS))
def test_joints_stay_closed_and_what_is_free_is_free(kind: str) -> None:
    ready, blocks = ran(KINDS[kind]())
    open_, size = 0.0, 0.0
    for block in blocks:
        rows = joint_rows(ready.model.rows, block.motion)
        assert rows is not None
        for k in range(len(block)):
            z = interface_values(ready.model.joints, [link.u[k] for link in block.links])
            open_ = max(open_, float(np.abs(rows.C[k] @ z).max()))
            size = max(size, float(np.abs(z).max()))
    assert open_ < 1e-10 * max(size, 1e-3)
    assert size > 1e-8


def balanced(ready: Prepared, a: np.ndarray) -> np.ndarray:
    """The accelerations with which forces at the end of steps are in balance."""
    scheme = generalised_alpha(time_grid(ready.scene).step, ready.scene.analysis.rho_inf)
    out = a.copy()
    for k in range(1, len(a)):
        both = (1 - scheme.alpha_m) * a[k] + scheme.alpha_m * a[k - 1]
        out[k] = (both - scheme.alpha_f * out[k - 1]) / (1 - scheme.alpha_f)
    return out


@pytest.mark.parametrize("kind", list(KINDS))
def test_joint_forces_balance_inertia_and_loads_of_every_link(kind: str) -> None:
    """Σ joint forces + Σ (P − M R0'') = Σ M δ'': K δ has no resultant, in any frame.

    Generalised-α's own δ'' is that of another instant; the one that balances the forces at a step's end follows from it,
    (1 − α_f) â1 + α_f â0 = (1 − α_m) a1 + α_m a0 (Arnold and Brüls 2007).
    """
    ready, blocks = ran({**KINDS[kind](), "gravity": [0, -9.81, 0]})
    forces = channels(ready, blocks)
    for k, link in enumerate(ready.model.links):
        loads = np.einsum("tnd,n->td", state(blocks, k, "F"), link.one)
        inertia = np.einsum("tnd,nd->td", balanced(ready, state(blocks, k, "a")), link.m1)
        left = in_space(link, loads - inertia)
        for name, joint in ready.scene.joints.items():
            if link.name in joint.links:
                on = joint.links[1] if joint.links[0] == "ground" else joint.links[0]
                left = left + (1.0 if on == link.name else -1.0) * forces[f"joints/{name}/force"]
        size = max(np.abs(forces[f"joints/{name}/force"]).max() for name in ready.scene.joints)
        assert (
            np.abs(left).max() < (1e-6 if link.kind == "spatial_beam" else 1e-8) * size
        )  # stiff hubs cost digits


def test_a_pin_that_does_not_move_along_its_slot_is_a_hinge_across_it() -> None:
    """The slot's line goes through the arm's own hinge: the pin goes around it with the arm, and slides nowhere.

    A hinge at the pin holds along the arm too, which matters little to its bending; beside a hinge the slot is redundant.
    """
    raw = inverted("beam", "slot", end_time=0.05, step=5e-4, turns=None, steps_per_turn=None)
    raw["drive"]["motion"] = {"kind": "cycloidal", "angle": 1.0, "rise": 0.04}
    raw["links"]["arm"] = bar("beam", (0, 0), (0.4, 0), 16)
    raw["joints"]["B"]["at"] = [0, 0]
    _, slot = ran(raw)
    hinge = {"kind": "revolute", "links": ["crank", "arm"], "at": [0.1, 0]}
    _, both = ran({**raw, "joints": {**raw["joints"], "E": hinge}})
    _, alone = ran({**raw, "joints": {**raw["joints"], "S": hinge}})
    across, as_well, wanted = (state(blocks, 1, "g")[:, :, 1] for blocks in (slot, both, alone))
    size = np.abs(wanted).max()
    assert_allclose(across, wanted, atol=1e-5 * size)
    assert_allclose(as_well, wanted, atol=1e-10 * size)


def test_a_pin_that_leaves_its_link_is_refused() -> None:
    """Drawn 0.316 m from the arm's hinge, the pin is 0.4 m away half a turn on; the arm is 0.348 m long."""
    raw = inverted("beam", "slot", turns=1.0)
    raw["links"]["crank"] = bar("beam", (0, 0), (0, 0.1))
    raw["links"]["arm"] = bar("beam", (-0.3, 0), (0.03, 0.11))
    raw["joints"]["S"] |= {"at": [0, 0.1], "axis": [3, 1, 0]}
    wanted = r"joints\.S: the pin must stay on link 'arm', which reaches from -0.316\d* to 0.0316\d* m along the line, "
    with pytest.raises(MeshError, match=wanted + r"got a way from -0.116\d* to 0.0837\d* m"):
        ran(raw)
