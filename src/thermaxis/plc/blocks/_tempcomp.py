"""A straight line through corrections at several positions: temperature compensation of SINUMERIK.

The control corrects the actual value of an axis by K(P) = K0 + slope * (P - P0). The block
computes a limited correction at every position that a model was identified at, as without a line,
and lays the line through them by least squares; through two positions it is exact. What the
control reports of its setting data is compared, and taken over once it is read, as corrections at
the positions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import pairwise
from math import isfinite, nextafter
from typing import final

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._build import build_program
from thermaxis.plc.blocks._draft import Body, Draft, statements
from thermaxis.plc.tree import (
    Block,
    Kind,
    Program,
    noted,
    outward_text,
    remark_text,
    stored,
)

LARGEST_POSITION_MM = 1e5
"""Largest magnitude of a position: a hundred metres. [mm]"""
CLOSEST_MM = 1.0
"""Shortest distance of two positions: a line through closer ones is made of noise. [mm]"""
VELOCITY_FACTOR = 0.01
"""Share of an axis's largest velocity that the control adds for a compensation. Default: that of
MD32760 COMP_ADD_VELO_FACTOR. [1]"""
LARGEST_READ = 1e6
"""Largest magnitude of what the control reports, in the unit of each. [1]"""
UNREAD_UM = 1e7
"""What stands for a correction that was not read: more than a block takes for one. [µm]"""
LINE, LINE_BACK = "tx_line", "tx_line_back"
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
        """Check the positions."""
        positions = self.positions_mm
        if len(positions) < _LEAST_POSITIONS:
            raise ConfigurationError("too_few_positions", place=Place(key="--at"))
        stated = [("--at", position) for position in positions]
        if self.reference_mm is not None:
            stated.append(("--reference-position", self.reference_mm))
        for key, position in stated:
            if not (isfinite(position) and abs(position) <= LARGEST_POSITION_MM):
                raise ConfigurationError(
                    "outside_range",
                    value=position,
                    least=-LARGEST_POSITION_MM,
                    most=LARGEST_POSITION_MM,
                    place=Place(key=key),
                )
        require_apart(positions)
        if not 0.0 < self.velocity_factor <= 1.0:
            raise ConfigurationError(
                "not_positive_up_to",
                value=self.velocity_factor,
                most=1,
                place=Place(key="--velocity-factor"),
            )
        mean = sum(map(Fraction, positions)) / len(positions)
        origin = float(mean) if self.reference_mm is None else self.reference_mm
        object.__setattr__(self, "origin_mm", origin)

    @property
    def um_per_mm(self) -> float:
        """Correction per millimetre of K: the axis moves against K. [µm/mm]"""
        return float(-_UM_PER_MM if self.away else _UM_PER_MM)

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
                "slope_too_large",
                slope=slope,
                largest=self.velocity_factor,
                place=Place(key="slope"),
            )
        return k0_mm, slope


def require_apart(positions_mm: Sequence[float]) -> None:
    """Refuse positions that are too close together for a line."""
    if any(b - a < CLOSEST_MM for a, b in pairwise(sorted(positions_mm))):
        raise ConfigurationError(
            "positions_too_close", closest_mm=CLOSEST_MM, place=Place(key="--at")
        )


def bound_texts(settings: PlcSettings, line: LineSettings) -> tuple[str, str]:
    """Return the bounds of K0 and slope as head, guide and summary say them."""
    exact = line.bounds(tuple(bounds.total_um for bounds in settings.compensation.bounds))
    k0_mm, slope = (outward_text(stored(bound, double=settings.double)) for bound in exact)
    return k0_mm, slope


def at_position(position_mm: float) -> str:
    """Return the name of the output at a position."""
    digits = f"{abs(position_mm):.9g}".replace(".", "_")
    return f"at_{'m' if position_mm < 0.0 else ''}{digits}"


def build_line_program(settings: PlcSettings, line: LineSettings) -> Program:
    """Return the program of a compensation with a line through the corrections of its outputs.

    The block is that of `build_program` with other inputs in place of the reported corrections:
    what the control reports of its line. Further outputs are K0, slope and reference position.

    Not protected: what `LineSettings` and `build_program` say. K0, slope and reference position
    are three values, and mean a line only together: whoever writes them must write all three of
    the same call in one job, or the reference position while the slope is zero.

    Parameters
    ----------
    settings : PlcSettings
        What is exported; an output for every position.
    line : LineSettings
        Positions and direction.

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ConfigurationError
        If there is not one position per output, the limits allow a slope that the control does
        not follow, or a number is none that the target's numbers hold.

    References
    ----------
    SINUMERIK, description of functions K3, temperature compensation: straight line by SD43900,
    SD43910 and SD43920.
    """
    if len(line.positions_mm) != len(settings.compensation.bounds):
        raise ConfigurationError("one_position_per_output", place=Place(key="--at"))
    if settings.names.block in {LINE, LINE_BACK}:
        raise ConfigurationError(
            "block_name_taken", name=settings.names.block, place=Place(key="name")
        )
    program = build_program(settings)
    main = _joined(settings, line, program.blocks[-1])
    own = _line_back_block(settings, line), _line_block(settings, line)
    blocks = (*program.blocks[:-1], *own, main)
    return replace(program, head=(*program.head, *_head(settings, line)), blocks=blocks)


def _head(settings: PlcSettings, line: LineSettings) -> tuple[str, ...]:
    model = settings.compensation.model
    k0_mm, slope = bound_texts(settings, line)
    direction = "away from" if line.away else "towards"
    return (
        "",
        "Line for the temperature compensation of SINUMERIK:",
        "  K(P) = k0_mm (SD43900) plus slope (SD43910) times (P minus reference_mm (SD43920)).",
        f"  A positive motion of the axis moves the tool point {direction} the workpiece.",
        "  The axis moves against K: it is the error of the actual value.",
        *(
            f"  {remark_text(output.name)}: at {noted(position, 9)} mm"
            for output, position in zip(model.outputs, line.positions_mm, strict=True)
        ),
        f"  Largest K0 {k0_mm} mm, largest slope {slope} mm/mm, rounded outward: they follow",
        "  from the limits of the corrections at the positions. Outside the positions the line",
        "  goes on straight.",
    )


def _target_offsets(settings: PlcSettings, line: LineSettings) -> list[float]:
    # The reference position that the control has is the rounded one.
    origin = stored(line.origin_mm, double=settings.double)
    return [stored(p, double=settings.double) - origin for p in line.positions_mm]


def _line_block(settings: PlcSettings, line: LineSettings) -> Block:
    """Return the block that lays the line."""
    draft = Draft(
        LINE,
        "The straight line through the corrections at the positions, by least squares.",
        double=settings.double,
    )
    totals_um = tuple(bounds.total_um for bounds in settings.compensation.bounds)
    numbers = range(1, len(line.positions_mm) + 1)
    for k in numbers:
        draft.input(f"c{k}_um", f"correction at position {k} [um]")
    draft.input("free", "whether a correction lies outside its limits", Kind.BOOL)
    draft.output("k0_mm", "line at the reference position [mm]")
    draft.output("slope", "slope of the line, mm/mm [1]")
    draft.output("residual_um", "largest distance of a correction from it [um]")
    draft.output("limited", "whether a bound of the line acts", Kind.BOOL)
    draft.temporary("term", "a term of a sum")
    draft.temporary("at_um", "the line at a position, as a correction [um]")
    draft.constant("zero", "nothing", 0.0)
    draft.constant("um_per_mm", "correction per line [um/mm]", line.um_per_mm)
    for k, k0, slope in zip(numbers, *line.weights(), strict=True):
        draft.constant(f"k0_{k}", f"to K0 of position {k} [mm/um]", k0, "--at")
        draft.constant(f"slope_{k}", f"to the slope of position {k} [1/um]", slope, "--at")
    k0_bound_mm, slope_bound = line.bounds(totals_um)
    draft.constant("largest_k0_mm", "largest magnitude of K0 [mm]", k0_bound_mm, "slope")
    draft.constant("largest_slope", "largest magnitude of the slope [1]", slope_bound, "slope")
    for k, way_mm in zip(numbers, _target_offsets(settings, line), strict=True):
        draft.constant(f"way{k}_mm", f"position {k} less the reference [mm]", way_mm, "--at")
    sums = "".join(
        f"""
        term = k0_{k} * c{k}_um
        k0_mm += term
        term = slope_{k} * c{k}_um
        slope += term"""
        for k in numbers
    )
    limits = "".join(
        f"""
        if not free and {value} > {bound}:
            {value} = {bound}
            limited = True
        if not free and {value} < -{bound}:
            {value} = -{bound}
            limited = True"""
        for value, bound in (("k0_mm", "largest_k0_mm"), ("slope", "largest_slope"))
    )
    distances = "".join(
        f"""
        term = slope * way{k}_mm
        term = k0_mm + term
        at_um = term * um_per_mm
        term = c{k}_um - at_um
        if term < zero:
            term = -term
        if term > residual_um:
            residual_um = term"""
        for k in numbers
    )
    return draft.block(
        f"""
        k0_mm = zero
        slope = zero{sums}
        limited = False{limits}
        residual_um = zero{distances}
        """
    )


def _line_back_block(settings: PlcSettings, line: LineSettings) -> Block:
    """Return the block that says how far the control's line is from the one written."""
    draft = Draft(
        LINE_BACK,
        "How far the line in the control is from the one that was written, at every position.",
        double=settings.double,
    )
    draft.input("k0_mm", "K0 in the control [mm]")
    draft.input("slope", "slope in the control, mm/mm [1]")
    draft.input("reference_mm", "reference position in the control [mm]")
    draft.input("written_k0_mm", "K0 that was written [mm]")
    draft.input("written_slope", "slope that was written [1]")
    draft.temporary("term", "a term of a sum")
    draft.temporary("own_mm", "the line that was written, at a position [mm]")
    draft.constant("um_per_mm", "correction per line [um/mm]", line.um_per_mm)
    draft.constant("largest", "more is no line: it was not read", LARGEST_READ)
    draft.constant("unread_um", "said where it was not read [um]", UNREAD_UM)
    distances = unread = ""
    for k, (position_mm, way_mm) in enumerate(
        zip(line.positions_mm, _target_offsets(settings, line), strict=True), 1
    ):
        draft.constant(f"position{k}_mm", f"position {k} [mm]", position_mm, "--at")
        draft.constant(f"way{k}_mm", f"position {k} less the reference [mm]", way_mm, "--at")
        draft.output(f"apart{k}_um", f"distance at position {k} [um]")
        distances += f"""
            own_mm = written_slope * way{k}_mm
            own_mm = written_k0_mm + own_mm
            term = position{k}_mm - reference_mm
            term = slope * term
            term = k0_mm + term
            term -= own_mm
            apart{k}_um = term * um_per_mm"""
        unread += f"""
            apart{k}_um = unread_um"""
    return draft.block(
        f"""
        if (
            -largest <= k0_mm <= largest
            and -largest <= slope <= largest
            and -largest <= reference_mm <= largest
        ):{distances}
        else:{unread}
        """
    )


def _joined(settings: PlcSettings, line: LineSettings, main: Block) -> Block:
    """Return the main block with the line."""
    stems = settings.names.outputs
    draft = Draft(settings.names.block, double=settings.double)
    reported = {f"read_{stem}": k for k, stem in enumerate(stems, 1)}
    first = _read_line(draft, reported)
    last = _written_line(draft, line)
    own = draft.block("")
    kept = [v for v in main.inputs if v.name not in reported]
    ends = kept.pop()  # read_ok stays the last
    return replace(
        main,
        inputs=(*kept, *own.inputs, ends),
        outputs=(*own.outputs, *main.outputs),
        states=(*main.states, *own.states),
        temporaries=(*main.temporaries, *(v for v in main.inputs if v.name in reported)),
        constants=(*main.constants, *own.constants),
        instances=(*main.instances, *own.instances),
        body=(*first, *main.body, *last),
    )


def _read_line(draft: Draft, reported: Mapping[str, int]) -> Body:
    draft.input("read_k0_mm", "SD43900 that the control reports [mm]")
    draft.input("read_slope", "SD43910 that the control reports, mm/mm [1]")
    draft.input("read_reference_mm", "SD43920 that the control reports [mm]")
    draft.state("line_k0_mm", "K0 that was said last [mm]")
    draft.state("line_slope", "slope that was said last [1]")
    draft.instance("fb_line_back", LINE_BACK)
    read = "".join(
        f"""
        {name} = in_force{k}_um + fb_line_back.apart{k}_um"""
        for name, k in reported.items()
    )
    return statements(
        f"""
        # The line in the control, as corrections at the positions.
        fb_line_back(
            k0_mm=read_k0_mm,
            slope=read_slope,
            reference_mm=read_reference_mm,
            written_k0_mm=line_k0_mm,
            written_slope=line_slope,
        ){read}
        """
    )


def _written_line(draft: Draft, line: LineSettings) -> Body:
    draft.instance("fb_line", LINE)
    draft.constant("origin_mm", "reference position of the line [mm]", line.origin_mm)
    draft.output("k0_mm", "K0, for SD43900 [mm]")
    draft.output("slope", "slope, for SD43910, mm/mm [1]")
    draft.output("reference_mm", "reference position, for SD43920 [mm]")
    draft.output("residual_um", "largest distance of a correction from it [um]")
    draft.output("line_limited", "whether a bound of the line acts", Kind.BOOL)
    numbers = range(1, len(line.positions_mm) + 1)
    corrections = ", ".join(f"c{k}_um=in_force{k}_um" for k in numbers)
    return statements(
        f"""
        # The line through the corrections.
        fb_line({corrections}, free=outside)
        line_k0_mm = fb_line.k0_mm
        line_slope = fb_line.slope
        k0_mm = line_k0_mm
        slope = line_slope
        reference_mm = origin_mm
        residual_um = fb_line.residual_um
        line_limited = fb_line.limited
        """
    )
