"""The model block: what belongs to one model, made from a template; it calls the library."""

import re
import textwrap
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from math import expm1
from typing import Any, TypeAlias, final

from thermaxis import __version__
from thermaxis.codes import Place
from thermaxis.compensation import STATED, WITNESS_S, Part
from thermaxis.errors import ConfigurationError
from thermaxis.plc._interface import Interface, interface_of, model_only_interface
from thermaxis.plc._library import (
    LIBRARY,
    LIBRARY_VERSION,
    SclCpu,
    StFlavour,
    c_library,
    folded,
    scl_text,
    st_library,
    with_panes,
)
from thermaxis.plc._line import LineSettings, line_bounds
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import noted, number_text, stored
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc._template import rendered
from thermaxis.plc._warnings import restart_warning, setting_warnings

HEAD_WIDTH = 88
"""Longest line of the head: a line of 100 signs with the signs of a remark. [1]"""
LARGEST_READ = 1e6
"""Largest magnitude of what the control reports, in the unit of each. [1]"""
UNREAD_UM = 1e7
"""What stands for a correction that was not read: more than a block takes for one. [µm]"""

_Items: TypeAlias = list[dict[str, Any]]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A compensation as the text of a block, beside the library that it calls.

    One call is one cycle of `thermaxis.compensation.cycle`, in the same order and, with LREAL, in
    the same operations. Times are counted from call to call: with LREAL and cycles that a binary
    number cannot hold, such as 0.1 s, a time limit may be met a cycle earlier or later than there.
    With REAL such cycles are refused, and times are counted exactly.

    Not protected: the block knows neither whether its inputs are wired to the sensors that the
    model means, nor whether the sign is right on this machine, nor whether the control adds what
    it is given. Whether the PLC was off it knows only by `init`, or where the measured time since
    the last call is longer than the longest gap of the model. Its supervisor believes its signals:
    an interlock that is wired to nothing is met or not met for ever. A correction that lies outside
    the total comes back at the rate, no faster. Of a sensor a slow drift is not seen.

    With a line: K0, slope and reference position are three values, and mean a line only together:
    whoever writes them must write all three of the same call in one job, or the reference position
    while the slope is zero.

    Raises
    ------
    ConfigurationError
        If a number is none that the target's numbers hold; with a line if there is not one
        position per output, or the limits allow a slope that the control does not follow.

    References
    ----------
    SINUMERIK, description of functions K3, temperature compensation: straight line by SD43900,
    SD43910 and SD43920.
    """

    settings: PlcSettings
    """What is exported; with a line an output for every position."""
    line: LineSettings | None = None
    """The line in the control; its inputs stand in place of the reported corrections."""
    model_only: bool = False
    """Whether it is the model with limits and rate alone, for who has a supervisor already."""
    remarks: tuple[str, ...] = ()
    """Further lines of the head."""

    _context: dict[str, Any] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the line and every number."""
        if self.line is not None and self.model_only:
            raise ConfigurationError("no_line_in_model_only", place=Place(key="--model-only"))
        positions = () if self.line is None else self.line.positions_mm
        if self.line is not None and len(positions) != len(self.settings.compensation.bounds):
            raise ConfigurationError("one_position_per_output", place=Place(key="--at"))
        object.__setattr__(self, "_context", self._made())

    @property
    def name(self) -> str:
        """Name of the block that a user calls."""
        return self.settings.names.block

    @property
    def interface(self) -> Interface:
        """Its inputs and outputs."""
        if self.model_only:
            return model_only_interface(self.settings)
        return interface_of(self.settings, self.line)

    def st(self, flavour: StFlavour = "iec") -> dict[str, str]:
        """Return library and block as Structured Text of IEC 61131-3.

        Parameters
        ----------
        flavour : {'iec', 'twincat', 'codesys'}
            Who reads it: the last two edit a block in two panes, so their texts have marks.
            Default: the text of the standard.

        Returns
        -------
        dict of str to str
            Texts by file, in the order of their import: ASCII, lines of at most 100 signs.
        """
        texts = self._texts()
        return {f"{name}.st": with_panes(text, flavour) for name, text in texts.items()}

    def scl(self, cpu: SclCpu = "s7-1500") -> dict[str, str]:
        """Return library and block as SCL for an external source.

        Not protected: the text was never compiled by a tool of Siemens.

        Parameters
        ----------
        cpu : {'s7-1500', 's7-300'}
            Class of the CPU: that of SINUMERIK ONE, or that of SINUMERIK 840D sl, which has REAL
            only. Default: the first.

        Returns
        -------
        dict of str to str
            Texts by file, in the order of their import.

        Raises
        ------
        ConfigurationError
            If LREAL is asked of the S7-300 class.

        References
        ----------
        S7-SCL V5.3 for S7-300/400, A5E00290611-01, chapters 7 and 9: elementary types, constants.
        """
        if cpu == "s7-300" and self.settings.double:
            raise ConfigurationError("no_lreal_in_cpu", place=Place(key="--real"))
        return {f"{name}.scl": scl_text(text, cpu) for name, text in self._texts().items()}

    def c(self) -> dict[str, str]:
        """Return library and block as C99, without allocation and without a C library.

        ``<name>_init(b)`` sets everything to its start, ``<name>_step(b)`` is one call. The source
        refuses a compiler that computes wider than the type or with fast math; whether a product
        and a sum are contracted it cannot see: compile with ``-ffp-contract=off``.

        Not protected: a struct that was not initialised, and a step that two threads call at once.

        Returns
        -------
        dict of str to str
            Texts by file; each source compiles alone.

        References
        ----------
        ISO/IEC 9899:1999, 5.2.4.2.2 (FLT_EVAL_METHOD), 6.5 (contraction).
        """
        files = c_library(double=self.settings.double)
        source = "model_only.c.j2" if self.model_only else "block.c.j2"
        files[f"{self.name}.h"] = self._rendered("block.h.j2")
        files[f"{self.name}.c"] = self._rendered(source)
        return files

    def _texts(self) -> dict[str, str]:
        library = st_library(double=self.settings.double)
        template = "model_only.st.j2" if self.model_only else "block.st.j2"
        return {LIBRARY: library, self.name: self._rendered(template)}

    def _rendered(self, template: str) -> str:
        return folded(rendered(template, self._context))

    @property
    def said(self) -> dict[str, Any]:
        """What head and guide say of it, by its names in their templates."""
        settings, line = self.settings, self.line
        compensation = settings.compensation
        said: dict[str, Any] = {
            "name": self.name,
            "alone": self.model_only,
            "settings": settings,
            "compensation": compensation,
            "model": compensation.model,
            "stated": compensation.model.reference == STATED,
            "rules": compensation.supervisor,
            "number": "LREAL" if settings.double else "REAL",
            "face": self.interface,
            "percent": round(100 * CYCLE_TOLERANCE),
            "restart": restart_warning(settings),
            "line": line,
        }
        if line is not None:
            said["k0_mm"], said["slope"] = line_bounds(settings, line)
        return said

    def _head(self) -> list[str]:
        """Return the lines at the top: what it is, where it comes from, what its numbers mean."""
        values = {
            **self.said,
            "version": __version__,
            "library": LIBRARY,
            "library_version": LIBRARY_VERSION,
            "warnings": setting_warnings(self.settings),
            "remarks": self.remarks,
        }
        paragraphs = re.sub(r"\n +", " ", rendered("head.j2", values)).splitlines()
        return [x for p in paragraphs for x in textwrap.wrap(p, HEAD_WIDTH, subsequent_indent="  ")]

    def _made(self) -> dict[str, Any]:
        """Return what the templates are filled with: numbers are texts of the target."""
        settings, line = self.settings, self.line
        compensation = settings.compensation
        rules, text = compensation.supervisor, _number_texts(settings)
        sensors = _sensors(settings, text)
        made: dict[str, Any] = {
            "head": self._head(),
            "real": int(not settings.double),
            "library": LIBRARY,
            "library_version": LIBRARY_VERSION,
            "channels": sensors[: len(compensation.model.channels)],
            "sensors": sensors,
            "later": any(s["w"] > s["k"] for s in sensors),
            "cycle_s": text(settings.cycle_s, "cycle_s"),
            "shortest_s": text(settings.shortest_cycle_s, "cycle_s"),
            "longest_s": text(settings.longest_cycle_s, "cycle_s"),
            "gap_s": text(compensation.model.longest_gap_s, "longest_gap_s"),
            "longest_hold_s": text(compensation.model.longest_hold_s, "longest_hold_s"),
            "margin_k": text(compensation.validity_margin_k, "margin_k"),
            "lowest_weight": text(compensation.lowest_weight, "lowest_weight"),
            "rules": {
                **{k: text(v, "supervisor") for k, v in asdict(rules).items()},
                "lost_input_s": text(rules.input_timeout_s + rules.hold_input_s, "supervisor"),
            },
            "line": None if line is None else _line(settings, line, text),
            "filter": None,
        }
        return self.said | made | _model(settings, text)


_Text: TypeAlias = Callable[..., str]


def _number_texts(settings: PlcSettings) -> _Text:
    def text(value: float, key: str, owner: str = "") -> str:
        place = Place(key=key, channel=owner)
        return number_text(value, double=settings.double, place=place)

    return text


def _sensors(settings: PlcSettings, text: _Text) -> _Items:
    compensation = settings.compensation
    model, rules, stems = compensation.model, compensation.rules, settings.names.channels
    rows = zip(stems, compensation.judged, rules, compensation.witnesses, strict=True)
    return [
        {
            "k": k,
            "stem": stem,
            "text": remark_text(channel),
            "reference_c": text(model.reference_c.get(channel, 0.0), "reference_c", channel),
            "lowest_c": text(rule.lowest_c, "lowest_c", channel),
            "highest_c": text(rule.highest_c, "highest_c", channel),
            "step_k": text(rule.step_k, "step_k", channel),
            "rate_k_per_s": text(rule.largest_rate_k_per_s, "largest_rate_k_per_s", channel),
            "frozen_s": text(rule.frozen_s, "frozen_s", channel),
            "rests_k": text(rule.rests_k, "rests_k", channel),
            "w": w + 1,
            "lately_s": text(min(WITNESS_S, rules[w].frozen_s), "frozen_s", channel),
        }
        for k, (stem, channel, rule, w) in enumerate(rows, 1)
    ]


def _model(settings: PlcSettings, text: _Text) -> dict[str, Any]:
    """Return the model as the templates know it: wires, delays, sections, parts, outputs."""
    compensation = settings.compensation
    model = compensation.model
    layout = model.layout
    filtered = model.input_filter_s > 0.0
    acting = "acting" if filtered else "input"
    delays: dict[tuple[int, int], str] = {}
    for k in layout.delayed:
        wire, cycles = layout.driven[k], settings.delay_cycles(layout.parts[k])
        if cycles:
            delays.setdefault((wire, cycles), f"late{len(delays) + 1}_k")
    acts = [
        delays.get((wire, settings.delay_cycles(part)), f"{acting}{wire + 1}_k")
        for wire, part in zip(layout.driven, layout.parts, strict=True)
    ]
    parts = [
        {
            "k": k + 1,
            "stem": stem,
            "text": remark_text(part.name),
            "n": layout.driven[k] + 1,
            "terms": _terms(settings, k, acts[k], text),
            "gain": _gain(part, text) if k in layout.gained else None,
            "ranged": part.lowest_k is not None and part.highest_k is not None,
            "lowest_k": text(part.lowest_k or 0.0, "lowest_k", part.name),
            "highest_k": text(part.highest_k or 0.0, "highest_k", part.name),
        }
        for k, (stem, part) in enumerate(zip(settings.names.parts, layout.parts, strict=True))
    ]
    outputs: _Items = []
    spans = zip(settings.names.outputs, model.outputs, compensation.bounds, settings.steps_um,
                layout.spans, strict=True)  # fmt: skip
    for k, (stem, output, bounds, step_um, (first, behind, offset_um)) in enumerate(spans, 1):
        numbers = {key: text(value, key, output.name) for key, value in asdict(bounds).items()}
        outputs.append(
            numbers
            | {
                "k": k,
                "stem": stem,
                "text": remark_text(output.name),
                "rate_step_um": text(step_um, "largest_rate_um_per_s", output.name),
                "offset_um": text(offset_um, "offset_um", output.name),
                "parts": parts[first:behind],
                "ranged": [part for part in parts[first:behind] if part["ranged"]],
            }
        )
    return {
        "filter": text(_alpha(settings, model.input_filter_s), "input_filter_s")
        if filtered
        else None,
        "filter_s": noted(model.input_filter_s),
        "acting": acting,
        "wires": _wires(settings),
        "delays": [
            {"m": m, "n": wire + 1, "cycles": cycles} for m, (wire, cycles) in enumerate(delays, 1)
        ],
        "sections": [
            {
                "i": i,
                "n": wire + 1,
                "tau_s": noted(tau_s),
                "alpha": text(_alpha(settings, tau_s), "parts", layout.parts[owner].name),
                "acts": acts[owner],
            }
            for i, (tau_s, wire, owner) in enumerate(
                zip(layout.taus_s, layout.drives, layout.owners, strict=True), 1
            )
        ],
        "parts": parts,
        "outputs": outputs,
        "ranged": any(part["ranged"] for part in parts),
        "gained": [part for part in parts if part["gain"]],
    }


def _alpha(settings: PlcSettings, tau_s: float) -> float:
    """Return the share of a cycle of a first-order lag. [1]"""
    return -expm1(-settings.cycle_s / tau_s)


def _wires(settings: PlcSettings) -> _Items:
    """Return the inputs of the model: differences to references, and of two channels."""
    model = settings.compensation.model
    channels = [remark_text(channel) for channel in model.channels]
    return [
        {
            "n": n,
            "text": channels[plus] + (f" - {channels[minus]}" if minus >= 0 else ""),
            "plus": plus + 1,
            "minus": minus + 1 if minus >= 0 else 0,
        }
        for n, (plus, minus) in enumerate(model.layout.wires, 1)
    ]


def _terms(settings: PlcSettings, k: int, acts: str, text: _Text) -> _Items:
    """Return the terms of a part: the direct one, where it is not zero or alone, and sections."""
    layout = settings.compensation.model.layout
    part = layout.parts[k]
    terms: _Items = []
    if part.direct_gain_um_per_k != 0.0 or not part.sections:
        gain = text(part.direct_gain_um_per_k, "parts", part.name)
        terms.append({"name": f"direct{k + 1}", "gain": gain, "of": acts, "i": 0})
    own = [i for i, owner in enumerate(layout.owners, 1) if owner == k]
    for i, section in zip(own, part.sections, strict=True):
        gain = text(section.gain_um_per_k, "parts", part.name)
        terms.append({"name": f"gain{i}", "gain": gain, "of": f"fb_lag{i}.x_k", "i": i})
    return terms


def _gain(part: Part, text: _Text) -> dict[str, Any]:
    """Return the gain of a part by the diameter of the workpiece."""
    points = part.gain_by_diameter

    def own(value: float) -> str:
        return text(value, "parts", part.name)

    return {
        "tool": own(part.tool_gain),
        "points": [
            {"k": k, "d": own(p.diameter_mm), "g": own(p.gain)} for k, p in enumerate(points, 1)
        ],
        "spans": [
            {"k": k, "width": own(b.diameter_mm - a.diameter_mm), "rise": own(b.gain - a.gain)}
            for k, (a, b) in enumerate(pairwise(points), 1)
        ],
    }


def _line(settings: PlcSettings, line: LineSettings, text: _Text) -> dict[str, Any]:
    """Return the line as the templates know it."""
    k0_mm, slope = line.bounds(tuple(bounds.total_um for bounds in settings.compensation.bounds))
    # The reference position that the control has is the rounded one.
    origin_mm = stored(line.origin_mm, double=settings.double)
    return {
        "um_per_mm": text(line.um_per_mm, "um_per_mm"),
        "origin_mm": text(origin_mm, "--reference-position"),
        "largest_k0_mm": text(k0_mm, "slope"),
        "largest_slope": text(slope, "slope"),
        "largest_read": text(LARGEST_READ, "read"),
        "unread_um": text(UNREAD_UM, "read"),
        "positions": [
            {
                "k": k,
                "stem": stem,
                "at_mm": text(at_mm, "--at"),
                "way_mm": text(stored(at_mm, double=settings.double) - origin_mm, "--at"),
                "k0": text(k0, "--at"),
                "slope": text(slope, "--at"),
            }
            for k, (stem, at_mm, k0, slope) in enumerate(
                zip(settings.names.outputs, line.positions_mm, *line.weights(), strict=True), 1
            )
        ],
    }
