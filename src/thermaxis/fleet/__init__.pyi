from ._axes import (
    AxisChange as AxisChange,
    AxisRun as AxisRun,
    AxisTrend as AxisTrend,
    axis_run as axis_run,
    axis_run_as_json as axis_run_as_json,
    axis_trends as axis_trends,
)
from ._engine import (
    TRIES as TRIES,
    Engine as Engine,
    dask_engine as dask_engine,
    results_of as results_of,
    serial_engine as serial_engine,
)
from ._evidence import Evidence as Evidence, evidence_of as evidence_of
from ._fetching import Fetch as Fetch, fetch as fetch
from ._judging import (
    SENSOR_CAUSES as SENSOR_CAUSES,
    SISTERS as SISTERS,
    Cause as Cause,
    Judgement as Judgement,
    judge as judge,
    judgement_as_json as judgement_as_json,
)
from ._lake import Lake as Lake
from ._night import (
    NightOutcome as NightOutcome,
    NightResult as NightResult,
    OutputNight as OutputNight,
    StoredNight as StoredNight,
    night as night,
    night_as_json as night_as_json,
)
from ._nights import (
    NightJob as NightJob,
    Nights as Nights,
    do_nights as do_nights,
    late_nights as late_nights,
    work as work,
)
from ._registry import (
    ADDED as ADDED,
    IN_FORCE as IN_FORCE,
    FleetMachine as FleetMachine,
    ProposalState as ProposalState,
    Registry as Registry,
    Standing as Standing,
    StoredModel as StoredModel,
    StoredProposal as StoredProposal,
)
from ._shipping import Shipment as Shipment, ship as ship
from ._signs import Sign as Sign, SignKind as SignKind
from ._sisters import LEAST_SISTERS as LEAST_SISTERS, sister_model as sister_model
