"""What a configuration would make the machine do, in plain words and as JSON."""

from typing import TYPE_CHECKING

from thermaxis.codes import message_as_json
from thermaxis.messages import place_text, remedy_of, sentence_of, text_of
from thermaxis.report.tables import filled, text_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from thermaxis.compensation import Output
    from thermaxis.runtime import Finding, MachineConfiguration, ScreenSettings, ServerSettings

_EXAMPLE_UM = 10.0
_MARKS = {"ok": "ok", "warning": "warning", "error": "ERROR"}


def machine_in_words(configuration: "MachineConfiguration") -> str:
    """Return what would be done, in plain words."""
    blocks = [
        _sentences(_overview(configuration)),
        _inputs_table(configuration),
        _sentences(_conditions(configuration)),
        _outputs_table(configuration),
        _sentences(_signs(configuration)),
        _sentences(_times(configuration)),
        _sentences(_surroundings(configuration)),
    ]
    return "\n".join(block for block in blocks if block)


def _sentences(sentences: "Iterable[str]") -> str:
    return "".join(f"{filled(sentence, hanging=True)}\n" for sentence in sentences)


def _seconds(value_s: float) -> str:
    """Return a time as people say it."""
    for length_s, unit in ((86_400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if value_s >= length_s and (value_s / length_s).is_integer():
            return f"{value_s / length_s:g} {unit}"
    return f"{value_s:g} s"


# ---- what is done -------------------------------------------------------------------------------


def _overview(configuration: "MachineConfiguration") -> "Iterable[str]":
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


def _made(configuration: "MachineConfiguration") -> str:
    provenance = configuration.model.model.provenance
    words = [word for word in (provenance.program, provenance.date) if word]
    logs = ", ".join(log.name for log in provenance.logs)
    made = f"made by {', '.join(words)}" if words else "nobody says who made it"
    return f"{made}{f' from {logs}' if logs else ''}."


def _sum_of_parts(output: "Output") -> str:
    parts: list[str] = []
    for part in output.parts:
        inputs = f"{part.plus} - {part.minus}" if part.minus else part.plus
        diameter = ", by diameter" if part.gain_by_diameter else ""
        parts.append(
            f"{part.name} ({inputs}, {part.dc_gain_um_per_k:+.3g} µm/K in the end{diameter})"
        )
    return f"{output.name} is the sum of {' and '.join(parts)}."


def _server(configuration: "MachineConfiguration", name: str) -> str:
    settings = configuration.connections[name]
    security = settings.security if settings.encrypted else "not encrypted"
    who = f"as {settings.user}" if settings.user else "without a user"
    return f"{settings.url} ({name}: {security}, {who})"


def _source(configuration: "MachineConfiguration") -> str:
    source = configuration.source
    if source.kind == "opcua":
        return f"by OPC UA from {_server(configuration, source.connection)}."
    pace = "as fast as possible" if source.as_fast_as_possible else "at the pace of the day itself"
    return (
        f"replayed from {source.log}, {pace}; interlocks, redundant sensors, probes and the"
        " diameter are not read."
    )


def _sink(configuration: "MachineConfiguration") -> str:
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


def _inputs_table(configuration: "MachineConfiguration") -> str:
    rows: list[list[str]] = []
    for name, entry in configuration.inputs.items():
        rules = configuration.rules.sensors[name]
        unit = entry.unit if entry.scale == 1.0 else f"{entry.unit} x {entry.scale:g}"
        rows.append(
            [
                name,
                entry.node or "the log's column",
                unit,
                f"{rules.lowest_c:g} to {rules.highest_c:g}",
                f"{60.0 * rules.largest_rate_k_per_s:g}",
                _seconds(rules.longest_age_s),
                _seconds(rules.frozen_s) if rules.frozen_s else "never",
                f"within {rules.largest_difference_k:g} K" if entry.redundant_node else "none",
            ]
        )
    heads = [
        *("input", "node", "unit", "plausible °C", "K/min", "oldest", "frozen after"),
        "redundant sensor",
    ]
    return text_table("What is read, and when it is believed", heads, rows, words=3)


def _conditions(configuration: "MachineConfiguration") -> "Iterable[str]":
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
    for name, probe in configuration.probes.items():
        times = "" if probe.scale == 1.0 else f", times {probe.scale:g}"
        yield (
            f"{name} is measured by {probe.node}, in {probe.unit}{times}: that is recorded and"
            " shown, and nothing is decided by it."
        )
    validity = configuration.compensation
    yield (
        "Outside the temperatures that the model was made from, its weight falls to"
        f" {validity.lowest_weight:g} within {validity.validity_margin_k:g} K."
    )


# ---- outputs ------------------------------------------------------------------------------------


def _outputs_table(configuration: "MachineConfiguration") -> str:
    rows: list[list[str]] = []
    for name, limits in configuration.rules.limits.items():
        rows.append(
            [
                name,
                f"{limits.largest_um:g}",
                f"{limits.largest_rate_um_per_s:g}",
                f"{limits.deadband_um:g}",
                f"{limits.soft_um:g}",
                f"{limits.largest_trim_um:g}",
                f"{limits.total_um:g}",
                _seconds(round(limits.total_um / limits.largest_rate_um_per_s)),
            ]
        )
    heads = [
        *("output", "largest um", "um/s", "deadband um", "warned from um", "trim um"),
        *("total um", "to zero at most"),
    ]
    return text_table("Limits that always hold", heads, rows, words=1)


def _signs(configuration: "MachineConfiguration") -> "Iterable[str]":
    for name, entry in configuration.outputs.items():
        if not entry.unit:
            continue
        from thermaxis.runtime import offset_factor  # noqa: PLC0415  only where it is needed

        written = -_EXAMPLE_UM * offset_factor(entry.unit, entry.sign)
        where = entry.node or "the joint's offset"
        yield (
            f"{name}: where the tool point has moved {_EXAMPLE_UM:g} µm away from the workpiece,"
            f" the correction is {-_EXAMPLE_UM:+g} µm, and {written:+g} in {entry.unit} is written"
            f" to {where}, for there {entry.sign}."
        )
        if entry.read_back_stated:
            yield f"  What the machine accepts is read from {entry.read_back_node}."
        if entry.effective_node:
            yield f"  What acts is read from {entry.effective_node}."


# ---- times and surroundings ---------------------------------------------------------------------


def _times(configuration: "MachineConfiguration") -> "Iterable[str]":
    rules = configuration.rules.supervisor
    again = (
        f"if it was enabled at most {_seconds(configuration.resume_within_s)} before"
        if configuration.resume_enabled
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
        f"the correction fades for at most {_seconds(configuration.stop_within_s)} first"
        if configuration.at_stop == "fade"
        else "the offset stays, and the machine's watchdog decides"
    )
    yield f"When the program is ended, {end}."


def _at_once(value_s: float) -> str:
    return f"Holding for {_seconds(value_s)}" if value_s else "Fading at once"


def _surroundings(configuration: "MachineConfiguration") -> "Iterable[str]":
    yield (
        f"Every cycle is recorded in {configuration.historian_url} for"
        f" {configuration.historian.retention_days} days; the state is kept in"
        f" {configuration.state_file}."
    )
    if configuration.model_folder is not None:
        choice = ", ".join(configuration.models_to_choose()) or "none"
        yield f"Models to choose from in {configuration.model_folder}: {choice}."
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


def _screen(screen: "ScreenSettings", server: "ServerSettings | None") -> str:
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


def findings_in_words(title: str, findings: "Sequence[Finding]") -> str:
    """Return findings as text."""
    lines = [filled(f"{_MARKS[f.level]:<8}{text_of(f.message)}", hanging=True) for f in findings]
    return "\n".join((title, "", *lines, ""))


def machine_as_json(configuration: "MachineConfiguration") -> dict[str, object]:
    """Return what would be done, as JSON."""
    rules, screen = configuration.rules, configuration.screen
    return {
        "name": configuration.name,
        "cycle_s": rules.cycle_s,
        "model": {
            "file": str(configuration.model.path),
            "sha256": configuration.model.sha256,
            "channels": list(configuration.compensation.model.channels),
        },
        "source": configuration.source.kind,
        "sink": configuration.sink.kind,
        "inputs": {
            name: {
                "node": entry.node,
                "unit": entry.unit,
                "lowest_c": rules.sensors[name].lowest_c,
                "highest_c": rules.sensors[name].highest_c,
            }
            for name, entry in configuration.inputs.items()
        },
        "interlocks": {
            n: {"node": f.node, "met": f.value} for n, f in configuration.interlocks.items()
        },
        "probes": {
            n: {"node": p.node, "unit": p.unit, "scale": p.scale}
            for n, p in configuration.probes.items()
        },
        "outputs": {
            name: {
                "node": entry.node,
                "unit": entry.unit,
                "sign": entry.sign,
                "largest_um": rules.limits[name].largest_um,
                "largest_rate_um_per_s": rules.limits[name].largest_rate_um_per_s,
            }
            for name, entry in configuration.outputs.items()
        },
        "screen": None
        if screen is None
        else {
            "address": screen.address,
            "port": screen.port,
            "hosts": list(screen.hosts),
            "secure": screen.secure,
            "view_without_login": screen.view_without_login,
        },
    }


def findings_as_json(findings: "Sequence[Finding]") -> list[dict[str, object]]:
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
