"""The operator's page in a browser: one screen in every state, size, language and theme."""

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import Browser, Route

from tests.system.screen.operator_browser import (
    ALARMS,
    CUT,
    FAINT,
    LOCALES,
    OVERLAPS,
    SCROLLS,
    an_alarm,
    context_of,
    drawn,
    opened,
    shown,
)
from tests.system.screen.operator_stand_in import StandIn, an_input, an_output, made_up
from tests.system.screen.stand import wait_until
from thermaxis.codes import Message
from thermaxis.compensation import GainPoint, Part, SampleQuality, gain_of
from thermaxis.messages import as_sentence, sentence
from thermaxis.runtime import Role
from thermaxis.screen.access import LOST, NO_ANSWER, Answer, Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.system

SIZES = ((1024, 600), (1366, 768), (1920, 1080))
TWENTY = (
    "spindle_front",
    "spindle_rear",
    "table_bearing_lower_side",
    "column",
    "ball_screw_nut_z",
    "motor_z",
    "oil_tank",
    "air_1",
    "air_2",
    "bed_left",
    "bed_right",
    "bed_front",
    "coolant_in",
    "coolant_out",
    "hydraulics",
    "cabinet",
    "scale_z",
    "scale_x",
    "turret",
    "chuck",
)


def many() -> dict[str, Any]:
    """Return four outputs with long names, twenty inputs of every quality, every alarm."""
    outputs = ("X_um", "Y_um", "Z_um", "an_output_with_a_very_long_name_um")
    told = made_up(
        outputs=outputs,
        state="Fault",
        reasons=("read_back_differs",),
        alarms=ALARMS,
    )
    qualities = [quality.value for quality in SampleQuality]
    told["inputs"] = {
        f"T_{name}_C": an_input(k, quality=qualities[k % len(qualities)])
        for k, name in enumerate(TWENTY)
    }
    low = {"correction_um": -235.0, "at_soft_limit": True}
    trim = {"trim_um": -12.5, "trim_owner": "a.long.name.of.a.person", "trim_left_s": 27000.0}
    told["outputs"]["Y_um"] = an_output(1, **low, **trim)
    high = {"correction_um": 280.0, "at_soft_limit": True, "at_limit": True}
    told["outputs"]["Z_um"] = an_output(2, **high, weight=0.4)
    return told | {"quality": "held", "source_connected": False, "sink_connected": False}


def states() -> list[dict[str, Any]]:
    """Return a status for every state and number of outputs, the worst at the end."""
    long_reason = "offset_outside"
    doors = ["drives_on", "emergency_stop_released", "guard_door_closed"]
    two = made_up(outputs=("X_um", "Z_um"), state="Fault", open_interlocks=doors)
    two["headline"] = {"code": "headline-fault", "values": {"reason": "double_compensation"}}
    two["outputs"]["X_um"] = an_output(trim_um=5.0, trim_owner="novak", trim_left_s=2400.0)
    nothing = {
        key: None if value is None or isinstance(value, float) else value
        for key, value in an_output().items()
    }
    empty = made_up(state="Warming", reasons=["settling"])
    empty["outputs"]["Z_um"] = nothing | {"limits": None, "sources_um": {}, "differences_k": {}}
    empty["inputs"]["T_spindle_C"] = an_input(value_c=None, age_s=None, quality="there is no value")
    return [
        made_up(),
        made_up(state="Off", reasons=["disabled"], diameter_mm=None),
        empty,
        two | {"alarms": list(ALARMS[2:])},
        made_up(outputs=("X_um", "Y_um", "Z_um"), state="Fading", reasons=[long_reason]),
        made_up(outputs=("A_um", "B_um", "C_um", "X_um", "Y_um", "Z_um"), state="Off"),
        many(),
    ]


@pytest.mark.parametrize("language", LOCALES)
def test_nothing_scrolls_and_nothing_is_cut_in_any_state_and_size(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    with context_of(browser, language) as context:
        page, wrong = opened(context, stand_in)
        found: list[str] = []
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            for k, status in enumerate(states()):
                shown(page, stand_in, status)
                for script in (CUT, OVERLAPS):
                    found += [f"{width} state {k}: {one}" for one in page.evaluate(script)]
                assert max(page.evaluate(SCROLLS)) <= 0, (width, k)
        assert not found, "\n".join(found)
        assert wrong == []


def test_a_phone_shows_every_state_in_one_column(browser: Browser, stand_in: StandIn) -> None:
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        page.set_viewport_size({"width": 390, "height": 844})
        for k, status in enumerate(states()):
            shown(page, stand_in, status)
            found = [one for script in (CUT, OVERLAPS) for one in page.evaluate(script)]
            assert not found, (k, found)
            assert page.evaluate(SCROLLS)[:2] == [0, 0], k  # the part between head and foot does


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_text_of_every_state_is_readable_in_both_themes(
    browser: Browser, stand_in: StandIn, theme: str
) -> None:
    with context_of(browser, "en", theme) as context:
        page, _ = opened(context, stand_in)
        page.set_viewport_size({"width": 1920, "height": 1080})
        for status in states():
            shown(page, stand_in, status)
            assert page.evaluate(FAINT) == []
        stand_in.live = False
        page.wait_for_selector('body[data-live="no"]')
        assert page.evaluate(FAINT) == []


def test_the_five_states_and_fault_stand_there_in_words_of_the_language(
    browser: Browser, stand_in: StandIn
) -> None:
    said = {
        "en": ("Off", "Warming up", "Compensating", "Hold", "Fading out", "Fault"),
        "de": ("Aus", "Läuft an", "Kompensiert", "Halten", "Läuft aus", "Störung"),
        "cs": ("Vypnuto", "Náběh", "Kompenzuje", "Podržení", "Dobíhá", "Porucha"),
    }
    for language, expected in said.items():
        with context_of(browser, language) as context:
            page, _ = opened(context, stand_in)
            found: list[str | None] = []
            for state in ("Off", "Warming", "Active", "Holding", "Fading", "Fault"):
                shown(page, stand_in, made_up(state=state))
                found.append(page.text_content("#state-word"))
            assert tuple(found) == expected


def test_a_trim_stays_in_sight_while_it_is_not_zero_and_its_owner_is_a_touch_away(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        for count in (1, 2, 4):
            names = ("W_um", "X_um", "Y_um", "Z_um")[:count]
            told = made_up(outputs=names)
            told["outputs"]["W_um"] |= {"trim_um": 4.5, "trim_owner": "novak", "trim_left_s": 90.0}
            shown(page, stand_in, told)
            assert "+4,5" in page.inner_text(".op-card:first-child")
            assert "(manuell)" in page.inner_text(".op-card:first-child")
            page.click(".op-card:first-child")
            assert "novak, noch 1\xa0min 30\xa0s" in page.inner_text("dialog[open]")
            page.keyboard.press("Escape")


def test_an_input_that_is_not_good_is_named_and_all_are_one_touch_away(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        told = made_up(inputs=[f"T_{name}_C" for name in TWENTY])
        shown(page, stand_in, told)
        assert page.inner_text("#inputs-open") == "20 inputs good"
        told["inputs"]["T_chuck_C"] = an_input(quality="too_fast")  # the last one
        shown(page, stand_in, told)
        assert page.inner_text("#inputs-open") == "▲ 1 of 20 inputs not good: T_chuck"
        page.click("#inputs-open")
        rows = page.locator("dialog .op-input:visible").all_inner_texts()
        assert len(rows) == 20
        assert "T_chuck" in rows[-1]
        assert sentence("quality-too_fast") in rows[-1]


def test_the_gravest_alarm_stands_in_the_banner_and_all_are_one_touch_away(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(alarms=ALARMS))
        banner = page.inner_text("#alarm")
        assert banner.startswith("1\n")  # number of the priority, in its octagon
        assert "Kritisch: Die Maschine meldet" in banner  # translated by its code
        assert "dann quittieren" in page.text_content("#alarm-more")  # what to do
        page.click("#alarm")
        items = page.locator(".op-alarm-item").all_inner_texts()
        assert [one.split("\n")[0] for one in items] == ["1", "2", "3", "4"]
        assert "Sensor T_table_bearing_lower_side_C" in items[1]  # without a code as it was said
        page.keyboard.press("Escape")
        page.goto(stand_in.address + "/#alarms")
        page.wait_for_selector("dialog .op-alarm-item")


def test_values_that_are_old_are_marked_and_come_back_by_themselves(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.wait_for_function("document.querySelector('.op-value b').textContent !== '–'")
        stand_in.live = False
        page.wait_for_selector('body[data-live="no"]')
        assert page.inner_text("#state-word") == "NO DATA"
        assert "since" in page.inner_text("#state-since")
        asks = "els => els.map(e => e.dataset.ask)"
        enabled = page.locator(".op-buttons button:enabled").evaluate_all(asks)
        assert enabled == ["Disable"]  # the safe direction
        assert page.inner_text("#asks-why") == sentence("operator-why_only_disable")
        assert page.inner_text(".op-value b") == "?"
        assert max(page.evaluate(SCROLLS)) <= 0
        stand_in.live = True
        page.wait_for_selector('body[data-live="yes"]')
        page.wait_for_function("document.getElementById('state-word').textContent[0] === 'C'")
        assert page.inner_text(".op-value b") == "−35.1"
        assert page.locator(".op-buttons button:enabled").count() > 0


def test_touch_targets_are_at_least_three_rem_high(browser: Browser, stand_in: StandIn) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, many())
        rem = page.evaluate("parseFloat(getComputedStyle(document.documentElement).fontSize)")
        for name in ("Trim", "Diameter"):
            heights = "els => els.map(e => e.getBoundingClientRect().height)"
            assert min(page.locator(".op-buttons button").evaluate_all(heights)) >= 3 * rem - 0.5
            shown(page, stand_in, made_up())
            page.click(f'[data-ask="{name}"]')
            found = page.locator("dialog button:visible, dialog input:visible").evaluate_all(
                heights
            )
            assert min(found) >= 3 * rem - 0.5
            page.keyboard.press("Escape")


def test_the_page_says_the_gain_at_a_diameter_as_the_model_does(
    browser: Browser, stand_in: StandIn
) -> None:
    points = (GainPoint(100.0, 0.4), GainPoint(700.0, 1.3), GainPoint(3000.0, -0.2))
    part = Part("table", "T_table_C", "T_column_C", 1.0, (), gain_by_diameter=points, tool_gain=0.9)
    gains = {"points": [[p.diameter_mm, p.gain] for p in points], "tool_gain": 0.9}
    diameters = [None, 0.0, 100.0, 333.0, 700.0, 1500.5, 3000.0, 9000.0]
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        script = """async ([gains, diameters]) => {
          const { gainAt } = await import("/static/operator/parts.js");
          return diameters.map((mm) => gainAt(gains, mm));
        }"""
        found = page.evaluate(script, [gains, diameters])
    assert found == pytest.approx([gain_of(part, mm) for mm in diameters], rel=1e-12)


# ---- interventions ------------------------------------------------------------------------------


def test_a_trim_goes_from_steps_over_words_to_the_loop_and_becomes_effective(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        page.click('[data-ask="Trim"]')
        for step in ("+5", "+5", "+5", "+5", "+5"):  # beyond the bound of 20 µm
            page.click(f"dialog .op-steps button:has-text('{step}')")
        assert page.inner_text("dialog output") == "+20.0\xa0µm"
        page.click("dialog .op-steps button:has-text('−1')")
        page.click("dialog label:has-text('30')")
        page.click("dialog .main")
        said = page.inner_text("dialog[open]")
        assert "a trim of +19.0 µm is added" in said
        assert "moves by +19.0 µm, at most 0.50 µm/s" in said
        assert "novak" in said
        assert stand_in.asked == []  # nothing before it is confirmed
        page.click("dialog .main")
        line = page.locator("[data-requests]")
        line.get_by_text("accepted").wait_for()
        assert stand_in.asked == [("Trim", ("Z_um", 19.0, 1800.0))]
        assert "not yet effective" in line.inner_text()
        told = made_up()
        told["outputs"]["Z_um"] |= {"trim_um": 19.0, "wanted_um": -16.2}
        told["outputs"]["Z_um"] |= {"trim_owner": "novak", "trim_left_s": 1795.0}
        shown(page, stand_in, told)
        assert "not yet effective" in line.inner_text()  # it is on its way
        told["outputs"]["Z_um"] |= {"correction_um": -16.3}
        shown(page, stand_in, told)
        assert "not yet effective" in line.inner_text()  # the control has not taken it
        told["outputs"]["Z_um"] |= {"effective_um": None, "accepted_um": -16.3}
        shown(page, stand_in, told)
        assert "not yet effective" in line.inner_text()  # what acts was not read
        told["outputs"]["Z_um"] |= {"acting_um": -16.3}
        shown(page, stand_in, told)
        assert "✓ effective" in line.inner_text()
        assert wrong == []


def test_a_refusal_shows_the_reason_in_the_language_of_the_page(
    browser: Browser, stand_in: StandIn
) -> None:
    stand_in.answer = Outcome(Answer.REFUSED, Message("answer-nothing_to_hold"))
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        page.click('[data-ask="Hold"]')
        page.click("dialog .main")
        line = page.locator("[data-requests]")
        line.get_by_text("abgelehnt").wait_for()
        said = as_sentence(sentence("answer-nothing_to_hold", language="de"))
        line.get_by_text(said).wait_for()
        assert line.get_attribute("data-answer") == "refused"


@pytest.mark.parametrize(
    ("name", "state", "reasons", "after", "expected"),
    [
        ("Enable", "Off", ["disabled"], "Active", "−35.1 µm to −35.5 µm"),
        ("Disable", "Active", [], "Off", "−35.1 µm fades to zero at 0.50 µm/s: about 1\xa0min 10"),
        ("Resume", "Holding", ["operator_hold"], "Active", "follows the model again"),
        ("Acknowledge", "Fault", ["double_compensation"], "Off", "Another"),
    ],
)
def test_every_plain_request_says_what_will_happen_and_when_it_has(
    browser: Browser,
    stand_in: StandIn,
    name: str,
    state: str,
    reasons: list[str],
    after: str,
    expected: str,
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(state=state, reasons=reasons, open_interlocks=["door"]))
        page.click(f'[data-ask="{name}"]')
        assert expected in page.inner_text("dialog[open]")
        assert "Interlock open: door. While the drives stand" in page.inner_text("dialog[open]")
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog", state="detached")
        assert stand_in.asked == []
        page.focus(f'[data-ask="{name}"]')
        page.keyboard.press("Enter")  # by keys alone
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        line = page.locator("[data-requests]")
        line.get_by_text("not yet effective").wait_for()
        assert stand_in.asked == [(name, ())]
        told = made_up(state=after)
        if name == "Disable":
            shown(page, stand_in, told)
            assert "not yet effective" in line.inner_text()  # the offset stands in the control
            told["outputs"]["Z_um"] |= {"correction_um": 0.0, "acting_um": 0.4}
        shown(page, stand_in, told)
        assert "✓ effective" in line.inner_text()


@pytest.mark.parametrize("key", [NO_ANSWER, LOST])
def test_a_request_without_an_answer_is_watched_until_it_is_effective(
    browser: Browser, stand_in: StandIn, key: str
) -> None:
    stand_in.answer = Outcome(Answer.UNKNOWN, Message(key))
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.click('[data-ask="Hold"]')
        page.click("dialog .main")
        line = page.locator("[data-requests]")
        line.get_by_text("no answer; it may still take effect").wait_for()
        assert line.get_attribute("data-answer") == "unknown"
        assert "✕" not in line.inner_text()
        assert "not yet effective" in line.inner_text()
        shown(page, stand_in, made_up(state="Holding", reasons=["operator_hold"]))
        assert "the state is as asked" in line.inner_text()
        assert "✓ effective" not in line.inner_text()  # somebody else may have asked it


def test_a_question_that_the_screen_itself_does_not_answer_is_no_refusal(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        answers: tuple[Callable[[Route], None], ...] = (
            lambda route: route.abort(),
            lambda route: route.fulfill(status=502, body="gateway"),
            lambda route: route.fulfill(status=200, body="no JSON"),
        )
        for count, answer in enumerate(answers):
            page.route("**/ask", answer)
            page.click('[data-ask="Hold"]')
            page.click("dialog .main")
            page.wait_for_function(
                """count => {
                  const place = document.getElementById("request");
                  return place.dataset.answer === "unknown"
                    && place.querySelectorAll(".ask-older").length === count;
                }""",
                arg=count,
            )
            page.unroute("**/ask")


def test_the_courses_of_three_requests_stand_in_a_list_each_until_its_end(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        line = page.locator("[data-requests]")
        page.click('[data-ask="Hold"]')
        page.click("dialog .main")
        line.get_by_text("accepted").wait_for()
        stand_in.answer = Outcome(Answer.REFUSED, Message("ask-told", {"said": "it may not be"}))
        page.click('[data-ask="Disable"]')
        page.click("dialog .main")
        line.get_by_text("It may not be").wait_for()
        assert line.get_attribute("data-answer") == "refused"
        (older,) = line.locator(".ask-older").all_inner_texts()
        assert older.endswith(" Hold: not yet effective")
        shown(page, stand_in, made_up(state="Holding", reasons=["operator_hold"]))
        (older,) = page.locator("#request .ask-older").all_text_contents()
        assert "✓ effective" in older
        assert line.get_attribute("data-answer") == "refused"
        for asks in (3, 4):
            page.click('[data-ask="Resume"]')
            page.click("dialog .main")
            wait_until("it is asked", lambda: len(stand_in.asked) == asks)  # noqa: B023 - at once
            page.wait_for_selector('#request:not([data-answer="waits"])')
            drawn(page)
            assert page.locator("#request .ask-older").count() == 2


def test_the_list_of_requests_is_a_button_that_space_and_enter_press(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.click('[data-ask="Hold"]')
        page.click("dialog .main")
        page.locator("button#request").get_by_text("Hold", exact=True).wait_for()
        for key in ("Space", "Enter"):
            page.focus("#request")
            page.keyboard.press(key)
            page.wait_for_selector("dialog[open]")
            page.keyboard.press("Escape")
            page.wait_for_selector("dialog", state="detached")
        aloud = page.locator("p.unseen[aria-live=polite]").all_text_contents()
        assert any("accepted" in one for one in aloud)


LOUD = """() => [...document.querySelectorAll("[aria-live=assertive], [role=alert]")]
  .filter((one) => !one.hidden).map((one) => one.id)"""


def test_one_part_at_a_time_is_read_aloud_at_once(browser: Browser, stand_in: StandIn) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.wait_for_selector('body[data-live="yes"]')
        assert page.evaluate(LOUD) == ["alarm-body"]
        stand_in.live = False
        page.wait_for_selector('body[data-live="no"]')
        assert page.evaluate(LOUD) == ["no-data"]


def test_a_diameter_is_typed_on_the_pad_and_the_tool_centre_point_is_one_touch(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "cs") as context:
        page, _ = opened(context, stand_in)
        page.click('[data-ask="Diameter"]')
        assert "0 až 3000 mm" in page.inner_text("dialog[open]")  # as in the model's file
        for key in ("1", "2", "9", "⌫", "0", ",", "5"):
            page.click(f"dialog .op-pad button:text-is('{key}')")
        page.click("dialog .main")
        assert "120,5\xa0mm; dosud: 1500\xa0mm" in page.inner_text("dialog[open]")
        page.click("dialog .main")
        page.locator("[data-requests]").get_by_text("přijato").wait_for()
        page.click('[data-ask="Diameter"]')
        page.fill("dialog input", "100001")
        assert page.locator("dialog .main").is_disabled()
        page.click("dialog button:has-text('Střed nástroje')")
        page.click("dialog .main")
        wait_until("it is asked", lambda: len(stand_in.asked) == 2)
    assert stand_in.asked == [("Diameter", (120.5,)), ("NoDiameter", ())]


def touched(count: int, **changed: Any) -> dict[str, Any]:
    """Return a status with touches at every output."""
    told = made_up(outputs=("Z_um", "X_um")[:count])
    known = {"offset_um": -3.9, "offset_known_um": 3.9, "offset_std_um": 1.3, "offset_acts": True}
    last = {"touch_um": 4.2, "touch_outcome": "believed", "touch_time": told["started"]}
    for output in told["outputs"].values():
        output.update(known | last | {"rest_um": 3.9} | changed)
    return told


@pytest.mark.parametrize("language", LOCALES)
def test_touches_stand_apart_with_how_sure_they_are_and_one_is_typed(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    stand_in.status = touched(1)
    off = {"offset_void": True, "offset_um": 0.0, "touch_outcome": "no_effect"}
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        share = page.locator('[data-row="touch"]').inner_text()
        point = "." if language == "en" else ","
        assert f"± 1{point}3 µm" in share.replace("\xa0", " ")
        assert f"−3{point}9" in share
        for told in (touched(1, touch_now=True), touched(2), touched(2, **off)):
            shown(page, stand_in, told)
            assert (page.evaluate(CUT), page.evaluate(OVERLAPS)) == ([], [])
            assert page.evaluate(SCROLLS) == [0, 0, 0, 0]
        assert page.is_disabled('[data-ask="Touch"]')
        page.locator('[data-ask="Acknowledge"]:enabled').wait_for()
        shown(page, stand_in, touched(1))
        page.click('[data-ask="Touch"]')
        for key in ("4", "2", "±"):
            page.click(f"dialog .op-pad button:text-is('{key}')")
        page.click("dialog .main")
        page.click("dialog .main")
        wait_until("it is asked", lambda: stand_in.asked != [])
    assert stand_in.asked == [("Touch", ("Z_um", -42.0, 0.0))]


def test_who_may_only_look_is_told_so_and_finds_no_button_to_press(
    browser: Browser, stand_in: StandIn
) -> None:
    stand_in.role = Role.VIEWER
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.wait_for_function("document.querySelector('.op-value b').textContent !== '–'")
        assert page.locator(".op-buttons button:enabled").count() == 0
        assert "log in as operator" in page.inner_text("#asks-why")


@pytest.mark.parametrize("language", LOCALES)
def test_a_long_answer_moves_nothing_out_of_the_page_and_is_whole_at_a_touch(
    browser: Browser, stand_in: StandIn, language: str
) -> None:
    reason = "the machine does not report the offset that was written still: "
    told = Message("ask-told", {"said": reason + "check the connection and the axis"})
    stand_in.answer = Outcome(Answer.REFUSED, told)
    with context_of(browser, language) as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(state="Fault", alarms=ALARMS))
        page.click('[data-ask="Acknowledge"]')
        page.click("dialog[open] .main")
        page.wait_for_selector('[data-requests][data-answer="refused"]')
        whole = page.text_content("#request")
        for live in (True, False):
            stand_in.live = live
            page.wait_for_selector(f'body[data-live="{"yes" if live else "no"}"]')
            drawn(page)
            assert max(page.evaluate(SCROLLS)) <= 0
            aside = "e => e.scrollHeight - e.clientHeight"
            assert page.locator(".op-asks").evaluate(aside) <= 0
            heights = "els => els.map(e => e.getBoundingClientRect().height)"
            touched = page.locator(".op-buttons button:enabled").evaluate_all(heights)
            assert min(touched) >= 44.5  # without data, that is to disable
        page.click("#request")
        assert page.text_content("dialog[open] .ask-body") == whole


def test_a_log_out_or_a_language_that_fails_is_told(browser: Browser, stand_in: StandIn) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        for path, act in (
            ("logout", lambda: page.click("#logout")),
            ("language", lambda: page.select_option("#language", "cs")),
        ):
            page.route(f"**/{path}", lambda route: route.abort())
            act()
            page.get_by_text("The screen's program does not answer").wait_for()
            page.click("#notice-close")
        assert page.input_value("#language") == "en"
        assert page.url == stand_in.address + "/"


def test_how_long_it_lasts_is_the_loops_word_whatever_its_clock_says(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, wrong = opened(context, stand_in)
        now = datetime.now(UTC)
        for since, expected in ((now - timedelta(seconds=300.2), "(5\xa0min"), (None, "")):
            told = made_up(headline_since=since and since.isoformat())
            shown(page, stand_in, told)
            assert (page.text_content("#state-for") or "").startswith(expected)
            assert bool(page.text_content("#state-since")) is (since is not None)
        assert wrong == []


def test_alarms_and_inputs_are_unknown_without_data_and_what_they_were_is_marked(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "cs") as context:
        page, _ = opened(context, stand_in)
        for alarms, before in (((), "Předtím: žádné."), (ALARMS[1:2], "Předtím: 1")):
            stand_in.live = True
            shown(page, stand_in, made_up(alarms=alarms))
            stand_in.live = False
            page.wait_for_selector('body[data-live="no"]')
            assert page.inner_text("#alarm-text") == "Alarmy: neznámé"
            assert page.inner_text("#alarm-count") == "?"
            assert page.inner_text("#alarm-more").startswith(before)
            assert page.get_attribute("#alarm", "data-priority") == "unknown"
            assert page.inner_text("#inputs-open") == "předtím: dobré vstupy: 3"
            page.click("#inputs-open")
            assert page.locator(".op-shape").all_inner_texts() == ["?", "?", "?"]
            page.keyboard.press("Escape")
            page.click("#alarm")
            assert "není známo" in page.inner_text("dialog[open]")
            page.keyboard.press("Escape")
            assert max(page.evaluate(SCROLLS)) <= 0
        stand_in.live = True
        page.wait_for_selector('body[data-live="yes"]')
        assert page.inner_text("#inputs-open") == "dobré vstupy: 3"


def test_a_dialog_notices_that_somebody_else_has_asked_already(
    browser: Browser, stand_in: StandIn
) -> None:
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(state="Holding", reasons=["operator_hold"]))
        page.click('[data-ask="Resume"]')
        page.wait_for_selector("dialog[open] .main:enabled")
        shown(page, stand_in, made_up())
        page.wait_for_selector("dialog[open] .main:disabled")
        assert "nothing to ask for" in page.inner_text("dialog[open]")
        assert stand_in.asked == []


def test_why_the_history_fails_stands_behind_its_alarm_as_a_detail(
    browser: Browser, stand_in: StandIn
) -> None:
    failure = "the history cannot be written (OperationalError disk I/O error)"
    alarm = an_alarm("medium", failure, "", "", "historian")
    alarm["values"] = {"waiting": 8.0, "failure": failure}
    with context_of(browser, "de") as context:
        page, _ = opened(context, stand_in)
        shown(page, stand_in, made_up(alarms=(alarm,)))
        assert page.inner_text("#alarm-text") == "Der Verlauf kann nicht gespeichert werden."
        assert "Operational" not in page.inner_text("#alarm")
        page.click("#alarm")
        assert f"Einzelheit: {failure}" in page.inner_text("dialog[open]")


def test_the_model_page_shows_a_diameter_as_it_was_stated(
    browser: Browser, stand_in: StandIn
) -> None:
    points = [{"diameter_mm": d, "gain": g} for d, g in ((0.0, 1.0), (1200.25, 1.5), (3e3, 2.0))]
    part = {"name": "table", "gain_by_diameter": points, "tool_gain": 1.0}
    script = """async (part) => {
      document.getElementById("words").textContent = '{"model-diameter_now": "{diameter} mm"}';
      const { drawGains } = await import("/static/model/charts.js");
      const chart = document.createElement("div");
      chart.className = "gain-chart";
      chart.style.cssText = "width: 600px; height: 300px";
      document.body.append(chart);
      drawGains(chart, { name: "Z_um", parts: [part] }, { diameter_mm: 1500.5 });
    }"""
    with context_of(browser, "en") as context:
        page, _ = opened(context, stand_in)
        page.evaluate(script, part)
        page.wait_for_function(
            "document.querySelector('.gain-chart')?.textContent.includes('1500.5')"
        )
