"""Plain sizes in one line, so that a wrong unit is seen."""

from collections.abc import Iterable

from kedfem.accuracy.sizes import Sizes
from kedfem.output.words import with_prefix


def size_line(found: Sizes) -> str:
    """Overall size, longest and shortest link, masses, moduli, speeds.

    >>> lengths, masses = {"crank": 0.1, "rod": 0.3}, {"crank": 0.16, "rod": 0.5}
    >>> size_line(Sizes(0.42, lengths, masses, {"steel": 2.1e11}, {"A": 600.0}, {}))
    'sizes: 420 mm overall; links 100 mm (crank) to 300 mm (rod); masses 0.16 to 0.5 kg; E 210 GPa; drive 600 rpm'
    """
    lines = [f"{with_prefix(found.overall, 'm')} overall"]
    if found.lengths:
        low, high = (pick(found.lengths, key=lambda x: found.lengths[x]) for pick in (min, max))
        ends = [f"{with_prefix(found.lengths[x], 'm')} ({x})" for x in dict.fromkeys((low, high))]
        lines.append(f"links {' to '.join(ends)}")
    lines += [f"masses {_range(found.masses.values(), 'kg')}"] if found.masses else []
    lines += [f"E {_range(found.moduli.values(), 'Pa')}"] if found.moduli else []
    speeds = [f"{x:.4g} rpm" for x in found.turns.values()]
    speeds += [with_prefix(x, "m/s") for x in found.speeds.values()]
    lines += [f"drive{'s' if len(speeds) > 1 else ''} {', '.join(speeds)}"] if speeds else []
    return "sizes: " + "; ".join(lines)


def _range(values: Iterable[float], unit: str) -> str:
    """The least and the greatest."""
    low, high = min(values := list(values)), max(values)
    if unit == "kg":  # 0.16 kg reads better than 160 mkg
        return f"{low:.4g} kg" if low == high else f"{low:.4g} to {high:.4g} kg"
    return with_prefix(low, unit) if low == high else f"{with_prefix(low, unit)} to {with_prefix(high, unit)}"
