"""The model block: what belongs to one model, made from a template; it calls the library."""

import re
import textwrap
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from math import expm1
from typing import Any, NamedTuple, TypeAlias, final

from thermaxis import __version__
from thermaxis.codes import Place
from thermaxis.compensation import (
    STATED,
    WITNESS_S,
    Outcome,
    Part,
    Reason,
    SampleQuality,
    SupervisorState,
    TouchOutcome,
    TouchRules,
)
from thermaxis.errors import ConfigurationError
from thermaxis.plc._interface import (
    NEVER_OUTCOMES,
    NEVER_QUALITIES,
    NEVER_TOUCHED,
    Interface,
    interface_of,
)
from thermaxis.plc._library import (
    LIBRARY,
    LIBRARY_VERSION,
    TOUCH,
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
            raise ConfigurationError("no_line_in_model_only", key="--model-only")
        positions = () if self.line is None else self.line.positions_mm
        if self.line is not None and len(positions) != len(self.settings.compensation.bounds):
            raise ConfigurationError("one_position_per_output", key="--at")
        object.__setattr__(self, "_context", self._made())

    @property
    def name(self) -> str:
        """Name of the block that a user calls."""
        return self.settings.names.block

    @property
    def interface(self) -> Interface:
        """Its inputs and outputs."""
        return interface_of(self.settings, self.line, model_only=self.model_only)

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
            raise ConfigurationError("no_lreal_in_cpu", key="--real")
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
        files = c_library(self._libraries, double=self.settings.double)
        source = "model_only.c.j2" if self.model_only else "block.c.j2"
        files[f"{self.name}.h"] = self._rendered("block.h.j2")
        files[f"{self.name}.c"] = self._rendered(source)
        return files

    def _texts(self) -> dict[str, str]:
        texts = {n: st_library(n, double=self.settings.double) for n in self._libraries}
        template = "model_only.st.j2" if self.model_only else "block.st.j2"
        return {**texts, self.name: self._rendered(template)}

    @property
    def _libraries(self) -> tuple[str, ...]:
        touches = self.settings.compensation.touches and not self.model_only
        return (LIBRARY, TOUCH) if touches else (LIBRARY,)

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
            "states": list(SupervisorState),
            "reasons": list(Reason),
            "outcomes": list(Outcome),
            "not_in_time": "the call did not come in time or time of such calls is still owed",
            "qualities": list(SampleQuality),
            "touched": bool(compensation.touches),
            "touch_outcomes": list(TouchOutcome),
            "never": NEVER_OUTCOMES | NEVER_QUALITIES | NEVER_TOUCHED,
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
        compensation, texts = settings.compensation, _Texts(settings.double)
        model, rules = compensation.model, compensation.supervisor
        sensors = _sensors(settings, texts)
        made: dict[str, Any] = {
            "head": self._head(),
            "real": int(not settings.double),
            "library": LIBRARY,
            "library_version": LIBRARY_VERSION,
            "touch_library": TOUCH,
            "channels": sensors[: len(model.channels)],
            "sensors": sensors,
            "later": any(s["w"] > s["k"] for s in sensors),
            "cycle_s": texts.one("cycle_s", settings.cycle_s),
            "shortest_s": texts.one("cycle_s", settings.shortest_cycle_s),
            "longest_s": texts.one("cycle_s", settings.longest_cycle_s),
            "gap_s": texts.one("longest_gap_s", model.longest_gap_s),
            "longest_hold_s": texts.one("longest_hold_s", model.longest_hold_s),
            "margin_k": texts.one("margin_k", compensation.validity_margin_k),
            "lowest_weight": texts.one("lowest_weight", compensation.lowest_weight),
            "rules": texts.all(
                "supervisor",
                **asdict(rules),
                lost_input_s=rules.input_timeout_s + rules.hold_input_s,
            ),
            "line": None if line is None else _line(settings, line, texts),
        }
        return self.said | made | _model(settings, texts)


class _Texts(NamedTuple):
    """Numbers as texts of the target; an error names the key and whose it is."""

    double: bool

    def one(self, key: str, value: float, owner: str = "") -> str:
        return number_text(value, double=self.double, place=Place(key=key, channel=owner))

    def all(self, key: str, owner: str = "", **values: Any) -> dict[str, str]:
        """Return the numbers among some values by their names, which are their keys without one."""
        numbers = {name: v for name, v in values.items() if isinstance(v, int | float)}
        return {name: self.one(key or name, v, owner) for name, v in numbers.items()}


def _sensors(settings: PlcSettings, texts: _Texts) -> _Items:
    compensation = settings.compensation
    references_c, rules = compensation.model.reference_c, compensation.rules
    stems = settings.names.channels
    rows = zip(stems, compensation.judged, rules, compensation.witnesses, strict=True)
    return [
        {
            "k": k,
            "stem": stem,
            "text": remark_text(channel),
            "w": w + 1,
            **texts.all("", channel, **asdict(rule)),
            "reference_c": texts.one("reference_c", references_c.get(channel, 0.0), channel),
            "lately_s": texts.one("frozen_s", min(WITNESS_S, rules[w].frozen_s), channel),
        }
        for k, (stem, channel, rule, w) in enumerate(rows, 1)
    ]


def _model(settings: PlcSettings, texts: _Texts) -> dict[str, Any]:
    """Return the model as the templates know it: wires, delays, sections, parts, outputs."""
    model, names = settings.compensation.model, settings.names
    layout, filter_s = model.layout, model.input_filter_s
    acting = "acting" if filter_s else "input"
    acts: list[str] = []
    delays: dict[tuple[int, int], str] = {}
    for wire, part in zip(layout.driven, layout.parts, strict=True):
        now, cycles = f"{acting}{wire + 1}_k", settings.delay_cycles(part)
        late = f"late{len(delays) + 1}_k"
        acts.append(delays.setdefault((wire, cycles), late) if cycles else now)
    parts: _Items = [
        {
            "k": k + 1,
            "stem": stem,
            "text": remark_text(part.name),
            "n": layout.driven[k] + 1,
            "terms": _terms(settings, k, acts[k], texts),
            "gain": _gain(part, texts) if part.gain_by_diameter else None,
            "ranged": part.lowest_k is not None and part.highest_k is not None,
            **texts.all("", part.name, lowest_k=part.lowest_k, highest_k=part.highest_k),
        }
        for k, (stem, part) in enumerate(zip(names.parts, layout.parts, strict=True))
    ]
    rows = zip(model.outputs, names.outputs, settings.compensation.bounds, settings.steps_um,
               layout.spans, settings.compensation.probed, strict=True)  # fmt: skip
    outputs: _Items = [
        {
            "k": k,
            "stem": stem,
            "text": remark_text(output.name),
            **texts.all("", output.name, **asdict(bounds), offset_um=offset_um),
            "rate_step_um": texts.one("largest_rate_um_per_s", step_um, output.name),
            "acts": own is not None and own.acts,
            "touch": None if own is None else _touch(settings, own, output.name, texts),
            "parts": parts[first:behind],
            "ranged": [part for part in parts[first:behind] if part["ranged"]],
        }
        for k, (output, stem, bounds, step_um, (first, behind, offset_um), own) in enumerate(
            rows, 1
        )
    ]
    channels = [remark_text(channel) for channel in model.channels]
    return {
        "filter": texts.one("input_filter_s", _alpha(settings, filter_s)) if filter_s else None,
        "filter_s": noted(filter_s),
        "acting": acting,
        "wires": [
            {
                "n": n,
                "text": channels[plus] + (f" - {channels[minus]}" if minus >= 0 else ""),
                "plus": plus + 1,
                "minus": minus + 1 if minus >= 0 else 0,
            }
            for n, (plus, minus) in enumerate(layout.wires, 1)
        ],
        "delays": [
            {"m": m, "n": wire + 1, "cycles": cycles} for m, (wire, cycles) in enumerate(delays, 1)
        ],
        "sections": [
            {
                "i": i,
                "n": wire + 1,
                "tau_s": noted(tau_s),
                "alpha": texts.one("parts", _alpha(settings, tau_s), layout.parts[owner].name),
                "acts": acts[owner],
            }
            for i, (tau_s, wire, owner) in enumerate(
                zip(layout.taus_s, layout.drives, layout.owners, strict=True), 1
            )
        ],
        "parts": parts,
        "outputs": outputs,
        "touched": [output for output in outputs if output["touch"]],
        "ranged": any(part["ranged"] for part in parts),
        "gained": [part for part in parts if part["gain"]],
    }


def _touch(settings: PlcSettings, own: TouchRules, name: str, texts: _Texts) -> dict[str, str]:
    """Return the rules of touches: variances, because no power is computed in a block."""
    return texts.all(
        "touches",
        name,
        touch_um2=own.noise_um**2 + own.discrepancy_um**2,
        discrepancy_um2=own.discrepancy_um**2,
        drift_um2_per_h=own.drift_um_per_root_h**2,
        start_um2=own.start_um**2,
        gate=own.gate,
        gate_2=own.gate**2,
        ramp_um_per_h=own.ramp_um_per_h,
        confirm_s=own.confirm_s,
        largest_um=own.limits.largest_um,
        rate_step_um=own.limits.largest_rate_um_per_s * settings.cycle_s,
    )


def _alpha(settings: PlcSettings, tau_s: float) -> float:
    """Return the share of a cycle of a first-order lag. [1]"""
    return -expm1(-settings.cycle_s / tau_s)


def _terms(settings: PlcSettings, k: int, acts: str, texts: _Texts) -> _Items:
    """Return the terms of a part: the direct one, where it is not zero or alone, and sections."""
    layout = settings.compensation.model.layout
    part = layout.parts[k]
    own = [i for i, owner in enumerate(layout.owners, 1) if owner == k]
    terms = [
        (f"gain{i}", section.gain_um_per_k, f"fb_lag{i}.x_k", i)
        for i, section in zip(own, part.sections, strict=True)
    ]
    if part.direct_gain_um_per_k or not terms:
        terms.insert(0, (f"direct{k + 1}", part.direct_gain_um_per_k, acts, 0))
    return [
        {"name": name, "gain": texts.one("parts", gain, part.name), "of": of, "i": i}
        for name, gain, of, i in terms
    ]


def _gain(part: Part, texts: _Texts) -> dict[str, Any]:
    """Return the gain of a part by the diameter of the workpiece."""
    points = part.gain_by_diameter
    return {
        **texts.all("parts", part.name, tool=part.tool_gain),
        "points": [
            {"k": k, **texts.all("parts", part.name, d=p.diameter_mm, g=p.gain)}
            for k, p in enumerate(points, 1)
        ],
        "spans": [
            {
                "k": k,
                **texts.all(
                    "parts", part.name, width=b.diameter_mm - a.diameter_mm, rise=b.gain - a.gain
                ),
            }
            for k, (a, b) in enumerate(pairwise(points), 1)
        ],
    }


def _line(settings: PlcSettings, line: LineSettings, texts: _Texts) -> dict[str, Any]:
    """Return the line as the templates know it."""
    k0_mm, slope = line.bounds(tuple(bounds.total_um for bounds in settings.compensation.bounds))
    # The reference position that the control has is the rounded one.
    origin_mm = stored(line.origin_mm, double=settings.double)
    rows = zip(settings.names.outputs, line.positions_mm, *line.weights(), strict=True)
    return {
        **texts.all("slope", um_per_mm=line.um_per_mm, largest_k0_mm=k0_mm, largest_slope=slope),
        **texts.all("--reference-position", origin_mm=origin_mm),
        **texts.all("read", unread_um=UNREAD_UM),
        "positions": [
            {
                "k": k,
                "stem": stem,
                **texts.all(
                    "--at",
                    at_mm=at_mm,
                    way_mm=stored(at_mm, double=settings.double) - origin_mm,
                    k0=to_k0,
                    slope=to_slope,
                ),
            }
            for k, (stem, at_mm, to_k0, to_slope) in enumerate(rows, 1)
        ],
    }
