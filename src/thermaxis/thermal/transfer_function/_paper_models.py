"""The published transfer functions as compensation models, and what their digits leave open."""

from thermaxis.compensation import CompensationModel, Output, Part, Provenance, Section
from thermaxis.thermal.transfer_function._conversion import (
    PAPER_SPINDLE,
    PAPER_TABLE,
    PrintedTransferFunction,
    equivalent_part,
    rounding_loss,
)

PAPER = "Mares and Horejs 2021, MM Science Journal, DOI 10.17973/MMSJ.2021_07_2021053"
"""Where the coefficients are printed."""
ASSUMED_SAMPLE_TIME_S = 1.0
"""The paper states no sample time; one second is assumed, and every time constant with it. [s]"""
_LARGE_LOSS = 0.01


def paper_spindle_model() -> CompensationModel:
    """Return the paper's transfer function of the spindle, epsilon 1: equation (5), table 1.

    Output ``Z_um``, part ``spindle``; direct gain and one lag that equal the printed coefficients
    after some tens of samples.
    """
    return _model("spindle", "T_spindle_C", PAPER_SPINDLE, "table 1, epsilon 1")


def paper_table_model() -> CompensationModel:
    """Return the paper's transfer function of the table, epsilon 2: equation (6), table 2.

    It warns that its printed digits do not define it.
    """
    return _model("table", "T_table_C", PAPER_TABLE, "table 2, epsilon 2")


def _model(
    name: str, channel: str, printed: PrintedTransferFunction, place: str
) -> CompensationModel:
    part = equivalent_part(printed.transfer_function, ASSUMED_SAMPLE_TIME_S, name)
    loss = rounding_loss(printed)
    low, high = sorted(loss.dc_gain_between)
    said = [
        (
            "the paper states no sample time: one second is assumed, and every time constant"
            " scales with it"
        ),
        (
            "the two fast modes of the printed coefficients are no heat conduction: their gain"
            " went into the direct gain, which differs from them in the first samples"
        ),
        f"the printed digits leave the DC gain between {low:.2f} and {high:.2f} um/K",
    ]
    if high - low > _LARGE_LOSS * abs(loss.dc_gain):
        said.append(
            "this model cannot be reproduced from its printed digits: use it as an example of a"
            " filter, never as the physics of a machine"
        )
    return CompensationModel(
        outputs=(
            Output(
                "Z_um",
                (
                    Part(
                        name=name,
                        plus=channel,
                        minus="T_column_C",
                        direct_gain_um_per_k=float(part.direct_gain),
                        sections=tuple(
                            Section(float(g), float(t))
                            for g, t in zip(part.gains, part.time_constants_s, strict=True)
                        ),
                    ),
                ),
            ),
        ),
        sample_time_s=ASSUMED_SAMPLE_TIME_S,
        provenance=Provenance(method=f"printed coefficients, {PAPER}, {place}"),
        warnings=tuple(said),
    )
