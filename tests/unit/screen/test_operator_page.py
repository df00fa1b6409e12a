"""The operator's page: who sees it, and what it is given."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tests.unit.screen.stand import Somebody, copied_lathe, lathe
from thermaxis.compensation import Limits, TouchRules
from thermaxis.messages import sentence
from thermaxis.runtime import Role
from thermaxis.runtime.status import ASKS
from thermaxis.screen.pages import operator_page as _operator_page
from thermaxis.screen.pages.operator_page import (
    EXPIRIES_S,
    ages_of,
    expiries_of,
    facts_of,
    gains_of,
)
from thermaxis.web import asset_folder

FOLDER = Path(_operator_page.__file__).parents[1]


def facts_in(text: str) -> dict[str, object]:
    """Return what stands in the page for its script."""
    found = re.search(r'<script type="application/json" id="operator-facts">(.*?)</script>', text)
    assert found is not None
    return json.loads(found[1])


def test_a_log_in_without_a_role_does_not_even_see_the_page() -> None:
    assert Somebody(Role.NONE).send("GET", "/").status_code == 403


def test_the_page_knows_the_loops_rules_that_the_status_does_not_tell() -> None:
    rules = lathe().compensation.supervisor
    page = Somebody().send("GET", "/").text
    facts = facts_in(page)
    assert facts["hold_operator_s"] == rules.hold_operator_s
    assert facts["model_sha256"] == lathe().model.sha256
    expiries = re.findall(r'name="seconds" value="([^"]+)"', page)
    assert tuple(map(float, expiries)) == expiries_of(rules.longest_trim_s)
    assert sentence("operator-diameter_machine") in page
    assert facts == json.loads(json.dumps(facts_of(lathe())))
    assert facts["touched"] == {}
    assert 'data-ask="Touch" hidden' in page


def test_a_touch_can_be_typed_where_touches_are_looked_at(tmp_path: Path) -> None:
    found = copied_lathe(tmp_path)
    rules = TouchRules(limits=Limits(20.0, 0.05), acts=True)
    touched = replace(found, compensation=replace(found.compensation, touches={"Z_um": rules}))
    page = Somebody(configuration=touched).send("GET", "/").text
    assert 'data-ask="Touch" hidden' not in page
    assert facts_in(page)["touched"] == {
        "Z_um": {"acts": True, "largest_um": 20.0, "largest_rate_um_per_s": 0.05}
    }


@pytest.mark.parametrize(
    ("cycle_s", "oldest_s", "most_s"), [(0.2, 0.0, 0.0), (1.0, 0.0, 60.0), (0.2, 1000.0, 900.0)]
)
def test_no_touch_is_typed_that_is_older_than_the_loop_remembers(
    cycle_s: float, oldest_s: float, most_s: float
) -> None:
    rules = TouchRules(limits=Limits(20.0, 0.05), oldest_s=oldest_s)
    given = replace(lathe().compensation, cycle_s=cycle_s, touches={"Z_um": rules})
    assert ages_of(given)[-1] == most_s


def test_the_gains_are_those_of_the_models_file() -> None:
    model = json.loads(lathe().model.path.read_text("utf-8"))
    expected = {
        output["name"]: {
            part["name"]: {
                "points": [[p["diameter_mm"], p["gain"]] for p in part["gain_by_diameter"]],
                "tool_gain": part["tool_gain"],
            }
            for part in output["parts"]
            if part["gain_by_diameter"]
        }
        for output in model["outputs"]
    }
    assert gains_of(lathe().model.model) == expected
    assert expected["Z_um"].keys() == {"table"}


def test_no_trim_can_be_chosen_that_expires_later_than_the_loop_allows() -> None:
    assert expiries_of(28_800.0) == EXPIRIES_S
    assert expiries_of(28_799.9) == (1800.0, 3600.0, 14_400.0)
    assert expiries_of(600.0) == (600.0,)


def test_a_hostile_model_name_stays_data_in_the_page() -> None:
    found = lathe()
    output = found.model.model.outputs[0]
    part = next(part for part in output.parts if part.gain_by_diameter)
    hostile = "</script><script>alert(1)</script>"
    parts = tuple(replace(one, name=hostile) if one is part else one for one in output.parts)
    model = replace(found.model.model, outputs=(replace(output, parts=parts),))
    text = str(_operator_page.for_script({"gains": gains_of(model)}))
    assert "<" not in text
    assert hostile in json.loads(text)["gains"]["Z_um"]


class _Words(HTMLParser):
    """Collects the letters that stand in a template itself."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_data(self, data: str) -> None:
        """Note text."""
        if any(c.isalpha() for c in data):
            self.found.append(data.strip())


def test_no_word_of_a_language_stands_in_the_template() -> None:
    template = (FOLDER / "pages" / "operator.html").read_text("utf-8")
    reader = _Words()
    reader.feed(re.sub(r"{%.*?%}|{{.*?}}", "", template, flags=re.DOTALL))
    assert reader.found == []


def test_every_method_that_an_operator_may_call_has_a_way_on_the_page() -> None:
    script = (asset_folder() / "operator/asks.js").read_text("utf-8")
    page = Somebody().send("GET", "/").text
    for ask in ASKS:
        if ask.role is Role.OPERATOR:
            assert re.search(rf"\b{ask.name}\b", script)
            if ask.name not in {"NoDiameter", "Datum"}:  # in the dialogs of diameter and touch
                assert f'data-ask="{ask.name}"' in page


def test_the_page_asks_nothing_of_any_other_address() -> None:
    for source in [*asset_folder().glob("operator/*"), *asset_folder().glob("ask/*")]:
        text = source.read_text("utf-8")
        assert "//" not in re.sub(r"(?m)^\s*//.*$|/\*.*?\*/|; // .*$", "", text)
        assert "innerHTML" not in text
        assert "eval(" not in text
