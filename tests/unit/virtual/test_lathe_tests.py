"""The virtual lathe's tests: the same bytes as the examples, and the physics they claim."""

from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.errors import ConfigurationError
from thermaxis.virtual import LATHE_TESTS, generate_lathe_test


def test_the_examples_are_what_the_command_writes(root: Path, tmp_path: Path) -> None:
    for test in LATHE_TESTS:
        path = tmp_path / f"lathe_{test}.csv"
        assert main(["generate", f"lathe-{test}", "-o", str(path)]) == 0
        assert path.read_bytes() == (root / "examples" / path.name).read_bytes()


def test_only_the_source_that_turns_gets_warm() -> None:
    spindle, table = generate_lathe_test("spindle"), generate_lathe_test("table")
    for log, warm, cold in ((spindle, "spindle", "table"), (table, "table", "spindle")):
        rise = {n: log.column(f"T_{n}_C") - log.column("T_column_C") for n in (warm, cold)}
        assert np.max(rise[warm]) > 4.0
        assert np.max(np.abs(rise[cold])) < 0.4
        assert np.all(log.column(f"n_{cold}_rpm") == 0.0)


def test_the_table_is_seen_for_seconds_while_it_turns_and_always_at_rest() -> None:
    log = generate_lathe_test("verification")
    turning = log.column("n_table_rpm") > 0.0
    seen = ~np.isnan(log.column("Z_D3000_um"))
    assert np.all(seen[~turning])
    assert 0.02 < np.mean(seen[turning]) < 0.05


def test_the_table_acts_with_the_gain_of_its_diameter() -> None:
    log = generate_lathe_test("table")
    rise = {d: float(np.nanmin(log.column(f"Z_D{d}_um"))) for d in (0, 1500, 3000)}
    assert rise[1500] / rise[0] == pytest.approx(1.6, abs=0.03)
    assert rise[3000] / rise[0] == pytest.approx(2.2, abs=0.03)


def test_another_seed_gives_another_hall() -> None:
    a, b = generate_lathe_test("spindle", 1), generate_lathe_test("spindle", 2)
    assert not np.array_equal(a.column("T_column_C"), b.column("T_column_C"))


def test_what_is_no_test_is_refused() -> None:
    for wrong in (("turret", 1), ("spindle", -1)):
        with pytest.raises(ConfigurationError):
            generate_lathe_test(*wrong)
