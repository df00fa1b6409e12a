"""Fields of the certificate's head as quantities and conditions."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from thermaxis.files.settings import HEADER_FIELDS, HEADER_GROUPS, HeaderField
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report.dcc._xml import NUMBER, element, proper, shifted, words

_UNITS = {
    "mm": (r"\milli\metre", 0),
    "µm": (r"\micro\metre", 0),
    "°": (r"\degree", 0),
    "mm/min": (r"\milli\metre\minute\tothe{-1}", 0),
    "°/min": (r"\degree\minute\tothe{-1}", 0),
    "s": (r"\second", 0),
    "°C": (r"\degreecelsius", 0),
    "K": (r"\kelvin", 0),
    "K/h": (r"\kelvin\hour\tothe{-1}", 0),
    "ppm/K": (r"\micro\metre\metre\tothe{-1}\kelvin\tothe{-1}", 0),
    "kPa": (r"\kilo\pascal", 0),
    "%": (r"\one", -2),
}
"""Units of the head in D-SI, and the power of ten to them."""
_BASIC = {"°C": "basic_temperature", "%": "basic_humidityRelative"}


def _type(field: HeaderField) -> str:
    """Return the type of a field: that of its place in the header file."""
    return f"thermaxis_header_{field.place.replace('.', '_')}"


def _stated(tag: str, name: str, text: str, unit: str, ref_type: str = "") -> Element:
    """Return a number with its unit, or what else was stated, as it was written."""
    value = proper("dcc:noQuantity", f"{text} {unit}" if unit else text)
    if unit in _UNITS and NUMBER.fullmatch(text):
        dsi, power = _UNITS[unit]
        value = element(
            "si:real", element("si:value", shifted(text, power)), element("si:unit", dsi)
        )
    return element(tag, words("dcc:name", name), value, refType=ref_type)


def quantities(
    report: CertifiedReport, tag: str, groups: tuple[str, ...], shown: frozenset[str]
) -> Iterator[Element]:
    """Yield what groups of the head state and the form does not show."""
    for field in (
        field for group in HEADER_GROUPS if group.name in groups for field in group.fields
    ):
        text = report.header.get(field.key, "")
        if text and field.key not in shown:
            yield _stated(tag, field.label, text, field.unit, _type(field))


def influence_conditions(report: CertifiedReport) -> list[Element]:
    """Return the environment as the head and the measured file state it."""
    environment = report.read_head.environment
    head = {f.key for group in HEADER_GROUPS if group.name == "environment" for f in group.fields}
    conditions: list[Element] = []
    for key in sorted({*environment, *(key for key in head if report.header.get(key))}):
        values = {"stated": report.header.get(key, "")}
        if (both := environment.get(key)) is not None:
            moments = {"at the start": both.start, "at the end": both.end}
            values |= {when: "" if v is None else repr(v) for when, v in moments.items()}
        conditions.append(_condition(key, {when: text for when, text in values.items() if text}))
    return conditions or [_condition("environment", {"stated": ""})]


def _condition(key: str, values: dict[str, str]) -> Element:
    field = HEADER_FIELDS.get(key)
    label, unit = (key.replace("_", " "), "") if field is None else (field.label, field.unit)
    types = (_BASIC.get(unit, ""), "" if field is None else _type(field))
    data = (_stated("dcc:quantity", when, text, unit) for when, text in values.items())
    name, data = words("dcc:name", label), element("dcc:data", *data)
    return element("dcc:influenceCondition", name, data, refType=" ".join(filter(None, types)))


def sensors(report: CertifiedReport) -> Iterator[Element]:
    """Yield the sensors of the environment."""
    for field in next(group.fields for group in HEADER_GROUPS if group.name == "sensors"):
        if text := report.header.get(field.key, ""):
            name = words("dcc:name", field.label)
            sensor = (name, proper("dcc:description", text))
            yield element("dcc:measuringEquipment", *sensor, refType=_type(field))
