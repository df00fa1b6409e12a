"""Identify a compensation model from records: one method for all outputs, one form of result."""

import math
import re
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise

import numpy as np

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal.design import next_test
from thermaxis.thermal.identification._far_touches import without_far_touches
from thermaxis.thermal.identification._figures import (
    SIMPLE,
    simple_model,
    static_gains,
    with_figures,
)
from thermaxis.thermal.identification._joint_gains import joint_gains
from thermaxis.thermal.identification._records import Records, compensation_model, has_output
from thermaxis.thermal.identification._regimes import with_regimes
from thermaxis.thermal.identification._result import Identification, IdentifiedOutput, Method
from thermaxis.thermal.log import Experiment
from thermaxis.thermal.modal import (
    ModalOptions,
    ModalResult,
    PartStd,
    modal,
    response_evidence,
)
from thermaxis.thermal.selection import SelectionOptions, faulty_candidates, select
from thermaxis.thermal.transfer_function import (
    LEAST_LOG_RATIO,
    PolynomialResult,
    ThermalModel,
    arx,
    held,
    oe,
    simulate_modal,
    thermal_model_of,
)

MOST_APART = 0.5
"""Gains and lags differ from the polynomials by at most so much of what these leave, which adds an
eighth to it. [1]"""
_ROUNDING_UM, _ROUNDING = 1e-6, 0.05
KNOWN = 0.05
"""Share of a DC gain within which it is known well enough. [1]"""
_AROUND = re.compile(r"ambient|hall|room|umgebung|(?<![a-z])air(?![a-z])", re.IGNORECASE)


def identify(
    records: Records,
    *,
    method: Method = Method.MODAL,
    choose: bool = False,
    orders: tuple[int, int, int] | None = None,
    modal_options: ModalOptions | None = None,
    selection_options: SelectionOptions | None = None,
) -> Identification:
    """Identify the model of every output of records.

    Parameters
    ----------
    records : Records
        Logs as experiments, of `records_of`.
    method : Method
        The estimator. Default: modal.
    choose : bool
        Whether the inputs are candidates among which the selection chooses, for all outputs
        together; modal only. Default: all inputs are used.
    orders : tuple of int, optional
        na, nb, nk of ARX and output error: order of the denominator, number of numerator
        coefficients, delay in rows. Default: searched up to three.
    modal_options, selection_options : optional
        As of `modal` and `select`.

    Returns
    -------
    Identification
        Models, their uncertainty and warnings.

    Raises
    ------
    ConfigurationError
        If options do not go together.
    DataError
        If the records do not allow a model, or do not determine its numbers.

    References
    ----------
    Mareš and Horejš 2021, section 3.
    """
    if method is not Method.MODAL and choose:
        raise ConfigurationError("method_without_choice", method=str(method), key="candidates")
    if method not in (Method.OE, Method.ARX) and orders is not None:
        raise ConfigurationError("method_without_orders", method=str(method), key="orders")

    healthy = selection_options or SelectionOptions()
    if choose:
        faulty = faulty_candidates(records.logs, records.inputs)
        healthy = replace(healthy, faulty=(*healthy.faulty, *faulty))

    def estimated(part: Records, options: ModalOptions | None) -> Identification:
        with _determined(part):
            if choose:
                return _chosen(part, healthy)
            return _identified(part, method, orders, options)

    brief = _without_intervals(modal_options)
    records, far = without_far_touches(records)
    found = with_figures(
        estimated(records, modal_options), records, lambda part: estimated(part, brief)
    )
    told = [replace(o, warnings=(*far.get(o.name, ()), *o.warnings)) for o in found.outputs]
    found = replace(found, outputs=tuple(told))
    if orders is None and not (brief.time_constants_s or brief.delays_s):
        found = replace(found, outputs=tuple(with_regimes(o, records) for o in found.outputs))
    return _with_units_assumed(_with_next_tests(found, records), records)


def _without_intervals(options: ModalOptions | None) -> ModalOptions:
    """Return the options of a fit that is only judged, in about half of the time."""
    return replace(options or ModalOptions(), intervals=False)


@contextmanager
def _determined(records: Records) -> Generator[None]:
    """Say in words where the numbers of a model cannot be solved for."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        names = dict.fromkeys(e.name for each in records.experiments.values() for e in each)
        raise DataError(
            "rows_not_determining",
            cause=str(error),
            file=", ".join([name for name in names if name][:3]),
        ) from None


def _identified(
    records: Records,
    method: Method,
    orders: tuple[int, int, int] | None,
    options: ModalOptions | None,
) -> Identification:
    names = [definition.name for definition in records.inputs]
    if method is Method.MODAL:
        results = [
            _from_modal(records, name, modal(e, input_names=names, options=options))
            for name, e in records.experiments.items()
        ]
        rule = Message("rule-modal")
    elif method in SIMPLE:
        results = [_simple(records, name, method) for name in records.experiments]
        rule = Message(f"rule-{method}")
    else:
        results = [_polynomials(records, name, method, orders) for name in records.experiments]
        rule = Message("rule-orders_searched")
        if orders is not None:
            rule = Message("rule-orders_stated", dict(zip(("na", "nb", "nk"), orders, strict=True)))
    return Identification(
        method=method,
        rule=rule,
        outputs=tuple(results),
        stable=all(o.polynomials is None or o.polynomials.stable for o in results),
        selection=None,
        warnings=(),
    )


def identify_joint(
    records: Records,
    output: str,
    part: str,
    diameters_mm: Mapping[str, float | None],
    *,
    modal_options: ModalOptions | None = None,
) -> Identification:
    """Identify one output from its displacements at several workpiece diameters.

    Parameters
    ----------
    records : Records
        Logs as experiments, of `records_of`.
    output : str
        Name of the model's output.
    part : str
        Name of the input whose part acts differently at each diameter.
    diameters_mm : mapping of str to float or None
        Diameter by channel; None for the tool centre point. [mm]
    modal_options : ModalOptions, optional
        As of `modal`.

    Returns
    -------
    Identification
        One output with `joint` gains; its figures are of all displacements together.

    Raises
    ------
    ConfigurationError, DataError
        As of `joint_gains`; also if the rows do not determine the model's numbers.

    References
    ----------
    Mareš and Horejš 2021, equation (8).
    """

    def estimated(part_of: Records, options: ModalOptions | None) -> Identification:
        with _determined(part_of):
            found = joint_gains(part_of, part, diameters_mm, options=options)
            one = _from_modal(part_of, found.reference, found.result)
            one = replace(one, name=output, evidence=None)  # that of all diameters
        rule = Message("rule-joint", {"part": part, "reference": found.reference})
        return Identification(
            Method.MODAL, rule, (one,), stable=True, selection=None, warnings=(), joint=found
        )

    brief = _without_intervals(modal_options)
    judged = with_figures(
        estimated(records, modal_options), records, lambda part_of: estimated(part_of, brief)
    )
    return _with_units_assumed(_with_next_tests(judged, records), records)


def _with_units_assumed(found: Identification, records: Records) -> Identification:
    """Warn of outputs that were taken to be in µm, as no known unit is stated."""
    names = [
        name
        for name in records.experiments
        if any(has_output(log, name) and not log.units[log.name_of(name)] for log in records.logs)
    ]
    warning = Message("warning-outputs_without_unit", {"names": ", ".join(names)})
    return replace(found, warnings=(*found.warnings, warning)) if names else found


def _with_next_tests(found: Identification, records: Records) -> Identification:
    """Return an identification with the tests that would help most, where intervals are stated."""
    if found.selection is not None or found.method is not Method.MODAL:
        return found
    names = [definition.name for definition in records.inputs]
    log = records.logs[0]
    alike = [(log.units[log.name_of(d.plus)], d.minus is None) for d in records.inputs]
    references = {d.minus for d in records.inputs}
    around = {
        d.name
        for d in records.inputs
        if d.minus is None and (d.plus in references or _AROUND.search(f"{d.name} {d.plus}"))
    }
    outputs: list[IdentifiedOutput] = []
    for output in found.outputs:
        if output.model is not None and output.posterior is not None:
            parts = output.model.parts
            evidence = output.evidence
            if evidence is None:
                options = ModalOptions(delays_s=tuple(part.delay_s for part in parts))
                experiments = records.experiments[found.reference_of(output.name)]
                evidence = response_evidence(experiments, options)
            asked = next_test(evidence, names, alike)
            half = dict(zip(names, (1.96 * output.posterior.dc_std).tolist(), strict=True))
            known = {p.input_name for p in parts if half[p.input_name] <= KNOWN * abs(p.dc_gain)}
            not_asked = frozenset(around | known)
            open_um = {test.input: test.level_k * half[test.input] for test in asked.tests}
            settled_um = {name: um for name, um in open_um.items() if math.isfinite(um)}
            asked = replace(asked, not_asked=not_asked, settled_um=settled_um)
            output = replace(output, next_test=asked, evidence=None)  # noqa: PLW2901 - the same output
        outputs.append(output)
    return replace(found, outputs=tuple(outputs))


def _from_modal(records: Records, name: str, result: ModalResult) -> IdentifiedOutput:
    return IdentifiedOutput(
        name=name,
        model=result.model,
        std=result.std,
        posterior=result.posterior,
        evidence=result.evidence,
        noise_std_um=result.noise_std_um,
        slow_noise_std_um=result.slow_noise_std_um,
        static_gains_um_per_k=static_gains(records, name),
        trials=result.trials,
        warnings=result.warnings,
    )


def _simple(records: Records, name: str, method: Method) -> IdentifiedOutput:
    model = simple_model(records, name, SIMPLE[method])
    return IdentifiedOutput(
        name=name,
        model=model,
        std=_dc_gains_alone(model, [None] * len(model.parts)),
        static_gains_um_per_k=static_gains(records, name),
        warnings=(),
    )


def _dc_gains_alone(model: ThermalModel, std: Sequence[float | None]) -> tuple[PartStd, ...]:
    """Return standard deviations of the DC gains, and none of the other numbers."""
    return tuple(
        PartStd(None, (None,) * part.gains.size, (None,) * part.gains.size, one, ())
        for part, one in zip(model.parts, std, strict=True)
    )


def _chosen(records: Records, options: SelectionOptions) -> Identification:
    names = [definition.name for definition in records.inputs]
    result = select(records.experiments, candidate_names=names, options=options)
    outputs = [
        IdentifiedOutput(
            name=name,
            model=chosen.model,
            std=_dc_gains_alone(chosen.model, [None] * len(chosen.model.parts)),
            static_gains_um_per_k=static_gains(records, name),
            warnings=chosen.flags,
        )
        for name, chosen in result.outputs.items()
    ]
    names = ", ".join(options.faulty)
    left_out = [Message("warning-candidates_left_out", {"names": names})] if names else []
    return Identification(
        method=Method.MODAL,
        rule=result.rule,
        outputs=tuple(outputs),
        stable=True,
        selection=result,
        warnings=(*left_out, *result.warnings),
    )


def _as_lags(
    result: PolynomialResult, name: str, records: Records
) -> tuple[ThermalModel | None, tuple[Message, ...]]:
    """Return polynomials as gains and time constants, or why a model file cannot hold them."""
    try:
        model = thermal_model_of(result.model)
        _check_apart(model)
        compensation_model({name: model}, records)
        _check_same(result, model, records.experiments[name])
    except (DataError, ConfigurationError) as error:
        return None, (Message("warning-no_lags", {"cause": error.message}),)
    return model, ()


def _check_apart(model: ThermalModel) -> None:
    """Refuse two lags that are one, with gains against each other: a derivative."""
    for part in model.parts:
        for one, other in pairwise(np.argsort(part.time_constants_s).tolist()):
            first_s, second_s = part.time_constants_s[[one, other]].tolist()
            against = part.gains[one] * part.gains[other] < 0.0
            if against and math.log(second_s / first_s) < LEAST_LOG_RATIO * (1.0 - _ROUNDING):
                ratio = math.exp(LEAST_LOG_RATIO)
                raise DataError(
                    "lags_too_close",
                    first_s=first_s,
                    second_s=second_s,
                    ratio=ratio,
                    key=part.input_name,
                )


def _check_same(
    result: PolynomialResult, model: ThermalModel, experiments: Sequence[Experiment]
) -> None:
    """Refuse gains and lags that do not follow the polynomials: fast modes were left out."""
    pairs = list(zip(experiments, result.simulated_um, strict=True))
    apart = [simulate_modal(model, e.sample_time_s, held(e.u)[0]) - s for e, s in pairs]
    left = [e.y - s for e, s in pairs]
    apart_um, left_um = (float(np.sqrt(np.nanmean(np.concatenate(e) ** 2))) for e in (apart, left))
    if apart_um > MOST_APART * left_um + _ROUNDING_UM:
        raise DataError("lags_differ", apart_um=apart_um, left_um=left_um)


def _polynomials(
    records: Records, name: str, method: Method, orders: tuple[int, int, int] | None
) -> IdentifiedOutput:
    experiments = records.experiments[name]
    names = [definition.name for definition in records.inputs]
    estimator = arx if method is Method.ARX else oe
    na, nb, nk = orders if orders is not None else (None, None, 0)
    result = estimator(experiments, na, nb, nk, input_names=names)
    model, why = _as_lags(result, name, records)
    return IdentifiedOutput(
        name=name,
        model=model,
        std=() if model is None else _dc_gains_alone(model, result.dc_gain_std.tolist()),
        noise_std_um=result.noise_std_um,
        static_gains_um_per_k=static_gains(records, name),
        polynomials=result,
        warnings=(*result.warnings, *why),
    )
