"""The block with a line in plain Python."""

from typing import NamedTuple, final

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.build import LARGEST_READ, UNREAD_UM, LineSettings
from thermaxis.plc.twin._numbers import rounding
from thermaxis.plc.twin._twin import PlcInputs, PlcOutputs, Twin

_LARGEST_UM = 1e6


@final
class LineInputs(NamedTuple):
    """Inputs of the block with a line in one call."""

    plain: PlcInputs
    """Inputs of the block without a line; its reported corrections are not used."""
    read_k0_mm: float
    """K0 that the control reports. [mm]"""
    read_slope: float
    """Slope that it reports, in mm/mm. [1]"""
    read_reference_mm: float
    """Reference position that it reports. [mm]"""


@final
class LineOutputs(NamedTuple):
    """Outputs of the block with a line after one call."""

    plain: PlcOutputs
    """Outputs of the block without a line."""
    k0_mm: float
    """K0. [mm]"""
    slope: float
    """Slope, in mm/mm. [1]"""
    reference_mm: float
    """Reference position. [mm]"""
    residual_um: float
    """Largest distance of a correction from the line. [µm]"""
    limited: bool
    """Whether a bound of the line acts."""


@final
class LineTwin:
    """The block with a line, in the target's numbers: one `step` is one call.

    Not protected: as `Twin`.
    """

    def __init__(self, settings: PlcSettings, line: LineSettings) -> None:
        r = self._r = rounding(double=settings.double)
        self._twin = Twin(settings)
        self._totals_um = [r(bounds.total_um) for bounds in settings.compensation.bounds]
        self._origin_mm = r(line.origin_mm)
        self._positions_mm = [r(p) for p in line.positions_mm]
        self._ways_mm = [r(p - self._origin_mm) for p in self._positions_mm]
        self._factor = line.um_per_mm
        k0, slope = line.weights()
        self._k0, self._slope = [r(w) for w in k0], [r(w) for w in slope]
        exact = line.bounds(tuple(b.total_um for b in settings.compensation.bounds))
        self._largest_k0_mm, self._largest_slope = (r(bound) for bound in exact)
        self._switch_on()

    def _switch_on(self) -> None:
        self._corrections_um = [0.0] * len(self._positions_mm)
        self._written = 0.0, 0.0

    def reported_um(self, inputs: LineInputs) -> tuple[float, ...]:
        """Return what the control's line means as corrections at the positions."""
        r = self._r
        k0_mm, slope, origin_mm = (r(read) for read in inputs[1:])
        if not all(abs(read) <= LARGEST_READ for read in (k0_mm, slope, origin_mm)):
            return tuple([r(c + UNREAD_UM) for c in self._corrections_um])
        said: list[float] = []
        for position_mm, way_mm, c in zip(
            self._positions_mm, self._ways_mm, self._corrections_um, strict=True
        ):
            own_mm = r(self._written[0] + r(self._written[1] * way_mm))
            there_mm = r(k0_mm + r(slope * r(position_mm - origin_mm)))
            said.append(r(c + r(r(there_mm - own_mm) * self._factor)))
        return tuple(said)

    def step(self, inputs: LineInputs) -> LineOutputs:
        """Do what one call of the block does."""
        if inputs.plain.restart:
            self._switch_on()
        reported_um = self.reported_um(inputs)
        told = inputs.plain._replace(read_um=reported_um)
        if self._twin.takes_over(told):
            found = zip(self._corrections_um, reported_um, strict=True)
            self._corrections_um = [u if abs(u) <= _LARGEST_UM else c for c, u in found]
        pairs = zip(self._corrections_um, self._totals_um, strict=True)
        outside = any(not -total <= c <= total for c, total in pairs)
        plain = self._twin.step(told)
        self._corrections_um = list(plain.correction_um)
        k0_mm, slope = self._sum(self._k0), self._sum(self._slope)
        limited = False
        if not outside:
            k0_mm, cut_k0 = _within(k0_mm, self._largest_k0_mm)
            slope, cut_slope = _within(slope, self._largest_slope)
            limited = cut_k0 or cut_slope
        self._written = k0_mm, slope
        residual_um = max(self._away_um(k) for k in range(len(self._positions_mm)))
        return LineOutputs(plain, k0_mm, slope, self._origin_mm, residual_um, limited)

    def _sum(self, weights: list[float]) -> float:
        total = 0.0
        for weight, c in zip(weights, self._corrections_um, strict=True):
            total = self._r(total + self._r(weight * c))
        return total

    def _away_um(self, k: int) -> float:
        r = self._r
        k0_mm, slope = self._written
        line_um = r(r(k0_mm + r(slope * self._ways_mm[k])) * self._factor)
        return abs(r(self._corrections_um[k] - line_um))


def _within(value: float, bound: float) -> tuple[float, bool]:
    if value > bound:
        return bound, True
    return (-bound, True) if value < -bound else (value, False)
