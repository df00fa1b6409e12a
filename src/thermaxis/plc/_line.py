"""A straight line through corrections at several positions: temperature compensation of SINUMERIK.

The control corrects the actual value of an axis by K(P) = K0 + slope * (P - P0). The block
computes a limited correction at every position that a model was identified at, as without a line,
and lays the line through them by least squares; through two positions it is exact. What the
control reports of its setting data is compared, and taken over once it is read, as corrections at
the positions.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from math import nextafter
from typing import final

from thermaxis.errors import ConfigurationError, require_positive, require_range
from thermaxis.plc._numbers import outward_text, stored
from thermaxis.plc._settings import PlcSettings

LARGEST_POSITION_MM = 1e5
"""Largest magnitude of a position: a hundred metres. [mm]"""
CLOSEST_MM = 1.0
"""Shortest distance of two positions: a line through closer ones is made of noise. [mm]"""
VELOCITY_FACTOR = 0.01
"""Share of an axis's largest velocity that the control adds for a compensation. Default: that of
MD32760 COMP_ADD_VELO_FACTOR. [1]"""
_UM_PER_MM = 1000
_LEAST_POSITIONS = 2
# Room for the roundings of the sum in REAL: the bound must not cut what the limits allow.
_ROOM = Fraction(1_000_001, 1_000_000)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LineSettings:
    """The line of an axis, and the positions that it is laid through.

    Not protected: outside its positions the line goes on straight, and the correction there may
    be larger than the limits of the corrections say; whether the axis is the one that the models
    were identified on, and its positive direction the one stated, is proven at commissioning.

    Raises
    ------
    ConfigurationError
        If there are fewer than two positions, one is out of its range, two are closer together
        than a millimetre, or a number is not finite.
    """

    positions_mm: tuple[float, ...]
    """Position of the axis by output. [mm]"""
    away: bool
    """Whether a positive motion of the axis moves the tool point away from the workpiece."""
    reference_mm: float | None = None
    """Reference position P0 of the line, for SD43920. Default: the mean of the positions. [mm]"""
    velocity_factor: float = VELOCITY_FACTOR
    """Largest slope that the control follows. Default: `VELOCITY_FACTOR`. [1]"""
    origin_mm: float = field(init=False)
    """The reference position in force. [mm]"""

    def __post_init__(self) -> None:
        positions = self.positions_mm
        if len(positions) < _LEAST_POSITIONS:
            raise ConfigurationError("too_few_positions", key="--at")
        stated = [("--at", position) for position in positions]
        if self.reference_mm is not None:
            stated.append(("--reference-position", self.reference_mm))
        for key, position in stated:
            require_range(key, position, -LARGEST_POSITION_MM, LARGEST_POSITION_MM)
        require_apart(positions)
        require_positive("--velocity-factor", self.velocity_factor, 1)
        mean = sum(map(Fraction, positions)) / len(positions)
        origin = float(mean) if self.reference_mm is None else self.reference_mm
        object.__setattr__(self, "origin_mm", origin)

    @property
    def um_per_mm(self) -> float:
        """Correction per millimetre of K. [µm/mm]"""
        return um_per_mm(away=self.away)

    def weights(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return what the corrections contribute to the line.

        Returns
        -------
        k0_mm_per_um : tuple of float
            By position, what a micrometre contributes to K0. [mm/µm]
        slope_per_um : tuple of float
            By position, what it contributes to the slope. [1/µm]

        References
        ----------
        Least squares through (position, correction), in exact fractions, rounded once.
        """
        k0, slope = self._exact_weights()
        return tuple(map(float, k0)), tuple(map(float, slope))

    def reach(self, largest_um: tuple[float, ...]) -> tuple[float, float]:
        """Return how large K0 and slope become, or change, while every correction does no more.

        Parameters
        ----------
        largest_um : tuple of float
            Largest magnitude, or change, of the correction by output. [µm]

        Returns
        -------
        k0_mm : float
            That of K0, rounded outward. [mm]
        slope : float
            That of the slope, in mm/mm, rounded outward. [1]
        """
        largest = [
            sum(abs(w) * Fraction(t) for w, t in zip(weights, largest_um, strict=True)) * _ROOM
            for weights in self._exact_weights()
        ]
        k0_mm, slope = (nextafter(float(value), float("inf")) for value in largest)
        return k0_mm, slope

    def _exact_weights(self) -> tuple[list[Fraction], list[Fraction]]:
        positions = [Fraction(p) for p in self.positions_mm]
        mean = sum(positions, Fraction()) / len(positions)
        square = sum(((p - mean) * (p - mean) for p in positions), Fraction())
        unit = 1 / Fraction(self.um_per_mm)
        slope = [(p - mean) / square for p in positions]
        away = Fraction(self.origin_mm) - mean
        k0 = [Fraction(1, len(positions)) + s * away for s in slope]
        return [unit * w for w in k0], [unit * w for w in slope]

    def bounds(self, totals_um: tuple[float, ...]) -> tuple[float, float]:
        """Return how large K0 and slope become while every correction lies within its total.

        Parameters
        ----------
        totals_um : tuple of float
            Largest magnitude of the correction with the trim, by output. [µm]

        Returns
        -------
        k0_mm : float
            Largest magnitude of K0. [mm]
        slope : float
            Largest magnitude of the slope, in mm/mm. [1]

        Raises
        ------
        ConfigurationError
            If the slope may become larger than the control follows.
        """
        k0_mm, slope = self.reach(totals_um)
        if slope > self.velocity_factor:
            raise ConfigurationError(
                "slope_too_large", slope=slope, largest=self.velocity_factor, key="slope"
            )
        return k0_mm, slope


def um_per_mm(*, away: bool) -> float:
    """Return the correction per millimetre of K: the axis moves against K. [µm/mm]"""
    return float(-_UM_PER_MM if away else _UM_PER_MM)


def require_apart(positions_mm: Sequence[float]) -> None:
    """Refuse positions that are too close together for a line."""
    if any(b - a < CLOSEST_MM for a, b in pairwise(sorted(positions_mm))):
        raise ConfigurationError("positions_too_close", closest_mm=CLOSEST_MM, key="--at")


def line_bounds(settings: PlcSettings, line: LineSettings) -> tuple[str, str]:
    """Return the bounds of K0 and slope as head, guide and summary say them."""
    exact = line.bounds(tuple(bounds.total_um for bounds in settings.compensation.bounds))
    k0_mm, slope = (outward_text(stored(bound, double=settings.double)) for bound in exact)
    return k0_mm, slope


def at_position(position_mm: float) -> str:
    """Return the name of the output at a position."""
    digits = f"{abs(position_mm):.9g}".replace(".", "_")
    return f"at_{'m' if position_mm < 0.0 else ''}{digits}"
