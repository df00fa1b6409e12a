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
  body: { dataset: { name: "novak", token: "one" } },
  documentElement: { lang: "en" },
  getElementById: () => null,
};
const store = new Map();
globalThis.sessionStorage = {
  getItem: (key) => store.get(key) ?? null,
  setItem: (key, text) => store.set(key, text),
  removeItem: (key) => store.delete(key),
};
const { acts, stageOf } = await import("file://STATIC/ask/effects.js");
const { LATE_MS, watch } = await import("file://STATIC/ask/watch.js");
const { endKeeping, keep, kept } = await import("file://STATIC/ask/kept.js");
process.stdout.write(JSON.stringify((() => { BODY })()));
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
        "title": method,
        "requested": 0,
        "answer": "accepted",
        "answered": 0,
        "reason": "",
        "started": "a",
        "number": 90,
        "model": "old.json ab",
        "person": "novak",
        "ended": "",
        "stage": "",
        "came": None,
        "blind": False,
    }
    return found | changed


def watched(courses: list[dict[str, Any]], told: dict[str, Any], now_ms: int = 5) -> Any:
    """Return of each request whether it is in effect, and why it is watched no more."""
    return said(
        """
        watch(given.courses, given.told, given.now);
        return given.courses.map((one) => [one.came, one.ended]);
        """,
        {"courses": courses, "told": told, "now": now_ms},
    )


def test_a_trim_is_effective_if_it_is_the_one_that_was_asked_for() -> None:
    trims = [
        ("novak", 3595.0, True),
        ("novak", 3600.0, True),
        ("svoboda", 3595.0, False),  # somebody else's of the same value
        ("novak", 3000.0, False),  # one's own of before
        ("novak", 7000.0, False),
    ]
    asked = course("Trim", "Z_um", 2.0, 3600)
    told = [status(trim_um=2.0, trim_owner=owner, trim_left_s=left_s) for owner, left_s, _ in trims]
    found = said("return given[0].map((told) => acts(told, given[1]));", [told, asked])
    assert found == [effective for _, _, effective in trims]


def test_a_trim_that_is_taken_back_is_effective_in_every_state() -> None:
    asked = course("Trim", "Z_um", 0, 3600)
    for state in ("Off", "Fading", "Active"):
        looks = [status(state), status(state, trim_um=2.0), status(state, wanted_um=9.0)]
        found = said("return given[0].map((told) => acts(told, given[1]));", [looks, asked])
        assert found == [True, False, state != "Active"]


def test_a_model_of_the_same_name_and_no_known_hash_is_not_known_to_be_loaded() -> None:
    asked = [
        (None, "old.json ab", [True, "ask-model_waits"]),
        (None, "new.json ab", [False, "operator-effective_unknown"]),  # nothing shows the choice
        (None, "new.json cd", [True, "ask-model_waits"]),
        ("ab", "new.json ab", [True, "ask-model_waits"]),
        ("cd", "new.json ab", [False, ""]),
    ]
    courses = [
        course("ChooseModel", "new.json", sha256=one, model=model) for one, model, _ in asked
    ]
    found = said(
        "return given[1].map((one) => [acts(given[0], one), stageOf(given[0], one)]);",
        [status(), courses],
    )
    assert found == [wanted for _, _, wanted in asked]


def test_a_request_is_effective_by_a_status_that_was_told_after_it() -> None:
    assert watched([course()], status(number=90)) == [[None, ""]]
    assert watched([course()], status(number=91)) == [[5, ""]]


def test_a_request_is_watched_until_the_contrary_is_asked() -> None:
    for later, ended in (
        (course("Disable"), "replaced"),
        (course("Disable", answer="unknown"), "replaced"),
        (course("Disable", answer="refused"), ""),
        (course("Diameter", 5.0), ""),
    ):
        _, (came, why) = watched([later, course()], status("Off"))
        assert (came, why) == (None, ended)
        _, (came, _) = watched([later, course()], status("Active"))
        assert (came == 5) is (ended == "")


def test_a_trim_of_another_output_is_no_contrary() -> None:
    newer = [course("Trim", name, 1.0, 60) for name in ("X_um", "Z_um")]
    for one, ended in zip(newer, ("", "replaced"), strict=True):
        assert watched([one, course("Trim", "Z_um", 3.0, 60)], status())[1] == [None, ended]


def test_what_a_loop_was_asked_that_was_started_again_is_not_known() -> None:
    assert watched([course(started="b")], status()) == [[None, "restarted"]]
    assert watched([course(started="", number=-1)], status()) == [[5, ""]]  # asked without data


def test_a_request_is_watched_for_a_quarter_of_an_hour() -> None:
    end = 15 * MINUTES_MS
    assert watched([course()], status(), end) == [[end, ""]]
    assert watched([course()], status(), end + 1) == [[None, "late"]]
    assert watched([course(blind=True)], status(), end + 1) == [[None, "unseen"]]


def test_what_was_kept_comes_back_only_if_every_field_is_there_and_of_its_kind() -> None:
    whole = course()
    broken = [{k: v for k, v in whole.items() if k != name} for name in whole]
    broken += [whole | {name: {}} for name in whole]
    found = said(
        """
        keep(given);
        const back = kept();
        endKeeping();
        keep(given); // an answer that comes before the page is gone
        return [back, kept(), store.size];
        """,
        [whole, *broken, None, 3],
    )
    assert found == [[whole], [], 0]


def test_whoever_logs_in_later_under_the_same_name_finds_nothing() -> None:
    found = said(
        """
        const counts = [];
        for (const [token, name] of [["one", "novak"], ["two", "novak"]]) {
          keep([given]);
          document.body.dataset.token = token === "one" ? "two" : "one";
          counts.push(kept().length, store.size);
        }
        keep([given]);
        const text = [...store.values()].join();
        counts.push(kept().length, text.includes(document.body.dataset.token + '"'));
        return counts;
        """,
        course(),
    )
    assert found == [0, 0, 0, 0, 1, False]
