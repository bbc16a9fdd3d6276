"""The error budget of a run by source and kind of channel, for the table, the results file and warnings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from kedfem.results.balance import Balance
from kedfem.scene import percentage

KINDS = ("displacement", "stress", "joint forces", "drive")
SOURCES = ("mesh", "step", "positions", "reduction", "frames", "rounding")
WARNED = 0.05  # error above which every run warns
TWICE = 2.0  # factor on the required accuracy above which a run warns: estimates are no better than that
WHOLE = 1.0  # error as large as the result
FACTOR = 3.0  # accuracy of estimates: one of three times the result means an error as large as the result
UNACCOUNTED = 0.5  # share of unaccounted energy above which results are meaningless
UNKNOWNS = 60_000  # of a model, above which no mesh is refined automatically
ROUNDING = 1e-12  # error below which there is only rounding
LEAST = 0.005  # error below which no run warns
OF_SOURCE, TOGETHER, UNKNOWN = "error of ", "error together, ", "no estimate "  # first words of a budget's notes


@dataclass(frozen=True, slots=True)
class Share:
    """The contribution of one source to the error.

    source : mesh, step, positions, reduction, frames or rounding
    errors : estimated error of each kind of channel, at the worst instant and in the worst channel, relative to the
        channel's largest value
    remedy : advice to reduce it; empty for the usual remedy of its source
    """

    source: str
    errors: Mapping[str, float]
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Budget:
    """Estimated errors of a run.

    shares : contributions by source; a source without a share causes no error
    limits : descriptions of what has no estimate
    links : error of each meshed link's mesh in the energy norm [-]
    step : error of the step in each channel [-]
    """

    shares: tuple[Share, ...]
    limits: tuple[str, ...] = ()
    links: Mapping[str, float] = field(default_factory=dict)
    step: Mapping[str, float] = field(default_factory=dict)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of channels with an estimate."""
        return tuple(kind for kind in KINDS if any(kind in share.errors for share in self.shares))

    @property
    def together(self) -> dict[str, float]:
        """Sum of all shares of each kind, since they may add up."""
        return {kind: sum(share.errors.get(kind, 0.0) for share in self.shares) for kind in self.kinds}

    @property
    def worst(self) -> float:
        """The largest of these sums."""
        return max(self.together.values(), default=0.0)

    @property
    def limiting(self) -> Share | None:
        """The largest share of the kind with the largest error."""
        if not self.kinds:
            return None
        kind = max(self.together, key=lambda kind: self.together[kind])
        return max(self.shares, key=lambda share: share.errors.get(kind, 0.0))

    def error_of(self, source: str) -> float | None:
        """The largest error of a source over all kinds; None if it is unknown."""
        share = self.of(source)
        return max(share.errors.values(), default=None) if share else None

    def of(self, source: str) -> Share | None:
        """The share of a source."""
        return next((share for share in self.shares if share.source == source), None)


def kind_of_name(name: str) -> str | None:
    """The kind of a judged channel, by its name; None for other channels.

    >>> kind_of_name("probes/tip/velocity"), kind_of_name("joints/A/force"), kind_of_name("drive/rigid_torque")
    ('displacement', 'joint forces', None)
    """
    if name.startswith("probes/"):
        return "stress" if name.endswith("/stress") else "displacement"
    if name.startswith("joints/") and name.endswith("/force"):
        return "joint forces"
    if name.startswith("drive/") and name.rsplit("/", 1)[-1] in {"torque", "force"}:
        return "drive"
    return None


def by_kind(errors: Mapping[str, float]) -> dict[str, float]:
    """Error of the worst channel of each kind."""
    out: dict[str, float] = {}
    for name, error in errors.items():
        kind = kind_of_name(name)
        if kind is not None:
            out[kind] = max(out.get(kind, 0.0), error)
    return out


def budget_warning(budget: Budget, asked: float | None = None, chosen: bool = False) -> tuple[str, ...]:
    """A warning if an error is above WARNED, or clearly above the required accuracy, with its largest source.

    Parameters
    ----------
    asked : the required accuracy
    chosen : whether the step was chosen for it
    """
    limit = WARNED if asked is None else min(WARNED, max(TWICE * asked, LEAST))
    over = {kind: error for kind, error in budget.together.items() if error > limit}
    share = budget.limiting
    if not over or share is None:
        return ()
    message = ", ".join(f"{kind} {percent(error)}" for kind, error in over.items())
    return (f"estimated error: {message}; {_advice(budget, share, chosen)}",)


def _advice(budget: Budget, share: Share, chosen: bool) -> str:
    """Advice to reduce the error by its largest share; if several parts exceed the result, none is singled out."""
    kind = max(budget.together, key=lambda kind: budget.together[kind])
    beyond = _beyond(budget, kind)
    if len(beyond) > 1:
        parts = " and ".join(f"{x.source} {percent(x.errors[kind])}" for x in beyond)
        return (
            f"no part of it can be singled out ({kind}: {parts}): the motion differs with every change, "
            "so that finer elements alone do not help; examine the animation and the other warnings, then take a "
            "step ten times shorter; if the motion does not change, look for a link or a joint that is too compliant"
        )
    usual = CHOSEN_STEP if share.source == "step" and chosen else REMEDIES[share.source]
    return f"most of it from the {share.source}: {share.remedy or usual}"


def _beyond(budget: Budget, kind: str) -> list[Share]:
    """The parts of an error that are larger than the result."""
    return [x for x in budget.shares if x.errors.get(kind, 0.0) > WHOLE]


def meaningless(budget: Budget, balance: Balance | None, unworked: float) -> str:
    """The reason why a run's own estimates show its results to be meaningless; empty if they do not.

    Parameters
    ----------
    balance : energy balance; None without time steps
    unworked : work of the drives that is missing in the energy balance, relative to the energy exchanged [-]
    """
    # a single part may be the phase of a vibration with the right amplitude; several mean another motion
    lost = {
        f"estimated error of {kind}": error for kind, error in budget.together.items()
        if error >= FACTOR * WHOLE or len(_beyond(budget, kind)) > 1
    }  # fmt: skip
    energy = {"energy": balance.energy} if balance else {}
    left = {"the drive's work": unworked} | energy
    message = [f"{what} {percent(error)}" for what, error in lost.items()]
    left = {what: share for what, share in left.items() if share >= UNACCOUNTED}
    message += [f"{percent(share)} of {what} unaccounted for" for what, share in left.items()]
    return "; ".join(message)


REMEDIES = {
    "mesh": "take finer elements; where mesh and element are left out, analysis.accuracy chooses them, up to "
    f"{UNKNOWNS:,} unknowns in all",
    "step": "take a shorter step, or leave it out so that analysis.accuracy chooses it; a sudden start or load that "
    'excites vibration beyond any step needs initial = "quasi-static", a smoother one, or damping',
    "positions": "take more of them, analysis.steps_per_revolution (or step), and let loads come and go over several",
    "reduction": "a smaller analysis.reduction_tolerance, or links that are not reduced",
    "frames": 'analysis.frames = "co-rotational" is right at any deflection; with it, more segments or elements',
    "rounding": 'links that are much stiffer than all others as model = "rigid"',
}  # fmt: skip


CHOSEN_STEP = (
    "analysis.accuracy chose it, among those that its trials may take (notes of the plan say what limits them): state a "
    "shorter one, analysis.step; a smoother start or load, or damping, leaves less vibration to follow"
)


def percent(error: float) -> str:
    """An error in percent with two digits, as many as an estimate has; below rounding it is about 0.

    >>> percent(0.01234), percent(9.3e-43)
    ('1.2 %', '≈ 0')
    """
    if 0 < error < ROUNDING:
        return "≈ 0"
    return "over 100 %" if error > 1 else percentage(error)


def attributes(budget: Budget) -> dict[str, float | str]:
    """The budget as attributes of a results file."""
    every = ((share.source, *each) for share in budget.shares for each in share.errors.items())
    notes: dict[str, float | str] = {f"{OF_SOURCE}{source}, {kind}": error for source, kind, error in every}
    notes |= {f"{TOGETHER}{kind}": error for kind, error in budget.together.items()}
    notes |= {f"mesh error of {link}, energy norm": error for link, error in budget.links.items()}
    notes |= {f"{UNKNOWN}{k}": text for k, text in enumerate(budget.limits, start=1)}
    return notes


def joined(shares: Sequence[Share | None]) -> tuple[Share, ...]:
    """All shares but None, in the order of SOURCES."""
    return tuple(sorted((x for x in shares if x is not None), key=lambda share: SOURCES.index(share.source)))
