"""Names that every target takes, and text from people that may stand in a remark."""

import re
import unicodedata
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import final

from thermaxis.codes import Place
from thermaxis.compensation import CompensationModel
from thermaxis.errors import ConfigurationError
from thermaxis.plc._library import LIBRARY, SINUMERIK, TOUCH, library_file

LONGEST_NAME = 24
"""Longest name of a block or a variable. Origin: the limit of old Siemens tools, from the trade.
[1]"""
PREFIX = "tx_"
"""What the name of every block begins with."""
LONGEST_TEXT = 60
"""Longest text from a person in a remark. Origin: a line of 100 signs with what stands before.
[1]"""
CUT = "..."
"""Sign behind a text that was cut; its signs may stand in a remark."""
# In C a block is a type and two functions; a name that ends like one could be that of another.
_TAKEN_ENDINGS = ("_init", "_step", "_h")
_LONGEST_CHANNEL = 14
_LONGEST_OUTPUT = 13
_LONGEST_PART = 18
_LONGEST_BLOCK = LONGEST_NAME - len(PREFIX)
# Names of the main block that are made of a prefix and one of these would mean something else.
_TAKEN_STEMS = frozenset({"ok", "quality", "runs", "id_1", "id_2"})


@final
@dataclass(frozen=True, slots=True)
class PlcNames:
    """Stems of names, each once, whatever the case: a variable is a prefix and a stem."""

    block: str
    """Name of the block that a user calls, with its prefix."""
    channels: tuple[str, ...]
    """By sensor: the channels of the model in its order, then witnesses besides."""
    outputs: tuple[str, ...]
    parts: tuple[str, ...]
    """By part, in the order of the outputs."""


def names_of(model: CompensationModel, name: str, judged: Iterable[str] = ()) -> PlcNames:
    """Return the names of a program; judged are its channels, maybe with others."""
    outputs = _stems([o.name for o in model.outputs], "outputs", _LONGEST_OUTPUT, _TAKEN_STEMS)
    parts = [part.name for output in model.outputs for part in output.parts]
    return PlcNames(
        _block_name(name),
        _stems(judged or model.channels, "channels", _LONGEST_CHANNEL, ()),
        outputs,
        _stems(parts, "parts", _LONGEST_PART, ()),
    )


def _block_name(name: str) -> str:
    stem = legal_stem(name, _LONGEST_BLOCK, place=Place(key="name"))
    texts = (f"{LIBRARY}.st", f"{LIBRARY}.h", f"{TOUCH}.st", f"{TOUCH}.h", f"{SINUMERIK}.st")
    library = "".join(map(library_file, texts))
    if re.search(rf"\b{PREFIX}{stem}\b", library):
        raise ConfigurationError("block_name_taken", name=f"{PREFIX}{stem}", key="name")
    if stem.endswith(_TAKEN_ENDINGS):
        raise ConfigurationError("block_name_ending", endings=_TAKEN_ENDINGS, key="name")
    return PREFIX + stem


def _stems(texts: Iterable[str], what: str, longest: int, taken: Iterable[str]) -> tuple[str, ...]:
    """Return a stem for every text; a text that needs no change keeps its own."""
    used, texts = set(taken), tuple(texts)
    words = [set(_plain(text).split("_")) for text in texts]
    shared = set[str]().union(*words[:1]).intersection(*words) if len(words) > 1 else set[str]()
    wanted = [
        (text, legal_stem(text, longest, place=Place(key=what, channel=text), without=shared))
        for text in texts
    ]
    stems: dict[int, str] = {}
    for changed in (False, True):
        for place, (text, stem) in enumerate(wanted):
            if place in stems or (not changed and (text != stem or stem in used)):
                continue
            stems[place] = unique(stem, used, longest)
            used.add(stems[place])
    return tuple([stems[place] for place in range(len(wanted))])


def unique(stem: str, used: Iterable[str], longest: int) -> str:
    """Return a name that is not used yet: with a number behind it where it is."""
    taken = set(used)
    tried, number = stem, 1
    while tried in taken:
        number += 1
        end = f"_{number}"
        tried = stem[: longest - len(end)].rstrip("_") + end
    return tried


def legal_stem(
    text: str, longest: int, *, place: Place, without: Collection[str] = frozenset()
) -> str:
    """Return a text as a name behind a prefix: lower case, digits and single underscores.

    One that is too long loses the words that it may be without, then letters of its longest words,
    so that left and right, front and rear, 1 and 2 stay apart.
    """
    stem = _plain(text)
    if not stem:
        raise ConfigurationError("name_without_letters", place=place)
    if len(stem) <= longest:
        return stem
    words = stem.split("_")
    words = [word for word in words if word not in without] or words
    while len("_".join(words)) > longest and max(map(len, words)) > 1:
        k = max(range(len(words)), key=lambda place: len(words[place]))
        letters = words[k].rstrip("0123456789")
        words[k] = letters[:-1] + words[k][len(letters) :] if letters else words[k][:-1]
    return "_".join(words)[:longest].rstrip("_")


def _plain(text: str) -> str:
    plain = unicodedata.normalize("NFKD", _ascii_units(text)).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_")


def remark_text(text: str, longest: int = LONGEST_TEXT) -> str:
    """Return text from a person so that it may stand in a remark of any target."""
    units = re.sub(r"(?<=um)/(?=[A-Za-z])", " per ", _ascii_units(text).replace("−", "-"))
    plain = unicodedata.normalize("NFKD", units)
    kept = "".join(c for c in plain if not unicodedata.combining(c))
    whole = " ".join(re.sub(r"[^A-Za-z0-9 _.-]", " ", kept).split())
    if len(whole) <= longest:
        return whole
    end = whole.rfind(" ", 0, longest - len(CUT))
    return f"{whole[:end]} {CUT}" if end > 0 else whole[: longest - len(CUT)] + CUT


def _ascii_units(text: str) -> str:
    return text.replace("µ", "u").replace("μ", "u").replace("°", "deg").replace("ß", "ss")
