"""How far a request came, by the scripts of the pages: never more than a status can show."""

from typing import Any

from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

STATIC = asset_folder()
MINUTES_MS = 60_000
BENCH = """
const given = JSON.parse(await new Promise((take) => {
  let text = "";
  process.stdin.on("data", (part) => { text += part; }).on("end", () => take(text));
}));
globalThis.document = {
  body: { dataset: { name: "novak", token: "one-and-more" } },
  head: { append() {} },
  documentElement: { lang: "en", dataset: {} },
  getElementById: () => null,
  querySelector: () => null,
  createElement: () => ({ append() {}, replaceChildren() {}, setAttribute() {} }),
};
document.body.append = () => {};
const store = new Map();
globalThis.sessionStorage = {
  getItem: (key) => store.get(key) ?? null,
  setItem: (key, text) => store.set(key, text),
  removeItem: (key) => store.delete(key),
};
const { begin, endOf, keep, kept, watch } = await import("file://STATIC/ask/requests.js");
const { TEXTS, blocked } = await import("file://STATIC/operator/asks.js");
const { touchesSaid } = await import("file://STATIC/operator/axes.js");
process.stdout.write(JSON.stringify((() => { BODY })()));
"""
HEADLINES = ("active", "at_limit", "another_writer", "not_acting", "unreachable")
BEGUN = """
return given.map(([before, after, method, args]) => ["unknown", "accepted"].map((answer) => {
  const asked = { ...begin(method, args, null, before), answer };
  watch([asked], after, 5);
  return [asked.came === 5, endOf([asked], asked, after, 5)];
}));
"""


def said(body: str, given: object = None) -> Any:
    """Return what a script says that has the modules' functions."""
    return said_by(BENCH.replace("STATIC", str(STATIC)).replace("BODY", body), given)


def status(state: str = "Active", *, number: int = 100, **trim: object) -> dict[str, Any]:
    """Return what the loop tells, with a trim in force."""
    axis = {
        "correction_um": 5.0,
        "wanted_um": 5.0,
        "accepted_um": 5.0,
        "effective_um": None,
        "acting_um": 5.0,
        "acting_known": True,
        "trim_um": 0.0,
        "trim_owner": "",
        "trim_left_s": 0.0,
        "limits": {"deadband_um": 0.0},
    }
    return {
        "started": "a",
        "number": number,
        "cycle_s": 1.0,
        "state": state,
        "reasons": [],
        "headline": {"code": "headline-active", "values": {}},
        "sink_reason": None,
        "alarms": [],
        "inputs": {},
        "outputs": {"Z_um": axis | trim},
        "model_file": "new.json",
        "model_sha256": "ab",
    }


def course(method: str = "Enable", *args: object, **changed: object) -> dict[str, Any]:
    """Return a request that was accepted."""
    found = {
        "method": method,
        "args": list(args),
        "sha256": None,
        "requested": 0,
        "answer": "accepted",
        "answered": 0,
        "reason": {},
        "started": "a",
        "number": 90,
        "stood": False,
        "came": None,
    }
    return found | changed


def watched(courses: list[dict[str, Any]], told: dict[str, Any], now_ms: int = 5) -> Any:
    """Return of each request when it was in effect, and why it is watched no more."""
    return said(
        """
        const { courses, told, now } = given;
        watch(courses, told, now);
        return courses.map((one) => [one.came, endOf(courses, one, told, now)]);
        """,
        {"courses": courses, "told": told, "now": now_ms},
    )


def acts(asked: dict[str, Any], *told: dict[str, Any]) -> list[bool]:
    """Return of each status whether it shows a request to be in effect."""
    return said(
        """
        const [asked, told] = given;
        return told.map((one) => {
          const request = { ...asked };
          watch([request], one, 5);
          return request.came === 5;
        });
        """,
        [asked, told],
    )


def test_a_trim_is_effective_if_it_is_ones_own() -> None:
    asked = course("Trim", "Z_um", 2.0, 3600)
    told = [status(trim_um=2.0, trim_owner=owner) for owner in ("novak", "svoboda")]
    assert acts(asked, *told, status(trim_owner="novak")) == [True, False, False]


def test_a_trim_that_is_taken_back_is_effective_in_every_state() -> None:
    asked = course("Trim", "Z_um", 0, 3600)
    for state in ("Off", "Fading", "Active"):
        looks = [status(state), status(state, trim_um=2.0), status(state, wanted_um=9.0)]
        assert acts(asked, *looks) == [True, False, state != "Active"]


def test_a_model_is_effective_once_it_is_the_one_that_was_chosen_and_is_followed() -> None:
    told = [status(), status("Warming"), status() | {"reasons": ["settling"]}]
    other = status() | {"model_file": "old.json"}
    for sha256, effective in ((None, True), ("ab", True), ("cd", False)):
        asked = course("ChooseModel", "new.json", sha256=sha256)
        assert acts(asked, *told, other) == [effective, False, False, False]


def test_an_enable_is_effective_only_while_the_control_follows() -> None:
    told = [status() | {"headline": {"code": f"headline-{code}"}} for code in HEADLINES]
    refused = status() | {"sink_reason": {"code": "error-node_not_writable", "values": {}}}
    for asked in (course(), course("ChooseModel", "new.json", sha256="ab")):
        assert acts(asked, *told, refused) == [True, True, False, False, False, False]


def test_a_correction_has_arrived_where_it_was_read_to_act_and_nowhere_else() -> None:
    trim = {"trim_um": 2.0, "trim_owner": "novak"}
    looks = [
        ({"acting_um": 5.0}, True),
        ({"acting_um": 1.0, "effective_um": None, "accepted_um": 5.0}, False),  # a missed look
        ({"acting_um": 5.0, "acting_known": False}, False),
        ({"acting_um": None, "acting_known": False}, False),
    ]
    told = [status(**trim | of) for of, _ in looks]
    assert acts(course("Trim", "Z_um", 2.0, 3600), *told) == [arrived for _, arrived in looks]
    still = {"correction_um": 0.0, "accepted_um": None}
    told = [status("Off", **still, acting_um=um) for um in (0.0, 3.0)]
    assert acts(course("Disable"), *told) == [True, False]


def test_what_was_set_already_shows_nothing_of_a_request_without_an_answer() -> None:
    mine = {"trim_um": 2.0, "trim_owner": "novak", "trim_left_s": 100.0}
    trim, model = ("Trim", ["Z_um", 2.0, 3600]), ("ChooseModel", ["new.json"])
    cases = [
        (status(**mine), trim, True),
        (status(**mine | {"acting_um": 1.0}), trim, True),  # and is on its way
        (status(**mine | {"trim_um": 1.0}), trim, False),
        (status(**mine | {"trim_owner": "svoboda"}), trim, False),
        (status(), model, True),
        (status("Warming") | {"reasons": ["settling"]}, model, True),
        (status() | {"model_file": "old.json"}, model, False),
        (status() | {"diameter_mm": 5.0}, ("Diameter", [5.0]), True),
        (status("Off"), ("Enable", []), False),
        (None, ("Enable", []), False),
    ]
    after = status(number=101, **mine) | {"diameter_mm": 5.0}
    found = said(BEGUN, [[before, after, *asked] for before, asked, _ in cases])
    not_known = [False, "operator-effective_unknown"]
    came = [True, ""]
    assert found == [[not_known if stood else came, came] for _, _, stood in cases]


def test_a_request_is_effective_by_a_status_that_was_told_after_it() -> None:
    assert watched([course()], status(number=90)) == [[None, ""]]
    assert watched([course()], status(number=91)) == [[5, ""]]


def test_a_request_is_watched_until_another_of_its_kind_is_asked() -> None:
    replaced = "operator-effect_replaced"
    for later, ended in (
        (course("Disable"), replaced),
        (course("Disable", answer="unknown"), replaced),
        (course("Disable", answer="waits"), replaced),  # which of them a status shows is open
        (course("Disable", answer="refused"), ""),
        (course("Diameter", 5.0), ""),
    ):
        _, found = watched([later, course()], status("Active"))
        assert found == [None if ended else 5, ended]


def test_a_trim_of_another_output_is_no_contrary() -> None:
    newer = [course("Trim", name, 1.0, 60) for name in ("X_um", "Z_um")]
    for one, ended in zip(newer, ("", "operator-effect_replaced"), strict=True):
        assert watched([one, course("Trim", "Z_um", 3.0, 60)], status())[1] == [None, ended]


def test_what_a_loop_was_asked_that_was_started_again_is_not_known() -> None:
    assert watched([course(started="b")], status()) == [[None, "operator-effect_restarted"]]
    assert watched([course(started="", number=-1)], status()) == [[5, ""]]  # asked without data


def test_a_request_is_watched_for_a_quarter_of_an_hour() -> None:
    end = 15 * MINUTES_MS
    assert watched([course()], status(), end) == [[end, ""]]
    assert watched([course()], status(), end + 1) == [[None, "operator-effective_late"]]
    unknown = said("return endOf([given], given, null, 5);", course())
    assert unknown == "operator-effective_unknown"  # without data


def test_requests_come_back_for_who_has_asked_them_and_one_without_its_answer_is_open() -> None:
    waits = course(answer="waits")
    found = said(
        """
        keep(given);
        const back = kept();
        sessionStorage.setItem([...store.keys()][0], "{");
        return [back, kept()];
        """,
        [course(), waits],
    )
    assert found == [[course(), waits | {"answer": "unknown"}], []]


def test_whoever_logs_in_later_under_the_same_name_finds_nothing() -> None:
    found = said(
        """
        const counts = [];
        for (const token of ["two-and-more", "one-and-more", "one-and-more"]) {
          keep([given]);
          document.body.dataset.token = token;
          counts.push(kept().length);
        }
        return [counts, [...store.values()].join().includes("one-and-more")];
        """,
        course(),
    )
    assert found == [[0, 0, 1], False]


# ---- what a confirmation says --------------------------------------------------------------------


def confirmations(*asked: tuple[str, dict[str, Any]]) -> list[list[str]]:
    """Return which sentences are said before each question in its status."""
    return said("return given.map(([name, told]) => TEXTS[name](told));", asked)


def asked_in(state: str, opened: str = "", *, um: float = 5.0, **changed: object) -> dict[str, Any]:
    """Return a status in which something is asked, with what its interlocks are said to be."""
    told = status(state, correction_um=um, acting_um=um, differences_k={"spindle": 2.0})
    return told | {"opened_said": opened, "reasons_said": [], "source_connected": True} | changed


def test_an_open_interlock_is_said_where_something_would_move_and_may_end_a_hold() -> None:
    moves, ends = "operator-ask_interlock", "operator-hold_interlock"
    jumped = {"inputs": {"T_spindle_C": {"quality": "too_fast", "read": 30.0}}}
    of = [
        ("Enable", asked_in("Off", "open"), moves),
        ("Resume", asked_in("Holding", "open"), moves),
        ("Disable", asked_in("Warming", "open"), moves),
        ("Disable", asked_in("Warming", "open", um=0.0), None),
        ("Acknowledge", asked_in("Fault", "open"), moves),
        ("Acknowledge", asked_in("Holding", "open", **jumped), None),
        ("Hold", asked_in("Holding", "open"), ends),
        ("Hold", asked_in("Active"), None),
    ]
    for texts, (_, _, expected) in zip(confirmations(*(o[:2] for o in of)), of, strict=True):
        assert {*texts} & {moves, ends} == ({expected} if expected else set())


def test_a_hold_that_would_keep_nothing_says_only_that() -> None:
    nothing = [asked_in("Fading"), asked_in("Warming", um=0.0), asked_in("Warming", "open", um=0.0)]
    assert confirmations(*(("Hold", told) for told in nothing)) == [["operator-hold_none"]] * 3
    assert "operator-hold_none" not in confirmations(("Hold", asked_in("Warming")))[0]
    held = [one | {"reasons": ["operator_hold"], "enabled": True} for one in nothing]
    why = said(
        "return given.map((told) => blocked(told).Hold);", [*held, held[0] | {"state": "Holding"}]
    )
    assert why == ["operator-why_hold_lost"] * 3 + ["operator-why_held"]


def test_where_a_correction_goes_is_said_only_where_it_is_read() -> None:
    unread = asked_in("Holding")
    unread["outputs"]["Z_um"] |= {"differences_k": {"spindle": None}}
    away = asked_in("Holding", source_connected=False)
    for name in ("Enable", "Resume"):
        known, *unknown = confirmations(*((name, of) for of in (asked_in("Off"), unread, away)))
        assert "operator-enable_unknown" not in known
        assert [texts[1:] for texts in unknown] == [["operator-enable_unknown"]] * 2


# ---- touches -------------------------------------------------------------------------------------

TOUCHED = {"offset_um": -3.9, "offset_known_um": 3.9, "offset_std_um": 1.2, "touch_um": 4.2}


def test_a_touch_is_effective_once_it_was_judged_and_a_datum_once_nothing_is_known() -> None:
    told = [status(**TOUCHED), status(**TOUCHED | {"touch_um": 4.1}), status()]
    assert acts(course("Touch", "Z_um", 4.2, 0), *told) == [True, False, False]
    forgotten = status(**TOUCHED | {"offset_known_um": None})
    assert acts(course("Datum"), told[0], forgotten) == [False, True]


def test_void_touches_wait_for_a_person_and_none_is_taken_meanwhile() -> None:
    void = asked_in("Active", acknowledge_said="")
    void["outputs"]["Z_um"] |= TOUCHED | {"offset_void": True}
    sound = asked_in("Active")
    sound["outputs"]["Z_um"] |= TOUCHED
    why = said(
        "return given.map(blocked).map((one) => [one.Acknowledge, one.Touch]);", [void, sound]
    )
    assert why == [["", "operator-why_fault"], ["operator-why_calm", ""]]
    assert confirmations(("Acknowledge", void)) == [["operator-acknowledge_touches"]]
    assert acts(course("Acknowledge"), void, sound) == [False, True]


def test_the_axis_that_asks_for_a_touch_is_told_before_one_that_was_touched_later() -> None:
    known = TOUCHED | {"touch_outcome": "believed", "acting_known": True}
    early, late = ({"touch_time": f"2026-11-23T10:0{k}:00Z"} | known for k in (1, 2))
    told = [
        {"X_um": early | one, "Z_um": late | other, "Y_um": {"offset_um": None}}
        for one, other in (
            ({}, {}),
            ({"touch_now": True}, {}),
            ({"touch_now": True, "acting_known": False}, {}),
            ({}, {"touch_outcome": "excluded"}),
            ({}, {"touch_outcome": "untimely"}),
            ({}, {"touch_outcome": "no_effect", "offset_void": True}),
        )
    ]
    script = "return given.map((outputs) => touchesSaid({ outputs, source_connected: true }));"
    found = said(script, [*told, {"Y_um": {}}])
    assert found == [
        [True, "operator-touched"],
        [False, "operator-touch_now"],
        [True, "operator-touched"],
        [False, "operator-touched"],
        [False, "operator-touched"],
        [False, "operator-touched"],
        None,
    ]
