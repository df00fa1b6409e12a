"""Thermal errors: logs, identification, verification; thermal fields. Numbers in, results out."""

from importlib import import_module
from typing import TYPE_CHECKING

from thermaxis.thermal._field import (
    MOST_PIXELS,
    DriftRelation,
    Region,
    RegionDrift,
    ThermalField,
    ThermalFieldsResult,
    correct_emissivity,
    default_regions,
    evaluate_thermal_fields,
    relate_to_drift,
)

if TYPE_CHECKING:
    from thermaxis.thermal._arx import (
        arx,
    )
    from thermaxis.thermal._baselines import (
        Baseline,
        BaselineModel,
        fit_baseline,
        simulate_baseline,
    )
    from thermaxis.thermal._conversion import (
        PAPER_SPINDLE,
        PAPER_TABLE,
        PrintedTransferFunction,
        RoundingLoss,
        change_sample_time,
        equivalent_part,
        modal_form,
        modal_part,
        polynomial_model_of,
        printed_with,
        rounding_loss,
        thermal_model_of,
        transfer_function_of,
    )
    from thermaxis.thermal._experiment import (
        Experiment,
    )
    from thermaxis.thermal._figures import (
        SimulationFigures,
        fit_percent,
        simulation_figures,
    )
    from thermaxis.thermal._identification import (
        Identification,
        IdentifiedOutput,
        Method,
        identify,
        identify_joint,
    )
    from thermaxis.thermal._input import (
        InputDefinition,
        check_inputs,
        evaluate_input,
        parse_input,
    )
    from thermaxis.thermal._joint_gains import (
        JointGains,
        joint_gains,
    )
    from thermaxis.thermal._log_quality import (
        LogFinding,
        check_log,
    )
    from thermaxis.thermal._merge import (
        ShiftResult,
        find_shift,
        merge_logs,
    )
    from thermaxis.thermal._modal import (
        ModalOptions,
        ModalResult,
        PartStd,
        modal,
    )
    from thermaxis.thermal._oe import (
        OeOptions,
        oe,
    )
    from thermaxis.thermal._paper_models import (
        paper_spindle_model,
        paper_table_model,
    )
    from thermaxis.thermal._polynomial_model import (
        PolynomialModel,
        PolynomialResult,
        Start,
        TransferFunction,
        simulate_polynomial,
        simulate_transfer_function,
    )
    from thermaxis.thermal._records import (
        Records,
        compensation_model,
        records_of,
    )
    from thermaxis.thermal._residuals import (
        ResidualAnalysis,
        analyse_residuals,
        pole_zero_map,
        step_responses,
    )
    from thermaxis.thermal._selection import (
        SelectionOptions,
        SelectionResult,
        select,
    )
    from thermaxis.thermal._superposition import (
        DiameterGain,
        combine_models,
        parse_gain,
    )
    from thermaxis.thermal._thermal_log import (
        ThermalLog,
    )
    from thermaxis.thermal._thermal_model import (
        ModalPart,
        ThermalModel,
        simulate_modal,
        step_response,
    )
    from thermaxis.thermal._verification import (
        MeasuredOutput,
        SimulatedLog,
        SimulatedOutput,
        Verification,
        VerificationFigures,
        VerifiedLog,
        VerifiedOutput,
        simulate_log,
        verify,
    )

__all__ = [
    "MOST_PIXELS",
    "PAPER_SPINDLE",
    "PAPER_TABLE",
    "Baseline",
    "BaselineModel",
    "DiameterGain",
    "DriftRelation",
    "Experiment",
    "Identification",
    "IdentifiedOutput",
    "InputDefinition",
    "JointGains",
    "LogFinding",
    "MeasuredOutput",
    "Method",
    "ModalOptions",
    "ModalPart",
    "ModalResult",
    "OeOptions",
    "PartStd",
    "PolynomialModel",
    "PolynomialResult",
    "PrintedTransferFunction",
    "Records",
    "Region",
    "RegionDrift",
    "ResidualAnalysis",
    "RoundingLoss",
    "SelectionOptions",
    "SelectionResult",
    "ShiftResult",
    "SimulatedLog",
    "SimulatedOutput",
    "SimulationFigures",
    "Start",
    "ThermalField",
    "ThermalFieldsResult",
    "ThermalLog",
    "ThermalModel",
    "TransferFunction",
    "Verification",
    "VerificationFigures",
    "VerifiedLog",
    "VerifiedOutput",
    "analyse_residuals",
    "arx",
    "change_sample_time",
    "check_inputs",
    "check_log",
    "combine_models",
    "compensation_model",
    "correct_emissivity",
    "default_regions",
    "equivalent_part",
    "evaluate_input",
    "evaluate_thermal_fields",
    "find_shift",
    "fit_baseline",
    "fit_percent",
    "identify",
    "identify_joint",
    "joint_gains",
    "merge_logs",
    "modal",
    "modal_form",
    "modal_part",
    "oe",
    "paper_spindle_model",
    "paper_table_model",
    "parse_gain",
    "parse_input",
    "pole_zero_map",
    "polynomial_model_of",
    "printed_with",
    "records_of",
    "relate_to_drift",
    "rounding_loss",
    "select",
    "simulate_baseline",
    "simulate_log",
    "simulate_modal",
    "simulate_polynomial",
    "simulate_transfer_function",
    "simulation_figures",
    "step_response",
    "step_responses",
    "thermal_model_of",
    "transfer_function_of",
    "verify",
]

_MODULES = {
    "arx": "_arx",
    "Baseline": "_baselines",
    "BaselineModel": "_baselines",
    "fit_baseline": "_baselines",
    "simulate_baseline": "_baselines",
    "PAPER_SPINDLE": "_conversion",
    "PAPER_TABLE": "_conversion",
    "PrintedTransferFunction": "_conversion",
    "RoundingLoss": "_conversion",
    "change_sample_time": "_conversion",
    "equivalent_part": "_conversion",
    "modal_form": "_conversion",
    "modal_part": "_conversion",
    "polynomial_model_of": "_conversion",
    "printed_with": "_conversion",
    "rounding_loss": "_conversion",
    "thermal_model_of": "_conversion",
    "transfer_function_of": "_conversion",
    "Experiment": "_experiment",
    "SimulationFigures": "_figures",
    "fit_percent": "_figures",
    "simulation_figures": "_figures",
    "Identification": "_identification",
    "IdentifiedOutput": "_identification",
    "Method": "_identification",
    "identify": "_identification",
    "identify_joint": "_identification",
    "InputDefinition": "_input",
    "check_inputs": "_input",
    "evaluate_input": "_input",
    "parse_input": "_input",
    "JointGains": "_joint_gains",
    "joint_gains": "_joint_gains",
    "LogFinding": "_log_quality",
    "check_log": "_log_quality",
    "ShiftResult": "_merge",
    "find_shift": "_merge",
    "merge_logs": "_merge",
    "ModalOptions": "_modal",
    "ModalResult": "_modal",
    "PartStd": "_modal",
    "modal": "_modal",
    "OeOptions": "_oe",
    "oe": "_oe",
    "paper_spindle_model": "_paper_models",
    "paper_table_model": "_paper_models",
    "PolynomialModel": "_polynomial_model",
    "PolynomialResult": "_polynomial_model",
    "Start": "_polynomial_model",
    "TransferFunction": "_polynomial_model",
    "simulate_polynomial": "_polynomial_model",
    "simulate_transfer_function": "_polynomial_model",
    "Records": "_records",
    "compensation_model": "_records",
    "records_of": "_records",
    "ResidualAnalysis": "_residuals",
    "analyse_residuals": "_residuals",
    "pole_zero_map": "_residuals",
    "step_responses": "_residuals",
    "SelectionOptions": "_selection",
    "SelectionResult": "_selection",
    "select": "_selection",
    "DiameterGain": "_superposition",
    "combine_models": "_superposition",
    "parse_gain": "_superposition",
    "ThermalLog": "_thermal_log",
    "ModalPart": "_thermal_model",
    "ThermalModel": "_thermal_model",
    "simulate_modal": "_thermal_model",
    "step_response": "_thermal_model",
    "MeasuredOutput": "_verification",
    "SimulatedLog": "_verification",
    "SimulatedOutput": "_verification",
    "Verification": "_verification",
    "VerificationFigures": "_verification",
    "VerifiedLog": "_verification",
    "VerifiedOutput": "_verification",
    "simulate_log": "_verification",
    "verify": "_verification",
}


def __getattr__(name: str) -> object:
    """Import an estimator when it is first asked for: scipy takes longer than most commands."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
