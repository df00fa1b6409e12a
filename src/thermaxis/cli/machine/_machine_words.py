"""What a configuration would make the machine do, described once for terminal and JSON."""

from collections.abc import Iterator, Mapping, Sequence

from thermaxis.codes import message_as_json
from thermaxis.compensation import Output, SensorRules, TouchRules
from thermaxis.messages import place_text, remedy_of, sentence_of, text_of
from thermaxis.report.tables import Part, Section, Table, Value, as_json, filled, values_of
from thermaxis.runtime import (
    Finding,
    MachineConfiguration,
    ProbeSettings,
    ScreenSettings,
    ServerSettings,
    offset_factor,
)
from thermaxis.runtime.config import history_day_mb

_EXAMPLE_UM = 10.0
_OF_A_PROBE = (
    "node", "unit", "scale", "counter_node", "largest_um", "largest_rate_um_per_s", "acts"
)  # fmt: skip
_MARKS = {"ok": "ok", "warning": "warning", "error": "ERROR"}


def describe_machine(configuration: MachineConfiguration) -> list[Part]:
    """Return what would be done."""
    model, screen = configuration.model, configuration.screen
    shown = ("address", "port", "hosts", "secure", "view_without_login")
    return [
        Value("name", configuration.name),
        Value("cycle_s", configuration.rules.cycle_s),
        Value("model.file", str(model.path)),
        Value("model.sha256", model.sha256),
        Value("model.channels", configuration.compensation.model.channels),
        Value("source", configuration.source.kind),
        Value("sink", configuration.sink.kind),
        Section("", list(_overview(configuration))),
        _inputs(configuration),
        Section("", list(_conditions(configuration))),
        _outputs(configuration),
        Section("", list(_signs(configuration))),
        Section("", list(_times(configuration))),
        Section("", list(_surroundings(configuration))),
        Value("interlocks", _of_each(configuration.interlocks, "node", met="value")),
        Value("probes", _of_each(configuration.probes, *_OF_A_PROBE)),
        Value("screen", None if screen is None else as_json(values_of(screen, *shown))),
    ]


def _of_each(entries: Mapping[str, object], *keys: str, **named: str) -> dict[str, object]:
    """Return attributes of entries by name, under the same keys or those that are named."""
    keys_of = {key: key for key in keys} | named
    return {
        name: {key: getattr(entry, attribute) for key, attribute in keys_of.items()}
        for name, entry in entries.items()
    }


def _seconds(value_s: float) -> str:
    """Return a time as people say it."""
    for length_s, unit in ((86_400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if value_s >= length_s and (value_s / length_s).is_integer():
            return f"{value_s / length_s:g} {unit}"
    return f"{value_s:g} s"


# ---- what is done -------------------------------------------------------------------------------


def _overview(configuration: MachineConfiguration) -> Iterator[str]:
    model = configuration.model
    yield (
        f"{configuration.name}: every {_seconds(configuration.rules.cycle_s)} the temperatures are"
        " read, the model is advanced, the correction is limited and written, read back and"
        " recorded."
    )
    yield f"Model {model.path.name}, sha256 {model.sha256[:12]}...: {_made(configuration)}"
    for output in model.model.outputs:
        yield f"  {_sum_of_parts(output)}"
    yield f"Values: {_source(configuration)}"
    yield f"Corrections: {_sink(configuration)}"


def _made(configuration: MachineConfiguration) -> str:
    provenance = configuration.model.model.provenance
    words = [word for word in (provenance.program, provenance.date) if word]
    logs = ", ".join(log.name for log in provenance.logs)
    made = f"made by {', '.join(words)}" if words else "nobody says who made it"
    return f"{made}{f' from {logs}' if logs else ''}."


def _sum_of_parts(output: Output) -> str:
    parts: list[str] = []
    for part in output.parts:
        inputs = f"{part.plus} - {part.minus}" if part.minus else part.plus
        diameter = ", by diameter" if part.gain_by_diameter else ""
        parts.append(
            f"{part.name} ({inputs}, {part.dc_gain_um_per_k:+.3g} µm/K in the end{diameter})"
        )
    return f"{output.name} is the sum of {' and '.join(parts)}."


def _server(configuration: MachineConfiguration, name: str) -> str:
    settings = configuration.connections[name]
    security = settings.security if settings.encrypted else "not encrypted"
    who = f"as {settings.user}" if settings.user else "without a user"
    return f"{settings.url} ({name}: {security}, {who})"


def _source(configuration: MachineConfiguration) -> str:
    source = configuration.source
    if source.kind == "opcua":
        return f"by OPC UA from {_server(configuration, source.connection)}."
    if source.kind == "linuxcnc":
        return "from pins of HAL of the LinuxCNC of this computer."
    pace = "as fast as possible" if source.as_fast_as_possible else "at the pace of the day itself"
    return (
        f"replayed from {source.log}, {pace}; interlocks, redundant sensors, probes"
        " but for touches, and the diameter are not read."
    )


def _sink(configuration: MachineConfiguration) -> str:
    sink = configuration.sink
    if sink.kind == "dry":
        return "none is written: a dry run."
    if sink.linuxcnc is not None:
        joints = ", ".join(
            f"{name} on joint {output.joint}" for name, output in sink.linuxcnc.outputs.items()
        )
        return (
            f"through HAL of the LinuxCNC of this computer: {joints}; without a heartbeat for"
            f" {_seconds(sink.linuxcnc.watchdog_s)} the machine takes them back."
        )
    beat = f"heartbeat {sink.heartbeat_node}" if sink.heartbeat_node else "no heartbeat"
    return f"by OPC UA to {_server(configuration, sink.connection)}, {beat}."


# ---- inputs and conditions ----------------------------------------------------------------------


def _inputs(configuration: MachineConfiguration) -> Table:
    rows: list[list[Value]] = []
    for name, entry in configuration.inputs.items():
        rules = configuration.rules.sensors[name]
        unit = entry.unit if entry.scale == 1.0 else f"{entry.unit} x {entry.scale:g}"
        second = f"within {rules.largest_difference_k:g} K" if entry.redundant_node else "none"
        rows.append(
            [
                Value("", name, "input"),
                *values_of(entry, "node", "unit"),
                Value("", entry.node or "the log's column", "node"),
                Value("", unit, "unit"),
                *values_of(rules, "lowest_c", "highest_c"),
                Value("", f"{rules.lowest_c:g} to {rules.highest_c:g}", "plausible °C"),
                Value("", 60.0 * rules.largest_rate_k_per_s, "K/min", "g"),
                Value("", _seconds(rules.longest_age_s), "oldest"),
                Value("", _frozen_after(rules), "frozen after"),
                Value("", second, "redundant sensor"),
            ]
        )
    title = "What is read, and when it is believed"
    return Table(title, rows, key="inputs", names=list(configuration.inputs), words=3)


def _frozen_after(rules: SensorRules) -> str:
    if not rules.frozen_s:
        return "never"
    rests = f" unless {rules.moves_with} rests within {rules.rests_k:g} K"
    return f"{_seconds(rules.frozen_s)}{rests if rules.moves_with else ''}"


def _conditions(configuration: MachineConfiguration) -> Iterator[str]:
    if configuration.interlocks:
        conditions = ", ".join(
            f"{name} ({flag.node} is {str(flag.value).lower()})"
            for name, flag in configuration.interlocks.items()
        )
        yield f"Nothing is corrected unless all of these hold: {conditions}."
    other, diameter = configuration.other_compensation, configuration.diameter
    if other is not None:
        yield (
            f"Nothing is corrected while {other.node} is {str(other.value).lower()}: then the"
            " machine's own compensation is active."
        )
    if diameter is not None:
        yield f"The workpiece's diameter is read from {diameter.node}, in {diameter.unit}."
    probes, touched = configuration.probes, configuration.rules.touches
    for name in {**probes, **touched}:  # a replay has no probes, but may have touches
        yield _probe(name, probes.get(name, ProbeSettings()), touched.get(name))
    validity = configuration.compensation
    yield (
        "Outside the temperatures that the model was made from, its weight falls to"
        f" {validity.lowest_weight:g} within {validity.validity_margin_k:g} K."
    )


def _probe(name: str, probe: ProbeSettings, rules: TouchRules | None) -> str:
    times = "" if probe.scale == 1.0 else f", times {probe.scale:g}"
    measured = f"measured by {probe.node}, in {probe.unit}{times}"
    if rules is None:
        return f"{name} is {measured}: that is recorded and shown, and nothing is decided by it."
    new = f", a touch each time {probe.counter_node} rises" if probe.counter_node else ""
    limits, acts = rules.limits, "added to the correction" if rules.acts else "only shown"
    return (
        f"{name} is {measured if probe.node else 'touched'}{new}: what the model lacks by its"
        f" touches is {acts}, at most {limits.largest_um:g} µm at"
        f" {limits.largest_rate_um_per_s:g} µm/s inside the total."
    )


# ---- outputs ------------------------------------------------------------------------------------


def _outputs(configuration: MachineConfiguration) -> Table:
    rows: list[list[Value]] = []
    for name, entry in configuration.outputs.items():
        limits = configuration.rules.limits[name]
        to_zero_s = round(limits.total_um / limits.largest_rate_um_per_s)
        rows.append(
            [
                Value("", name, "output"),
                *values_of(entry, "node", "unit", "sign"),
                Value("largest_um", limits.largest_um, "largest um", "g"),
                Value("largest_rate_um_per_s", limits.largest_rate_um_per_s, "um/s", "g"),
                Value("", limits.deadband_um, "deadband um", "g"),
                Value("", limits.soft_um, "warned from um", "g"),
                Value("", limits.largest_trim_um, "trim um", "g"),
                Value("", limits.total_um, "total um", "g"),
                Value("", _seconds(to_zero_s), "to zero at most"),
            ]
        )
    title = "Limits that always hold"
    return Table(title, rows, key="outputs", names=list(configuration.outputs), words=1)


def _signs(configuration: MachineConfiguration) -> Iterator[str]:
    for name, entry in configuration.outputs.items():
        if not entry.unit:
            continue
        written = -_EXAMPLE_UM * offset_factor(entry.unit, entry.sign)
        where = entry.node or "the joint's offset"
        yield (
            f"{name}: where the tool point has moved {_EXAMPLE_UM:g} µm away from the workpiece,"
            f" the correction is {-_EXAMPLE_UM:+g} µm, and {written:+g} in {entry.unit} is written"
            f" to {where}, for there {entry.sign}."
        )
        if entry.read_back_node:
            yield f"  What the machine accepts is read from {entry.read_back_node}."
        if entry.effective_node:
            yield f"  What acts is read from {entry.effective_node}."


# ---- times and surroundings ---------------------------------------------------------------------


def _times(configuration: MachineConfiguration) -> Iterator[str]:
    rules = configuration.rules.supervisor
    again = (
        f"if it was enabled at most {_seconds(configuration.supervisor.resume_within_s)} before"
        if configuration.supervisor.resume_enabled
        else "never: somebody enables it"
    )
    yield (
        f"Enabled, it is Warming for {_seconds(rules.settle_s)} with good inputs, then Active."
        f" After a restart it is enabled by itself {again}."
    )
    yield (
        f"A lost input is bridged for {_seconds(rules.input_timeout_s)}, then Holding for"
        f" {_seconds(rules.hold_input_s)}, then Fading to zero; a lost connection: Holding for"
        f" {_seconds(rules.hold_connection_s)}; an open interlock:"
        f" {_at_once(rules.hold_interlock_s)}; an operator's hold:"
        f" {_seconds(rules.hold_operator_s)}. All is there again for"
        f" {_seconds(rules.recovery_delay_s)}: it recovers by itself."
    )
    yield (
        f"Fault, until somebody acknowledges it: {_seconds(rules.at_limit_s)} at the limit;"
        f" read-back off by more than {rules.read_back_tolerance_um:g} µm for"
        f" {_seconds(rules.read_back_s)}; another compensation; an offset found beyond the limits."
    )
    end = (
        f"the correction fades for at most {_seconds(configuration.supervisor.stop_within_s)} first"
        if configuration.supervisor.at_stop == "fade"
        else "the offset stays, and the machine's watchdog decides"
    )
    yield f"When the program is ended, {end}."


def _at_once(value_s: float) -> str:
    return f"Holding for {_seconds(value_s)}" if value_s else "Fading at once"


def _surroundings(configuration: MachineConfiguration) -> Iterator[str]:
    yield (
        f"Every cycle is recorded in {configuration.historian.url} for"
        f" {configuration.historian.retention_days} days, about"
        f" {history_day_mb(configuration):.3g} MB a day; the state is kept in"
        f" {configuration.state_file}."
    )
    if configuration.machine.model_folder is not None:
        choice = ", ".join(configuration.models_to_choose()) or "none"
        yield f"Models to choose from in {configuration.machine.model_folder}: {choice}."
    server, metrics = configuration.server, configuration.metrics
    if server is None:
        yield "There is no status server: it is enabled at the start, by thermaxis run --enable."
    else:
        who = f"users of {server.users}" if server.users is not None else "nobody with a name"
        anonymous = "may look" if server.anonymous_role == "viewer" else "may do nothing"
        yield (
            f"Status server at opc.tcp://{server.address}:{server.port}: {who}; people without a"
            f" name {anonymous}."
        )
    if metrics is not None:
        yield f"Figures for Prometheus at {metrics.address}, port {metrics.port}."
    if configuration.screen is not None:
        yield _screen(configuration.screen, configuration.server)


def _screen(screen: ScreenSettings, server: ServerSettings | None) -> str:
    """Return where thermaxis screen serves its pages, and who may look."""
    scheme, tls = ("https", "encrypted") if screen.secure else ("http", "not encrypted")
    address = f"[{screen.address}]" if ":" in screen.address else screen.address
    names = f", also called {', '.join(screen.hosts)}" if screen.hosts else ""
    feed = f"as {screen.user}" if screen.user else "without a name"
    who = "everybody may look; nobody logs in"
    if server is not None and server.users is not None:
        looks = (
            "everybody may look" if screen.view_without_login else "without a log-in nobody looks"
        )
        who = (
            f"{looks}; whoever has logged in as a user of the status server may ask for what the"
            f" role allows; a log-in ends after {_seconds(screen.idle_s)} without its person, and"
            f" after {_seconds(screen.longest_login_s)} in any case"
        )
    return (
        f"Pages of thermaxis screen at {scheme}://{address}:{screen.port}{names}, {tls}: {who}."
        f" They are told by the status server {feed}."
    )


# ---- findings -----------------------------------------------------------------------------------


def findings_in_words(title: str, findings: Sequence[Finding]) -> str:
    """Return findings as text."""
    lines = [filled(f"{_MARKS[f.level]:<8}{text_of(f.message)}", hanging=True) for f in findings]
    return "\n".join((title, "", *lines, ""))


def findings_as_json(findings: Sequence[Finding]) -> list[dict[str, object]]:
    """Return findings as JSON: codes, values and places, and their sentences."""
    return [
        {
            "level": str(level),
            "where": place_text(message.place),
            "what": sentence_of(message),
            "remedy": remedy_of(message),
            **message_as_json(message),
        }
        for level, message in findings
    ]
