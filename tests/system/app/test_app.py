"""Measured runs in a real browser: files dropped, numbers, forms, files taken along, the end."""

import json
import re
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from tests.system.app.stand import (
    DROP,
    EXAMPLES,
    FAULTS,
    LONGEST_MS,
    App,
    command,
    opened,
    readable,
)
from thermaxis.messages import sentence

pytestmark = pytest.mark.system

RUNS = (EXAMPLES / "x_axis_100_cycles.csv", EXAMPLES / "y_axis_50_cycles.rtl")


def named(page: Page, name: str) -> None:
    """Wait for the result of what was just sent; a former one is hidden by then."""
    expect(page.locator("#run-result")).to_be_visible(timeout=LONGEST_MS)
    expect(page.locator("#run-name")).to_have_text(name)


def shown(page: Page) -> dict[str, list[str]]:
    """Return the numbers of the table of figures with all of their digits, by figure."""
    rows = page.locator("#run-shown table").first.locator("tbody tr").all()
    return {
        row.locator(".run-symbol").inner_text(): [
            cell.get_attribute("data-value") or "" for cell in row.locator("td.number").all()
        ]
        for row in rows
    }


KEYS = ("value", "expanded_uncertainty", "drift_free", "drift_free_expanded_uncertainty")


def test_the_page_shows_the_numbers_of_the_command_to_the_last_digit(
    app: App, browser: Browser, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = list(RUNS)
    for seed in range(2):
        runs.append(tmp_path / f"run{seed}.csv")
        command("generate", "x-axis", "--cycles", 5, "--seed", seed, "-o", runs[-1])
    page = opened(browser, app)
    for run in runs:
        page.set_input_files("input[name=file]", run)
        page.click("#run-submit")
        named(page, run.name)
        capsys.readouterr()
        command("evaluate", run, "--json", tmp_path / "result.json")
        summary = capsys.readouterr().out
        figures = json.loads((tmp_path / "result.json").read_text())["figure_table"]
        rows = shown(page)
        assert len(rows) == len(figures) == 12
        for figure, numbers in zip(figures, rows.values(), strict=True):
            stated = [figure[key] for key in KEYS]
            assert [float(one) for one in numbers] == [one for one in stated if one is not None]
        for symbol in "BMERA":  # and rounded as the command rounds
            row = page.locator("#run-shown tbody tr").filter(
                has=page.locator(".run-symbol", has_text=re.compile(f"^{symbol}$"))
            )
            line = next(text for text in summary.splitlines() if text.startswith(f"  {symbol}  "))
            printed = re.findall(r"-?\d+(?:\.\d+)?", line)
            cells = [cell.inner_text().replace("−", "-") for cell in row.locator("td.number").all()]
            assert cells == printed
        told = page.locator("#run-shown").inner_text()
        amounts = re.findall(r"less than [\d.]+|[+−][\d.]+ ± [\d.]+", " ".join(summary.split()))
        assert len(amounts) == 3  # growth, of the whole axis, shift
        for amount in amounts:
            assert amount in told, (run.name, amount)
        factors = [
            f"{one[key]:.2f}"
            for one in figures
            for key in ("coverage_factor", "drift_free_coverage_factor")
        ]
        if "may cover less" not in summary:
            assert f"k from {min(factors)} to {max(factors)}" in told
    assert FAULTS[page] == []


def test_a_dropped_run_becomes_a_certificate_and_results_to_take_along(
    app: App, browser: Browser, tmp_path: Path
) -> None:
    page = opened(browser, app)
    run = tmp_path / "run.csv"
    command("generate", "x-axis", "--cycles", 5, "-o", run)
    for file in (*(EXAMPLES / f"{one}.toml" for one in ("header", "limits", "budget")), run):
        page.evaluate(DROP, ["#run-drop", file.name, file.read_text("utf-8")])
        expect(page.locator(".room-file-name", has_text=file.name)).to_have_count(1)
    named(page, run.name)
    expect(page.locator(".run-verdict")).to_be_visible()  # by the limits that were dropped
    expect(page.locator("#run-facts")).to_contain_text("virtual milling machine")  # by the head
    beginnings = {
        "#run-certificate": b"%PDF-",
        "[data-kind=csv]": b"#",
        "[data-kind=json]": b"{",
    }
    page.click(".run-more summary")
    for selector, beginning in beginnings.items():
        with page.expect_download(timeout=LONGEST_MS) as coming:
            page.click(selector)
        path = tmp_path / "file"
        coming.value.save_as(path)
        assert path.read_bytes().lower().startswith(beginning.lower()), selector
    assert FAULTS[page] == []


def test_several_runs_a_table_a_plan_and_its_program_come_by_keyboard_alone(
    app: App, browser: Browser
) -> None:
    page = opened(browser, app)
    page.set_input_files("input[name=file]", list(RUNS[:1]))
    page.focus("#run-submit")
    page.keyboard.press("Enter")
    named(page, RUNS[0].name)
    page.focus("#run-levels .chart-plot")
    page.keyboard.press("ArrowLeft")  # a chart is pointed at
    expect(page.locator("#run-levels .chart-cursor text")).to_have_text(re.compile(r"29\d\.\d\d"))
    page.focus("#run-table > summary")
    page.keyboard.press("Enter")
    page.focus("#table-form button")
    page.keyboard.press("Enter")
    expect(page.locator("#table-told pre")).to_contain_text("simulated", timeout=LONGEST_MS)
    page.focus("#run-plan > summary")
    page.keyboard.press("Enter")
    page.focus("#plan-form button")
    page.keyboard.press("Enter")
    expect(page.locator("#made-shown pre")).to_contain_text("11 targets", timeout=LONGEST_MS)
    page.focus("#program-form button")
    page.keyboard.press("Enter")
    expect(page.locator("#made-shown pre")).to_contain_text("NC program", timeout=LONGEST_MS)
    page.set_input_files("input[name=file]", [RUNS[0], RUNS[0]])
    page.focus("#run-submit")
    page.keyboard.press("Enter")
    expect(page.locator("#made-shown tbody tr")).to_have_count(2, timeout=LONGEST_MS)
    assert FAULTS[page] == []


def test_a_form_is_kept_and_sent_as_the_file_that_the_command_reads(
    app: App, browser: Browser
) -> None:
    page = opened(browser, app)
    page.set_input_files("input[name=file]", RUNS[1])
    page.click("#run-submit")
    named(page, RUNS[1].name)
    page.click("[data-form=head]")
    page.fill("[name='machine.name']", 'mill "7" <b>')
    with page.expect_response("**/positioning/form/head"):
        page.click("dialog[open] button.main")  # what is shown is evaluated with it
    expect(page.locator("#run-facts")).to_contain_text('mill "7" <b>', timeout=LONGEST_MS)
    page.reload()
    named(page, RUNS[1].name)
    page.click("[data-form=head]")  # the next time
    expect(page.locator("[name='machine.name']")).to_have_value('mill "7" <b>')
    page.keyboard.press("Escape")
    page.click("[data-form=limits]")
    page.fill("[name='limits.A_um']", "many")
    page.click("dialog[open] button.main")
    expect(page.locator("dialog[open] .wrong")).to_contain_text("A_um")  # told at the form
    page.keyboard.press("Escape")  # asked whether to drop it, nobody says yes
    expect(page.locator("[name='limits.A_um']")).to_have_value("many")
    page.once("dialog", lambda asked: asked.accept())
    page.keyboard.press("Escape")
    for form in ("head", "limits"):  # nothing is kept for those who come
        page.click(f"[data-form={form}]")
        page.click("dialog[open] [data-act=empty]")
        with page.expect_response("**/positioning/upload?*"):  # the shown run, without it
            page.click("dialog[open] button.main")
        named(page, RUNS[1].name)
        expect(page.locator(f"#run-form [name={form}] ~ * .room-file-name")).to_have_text(
            "no file chosen"
        )


def test_two_meanings_of_a_number_are_a_choice_on_the_page(app: App, browser: Browser) -> None:
    page = opened(browser, app)
    dates = "".join(
        f"{k},{way},{100 * target},{target + 0.1 * k},0{k}/0{k + 1}/2026 10:0{target}\n"
        for k in range(1, 6)
        for way in ("forward", "backward")
        for target in range(1, 4)
    )
    head = "cycle,direction,position_mm,deviation_um,time\n"
    page.evaluate(DROP, ["#run-drop", "run.csv", head + dates])
    wrong = page.locator("#wrong")
    expect(wrong).to_contain_text(sentence("positioning-date_order"), timeout=LONGEST_MS)
    expect(page.locator("select[name=date_order]")).to_be_focused()
    page.select_option("select[name=date_order]", "day")
    page.click("#run-submit")
    named(page, "run.csv")
    page.evaluate(DROP, ["#run-drop", "next.csv", head + dates])  # it held for that run alone
    expect(wrong).to_contain_text("next.csv", timeout=LONGEST_MS)
    page.click("#run-kept button")
    named(page, "run.csv")
    page.select_option("select[name=date_order]", "month")
    page.click("#run-submit")  # the run that is shown is evaluated anew
    expect(page.locator("#run-facts")).to_contain_text("2026-01-02 10:01", timeout=LONGEST_MS)


def test_the_page_is_readable_for_everybody_in_every_language_and_size(
    app: App, browser: Browser
) -> None:
    page = opened(browser, app)
    page.set_input_files("input[name=file]", RUNS[1])
    page.click("#run-submit")
    named(page, RUNS[1].name)
    readable(page)
    page.context.close()


def test_the_first_visit_is_light_and_the_address_loses_its_token(
    app: App, browser: Browser
) -> None:
    context = browser.new_context()
    page = context.new_page()
    sizes: list[int] = []
    page.on("requestfinished", lambda one: sizes.append(one.sizes()["responseBodySize"]))
    page.goto(app.address)
    page.wait_for_load_state("networkidle")
    assert sum(sizes) < 300_000
    assert "token" not in page.url
    page.reload()
    expect(page.locator("#run-submit")).to_be_visible()
    stranger = browser.new_context().new_page()
    stranger.goto(page.url)
    expect(stranger.locator("main")).to_contain_text(sentence("app-no_token"))


def test_work_that_is_given_up_ends_and_the_button_ends_the_program(
    browser: Browser, tmp_path: Path
) -> None:
    with App(tmp_path) as own:
        page = opened(browser, own)
        expect(page.locator("#run-nothing li")).to_have_count(3)
        assert Axe().run(page).violations_count == 0
        page.set_input_files("input[name=file]", RUNS[0])
        page.click("#run-submit")
        page.click("#cancel")
        expect(page.locator("#wrong")).to_have_text(sentence("room-cancelled"))
        page.set_input_files("input[name=file]", RUNS[1])
        page.click("#run-submit")  # its place is free again
        named(page, RUNS[1].name)
        page.on("dialog", lambda asked: asked.accept())
        page.click("#app-end")
        expect(page.locator("main")).to_have_text(sentence("app-ended"))
        assert own.program.wait(timeout=LONGEST_MS / 1e3) == 0
    assert list(tmp_path.glob("thermaxis-work-*")) == []
