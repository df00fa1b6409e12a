"""Run a compensation on a machine: the loop, its borders, its configuration, its servers.

Sources, sinks and historians are packages of their own below this one. Every name is imported
when it is first asked for: the loop needs no certificate, and a command no OPC UA.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from thermaxis.runtime._alarms import PRIORITIES, alarms_of
    from thermaxis.runtime._certificates import Certificate, CertificateUse, PrivateKey
    from thermaxis.runtime._commissioning import CommissioningPlan, StepProof, prove_step
    from thermaxis.runtime._config import examine_machine, read_machine
    from thermaxis.runtime._config_connection import Problem
    from thermaxis.runtime._config_settings import (
        DiameterSettings,
        FlagSettings,
        InputSettings,
        MachineConfiguration,
        MachineRules,
        MetricsSettings,
        ModelFile,
        OutputSettings,
        ServerSettings,
        SinkSettings,
        SourceSettings,
    )
    from thermaxis.runtime._config_warnings import warnings_of
    from thermaxis.runtime._connection import SECURITIES, ConnectionSettings, Secret
    from thermaxis.runtime._loop import (
        SELF_TEST,
        AtStop,
        Borders,
        CompensationLoop,
        LoopSettings,
        Models,
    )
    from thermaxis.runtime._metrics import MetricsServer
    from thermaxis.runtime._opcua_session import NodeDescription, OpcUaSession
    from thermaxis.runtime._ports import (
        DIAMETER,
        NOT_READ,
        OTHER_COMPENSATION,
        Applied,
        Clock,
        CycleRecord,
        EventRecord,
        Historian,
        HistorianStatus,
        RequestBox,
        RequestOutcome,
        Sink,
        Source,
        SourceSample,
        SystemClock,
        interlock_name,
        spare_name,
    )
    from thermaxis.runtime._record_config import ChannelSettings, RecordSettings, read_record
    from thermaxis.runtime._recorder import Recorder, RecordSummary
    from thermaxis.runtime._saved_state import SavedState, StateFile
    from thermaxis.runtime._self_test import MachineParts, reasons_against, self_test
    from thermaxis.runtime._self_test_nodes import Finding, Level
    from thermaxis.runtime._sign import AWAY, OFFSET_UNITS, SIGNS, TOWARDS, offset_factor
    from thermaxis.runtime._sole_runner import sole_runner
    from thermaxis.runtime._status import Alarm, RuntimeStatus
    from thermaxis.runtime._status_server import StatusServer
    from thermaxis.runtime._systemd import SignOfLife
    from thermaxis.runtime._users import Role, User, hash_password, read_users, write_users
    from thermaxis.runtime._virtual_time import VirtualClock, run_in_virtual_time

__all__ = [
    "AWAY",
    "DIAMETER",
    "NOT_READ",
    "OFFSET_UNITS",
    "OTHER_COMPENSATION",
    "PRIORITIES",
    "SECURITIES",
    "SELF_TEST",
    "SIGNS",
    "TOWARDS",
    "Alarm",
    "Applied",
    "AtStop",
    "Borders",
    "Certificate",
    "CertificateUse",
    "ChannelSettings",
    "Clock",
    "CommissioningPlan",
    "CompensationLoop",
    "ConnectionSettings",
    "CycleRecord",
    "DiameterSettings",
    "EventRecord",
    "Finding",
    "FlagSettings",
    "Historian",
    "HistorianStatus",
    "InputSettings",
    "Level",
    "LoopSettings",
    "MachineConfiguration",
    "MachineParts",
    "MachineRules",
    "MetricsServer",
    "MetricsSettings",
    "ModelFile",
    "Models",
    "NodeDescription",
    "OpcUaSession",
    "OutputSettings",
    "PrivateKey",
    "Problem",
    "RecordSettings",
    "RecordSummary",
    "Recorder",
    "RequestBox",
    "RequestOutcome",
    "Role",
    "RuntimeStatus",
    "SavedState",
    "Secret",
    "ServerSettings",
    "SignOfLife",
    "Sink",
    "SinkSettings",
    "Source",
    "SourceSample",
    "SourceSettings",
    "StateFile",
    "StatusServer",
    "StepProof",
    "SystemClock",
    "User",
    "VirtualClock",
    "alarms_of",
    "examine_machine",
    "hash_password",
    "interlock_name",
    "offset_factor",
    "prove_step",
    "read_machine",
    "read_record",
    "read_users",
    "reasons_against",
    "run_in_virtual_time",
    "self_test",
    "sole_runner",
    "spare_name",
    "warnings_of",
    "write_users",
]

_MODULES = {
    "AWAY": "_sign",
    "DIAMETER": "_ports",
    "NOT_READ": "_ports",
    "OFFSET_UNITS": "_sign",
    "OTHER_COMPENSATION": "_ports",
    "PRIORITIES": "_alarms",
    "SECURITIES": "_connection",
    "SELF_TEST": "_loop",
    "SIGNS": "_sign",
    "TOWARDS": "_sign",
    "Alarm": "_status",
    "Applied": "_ports",
    "AtStop": "_loop",
    "Borders": "_loop",
    "Certificate": "_certificates",
    "CertificateUse": "_certificates",
    "ChannelSettings": "_record_config",
    "Clock": "_ports",
    "CommissioningPlan": "_commissioning",
    "CompensationLoop": "_loop",
    "ConnectionSettings": "_connection",
    "CycleRecord": "_ports",
    "DiameterSettings": "_config_settings",
    "EventRecord": "_ports",
    "Finding": "_self_test_nodes",
    "FlagSettings": "_config_settings",
    "Historian": "_ports",
    "HistorianStatus": "_ports",
    "InputSettings": "_config_settings",
    "Level": "_self_test_nodes",
    "LoopSettings": "_loop",
    "MachineConfiguration": "_config_settings",
    "MachineParts": "_self_test",
    "MachineRules": "_config_settings",
    "MetricsServer": "_metrics",
    "MetricsSettings": "_config_settings",
    "ModelFile": "_config_settings",
    "Models": "_loop",
    "NodeDescription": "_opcua_session",
    "OpcUaSession": "_opcua_session",
    "OutputSettings": "_config_settings",
    "PrivateKey": "_certificates",
    "Problem": "_config_connection",
    "RecordSettings": "_record_config",
    "RecordSummary": "_recorder",
    "Recorder": "_recorder",
    "RequestBox": "_ports",
    "RequestOutcome": "_ports",
    "Role": "_users",
    "RuntimeStatus": "_status",
    "SavedState": "_saved_state",
    "Secret": "_connection",
    "ServerSettings": "_config_settings",
    "SignOfLife": "_systemd",
    "Sink": "_ports",
    "SinkSettings": "_config_settings",
    "Source": "_ports",
    "SourceSample": "_ports",
    "SourceSettings": "_config_settings",
    "StateFile": "_saved_state",
    "StatusServer": "_status_server",
    "StepProof": "_commissioning",
    "SystemClock": "_ports",
    "User": "_users",
    "VirtualClock": "_virtual_time",
    "alarms_of": "_alarms",
    "examine_machine": "_config",
    "hash_password": "_users",
    "interlock_name": "_ports",
    "offset_factor": "_sign",
    "prove_step": "_commissioning",
    "read_machine": "_config",
    "read_record": "_record_config",
    "read_users": "_users",
    "reasons_against": "_self_test",
    "run_in_virtual_time": "_virtual_time",
    "self_test": "_self_test",
    "sole_runner": "_sole_runner",
    "spare_name": "_ports",
    "warnings_of": "_config_warnings",
    "write_users": "_users",
}


def __getattr__(name: str) -> object:
    """Import a name when it is first asked for: asyncua, pydantic and argon2 take their time."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
