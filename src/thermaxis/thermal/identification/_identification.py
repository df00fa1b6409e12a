"""Identify a compensation model from records: one method for all outputs, one form of result."""

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.compensation import CompensationModel, Provenance
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.identification._joint_gains import (
    JointGains,
    joint_gains,
    simulate_from_rest,
)
from thermaxis.thermal.identification._records import Records, compensation_model
from thermaxis.thermal.modal import ModalOptions, ModalResult, PartStd, modal
from thermaxis.thermal.selection import SelectionOptions, SelectionResult, select
from thermaxis.thermal.transfer_function import (
    PolynomialResult,
    ThermalModel,
    arx,
    combine_models,
    held,
    oe,
    thermal_model_of,
)
from thermaxis.thermal.verification import (
    Baseline,
    fit_baseline,
    persistence_one_step,
    simulate_baseline,
)

_MUCH_WORSE = 3.0
"""Times as much as fixed averages leave is said. [1]"""


class Method(StrEnum):
    """Estimators."""

    MODAL = "modal"
    """Direct gain and first-order lags; always stable."""
    OE = "oe"
    """Output error of the paper."""
    ARX = "arx"
    """ARX of the paper."""


@final
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class IdentifiedOutput:
    """The model of one displacement and how sure its numbers are."""

    name: str
    """Channel of the displacement."""
    model: ThermalModel | None
    """Gains and time constants; None where the polynomials are no sum of stable lags."""
    std: tuple[PartStd, ...]
    """Standard deviations, one per part; None within where the record does not support one."""
    fit_percent: float
    """Fit of the free run to the training records, with the start that the estimator fitted. [%]"""
    fit_from_rest_percent: float
    """The same from rest at the first row, as `verify` runs it; low for a test that began warm.
    [%]"""
    noise_std_um: float | None = None
    """White noise of one reading, standard deviation; None where it was not estimated. [µm]"""
    slow_noise_std_um: float | None = None
    """Slow drift that no input explains; None where it was not estimated. [µm]"""
    validation_mae_um: float | None = None
    """Mean absolute error of the free run on parts that were held out; None where there were
    none. [µm]"""
    baseline_mae_um: Mapping[str, float] = field(default_factory=dict[str, float])
    """The same of simple rules, by name; empty where there were none. [µm]"""
    training_rmse_um: Mapping[str, float]
    """Root mean square error on the training rows: of the ``model`` in free run, of a ``static``
    regression and of fixed exponential ``averages`` in free run (both with a ridge), and of
    ``one_step`` persistence, which knows the displacement of the row before. [µm]"""
    static_gains_um_per_k: FloatArray
    """Gains of the static regression, one per input of the records. [µm/K]"""
    polynomials: PolynomialResult | None = None
    """Numerators and denominators of ARX and output error."""
    warnings: tuple[Message, ...]
    """What the user must know of this output."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What was identified."""

    method: Method
    """The estimator."""
    rule: Message
    """How inputs and orders were chosen."""
    outputs: tuple[IdentifiedOutput, ...]
    """Every displacement."""
    stable: bool
    """Whether every model is stable."""
    selection: SelectionResult | None
    """Choice among candidates; None where the inputs were named."""
    warnings: tuple[Message, ...]
    """What the user must know of all outputs."""
    joint: JointGains | None = None
    """Gains by workpiece diameter that were estimated with the parts; None where none were."""

    @property
    def messages(self) -> tuple[Message, ...]:
        """What the user must know of all outputs and of each, its name as the place."""
        own = [replace(w, place=Place(channel=o.name)) for o in self.outputs for w in o.warnings]
        return (*self.warnings, *own)

    def to_compensation_model(
        self,
        records: Records,
        provenance: Provenance | None = None,
        *,
        sentence: Callable[[Message], str] = str,
    ) -> CompensationModel:
        """Return the model that may run on the machine once its limits are set.

        Parameters
        ----------
        records : Records
            What it was identified from.
        provenance : Provenance, optional
            Where it comes from.
        sentence : callable
            Makes the warnings that the model carries, such as `thermaxis.messages.text_of`.
            Default: code, values and place as they are.

        Returns
        -------
        CompensationModel
            Gains and time constants of every output.

        Raises
        ------
        DataError
            If a model is not stable: it must not run anywhere.
        """
        models: dict[str, ThermalModel] = {}
        statics = {output.name: output.static_gains_um_per_k for output in self.outputs}
        for output in self.outputs:
            if output.model is None:
                raise DataError("model_not_stable_lags", output=output.name)
            models[output.name] = output.model
        model = compensation_model(
            models,
            records,
            static_gains_um_per_k=statics,
            provenance=provenance,
            warnings=[*map(sentence, self.messages)],
        )
        if self.joint is None:
            return model
        name = next(iter(models))
        return combine_models([(name, model)], {self.joint.part: self.joint.gain})


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
        Experiments by output.
    method : Method
        The estimator. Default: modal.
    choose : bool
        Whether the inputs are candidates among which the selection chooses, for all outputs
        together; modal only. Default: all inputs are used.
    orders : tuple of int, optional
        na, nb, nk of ARX and output error: order of the denominator, number of numerator
        coefficients, delay in rows. Default: searched up to four. [1]
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
        raise ConfigurationError(
            "method_without_choice", method=str(method), place=Place(key="candidates")
        )
    if method is Method.MODAL and orders is not None:
        raise ConfigurationError("method_without_orders", place=Place(key="orders"))
    with _determined(records):
        if choose:
            return _chosen(records, selection_options)
        return _identified(records, method, orders, modal_options)


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
            place=Place(", ".join([name for name in names if name][:3])),
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
        Experiments with the displacements of all diameters.
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
    with _determined(records):
        found = joint_gains(records, part, diameters_mm, options=modal_options)
        identified = _from_modal(records, found.reference, found.result)
    # the verdict of one output is not that of all diameters
    identified = replace(identified, name=output, warnings=found.result.warnings)
    return Identification(
        method=Method.MODAL,
        rule=Message("rule-joint", {"part": part, "reference": found.reference}),
        outputs=(identified,),
        stable=True,
        selection=None,
        warnings=(),
        joint=found,
    )


def _from_modal(records: Records, name: str, result: ModalResult) -> IdentifiedOutput:
    fit, rmse = _free_run(records, name, result.model)
    beside, static = _beside(records, name, rmse)
    return IdentifiedOutput(
        name=name,
        model=result.model,
        std=result.std,
        fit_percent=result.fit_percent,
        fit_from_rest_percent=fit,
        noise_std_um=result.noise_std_um,
        slow_noise_std_um=result.slow_noise_std_um,
        training_rmse_um=beside,
        static_gains_um_per_k=static,
        warnings=(*result.warnings, *_verdict(result.fit_percent, fit, beside)),
    )


def _verdict(
    fit_percent: float, fit_from_rest_percent: float, rmse_um: Mapping[str, float]
) -> tuple[Message, ...]:
    """Return a warning where simple rules leave less of the training rows than the model."""
    spread = rmse_um["model"] / max(1.0 - 0.01 * fit_from_rest_percent, 1e-9)
    own = spread * (1.0 - 0.01 * fit_percent)
    if own >= rmse_um["static"]:
        code, compared = "no_better_than_static", {"model_um": own, "static_um": rmse_um["static"]}
    elif rmse_um["model"] >= rmse_um["static"]:
        code = "worse_from_rest"
        compared = {"model_um": rmse_um["model"], "static_um": rmse_um["static"]}
    elif own > _MUCH_WORSE * rmse_um["averages"]:
        code, compared = "averages_better", {"averages_um": rmse_um["averages"], "model_um": own}
    else:
        return ()
    values = {name: significant(value, 3) for name, value in compared.items()}
    return (Message(f"warning-{code}", values),)


def _dc_gains_alone(model: ThermalModel, std: Sequence[float | None]) -> tuple[PartStd, ...]:
    """Return standard deviations of the DC gains, and none of the other numbers."""
    return tuple(
        PartStd(None, (None,) * part.gains.size, (None,) * part.gains.size, one, ())
        for part, one in zip(model.parts, std, strict=True)
    )


def _chosen(records: Records, options: SelectionOptions | None) -> Identification:
    names = [definition.name for definition in records.inputs]
    result = select(records.experiments, candidate_names=names, options=options)
    outputs: list[IdentifiedOutput] = []
    for name, chosen in result.outputs.items():
        fit, rmse = _free_run(records, name, chosen.model)
        beside, static = _beside(records, name, rmse)
        outputs.append(
            IdentifiedOutput(
                name=name,
                model=chosen.model,
                std=_dc_gains_alone(chosen.model, [None] * len(chosen.model.parts)),
                fit_percent=fit,
                fit_from_rest_percent=fit,
                validation_mae_um=chosen.validation_mae_um,
                baseline_mae_um=dict(chosen.baseline_mae_um),
                training_rmse_um=beside,
                static_gains_um_per_k=static,
                warnings=(*chosen.flags, *_verdict(fit, fit, beside)),
            )
        )
    findings = [finding.message for finding in result.findings]
    return Identification(
        method=Method.MODAL,
        rule=result.rule,
        outputs=tuple(outputs),
        stable=True,
        selection=result,
        warnings=(*findings, *result.warnings),
    )


def _free_run(records: Records, name: str, model: ThermalModel) -> tuple[float, float]:
    """Return fit and root mean square error of the free run over the training records."""
    wanted = [part.input_name for part in model.parts]
    columns = [[d.name for d in records.inputs].index(name) for name in wanted]
    left = spread = 0.0
    rows = 0
    for experiment in records.experiments[name]:
        u, _ = held(experiment.u[:, columns])
        simulated = simulate_from_rest(model, experiment.sample_time_s, u)
        measured = ~np.isnan(experiment.y)
        y = experiment.y[measured]
        left += float(np.sum((y - simulated[measured]) ** 2))
        spread += float(np.sum((y - np.mean(y)) ** 2))
        rows += y.size
    return 100.0 * (1.0 - float(np.sqrt(left / spread))), float(np.sqrt(left / rows))


def _beside(
    records: Records, name: str, model_rmse_um: float
) -> tuple[dict[str, float], FloatArray]:
    """Return errors of model and baselines on the training records, and the static gains."""
    experiments = records.experiments[name]
    fitted = {
        "static": fit_baseline(Baseline.RIDGE, experiments),
        "averages": fit_baseline(Baseline.AVERAGES_RIDGE, experiments),
    }
    errors: dict[str, list[FloatArray]] = {"static": [], "averages": [], "one_step": []}
    for experiment in experiments:
        for key, model in fitted.items():
            simulated = simulate_baseline(model, experiment.u, experiment.sample_time_s)
            errors[key].append(experiment.y - simulated)
        errors["one_step"].append(experiment.y - persistence_one_step(experiment.y))
    rmse = {
        key: float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2))) for key, parts in errors.items()
    }
    return {"model": model_rmse_um, **rmse}, fitted["static"].gains_um_per_k[:, 0]


def _as_lags(result: PolynomialResult) -> tuple[ThermalModel | None, tuple[Message, ...]]:
    """Return polynomials as gains and time constants, or why they are none."""
    if not result.stable:
        return None, (Message("warning-not_stable"),)
    try:
        return thermal_model_of(result.model), ()
    except DataError as error:
        return None, (Message("warning-no_lags", {"cause": error.message}),)


def _polynomials(
    records: Records, name: str, method: Method, orders: tuple[int, int, int] | None
) -> IdentifiedOutput:
    experiments = records.experiments[name]
    names = [definition.name for definition in records.inputs]
    estimator = arx if method is Method.ARX else oe
    na, nb, nk = orders if orders is not None else (None, None, 0)
    result = estimator(experiments, na, nb, nk, input_names=names)
    model, why = _as_lags(result)
    left = np.concatenate([e.y - s for e, s in zip(experiments, result.simulated_um, strict=True)])
    beside, static = _beside(records, name, float(np.sqrt(np.nanmean(left**2))))
    return IdentifiedOutput(
        name=name,
        model=model,
        std=() if model is None else _dc_gains_alone(model, result.dc_gain_std.tolist()),
        fit_percent=result.fit_percent,
        fit_from_rest_percent=result.fit_percent,
        noise_std_um=result.noise_std_um,
        training_rmse_um=beside,
        static_gains_um_per_k=static,
        polynomials=result,
        warnings=(*result.warnings, *why),
    )
