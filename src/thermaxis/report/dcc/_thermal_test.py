"""Results of a thermal test as quantities of D-SI."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from thermaxis.report.dcc._results import Content, result
from thermaxis.report.dcc._types import NORMAL
from thermaxis.report.dcc._xml import Quantity, Uncertainty, element, words

_UNITS = {"um": r"\micro\metre", "um/m": r"\micro\metre\metre\tothe{-1}"}
_RANGES = {
    "first_hour": ("rangeFirstHour", "range within the first 60 min"),
    "whole": ("range", "range within the whole test or motion"),
    "cooling": ("rangeCooling", "range after the motion"),
}
_AMBIENT = {
    "range_k": ("ambientRange", r"\kelvin", "range of"),
    "gradient_k_per_h": (
        "ambientGradient",
        r"\kelvin\hour\tothe{-1}",
        "largest change per hour of",
    ),
}
_CASES = {
    "measured": "Thermal test as measured",
    "left_by_model": "Left by the model in free run (not a result of ISO 230-3)",
    "in_force": "Thermal test with compensation in force",
}


def thermal_test_results(results: Content) -> Iterator[Element]:
    """Yield the results of each case of a thermal test, from its JSON."""
    for case in results["cases"]:
        name, data = case["case"], [*_ranges(case, results["coverage_factor"]), *_ambient(case)]
        if case["spans_h"]:
            data.append(_within_spans(case))
        yield result(_CASES[name], f"thermalTest_{name}", "iso230_3 gum_terms", data)


def _symbol(one: Content) -> str:
    """Return a name as a type may have it."""
    return str(one["name"]).replace("+", "_forward").replace("-", "_backward")


def _ranges(case: Content, k: float) -> Iterator[Element]:
    for one in case["quantities"]:
        for key, (kind, meaning) in _RANGES.items():
            if (figure := one[key]) is not None:
                u = Uncertainty([figure["expanded_uncertainty"]], NORMAL, k)
                yield Quantity(
                    f"thermaxis_{_symbol(one)}_{kind}",
                    f"{one['name']}, {meaning}",
                    _UNITS[one["unit"]],
                    [figure["value"]],
                    u,
                ).as_element()


def _ambient(case: Content) -> Iterator[Element]:
    for one in case["temperatures"]:
        for key, (kind, unit, meaning) in _AMBIENT.items():
            if one["ambient"] and one[key] is not None:
                name = f"{meaning} ambient temperature, {one['channel']}"
                yield Quantity(f"thermaxis_{kind}", name, unit, [one[key]]).as_element()


def _within_spans(case: Content) -> Element:
    spans = Quantity("thermaxis_span", "span t", r"\hour", case["spans_h"], listed=True)
    found = (
        Quantity(
            f"thermaxis_{_symbol(one)}_etve",
            f"ETVE({one['name']}, t)",
            _UNITS[one["unit"]],
            one["within_spans"],
            listed=True,
        )
        for one in case["quantities"]
    )
    return element(
        "dcc:list", words("dcc:name", "ETVE(D, t)"), *(one.as_element() for one in (spans, *found))
    )
