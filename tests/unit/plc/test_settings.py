"""What a PLC gets of a compensation, and what is refused in words."""

from dataclasses import replace

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.plc.compiled import compiled
from thermaxis.codes import Place
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    GainPoint,
    Limits,
    Output,
    Part,
    Section,
    SensorRules,
    SupervisorRules,
    TouchRules,
)
from thermaxis.plc import Block, PlcSettings, export_settings, remark_of
from thermaxis.plc._numbers import stored
from thermaxis.plc._settings import compensated_stall

RULES = SensorRules(lowest_c=1.0, highest_c=90.0)


def a_compensation(*parts: Part, outputs: int = 1, **traits: object) -> Compensation:
    made = parts or (Part("p", "t", "", 1.0, (Section(2.0, 600.0),)),)
    model = CompensationModel(outputs=tuple(Output(f"o{k}", made) for k in range(outputs)))
    plain = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, RULES),
        limits={output.name: Limits(20.0, 1.0) for output in model.outputs},
    )
    return replace(plain, **traits)


def exported(compensation: Compensation, **traits: object) -> PlcSettings:
    chosen = {"cycle_s": 1.0, "name": "z"} | traits
    return export_settings(compensation, **chosen)


def test_an_export_has_the_cycle_of_the_plc_one_interlock_and_no_second_sensors() -> None:
    given = a_compensation(redundant=frozenset({"t"}), interlocks=("on", "homed"), cycle_s=0.5)
    settings = exported(given, cycle_s=2.0)
    assert settings.compensation.cycle_s == 2.0
    assert settings.compensation.interlocks == ("plc",)
    assert settings.compensation.redundant == frozenset()
    assert settings.compensation.model is given.model
    assert settings.notes == ()


def test_a_rate_of_touches_that_real_would_lose_is_refused() -> None:
    given = a_compensation()
    name = given.model.outputs[0].name
    slow = TouchRules(limits=Limits(given.limits[name].total_um, 1e-4))
    given = replace(given, touches={name: slow})
    assert exported(given).compensation.touches == {name: slow}
    late = replace(given, touches={name: replace(slow, oldest_s=600.0)})
    assert exported(late).compensation.touches == {name: slow}
    assert [note.code for note in exported(late).notes] == ["change-touches_of_calls"]
    with refused("no_oldest_touch_in_block"):
        PlcSettings(compensation=replace(late, interlocks=("plc",)))
    with refused("rate_lost_in_real"):
        PlcSettings(compensation=exported(given).compensation, double=False)


def test_a_delay_becomes_the_nearest_whole_number_of_cycles_and_the_export_says_so() -> None:
    parts = [Part(f"p{k}", "t", "", 1.0, delay_s=d) for k, d in enumerate((0.0, 0.4, 2.6, 4.0))]
    settings = exported(a_compensation(*parts))
    delays = [settings.delay_cycles(part) for part in settings.compensation.model.layout.parts]
    assert delays == [0, 0, 3, 4]
    assert [*map(remark_of, settings.notes)] == [
        "delay of p1: 0.4 s in the model, 0 s here",
        "delay of p2: 2.6 s in the model, 3 s here",
    ]


def test_the_cycle_may_differ_by_a_tenth() -> None:
    settings = exported(a_compensation(), cycle_s=10.0)
    assert (settings.shortest_cycle_s, settings.longest_cycle_s) == (9.0, 11.0)


def test_a_cycle_outside_a_tenth_of_a_second_to_a_minute_is_refused() -> None:
    for cycle_s in [0.0, 0.09, 61.0, float("nan")]:
        with refused("outside_range"):
            exported(a_compensation(), cycle_s=cycle_s)


@pytest.mark.parametrize(
    ("parts", "outputs", "key", "count", "most"),
    [
        ((), 9, "outputs", 9, 8),
        (tuple(Part(f"p{k}", "t", "", 1.0) for k in range(51)), 1, "parts", 51, 50),
        (
            (Part("p", "t", "", 1.0, tuple(Section(1.0, 60.0 + k) for k in range(101))),),
            1,
            "sections",
            101,
            100,
        ),
        (tuple(Part(f"p{k}", f"t{k}", "", 1.0) for k in range(33)), 1, "channels", 33, 32),
    ],
)
def test_too_large_models_are_refused(
    parts: tuple[Part, ...], outputs: int, key: str, count: int, most: int
) -> None:
    with refused("outside_count", key=key, count=count, most=most):
        exported(a_compensation(*parts, outputs=outputs))


def test_too_long_a_delay_is_refused_and_the_longest_is_not() -> None:
    def part(delay_s: float) -> Part:
        return Part("p", "t", "", 1.0, delay_s=delay_s)

    with refused("delay_too_long", key="parts", channel="p", cycles=10_001):
        exported(a_compensation(part(10_001.0)))
    assert exported(a_compensation(part(10_000.0))).notes == ()
    assert exported(a_compensation(part(10_001.0)), cycle_s=2.0).notes


def test_settings_that_were_not_made_by_the_export_are_checked_too() -> None:
    plain = a_compensation(interlocks=("plc",))
    PlcSettings(compensation=plain)
    late = a_compensation(Part("p", "t", "", 1.0, delay_s=0.7), interlocks=("plc",))
    for compensation, code in (
        (late, "delay_no_whole_cycles"),
        (a_compensation(), "one_interlock_in_block"),
        (a_compensation(redundant=frozenset({"t"}), interlocks=("plc",)), "no_redundant_in_block"),
    ):
        with refused(code):
            PlcSettings(compensation=compensation)
    with refused("no_sha256"):
        PlcSettings(compensation=plain, model_sha256="xyz")


def test_a_gap_within_two_cycles_is_refused() -> None:
    plain = a_compensation()
    short = replace(plain, model=replace(plain.model, longest_gap_s=5.0))
    with refused("gap_within_cycle", key="longest_gap_s", gap_s=5.0):
        exported(short, cycle_s=10.0)
    assert exported(short, cycle_s=2.5).cycle_s == 2.5


def test_numbers_that_binary32_cannot_hold_are_refused_in_real_only() -> None:
    tiny = a_compensation(Part("p", "t", "", 1e-40))
    with refused("too_small_for_plc", key="parts", channel="p", kind="REAL"):
        Block(settings=exported(tiny, double=False))
    assert Block(settings=exported(tiny)).settings.double
    narrow = (GainPoint(100.0, 1.0), GainPoint(100.000001, 2.0))
    close = a_compensation(Part("p", "t", "", 1.0, gain_by_diameter=narrow))
    with refused("diameters_equal_in_real", key="parts", channel="p"):
        exported(close, double=False)
    assert exported(close).double
    with refused("too_small_for_plc", kind="LREAL"):
        stored(5e-324, double=True, place=Place(key="x"))
    wrong = {float("nan"): "not_finite", float("inf"): "not_finite", 1e39: "too_large_for_plc"}
    for value, code in wrong.items():
        with refused(code, key="x"):
            stored(value, double=False, place=Place(key="x"))


def test_a_constant_that_only_the_build_computes_is_refused_too() -> None:
    plain = a_compensation()
    faint = replace(plain, validity_margin_k=1e-42)
    ranged = Part("p", "t", "", 1.0, lowest_k=-1.0, highest_k=1.0)
    faint = replace(faint, model=replace(plain.model, outputs=(Output("o0", (ranged,)),)))
    with refused("too_small_for_plc"):
        Block(settings=exported(faint, double=False))
    assert Block(settings=exported(faint)).settings.double


def test_the_stall_of_a_compensated_increment_matters_only_beyond_every_legal_section() -> None:
    """The slowest legal section at the fastest legal cycle: alpha is 1e-9."""
    assert compensated_stall(1e-9) == pytest.approx(3.55e-6, rel=1e-3)
    with refused("not_positive_up_to", most=1e8):
        Section(1.0, 1.01e8)
    with refused("outside_range", least=0.1):
        exported(a_compensation(), cycle_s=0.099)


def test_a_number_in_the_target_is_rounded_once() -> None:
    assert stored(0.1, double=True) == 0.1
    assert stored(0.1, double=False) == 0.100000001490116119384765625


# ---- REAL ---------------------------------------------------------------------------------------


def test_a_cycle_in_real_that_is_no_multiple_of_a_128th_of_a_second_is_refused() -> None:
    for cycle_s in [0.1, 0.2, 1.1, 2.003]:
        with refused("cycle_not_counted", key="cycle_s") as caught:
            exported(a_compensation(), cycle_s=cycle_s, double=False)
        nearest_s = caught.value.values["nearest_s"]
        assert isinstance(nearest_s, float)
        assert not exported(a_compensation(), cycle_s=nearest_s, double=False).double
        assert abs(nearest_s - cycle_s) <= 1.0 / 256.0
        assert exported(a_compensation(), cycle_s=cycle_s).double


def test_in_real_every_time_up_to_a_day_is_counted_exactly() -> None:
    for cycle_s in [13.0 / 128.0, 0.125, 141.0 / 128.0, 1.0, 59.9921875]:
        exported(a_compensation(), cycle_s=cycle_s, double=False)
        cycles = int(86_400.0 / cycle_s) + 2
        counted = np.add.accumulate(np.full(cycles, cycle_s, np.float32), dtype=np.float32)
        assert np.array_equal(counted.astype(float), cycle_s * np.arange(1, cycles + 1))


def test_times_together_that_real_does_not_count_exactly_are_refused() -> None:
    long = SupervisorRules(settle_s=60_000.0, hold_operator_s=86_400.0)
    with refused("time_not_counted", key="supervisor", longest_s=131_072.0):
        exported(a_compensation(supervisor=long), cycle_s=0.1015625, double=False)
    assert not exported(a_compensation(supervisor=long), cycle_s=1.0, double=False).double
    assert exported(a_compensation(supervisor=long), cycle_s=0.1015625).double


ULP_UM = float(np.spacing(np.float32(100.0)))


def at_the_border(share: float) -> Compensation:
    """Return limits whose rate is a share of what REAL demands, at a cycle of a second."""
    return a_compensation(limits={"o0": Limits(100.0, share * 1000.0 * ULP_UM)})


def test_a_rate_that_real_would_lose_in_the_rounding_of_its_total_is_refused() -> None:
    with refused("rate_lost_in_real", key="largest_rate_um_per_s", channel="o0"):
        exported(at_the_border(0.999), double=False)
    assert not exported(at_the_border(1.0), double=False).double
    assert not exported(at_the_border(0.999), cycle_s=2.0, double=False).double
    assert exported(at_the_border(0.999)).double


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_the_border_the_rate_in_real_is_reached_and_never_passed_but_by_rounding(
    sign: float,
) -> None:
    compensation = at_the_border(1.0)
    rate_um = compensation.bounds[0].largest_rate_um_per_s
    block = compiled(exported(compensation, double=False))
    calm = {"cycle_time_s": 1.0, "ok_t": True, "interlocks_met": True, "connected": True}
    stands_um, changes_um, reached_um = sign * 99.0, list[float](), list[float]()
    for call in range(400):
        told = calm | {"enable": call > 0, "read_ok": True, "read_o0": stands_um}
        told |= {"t_t": 20.0}
        for name, value in told.items():
            assert hasattr(block, name)
            setattr(block, name, value)
        block.call()
        changes_um.append(block.correction_o0 - stands_um)
        reached_um.append(block.correction_o0)
        stands_um = block.correction_o0
    assert max(map(abs, changes_um)) <= rate_um + 0.5 * ULP_UM
    assert max(map(abs, changes_um)) >= rate_um - 0.5 * ULP_UM
    assert sum(abs(c) > 0.999 * rate_um for c in changes_um) > 300
    assert abs(reached_um[-1]) == pytest.approx(99.0 - rate_um * 339, abs=3.0 * rate_um)
