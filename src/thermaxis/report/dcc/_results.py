"""Results of a run as quantities of D-SI, each with its type, unit and uncertainty."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias
from xml.etree.ElementTree import Element

from thermaxis.positioning import Edition
from thermaxis.quantities import AxisKind
from thermaxis.report.dcc._types import (
    CHANGES,
    DRIFT,
    DRIFT_FREE_FIGURES,
    FIGURES,
    LEVELS,
    NORMAL,
    TARGET,
    TARGETS,
    QuantityType,
    unit_of,
)
from thermaxis.report.dcc._xml import Quantity, Uncertainty, element, words

Content: TypeAlias = Mapping[str, Any]
"""Results of a run, or a part of them, as its JSON has them."""
_NOT_OF_THE_STANDARD = "without drift (not a result of ISO 230-2)"


def results_of(results: Content) -> list[Element]:
    """Return the results of a run, from its JSON."""
    axis = AxisKind(results["test"]["kind"])
    edition = Edition(results["iso230_2"]["edition"])
    drift: Content | None = results["drift"]
    uncertainty: Content = results["uncertainty"] or {"measured": {"stated": ()}}
    stated: Sequence[str] = uncertainty["measured"]["stated"]
    rows = [{**row, "stated": row["figure"] in stated} for row in results["figure_table"]]
    targets: Sequence[Content] = results["iso230_2"]["targets"]
    figures = _figures(axis, rows, FIGURES, edition)
    parts = [
        result("Figures of ISO 230-2", "figures", "iso230_2 gum", figures),
        result("Targets", "targets", "iso230_2", [_over_targets(axis, targets, TARGETS)]),
    ]
    if drift is not None:
        levels = [key for kind in LEVELS for key in (kind.key, kind.uncertainty)]
        free = [
            {**row, **{key: drift[key][k] for key in levels}}
            for k, row in enumerate(drift["iso230_2"]["targets"])
        ]
        figures = _figures(axis, rows, DRIFT_FREE_FIGURES, edition)
        lists = [_over_targets(axis, free, (*LEVELS, *TARGETS), "_driftFree")]
        parts += [
            result(f"Figures {_NOT_OF_THE_STANDARD}", "figures_driftFree", "drift gum", figures),
            result(f"Targets {_NOT_OF_THE_STANDARD}", "targets_driftFree", "drift", lists),
            result("Drift", "drift", "drift", _drift(axis, drift)),
        ]
    return parts


def result(name: str, ref_type: str, methods: str, data: Iterable[Element]) -> Element:
    """Return quantities with the methods that gave them."""
    return element(
        "dcc:result",
        words("dcc:name", name),
        element("dcc:data", *data),
        refId=methods,
        refType=f"thermaxis_{ref_type}",
    )


def _quantity(
    axis: AxisKind, kind: QuantityType, rows: Sequence[Content], *, listed: bool = False
) -> Quantity:
    """Return a quantity of rows that have it, with its uncertainty where all of them have one."""
    unit, shift = unit_of(axis, kind.unit)
    uncertainties: list[Any] = [row.get(kind.uncertainty) for row in rows]
    factor = rows[0].get(kind.factor)
    uncertainty = None
    if None not in uncertainties and (not kind.factor or (factor or 0.0) >= 1.0):
        uncertainty = Uncertainty(uncertainties, kind.distribution, factor)
    values = tuple(row[kind.key] for row in rows)
    return Quantity(kind.ref_type, kind.meaning, unit, values, uncertainty, listed, shift)


# ---- figures ------------------------------------------------------------------------------------


def _figures(
    axis: AxisKind, rows: Sequence[Content], kinds: Sequence[QuantityType], edition: Edition
) -> Iterator[Element]:
    for row in rows:
        for kind in kinds:
            if row.get(kind.key) is not None:
                of_figure = kind.of_figure(row["figure"], edition)
                if kind.key == "value" and row["stated"]:
                    of_figure = replace(of_figure, distribution=NORMAL)
                conformity = _conformity(axis, row) if kind.key == "value" else None
                yield _quantity(axis, of_figure, [row]).as_element(conformity)


def _conformity(axis: AxisKind, row: Content) -> Element | None:
    """Return the verdict on a figure, with its limit."""
    if row.get("limit") is None:
        return None
    unit, _ = unit_of(axis, "deviation")
    limit = Quantity("basic_toleranceLimitUpper", "limit", unit, (row["limit"],)).as_element()
    return conformity(row["verdict"], f"{row['figure']}: {row['verdict']}", limit)


def conformity(verdict: str, declaration: str, limit: Element | None = None) -> Element:
    """Return a statement of conformity; what is not decided is neither pass nor fail."""
    decided = verdict if verdict in {"pass", "fail"} else None
    return element(
        "dcc:metaData",
        words("dcc:name", "Conformity"),
        words("dcc:declaration", declaration),
        decided and element("dcc:conformity", decided),
        limit if limit is None else element("dcc:data", limit),
        refType="basic_conformity",
    )


# ---- lists --------------------------------------------------------------------------------------


def _over_targets(
    axis: AxisKind, rows: Sequence[Content], kinds: Sequence[QuantityType], suffix: str = ""
) -> Element:
    """Return quantities over the targets."""
    own = (replace(kind, name=kind.name + suffix) for kind in kinds)
    return _list(axis, "Targets", rows, (TARGET, *own))


def _list(
    axis: AxisKind, name: str, rows: Sequence[Content], kinds: Iterable[QuantityType]
) -> Element:
    """Return quantities with one value for each row; what the run does not have is left out."""
    known = [kind for kind in kinds if all(row[kind.key] is not None for row in rows)]
    quantities = (_quantity(axis, kind, rows, listed=True).as_element() for kind in known)
    return element("dcc:list", words("dcc:name", name), *quantities)


def _drift(axis: AxisKind, drift: Content) -> Iterator[Element]:
    for kind in DRIFT:
        if drift.get(kind.key) is not None:
            yield _quantity(axis, kind, [drift]).as_element()
    changes: Sequence[Content] = drift["changes"]
    unit = axis.units.deviation_suffix
    kinds = [
        replace(k, key=k.key.format(unit), uncertainty=k.uncertainty.format(unit)) for k in CHANGES
    ]
    for name in dict.fromkeys(change["kind"] for change in changes):
        own = [change for change in changes if change["kind"] == name]
        steps = _list(axis, f"Steps of the drift: {name}", own, kinds)
        steps.set("refType", f"thermaxis_changes_{name}")
        yield steps
