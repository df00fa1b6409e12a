"""Names that every target takes, and text from people."""

import re

import pytest
from hypothesis import given, strategies as st

from tests.refusals import refused
from thermaxis.codes import Place
from thermaxis.compensation import CompensationModel, Output, Part
from thermaxis.errors import ConfigurationError
from thermaxis.plc._names import (
    LONGEST_NAME,
    legal_stem,
    names_of,
    remark_text,
    unique,
)

PREFIXES = ("correction_", "model_", "wanted_", "weight_", "limit_", "added_", "trim_", "read_")


_IEC = """
    action and any array at begin bool by byte case char configuration const constant continue
    do dint dt dword else elsif en end eno eq exit exp expt false for from function function_block
    ge goto gt if implements in int interface interval le len limit lint ln log lreal lt lword max
    method min mod move mux namespace ne not null of on or override pointer private program
    protected public r_edge read_only read_write real ref ref_to reference repeat resource retain
    return rol ror r_trig f_trig rs sel shl shr single sint sqrt sr step string struct super
    task then this time tod to tof ton tp transition true trunc type udint uint ulint union until
    usint using var var_access var_config var_external var_global var_in_out var_input var_output
    var_temp vars while with word wstring xor abs acos asin atan cos sin tan add sub mul div
    concat delete find insert left mid replace right ctu ctd ctud f_edge non_retain date
    date_and_time time_of_day
"""
_SCL = """
    any_to block_db block_fb block_fc block_sdb block_sfb block_sfc counter data_block db di
    end_const end_data_block end_label end_region end_var ib iw label ldt mb mw nil ok
    organization_block overlap peek poke qb qw region s5time temp timer title variant version void
"""
_C = """
    auto bool break char const default double enum extern float inline int int16_t long main
    register restrict short signed sizeof static switch typedef unsigned void volatile errno
    assert linux unix near far
"""
RESERVED = frozenset(f"{_IEC} {_SCL} {_C}".split())
"""Words that are no name in one of the targets, lower case: those of IEC 61131-3 with its standard
functions and blocks, those that STEP 7 and TIA Portal keep beside them, those of C."""


def is_legal(name: str) -> bool:
    """Whether every target takes a name."""
    formed = re.fullmatch(r"[a-z](_?[a-z0-9])*", name) is not None
    return formed and len(name) <= LONGEST_NAME and name not in RESERVED


def a_model(*parts: tuple[str, str], outputs: tuple[str, ...] = ("Z_um",)) -> CompensationModel:
    made = tuple(Part(name, channel) for name, channel in parts)
    return CompensationModel(outputs=tuple(Output(name, made) for name in outputs))


def test_a_name_becomes_lower_case_with_single_underscores() -> None:
    assert legal_stem("Spindle  front-bearing", 30, place=Place(key="x")) == "spindle_front_bearing"
    assert legal_stem("__T1__(°C)", 30, place=Place(key="x")) == "t1_degc"
    assert legal_stem("Lůžko řady 3", 30, place=Place(key="x")) == "luzko_rady_3"
    assert legal_stem("Weg µm", 30, place=Place(key="x")) == "weg_um"
    assert legal_stem("front bearing", 6, place=Place(key="x")) == "fr_bea"
    assert legal_stem("a b c d e f g", 6, place=Place(key="x")) == "a_b_c"


def test_a_name_without_a_letter_is_refused() -> None:
    for text in ["", "   ", "---", "温度", "*()", "_"]:
        with refused("name_without_letters", key="channel"):
            legal_stem(text, 20, place=Place(key="channel"))


@given(st.text(max_size=40))
def test_every_name_is_legal_behind_its_prefix_or_refused(text: str) -> None:
    try:
        stem = legal_stem(text, 13, place=Place(key="output"))
    except ConfigurationError:
        assert not re.search("[A-Za-z0-9]", text)
        return
    for prefix in PREFIXES:
        assert is_legal(prefix + stem)


@given(st.lists(st.text("aBbC_ 1", min_size=1, max_size=20), min_size=1, max_size=12, unique=True))
def test_names_are_unique_whatever_the_case(texts: list[str]) -> None:
    named = [(text, text) for text in texts if re.search("[A-Za-z0-9]", text)]
    if not named:
        return
    names = names_of(a_model(*named), "axis")
    for stems, prefix in ((names.channels, "quality_"), (names.parts, "part_")):
        assert len({stem.lower() for stem in stems}) == len(named)
        assert all(is_legal(prefix + stem) for stem in stems)


def test_long_names_keep_what_tells_them_apart() -> None:
    def channels(*texts: str) -> tuple[str, ...]:
        return names_of(a_model(*((text, text) for text in texts)), "axis").channels

    bearing = "T_Spindellager_vorne_{}_C"
    sides = bearing.format("links"), bearing.format("rechts")
    assert channels(*sides) == ("links", "rechts")
    assert channels(*sides, "T_Bett_C") == ("spin_vorn_link", "spin_vorn_rech", "t_bett_c")
    assert channels(*sides, "Raum") == ("t_sp_vor_lin_c", "t_sp_vor_rec_c", "raum")
    assert channels("Umgebungstemperatur12", "Umgebungstemperatur13") == (
        "umgebungstem12",
        "umgebungstem13",
    )
    blocks = [names_of(a_model(("p", "t")), f"Bearbeitungszentrum Halle {k}").block for k in "12"]
    assert blocks == ["tx_bearbeitungsz_halle_1", "tx_bearbeitungsz_halle_2"]


def test_names_that_are_cut_to_the_same_get_a_number() -> None:
    long = "temperatureofthefrontbearing"
    names = names_of(a_model((f"{long}a", f"{long}a"), (f"{long}b", f"{long}b")), "axis")
    assert names.channels == ("temperatureoft", "temperatureo_2")
    assert unique("a", {"a", "a_2"}, 5) == "a_3"


def test_a_name_that_needs_no_change_keeps_it_wherever_it_stands() -> None:
    for texts in [("A", "a"), ("a", "A"), ("A", "a_2", "a"), ("a b", "A", "a_b", "a")]:
        names = names_of(a_model(*((text, text) for text in texts)), "axis")
        for stems in (names.channels, names.parts):
            kept = dict(zip(texts, stems, strict=True))
            for text in texts:
                assert (kept[text] == text) == (re.fullmatch("[a-z0-9_]+", text) is not None)
            assert len(set(stems)) == len(texts)


def test_an_output_never_takes_the_name_of_another_variable() -> None:
    """An output `ok` would make `read_ok`, `quality` would make `model_quality`."""
    names = names_of(a_model(("p", "t"), outputs=("ok", "Quality", "id_1")), "axis")
    made = {prefix + stem for prefix in PREFIXES for stem in names.outputs}
    assert not made & {"read_ok", "model_quality", "model_id_1", "model_id_2"}


def test_parts_of_two_outputs_have_names_of_their_own() -> None:
    names = names_of(a_model(("spindle", "t"), outputs=("Z_um", "X_um")), "axis")
    assert names.parts == ("spindle", "spindle_2")


def test_the_block_never_takes_a_name_that_the_program_needs() -> None:
    for name in [
        "lag",
        "Sensor",
        "begin",
        "number",
        "Model state",
        "lag_step",
        "z_init",
        "nc_offset",
    ]:
        with pytest.raises(ConfigurationError) as caught:
            names_of(a_model(("p", "t")), name)
        assert caught.value.place.key == "name"


def test_reserved_words_are_no_names() -> None:
    for name in ["limit", "at", "to", "step", "ok", "int", "function_block"]:
        assert name in RESERVED
        assert not is_legal(name)


def test_other_signs_are_no_names() -> None:
    for name in ["A", "a__b", "_a", "a_", "1a", "a b", "", "ä", "x" * 25]:
        assert not is_legal(name)
        assert is_legal("x" * LONGEST_NAME)


@given(st.text(max_size=200))
def test_text_from_people_is_letters_digits_space_and_three_signs(text: str) -> None:
    shown = remark_text(text)
    assert re.fullmatch(r"[A-Za-z0-9 _.-]{0,60}", shown)
    assert remark_text(shown) == shown


def test_text_from_people_stays_readable() -> None:
    assert remark_text("+3.55 and −2.57 µm/K") == "3.55 and -2.57 um per K"
    assert remark_text("Ložisko č. 3 (°C) – 5 µm; *) END_VAR") == "Lozisko c. 3 degC 5 um END_VAR"


def test_a_text_that_is_too_long_ends_behind_a_word_with_a_sign_that_it_was_cut() -> None:
    text = "the fit of the spindle is worse than that of the column by thirteen percent"
    assert remark_text(text) == "the fit of the spindle is worse than that of the column ..."
    assert remark_text(text, len(text)) == text
    assert remark_text(text, len(text) - 1) == text.removesuffix(" percent") + " ..."
    assert remark_text("x" * 80) == "x" * 57 + "..."


@given(st.lists(st.text("abcXYZ019-_.", min_size=1, max_size=30)), st.integers(4, 80))
def test_what_is_left_of_a_text_is_whole_words_of_it(words: list[str], longest: int) -> None:
    shown = remark_text(" ".join(words), longest)
    assert len(shown) <= longest
    if shown != " ".join(words):
        left, sign = shown[:-3], shown[-3:]
        assert sign == "..."
        if " " in left:
            kept = left.split()
            assert left.endswith(" ")
            assert kept == words[: len(kept)]
            # As many words as there is room for.
            assert len(" ".join(words[: len(kept) + 1])) + len(" ...") > longest
        else:
            assert words[0].startswith(left)
