"""How old a page takes a status to be, and what it does with one that it cannot show."""

import json
from typing import Any

import pytest

from tests.proofs import quick_first
from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

STATIC = asset_folder()
BENCH = """
let now = 1000;
let dateMs = 5e11;
const ticks = [];
const errors = [];
globalThis.performance = { now: () => now };
Date.now = () => dateMs;
console.error = (error) => { errors.push(String(error)); };
globalThis.document = {
  body: { dataset: { program: "this run", name: "", role: "viewer" } },
  documentElement: { lang: "en" },
  getElementById: () => null,
};
globalThis.location = { protocol: "http:", host: "a:1", pathname: "/", reload: () => {} };
globalThis.window = { addEventListener: () => {} };
globalThis.setInterval = (tick) => { ticks.push(tick); };
globalThis.setTimeout = (act) => { act(); };
const sockets = [];
globalThis.WebSocket = class {
  constructor() { this.heard = {}; sockets.push(this); }
  addEventListener(name, act) { this.heard[name] = act; }
  close() { this.heard.close?.(); }
};
const live = await import(STATIC + "live.js");
const told = [];
live.onStatus((status, ageS) => {
  told.push(["status", Math.round(100 * ageS) / 100, status.number]);
  if (status.breaks) throw new Error("a part that cannot show it");
});
live.onStatus((status) => { told.push(["second", status.number]); });
live.onLive(() => { told.push(["live"]); });
live.onNoData((none) => { told.push(["none", none.text]); if (none.breaks) throw none; });
live.startLive();
let serverS = 70_000;
const tell = (changes = {}, lateS = 0) => {
  const status = { number: 1, cycle_s: 1, utc: "2026-11-21T09:00:00Z", ...changes };
  const message = { kind: "status", age_s: 0.25, sent_s: serverS - lateS, status };
  sockets.at(-1).heard.message({ data: JSON.stringify(message) });
};
const pass = (s, asleepS = 0) => {
  now += 1000 * s;
  dateMs += 1000 * (s + asleepS);
  serverS += s + asleepS;
};
const look = () => { for (const tick of ticks) tick(); };
const found = (() => { BODY })();
process.stdout.write(JSON.stringify(found));
"""


def played(body: str) -> Any:
    """Return what a page did; `body` ends with a ``return``."""
    text = BENCH.replace("STATIC", json.dumps(f"file://{STATIC}/")).replace("BODY", body)
    return said_by(text)


CANNOT_READ = "operator-page_cannot_read"  # the bench gives no words: keys stand for themselves
NO_CONNECTION = "common-no_connection_to_screen"


def test_the_time_on_the_way_beyond_the_shortest_one_counts_as_age() -> None:
    found = played("tell(); pass(1); tell(); pass(1); tell({ number: 2 }, 1.5); return told;")
    ages = [one[1] for one in found if one[0] == "status"]
    assert ages == [0.25, 0.25, 1.75]


def test_a_status_that_waited_longer_than_is_fresh_is_no_data() -> None:
    found = played(
        "tell(); pass(1); tell({ number: 2 }, 3.5); return [told, live.latest(), live.lastKnown()];"
    )
    told, latest, known = found
    assert told[-1] == ["none", NO_CONNECTION]
    assert ["status", 3.75, 2] not in told
    assert latest is None
    assert known["number"] == 2


@pytest.mark.parametrize("drift", quick_first(1, [-1e-4, 1e-4]))
def test_clocks_of_two_computers_that_drift_apart_make_no_age(drift: float) -> None:
    found = played(
        f"for (let k = 0; k < 90_000; k += 1) {{ pass(1); serverS -= {drift}; tell(); }}"
        "return [told.filter((one) => one[0] === 'status').at(-1)[1], live.latest() !== null];"
    )
    assert found == [0.25, True]  # after more than a day, which is 9 s apart


def test_after_a_sleep_nothing_is_fresh_before_a_new_connection_has_told_it() -> None:
    found = played(
        "tell(); pass(0.2, 3600); look(); const none = [live.latest(), told.at(-1)];"
        "const count = sockets.length; pass(0.2); tell({ number: 9 });"
        "return [none, count, live.latest().number];"
    )
    assert found == [[None, ["none", NO_CONNECTION]], 2, 9]


def test_what_was_sent_before_a_sleep_and_read_after_it_is_not_shown() -> None:
    found = played("tell(); pass(0.1, 600); tell({ number: 5 }, 600); return [told, live.latest()]")
    told, latest = found
    assert latest is None
    assert ["status", 0.25, 5] not in told


def test_a_part_that_cannot_show_a_status_makes_it_no_data_and_the_others_still_hear_it() -> None:
    found = played(
        "tell(); const good = told.splice(0);"
        "tell({ number: 2, breaks: true }); tell({ number: 3, breaks: true });"
        "return [good, told.splice(0), live.latest(), live.lastKnown().number, errors];"
    )
    good, bad, latest, known, errors = found
    assert good == [["status", 0.25, 1], ["second", 1], ["live"]]
    assert bad[:3] == [["status", 0.25, 2], ["second", 2], ["none", CANNOT_READ]]
    assert ["live"] not in bad
    assert (latest, known) == (None, 1)
    assert errors == ["Error: a part that cannot show it"]  # once


def test_a_page_that_could_not_read_goes_on_with_the_next_status_that_it_can() -> None:
    found = played(
        "tell({ breaks: true }); pass(10); look(); const then = told.at(-1);"
        "tell({ number: 2 }); return [then, told.at(-1), live.latest().number];"
    )
    assert found == [["none", CANNOT_READ], ["live"], 2]


def test_a_message_that_is_no_json_is_no_data() -> None:
    found = played(
        "tell(); sockets[0].heard.message({ data: '{' }); return [told.at(-1), live.latest()]"
    )
    assert found == [["none", CANNOT_READ], None]


def test_a_status_without_its_times_is_not_shown() -> None:
    found = played(
        "const message = { kind: 'status', age_s: 0.1, status: { number: 1, cycle_s: 1 } };"
        "sockets[0].heard.message({ data: JSON.stringify(message) });"
        "return [told, live.latest()]"
    )
    assert found == [[["none", CANNOT_READ]], None]


def test_a_page_that_is_opened_without_data_shows_the_last_status_as_old() -> None:
    found = played(
        "const status = { number: 4, cycle_s: 1, utc: '2026-11-21T09:00:00Z' };"
        "const none = { kind: 'no_data', text: 'why', since: status.utc };"
        "const hear = (more) => sockets[0].heard.message({"
        " data: JSON.stringify({ ...none, ...more }) });"
        "hear({ age_s: 40, sent_s: 1, status }); const first = told.splice(0);"
        "hear({}); return [first, told, live.latest(), live.lastKnown().number];"
    )
    none = ["none", "why"]
    assert found == [[["status", 40, 4], ["second", 4], none], [none], None, 4]
