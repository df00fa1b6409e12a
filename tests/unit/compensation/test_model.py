"""A model that may act on a machine: the numbers that it takes, and those that it refuses."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from tests.refusals import refused
from thermaxis.compensation import (
    STATED,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
)
from thermaxis.errors import ConfigurationError

PART = Part("s", "a")


def gains(*diameters_mm: float, gain: float = 1.0) -> Part:
    return Part("s", "a", gain_by_diameter=tuple(GainPoint(d, gain) for d in diameters_mm))


def model(**options: Any) -> CompensationModel:
    return CompensationModel(outputs=(Output("Z_um", (PART,)),), **options)


RANGES: dict[str, tuple[Callable[[float], object], tuple[float, ...], tuple[float, ...]]] = {
    "gain": (lambda x: Section(x, 5.0), (-1e5, 0.0, 1e5), (-1.1e5, 1.1e5)),
    "time constant": (lambda x: Section(1.0, x), (1e-3, 1e8), (-5.0, 0.0, 1.1e8)),
    "direct gain": (lambda x: Part("s", "a", "", x), (-1e5, 1e5), (-1.1e5, 1.1e5)),
    "delay": (lambda x: Part("s", "a", delay_s=x), (0.0, 86_400.0), (-1.0, 86_401.0)),
    "static": (lambda x: Part("s", "a", static_gain_um_per_k=x), (-1e6, 1e6), (-1.1e6, 1.1e6)),
    "diameter": (gains, (-1e6, 0.0, 1e6), (-1.1e6, 1.1e6)),
    "gain by diameter": (lambda x: gains(5.0, gain=x), (-1e3, 1e3), (-1.1e3, 1.1e3)),
    "tool gain": (lambda x: Part("s", "a", tool_gain=x), (-1e3, 1e3), (-1.1e3, 1.1e3)),
    "next diameter": (lambda x: gains(5.0, x), (5.1,), (4.0, 5.0)),
    "lowest": (lambda x: Part("s", "a", lowest_k=x, highest_k=2.0), (-1e6, 2.0), (-1.1e6, 2.1)),
    "highest": (lambda x: Part("s", "a", lowest_k=2.0, highest_k=x), (2.0, 1e6), (1.9, 1.1e6)),
    "offset": (lambda x: Output("Z_um", (PART,), x), (-1e6, 1e6), (-1.1e6, 1.1e6)),
    "figure": (lambda x: Provenance(figures={"Z_um.fit_percent": x}), (0.0,), (-math.inf,)),
    "sample time": (lambda x: model(sample_time_s=x), (1e-3, 86_400.0), (0.0, 86_401.0)),
    "input filter": (lambda x: model(input_filter_s=x), (0.0, 86_400.0), (-0.1, 86_401.0)),
    "longest gap": (lambda x: model(longest_gap_s=x), (1e-3, 1e8), (0.0, 1.1e8)),
    "longest hold": (lambda x: model(longest_hold_s=x), (0.0, 1e6), (-0.1, 1.1e6)),
    "reference": (lambda x: model(reference_c={"a": x}), (-1e6, 1e6), (-1.1e6, 1.1e6)),
}


def test_the_ends_of_a_range_are_taken_and_what_is_beyond_is_refused() -> None:
    for make, taken, beyond in RANGES.values():
        for value in taken:
            make(value)
        for value in (*beyond, math.nan, math.inf):
            with pytest.raises(ConfigurationError):
                make(value)


def test_a_model_that_cannot_be_is_refused_at_its_place() -> None:
    for make, code, key, channel in (
        (lambda: Part("", "a"), "no_channel", "plus", ""),
        (lambda: Part("s", ""), "no_channel", "plus", "s"),
        (lambda: Part("s", "a", "a"), "channel_minus_itself", "minus", "s"),
        (lambda: Part("s", "a", delay_s=-1.0), "outside_range", "delay_s", "s"),
        (
            lambda: Part("s", "a", sections=(Section(1.0, 5.0),) * 201),
            *("outside_count", "sections", "s"),
        ),
        (lambda: gains(5.0, 5.0), "not_rising", "gain_by_diameter", "s"),
        (lambda: Part("s", "a", lowest_k=1.0), "half_range", "lowest_k, highest_k", "s"),
        (lambda: Part("s", "a", highest_k=1.0), "half_range", "lowest_k, highest_k", "s"),
        (lambda: Output("", (PART,)), "output_without_name", "name", ""),
        (lambda: Output("Z_um", ()), "outside_count", "parts", "Z_um"),
        (lambda: Output("Z_um", (PART, PART)), "stated_twice", "parts", "Z_um"),
        (
            lambda: Output("Z_um", tuple(Part(f"s{k}", "a") for k in range(201))),
            *("outside_count", "parts", "Z_um"),
        ),
        (lambda: CompensationModel(outputs=()), "outside_count", "outputs", ""),
        (
            lambda: CompensationModel(outputs=(Output("Z_um", (PART,)),) * 2),
            *("stated_twice", "outputs", ""),
        ),
        (
            lambda: CompensationModel(outputs=tuple(Output(f"Z{k}", (PART,)) for k in range(201))),
            *("outside_count", "outputs", ""),
        ),
        (lambda: model(reference=STATED), "reference_missing", "reference_c", ""),
        (lambda: model(reference="middle"), "unknown_choice", "reference", ""),
        (lambda: Provenance(figures={"rmse": math.nan}), "not_finite", "figures.rmse", ""),
    ):
        with refused(code, key=key, channel=channel):
            make()


def test_as_many_parts_sections_and_outputs_as_allowed_are_taken() -> None:
    part = Part("s", "a", sections=(Section(1.0, 5.0),) * 200)
    parts = (part, *(Part(f"s{k}", "a") for k in range(199)))
    outputs = (Output("Z_um", parts), *(Output(f"Z{k}", (PART,)) for k in range(199)))
    assert CompensationModel(outputs=outputs).channels == ("a",)
