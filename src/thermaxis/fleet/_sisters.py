"""The model with which a new machine starts: the median of its sisters'."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median, mode
from typing import Final

import numpy as np
from numpy.typing import NDArray

from thermaxis import __version__
from thermaxis.compensation import STATED, CompensationModel, Part, Provenance, Section
from thermaxis.errors import ConfigurationError
from thermaxis.files import model_sha256

LEAST_SISTERS: Final = 3
"""A median of fewer is none. [1]"""
_ON_SISTERS = "identified on sisters, not on this machine"


def sister_model(sisters: Mapping[str, CompensationModel]) -> CompensationModel:
    """Return the median of models of sisters.

    Of each part it is the median of the step responses at every time, fitted by sections with the
    median time constants: medians of single gains would not belong together.

    Not protected: it was identified on other machines. What it leaves is as large as sisters
    differ, until a model of the machine's own takes its place.

    Parameters
    ----------
    sisters : mapping of str to CompensationModel
        Their models in force, by machine; of those that have the same one, the first counts.

    Returns
    -------
    CompensationModel
        The model; it says what it was made from.

    Raises
    ------
    ConfigurationError
        If fewer than three have a model of their own, or they differ in outputs, inputs or
        references.
    """
    own = {name: one for name, one in sisters.items() if _ON_SISTERS not in one.warnings}
    once = {model_sha256(own[name]): name for name in reversed(own)}
    names = [name for name in own if name in once.values()]
    models = [own[name] for name in names]
    if len(models) < LEAST_SISTERS:
        raise ConfigurationError("too_few_sisters", count=len(models), least=LEAST_SISTERS)
    for name, one in zip(names, models, strict=True):
        if _structure(one) != _structure(models[0]):
            raise ConfigurationError("sisters_differ", name=name, other=names[0])
    stated = models[0].channels if models[0].reference == STATED else ()
    outputs = tuple(
        replace(
            same[0],
            parts=tuple(_middle(parts) for parts in zip(*(o.parts for o in same), strict=True)),
            offset_um=median(o.offset_um for o in same),
        )
        for same in zip(*(one.outputs for one in models), strict=True)
    )
    return replace(
        models[0],
        outputs=outputs,
        reference_c={c: median(m.reference_c[c] for m in models) for c in stated},
        provenance=Provenance(
            method=f"median of the models of {', '.join(names)}"[:2000],
            program=f"thermaxis {__version__}",
        ),
        warnings=(_ON_SISTERS,),
    )


def _structure(model: CompensationModel) -> object:
    """Return all that medians are not taken of."""
    parts = [
        [(p.name, p.plus, p.minus, p.gain_by_diameter, p.tool_gain) for p in output.parts]
        for output in model.outputs
    ]
    names = [output.name for output in model.outputs]
    return names, parts, model.reference, model.input_filter_s


def _middle(parts: Sequence[Part]) -> Part:
    count = mode(len(part.sections) for part in parts)
    every = [sorted(s.time_constant_s for s in p.sections) for p in parts]
    alike = [taus for taus in every if len(taus) == count]
    taus_s = np.exp(np.median(np.log(np.reshape(alike, (len(alike), count))), axis=0))
    known = [tau for taus in every for tau in taus] or [1.0]
    time_s = np.geomspace(0.1 * min(known), 10.0 * max(known), 200)
    middle = np.median([_step_response(part, time_s) for part in parts], axis=0)
    direct = any(part.direct_gain_um_per_k for part in parts) or not count
    rises = [*(-np.expm1(-time_s / tau) for tau in taus_s), *[np.ones(time_s.size)] * direct]
    gains = [float(gain) for gain in np.linalg.lstsq(np.stack(rises, axis=1), middle)[0]]
    ranges = [part.range_k for part in parts if part.lowest_k is not None]
    statics = [g for p in parts if (g := p.static_gain_um_per_k) is not None]
    return replace(
        parts[0],
        direct_gain_um_per_k=gains[-1] if direct else 0.0,
        sections=tuple(map(Section, gains, map(float, taus_s))),
        delay_s=median(part.delay_s for part in parts),
        lowest_k=median(low for low, _ in ranges) if ranges else None,
        highest_k=median(high for _, high in ranges) if ranges else None,
        static_gain_um_per_k=median(statics) if statics else None,
    )


def _step_response(part: Part, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    rises = (-s.gain_um_per_k * np.expm1(-time_s / s.time_constant_s) for s in part.sections)
    return part.direct_gain_um_per_k + sum(rises, np.zeros(time_s.size))
