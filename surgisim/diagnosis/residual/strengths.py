"""Intervals of a residual law's strengths where only they were fitted: 90 %, from the spread of its amplitudes."""

from collections.abc import Sequence

from surgisim.diagnosis.uncertain import Interval, Spread, scaled


def each(names: Sequence[str]) -> Interval:
    """Of several numbers that the amplitudes scale together, each of either sign."""

    def interval(key: str, value: float, spread: Spread) -> tuple[float, float]:
        if key not in names:
            return value, value
        ends = scaled(key, over_stiffness=True)(key, value, spread)
        return min(ends), max(ends)

    return interval
