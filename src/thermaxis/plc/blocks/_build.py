"""The compensation as a program for a PLC: what `thermaxis.compensation.cycle` does, as a tree."""

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._head import head_of
from thermaxis.plc.blocks._lag import lag_block
from thermaxis.plc.blocks._limit import limit_block, read_back_block, trim_block, wanted_block
from thermaxis.plc.blocks._main import main_block
from thermaxis.plc.blocks._model import model_blocks
from thermaxis.plc.blocks._sensor import sensor_block
from thermaxis.plc.blocks._supervisor import requests_block, supervisor_block
from thermaxis.plc.tree import Program


def build_program(settings: PlcSettings) -> Program:
    """Return the program of a compensation.

    One call is one cycle of `thermaxis.compensation.cycle`, in the same order and, with LREAL, in
    the same operations. Times are counted from call to call: with LREAL and cycles that a binary
    number cannot hold, such as 0.1 s, a time limit may be met a cycle earlier or later than there.
    With REAL such cycles are refused, and times are counted exactly.

    In every call in Off the offset that stands in the control is read and taken over, as it is
    after a loss of the connection; in every call before that was done it is `cycle` without a
    connection. Levels that stand in the first call ask for nothing.

    Not protected: the block knows neither whether its inputs are wired to the sensors that the
    model means, nor whether the sign is right on this machine, nor whether the control adds what
    it is given. It keeps nothing over a loss of power: it starts at steady state.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.

    Returns
    -------
    Program
        The program: the same settings give the same one.

    Raises
    ------
    ConfigurationError
        If a number is none that the target's numbers hold.
    """
    double = settings.double
    blocks = (
        *((lag_block(double=double),) if _has_lags(settings) else ()),
        sensor_block(double=double),
        *model_blocks(settings),
        trim_block(double=double),
        requests_block(double=double),
        read_back_block(double=double),
        wanted_block(double=double),
        supervisor_block(settings),
        limit_block(double=double),
        main_block(settings),
    )
    return Program(name=settings.names.block, double=double, head=head_of(settings), blocks=blocks)


def _has_lags(settings: PlcSettings) -> bool:
    model = settings.compensation.model
    return bool(model.layout.taus_s) or model.input_filter_s > 0.0
