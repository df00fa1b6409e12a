"""Elements of a Digital Calibration Certificate: its form, filled, and quantities of D-SI."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from importlib import resources
from typing import TypeAlias, final
from xml.etree.ElementTree import XML, Element, register_namespace

from thermaxis.report._text import NOT_STATED, plain_text

LONGEST = 2000
"""Longest text of a person or a file. [1]"""
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([Ee][-+]?\d+)?", re.ASCII)
"""A number as D-SI writes it."""
_NAMESPACES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
_COVERAGE_PROBABILITY = "0.9545"
"""What k = 2 encloses of a normal distribution, as U is evaluated. [1]"""

Content: TypeAlias = Element | str | None

for _prefix, _namespace in _NAMESPACES.items():
    register_namespace(_prefix, _namespace)


def element(tag: str, *content: Content, **attributes: str) -> Element:
    """Return an element with its text, or with what exists of its children."""
    prefix, _, name = tag.partition(":")
    attributes = {key: value for key, value in attributes.items() if value}
    made = Element(f"{{{_NAMESPACES[prefix]}}}{name}", attributes)
    for part in content:
        if isinstance(part, str):
            made.text = part
        elif part is not None:
            made.append(part)
    return made


def words(tag: str, text: str) -> Element:
    """Return an element with a sentence of this program."""
    return element(tag, element("dcc:content", plain_text(text, LONGEST), lang="en"))


def proper(tag: str, text: str) -> Element:
    """Return an element with a text of a person or a file, in whatever language."""
    return element(tag, element("dcc:content", plain_text(text, LONGEST) or NOT_STATED))


def filled_form(texts: Mapping[str, str], slots: Mapping[str, Iterable[Element]]) -> Element:
    """Return ``certificate.xml`` with texts and elements in their places."""
    form = XML(resources.files("thermaxis.report.dcc").joinpath("certificate.xml").read_bytes())
    for parent in list(form.iter()):
        for child in list(parent):
            slot = child.attrib.pop("slot", "")
            child.extend(slots.get(slot, ()))
            needed = child.attrib.pop("if", "")
            if (needed and not texts.get(needed)) or (slot and not _stays(child, texts)):
                parent.remove(child)
            elif child.text and child.text.startswith("{"):
                child.text = texts.get(child.text.strip("{}")) or NOT_STATED
    return form


def _stays(element: Element, texts: Mapping[str, str]) -> bool:
    """Return whether an element will have a child."""
    return any("if" not in child.attrib or texts.get(child.attrib["if"]) for child in element)


# ---- quantities ---------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Uncertainty of each value of a quantity."""

    values: Sequence[float]
    """Expanded with a coverage factor, standard without one. [as the quantity]"""
    distribution: str
    """Distribution of what the value may be; one word."""
    coverage_factor: float | None = None
    """k; None for standard uncertainties. [1]"""


@final
@dataclass(frozen=True, slots=True)
class Quantity:
    """One number, or one for each target."""

    ref_type: str
    name: str
    """What it is, in words."""
    unit: str
    values: Sequence[float]
    """Value, or values in the order of the targets."""
    uncertainty: Uncertainty | None = None
    """Its uncertainty; None where none was evaluated."""
    listed: bool = False
    """Whether it is a list, which may have one entry."""
    shift: int = 0
    """Power of ten from the unit of the results to this one. [1]"""

    def as_element(self, metadata: Element | None = None) -> Element:
        """Return it as the certificate has it."""
        suffix = "XMLList" if self.listed else ""
        number = element(
            "si:realListXMLList" if self.listed else "si:real",
            element(f"si:value{suffix}", self._digits(self.values)),
            element(f"si:unit{suffix}", self.unit),
            self._uncertainty(suffix),
        )
        about = None if metadata is None else element("dcc:measurementMetaData", metadata)
        name = words("dcc:name", self.name)
        return element("dcc:quantity", name, number, about, refType=self.ref_type)

    def _digits(self, values: Iterable[float]) -> str:
        """Return numbers with all their digits: reading them gives the same floats."""
        return " ".join(shifted(repr(value), self.shift) for value in values)

    def _uncertainty(self, suffix: str) -> Element | None:
        stated = self.uncertainty
        if stated is None:
            return None
        kind, factor = "standard", list[Element]()
        if stated.coverage_factor is not None:
            kind = "expanded"
            factor = [
                element(f"si:coverageFactor{suffix}", repr(stated.coverage_factor)),
                element(f"si:coverageProbability{suffix}", _COVERAGE_PROBABILITY),
            ]
        mu = element(
            f"si:{kind}MU{suffix}",
            element(f"si:value{kind.capitalize()}MU{suffix}", self._digits(stated.values)),
            *factor,
            element(f"si:distribution{suffix}", stated.distribution),
        )
        return element(f"si:measurementUncertaintyUnivariate{suffix}", mu)


def shifted(digits: str, power: int) -> str:
    """Return a number times a power of ten, with the same digits."""
    return str(Decimal(digits).scaleb(power)) if power else digits
