"""The error budget of a run, by source and kind of channel: one record for table, results file and warnings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from kedfem.results.balance import Balance

KINDS = ("displacement", "stress", "joint forces", "drive")
SOURCES = ("mesh", "step", "positions", "reduction", "frames", "rounding")
WARNED = 0.05  # error above which every run warns
TWICE = 2.0  # times the required accuracy: estimates are no better than that
WHOLE = 1.0  # an error as large as the result
FACTOR = 3.0  # estimates are right within it: an estimate of three times the result means an error as large as the result
UNACCOUNTED = 0.5  # of energy
UNKNOWNS = 60_000  # of a model, beyond which no mesh is refined automatically
ROUNDING = 1e-12  # error that is nothing but rounding
LEAST = 0.005  # error below which no run warns
OF_SOURCE, TOGETHER, UNKNOWN = "error of ", "error together, ", "no estimate "  # how notes of a budget begin


@dataclass(frozen=True, slots=True)
class Share:
    """The contribution of one source to the error.

    source : mesh, step, positions, reduction, frames or rounding
    errors : kind of channel → estimated error, relative to the channel's largest value, at the worst instant and channel
    remedy : how to reduce it, in words; if empty, the usual remedy of its source
    """

    source: str
    errors: Mapping[str, float]
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Budget:
    """Estimated errors of a run.

    shares : by source; a source without a share causes no error
    limits : where no estimate is claimed, in words
    links : meshed link → error of its mesh in the energy norm [-]
    step : channel → error of the step
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
        """Kind → sum of all shares, as they may add up."""
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
    """The kind of a channel that is judged, by its name; None for other channels.

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
    """Errors by kind: that of the worst channel of each."""
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
    """How to reduce the error, whose largest share is given; if several parts exceed the result, none is singled out."""
    kind = max(budget.together, key=lambda kind: budget.together[kind])
    beyond = _beyond(budget, kind)
    if len(beyond) > 1:
        parts = " and ".join(f"{x.source} {percent(x.errors[kind])}" for x in beyond)
        return (
            f"no part of it can be singled out ({kind}: {parts}): the motion is another one with every change, "
            "so that finer elements alone do not help; look at the animation and at the other warnings, then take a "
            "step ten times shorter, and if the motion stays as it is, look for a link or a joint that gives way"
        )
    usual = CHOSEN_STEP if share.source == "step" and chosen else REMEDIES[share.source]
    return f"most of it from the {share.source}: {share.remedy or usual}"


def _beyond(budget: Budget, kind: str) -> list[Share]:
    """The parts of an error that are larger than the result."""
    return [x for x in budget.shares if x.errors.get(kind, 0.0) > WHOLE]


def meaningless(budget: Budget, balance: Balance | None, unworked: float) -> str:
    """Why the results of a run are meaningless by its own estimates, in words; else empty.

    Parameters
    ----------
    balance : of energy; None without time steps
    unworked : work of the drives that is missing in the energy account, relative to the energy exchanged [-]
    """
    # one part alone may be the phase of a vibration, whose size is right; several are another motion altogether
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
    """An error in percent, with two digits: an estimate has no more. What is less than rounding is none.

    >>> percent(0.01234), percent(9.3e-43)
    ('1.2 %', '≈ 0')
    """
    if 0 < error < ROUNDING:
        return "≈ 0"
    return "over 100 %" if error > 1 else f"{float(f'{100 * error:.2g}'):g} %"


def attributes(budget: Budget) -> dict[str, float | str]:
    """The budget as notes of a results file."""
    every = ((share.source, *each) for share in budget.shares for each in share.errors.items())
    notes: dict[str, float | str] = {f"{OF_SOURCE}{source}, {kind}": error for source, kind, error in every}
    notes |= {f"{TOGETHER}{kind}": error for kind, error in budget.together.items()}
    notes |= {f"mesh error of {link}, energy norm": error for link, error in budget.links.items()}
    notes |= {f"{UNKNOWN}{k}": text for k, text in enumerate(budget.limits, start=1)}
    return notes


def joined(shares: Sequence[Share | None]) -> tuple[Share, ...]:
    """All shares but None, in the order of SOURCES."""
    return tuple(sorted((x for x in shares if x is not None), key=lambda share: SOURCES.index(share.source)))
