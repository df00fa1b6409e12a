"""Forms of the head, the limits and the budget: the fields that their files may state."""

from thermaxis.app._rooms import Json
from thermaxis.files.settings import BUDGET_KEYS, HEADER_GROUPS
from thermaxis.positioning import FIGURE_KEYS

_RULES = ("simple", "iso14253-1")


def forms() -> dict[str, list[Json]]:
    """Return the fields of each file, by groups: table, title, and keys with what they take."""
    head = [
        {
            "table": group.name,
            "title": group.title,
            "fields": [
                {"key": one.name, "label": one.label, "unit": one.unit, "needed": one.needed}
                for one in group.fields
            ],
        }
        for group in HEADER_GROUPS
    ]
    limits = [
        {"key": f"{key}_{suffix}", "label": key, "unit": unit}
        for suffix, unit in (("um", "µm"), ("arcsec", "″"))
        for key in FIGURE_KEYS
    ]
    rule = {"key": "decision_rule", "label": "decision_rule", "unit": "", "choices": _RULES}
    budget = [
        {"table": table, "title": table, "fields": [_named(key) for key in keys]}
        for table, keys in BUDGET_KEYS.items()
    ]
    limit_group = {"table": "limits", "title": "limits", "fields": [*limits, rule]}
    return {"head": head, "limits": [limit_group], "budget": budget}


def _named(key: str) -> Json:
    return {"key": key, "label": key.replace("_", " "), "unit": ""}
