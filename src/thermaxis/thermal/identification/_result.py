"""What an identification is: models by output, their figures, and the model that may run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import final

from thermaxis.codes import Message, Place
from thermaxis.compensation import CompensationModel, Provenance
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.design import NextTest
from thermaxis.thermal.identification._joint_gains import JointGains
from thermaxis.thermal.identification._records import Records, compensation_model
from thermaxis.thermal.modal import (
    LagTrial,
    PartStd,
    ResponseEvidence,
    ResponsePosterior,
)
from thermaxis.thermal.selection import SelectionResult
from thermaxis.thermal.transfer_function import PolynomialResult, ThermalModel, combine_models
from thermaxis.thermal.verification import (
    LogStart,
    MeasuredOutput,
    VerificationFigures,
    VerifiedOutput,
)

VERDICTS = frozenset({"warning-not_fit", "warning-explains_nothing"})
"""Warnings by which a model is not to be used."""


class Method(StrEnum):
    """Estimators."""

    MODAL = "modal"
    """Direct gain and first-order lags; always stable."""
    OE = "oe"
    """Output error of the paper."""
    ARX = "arx"
    """ARX of the paper."""
    AVERAGES = "averages"
    """Ridge on the inputs and their exponential averages over fixed times."""
    STATIC = "static"
    """Ridge on the inputs alone: no lag."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """What the method is worth on rows that it did not see: all of it, fitted anew without them."""

    what: Message
    """Which rows: ``held_out-later_part`` of the same runs, ``held_out-other_runs``, or of few
    measured rows one of the ``held_out-stretches`` after the other."""
    fit_percent: float | None
    """Fit of the free run; None where the displacement is constant there. [%]"""
    rmse_um: Mapping[str, float]
    """Root mean square error in free run of the ``model``, of a ``static`` regression and of fixed
    exponential ``averages``, each fitted to the same rows and relative to the start of the log;
    of ``hold``, the last displacement before them, or none where another run is judged. [µm]"""
    constant_um: float
    """What the better of two constants known before leaves: that displacement, or the mean of those
    before the rows; zero where another run is judged. [µm]"""
    starts: tuple[LogStart, ...]
    """How every run that judges began, by the evidence of `verify`."""

    @property
    def in_stretches(self) -> bool:
        """Whether few measured rows, such as touches, were held out in stretches."""
        return self.what.code == "held_out-stretches"


@final
@dataclass(frozen=True, slots=True, eq=False)
class Regimes:
    """Gains and time constants that change with a column of two values, such as a coolant's."""

    log: str
    """The log that they are of."""
    column: str
    values: tuple[float, float]
    models: tuple[ThermalModel, ThermalModel]
    """What holds at each, with the same lags in the same order (`simulate_switched`)."""
    held_out_rmse_um: float
    """Root mean square error of the free run that switches, from rest, on the last 30 % of the
    measured rows, about its mean on those before, of which the models are made. [µm]"""
    one_model_rmse_um: float
    """That of gains and lags that do not switch, judged alike; more. [µm]"""


@final
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class IdentifiedOutput:
    """The model of one displacement and how sure its numbers are."""

    name: str
    model: ThermalModel | None
    """Gains and time constants; None where the polynomials are no sum of stable lags."""
    std: tuple[PartStd, ...]
    """Standard deviations, one per part; None within where the record does not support one."""
    posterior: ResponsePosterior | None = None
    """How sure its responses are; None where that is not known, or by the polynomials."""
    evidence: ResponseEvidence | None = None
    """What the record says before lags are chosen, until the next test is known."""
    noise_std_um: float | None = None
    """White noise of one reading, standard deviation; None where it was not estimated. [µm]"""
    slow_noise_std_um: float | None = None
    """Slow drift that no input explains; None where it was not estimated, or where it is in the
    noise, as touches do not tell it apart. [µm]"""
    trained: VerificationFigures | None = None
    """Figures of the free run along the training logs, of the model as it is written: those that
    `verify` finds there. None where there is no model."""
    runs: tuple[VerifiedOutput, ...] = ()
    """That free run along every training log that has the output, each from the start that `verify`
    finds."""
    training_rmse_um: Mapping[str, float] = field(default_factory=dict[str, float])
    """Root mean square error along the training logs: of the ``model`` in free run, of a ``static``
    regression and of fixed exponential ``averages`` (both with a ridge) run alike, and of
    ``one_step`` persistence, which knows the displacement of the row before. [µm]"""
    held_out: HeldOut | None = None
    """The same on rows that were held out; None where too few were measured."""
    static_gains_um_per_k: FloatArray
    """Gains of the static regression, one per input of the records. [µm/K]"""
    polynomials: PolynomialResult | None = None
    """Numerators and denominators of ARX and output error."""
    trials: tuple[LagTrial, ...] = ()
    """Sets of lags that `modal` tried; those of ARX and output error are in `polynomials`."""
    next_test: NextTest | None = None
    """What to measure next; None without a model, and where candidates were chosen among: which
    of them are sources is not known."""
    regimes: tuple[Regimes, ...] = ()
    """What holds in each of two regimes, by log, where it leaves clearly less than one model."""
    warnings: tuple[Message, ...]
    """What the user must know of this output."""

    @property
    def fit_percent(self) -> float | None:
        """Fit of the written model's free run to the training logs; None without a model. [%]"""
        return None if self.trained is None else self.trained.fit_percent

    @property
    def starts(self) -> tuple[LogStart, ...]:
        """How every training log began, by the evidence of `verify`."""
        return tuple(run.start.start for run in self.runs)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What was identified."""

    method: Method
    rule: Message
    """How inputs and orders were chosen."""
    outputs: tuple[IdentifiedOutput, ...]
    stable: bool
    """Whether every model is stable."""
    selection: SelectionResult | None
    """Choice among candidates; None where the inputs were named."""
    warnings: tuple[Message, ...]
    """What the user must know of all outputs."""
    joint: JointGains | None = None
    """Gains by workpiece diameter that were estimated with the parts; None where none were."""

    def measured_of(self, output: str) -> tuple[MeasuredOutput, ...]:
        """Return the channels with which an output of the model is compared."""
        if self.joint is None:
            return (MeasuredOutput(output, output),)
        at = self.joint.diameters_mm.items()
        return tuple(MeasuredOutput(channel, output, d_mm) for channel, d_mm in at)

    def reference_of(self, output: str) -> str:
        """Return the channel to which an output of the model belongs as it is."""
        return output if self.joint is None else self.joint.reference

    @property
    def messages(self) -> tuple[Message, ...]:
        """What the user must know of all outputs and of each, its name as the place."""
        own = [
            replace(w, place=Place(w.place.file, channel=o.name))
            for o in self.outputs
            for w in o.warnings
        ]
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
                cause = [w.values["cause"] for w in output.warnings if "cause" in w.values]
                raise DataError("model_not_stable_lags", output=output.name, cause=(*cause, "")[0])
            models[output.name] = output.model
        model = compensation_model(
            models,
            records,
            static_gains_um_per_k=statics,
            provenance=provenance,
            warnings=[*map(sentence, sorted(self.messages, key=lambda m: m.code not in VERDICTS))],
        )
        if self.joint is None:
            return model
        name = next(iter(models))
        return combine_models([(name, model)], {self.joint.part: self.joint.gain})
