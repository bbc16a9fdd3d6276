"""SI prefixes for axes and colour bars."""

import math

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}

PLAIN = frozenset({"", "-", "1", "rad", "deg", "°", "°/s", "°/s²", "kg", "%"})
"""Units that take no prefix."""


def prefixed(peak: float, unit: str) -> tuple[float, str]:
    """The prefix that brings a peak to 1 … 1000.

    Parameters
    ----------
    peak : largest absolute value, in `unit`
    unit : the prefix goes before its first letter

    Returns
    -------
    divisor, unit with prefix

    Examples
    --------
    >>> prefixed(4.2e7, "Pa")
    (1000000.0, 'MPa')
    >>> prefixed(0.0042, "m")
    (0.001, 'mm')
    >>> prefixed(2500.0, "m/s^2")
    (1.0, 'm/s²')
    >>> prefixed(0.0, "N*m")
    (1.0, 'N m')
    """
    pretty = unit.replace("**", "^").replace("^2", "²").replace("^3", "³").replace("*", " ")
    if pretty in PLAIN or peak <= 0 or not math.isfinite(peak):
        return 1.0, pretty
    power = 3 * math.floor(math.log10(peak) / 3 + 1e-12)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    if power > 0 and pretty.startswith("m"):
        power = 0  # nobody reads kilometres per second off a linkage
    return 10.0**power, PREFIXES[power] + pretty
