"""Thermal tests of four machines whose truth is known, made apart from the code that is tested.

A machine is a network of temperatures x = T - T(0) with heat q from two sources and a hall h,

    dx/dt = A x + B q + b h      temperatures and displacement = C x

which starts at the hall's temperature. Three rounded sensors (spindle, table, column) are logged;
inputs are spindle less column and table less column. What a model of those inputs can know is the
ratio of two responses, Z(s) U(s)^-1 with both answers to the two sources: its value at rest is the
true DC gain. Everything else that moves the tool point (hall, drift, probe) is drift.

direct    three lags, 400, 3000 and 12000 s, of the two true differences: sums of lags are exact
coupled   heat of either source flows through a common bed and warms both sensors and the column
remote    sensors away from the heat: the displacement starts the wrong way (zero in the right half
          plane), and the ratio has a pair of complex poles
coolant   a coolant carries heat from the spindle along the bed to table, column, tank and back
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig
from scipy.signal import lfilter

Array = NDArray[np.float64]

KINDS = ("direct", "coupled", "remote", "coolant")
TRUE_TAU_S = (400.0, 3000.0, 12000.0)
"""Lags of the machine `direct`. [s]"""
_GAINS = ((10.0, 30.0, -16.0), (6.0, 9.0, 17.0))
DRIFT_UM, DRIFT_S = 0.7, 7200.0
NOISE_UM, NOISE_K, STEP_K = 0.4, 0.02, 0.1


@dataclass(frozen=True, eq=False)
class Machine:
    """Matrices of a network; rows of `c`: spindle, table, column, displacement."""

    a: Array
    b: Array
    hall: Array
    c: Array

    @property
    def dc_gain(self) -> Array:
        """True gain at rest of both inputs: the ratio of two responses to the heat. [um/K]"""
        rest = self.c @ np.linalg.solve(-self.a, self.b)
        return np.linalg.solve((rest[:2] - rest[2]).T, rest[3])

    def response(self, s: complex) -> NDArray[np.complex128]:
        """Ratio Z(s) U(s)^-1 of both inputs. [um/K]"""
        answer = self.c @ np.linalg.solve(s * np.eye(len(self.a)) - self.a, self.b)
        return np.linalg.solve((answer[:2] - answer[2]).T, answer[3])

    @property
    def ratio_poles(self) -> NDArray[np.complex128]:
        """Poles of the ratio: the finite zeros of the heat's path to the two inputs. [1/s]"""
        n = len(self.a)
        rows = np.vstack([self.c[0] - self.c[2], self.c[1] - self.c[2]])
        pencil = np.block([[self.a, self.b], [rows, np.zeros((2, 2))]])
        mass = np.zeros_like(pencil)
        mass[:n, :n] = np.eye(n)
        alpha, beta = eig(pencil, mass, right=False, homogeneous_eigvals=True)
        finite = np.abs(beta) > 1e-9 * np.abs(alpha)
        return alpha[finite] / beta[finite]


class _Network:
    """Conductances and flows between named nodes, capacity in J/K, W/K; node `hall` is outside."""

    def __init__(self, **capacity: float) -> None:
        self.names = list(capacity)
        self.capacity = np.array(list(capacity.values()))
        self.a = np.zeros((len(capacity),) * 2)
        self.outside = np.zeros(len(capacity))

    def path(self, one: str, other: str, w_per_k: float) -> None:
        """Heat flows between two nodes by their difference."""
        self.flow(one, other, w_per_k)
        if other != "hall":
            self.flow(other, one, w_per_k)

    def flow(self, to: str, source: str, w_per_k: float) -> None:
        """A node takes the temperature of another: half of a path, or a coolant that arrives."""
        k = self.names.index(to)
        self.a[k, k] -= w_per_k / self.capacity[k]
        if source == "hall":
            self.outside[k] += w_per_k / self.capacity[k]
        else:
            self.a[k, self.names.index(source)] += w_per_k / self.capacity[k]

    def row(self, **weights: float) -> Array:
        """Mean, or sum of expansions, of nodes."""
        row = np.zeros(len(self.names))
        for name, weight in weights.items():
            row[self.names.index(name)] = weight
        return row

    def machine(self, heated: tuple[str, str], watts: tuple[float, float], *rows: Array) -> Machine:
        """Return the machine whose sources heat two nodes by so much at full speed."""
        b = np.zeros((len(self.names), 2))
        for source, (name, power) in enumerate(zip(heated, watts, strict=True)):
            k = self.names.index(name)
            b[k, source] = power / self.capacity[k]
        return Machine(self.a, b, self.outside, np.array(rows))


def _direct() -> Machine:
    net = _Network(spindle=6e3, head=6e4, table=1.2e4, base=1.4e5, column=2e5)
    net.path("spindle", "head", 12.0)
    net.path("head", "hall", 13.0)
    net.path("table", "base", 14.0)
    net.path("base", "hall", 21.0)
    net.path("column", "hall", 30.0)
    base = net.machine(
        ("spindle", "table"),
        (48.0, 57.0),
        net.row(spindle=1.0),
        net.row(table=1.0),
        net.row(column=1.0),
    )
    n, lags = len(base.a), 2 * len(TRUE_TAU_S)
    a, c = np.zeros((n + lags, n + lags)), np.zeros((4, n + lags))
    a[:n, :n], c[:3, :n] = base.a, base.c
    for k, (gains, row) in enumerate(zip(_GAINS, (base.c[0], base.c[1]), strict=True)):
        for j, (gain, tau_s) in enumerate(zip(gains, TRUE_TAU_S, strict=True)):
            state = n + k * len(TRUE_TAU_S) + j
            a[state, :n] = (row - base.c[2]) / tau_s
            a[state, state] = -1.0 / tau_s
            c[3, state] = gain
    zeros = np.zeros((lags, 2))
    return Machine(a, np.vstack([base.b, zeros]), np.append(base.hall, zeros[:, 0]), c)


def _coupled() -> Machine:
    net = _Network(spindle=5e3, head=4e4, shaft=8e3, table=1e4, base=9e4, bed=1.6e5, column=1.1e5)
    net.path("spindle", "head", 14.0)
    net.path("spindle", "shaft", 6.0)
    net.path("head", "column", 7.0)
    net.path("head", "hall", 6.0)
    net.path("table", "base", 16.0)
    net.path("base", "bed", 22.0)
    net.path("bed", "column", 12.0)
    net.path("bed", "head", 4.0)
    net.path("base", "hall", 6.0)
    net.path("bed", "hall", 14.0)
    net.path("column", "hall", 10.0)
    return net.machine(
        ("spindle", "table"),
        (110.0, 90.0),
        net.row(spindle=1.0),
        net.row(table=1.0),
        net.row(column=1.0),
        net.row(shaft=8.0, head=16.0, bed=-14.0, base=24.0, column=-34.0),
    )


def _remote() -> Machine:
    net = _Network(
        bearing=5e3, near=9e3, far=9e3, skin=9e3, head=5e4, plate=2.5e4, base=1.2e5, column=2e5
    )
    for one, other in (("bearing", "near"), ("near", "far"), ("far", "skin")):
        net.path(one, other, 16.0)
    net.path("skin", "head", 6.0)
    net.path("head", "hall", 12.0)
    net.path("plate", "base", 18.0)
    net.path("base", "hall", 20.0)
    net.path("column", "hall", 30.0)
    net.path("bearing", "head", 3.0)
    return net.machine(
        ("bearing", "plate"),
        (100.0, 140.0),
        net.row(bearing=0.12, skin=0.88),
        net.row(plate=1.0),
        net.row(column=1.0),
        net.row(near=-5.0, skin=8.0, head=15.0, plate=-6.0, base=26.0, column=-38.0),
    )


def _coolant() -> Machine:
    cells = {f"bed{k}": 1.5e4 for k in range(4)}
    net = _Network(spindle=6e3, jacket=5e3, head=4e4, table=1.2e4, base=9e4, column=1.2e5,
                   tank=6e4, **cells)  # fmt: skip
    flow = 14.0
    for to, source in (
        ("jacket", "tank"), ("bed0", "jacket"), ("bed1", "bed0"), ("bed2", "bed1"),
        ("bed3", "bed2"), ("tank", "bed3"),
    ):  # fmt: skip
        net.flow(to, source, flow)
    net.path("spindle", "jacket", 20.0)
    net.path("spindle", "head", 6.0)
    net.path("bed1", "base", 6.0)
    net.path("bed2", "column", 6.0)
    net.path("table", "base", 14.0)
    for node, w_per_k in {"head": 8.0, "base": 14.0, "column": 16.0, "tank": 9.0}.items():
        net.path(node, "hall", w_per_k)
    return net.machine(
        ("spindle", "table"),
        (150.0, 130.0),
        net.row(spindle=1.0),
        net.row(table=1.0),
        net.row(column=1.0),
        net.row(head=22.0, jacket=4.0, base=30.0, bed1=-4.0, column=-52.0),
    )


@cache
def machine(kind: str) -> Machine:
    """Return one of the machines."""
    makers = {"direct": _direct, "coupled": _coupled, "remote": _remote, "coolant": _coolant}
    return makers[kind]()


@dataclass(frozen=True, eq=False)
class Log:
    """What was logged, and what is true."""

    kind: str
    step_s: float
    temperatures_c: Array
    """Spindle, table, column, hall, (n, 4)."""
    z_um: Array
    clean_um: Array
    """Displacement by the two sources alone, without hall, drift, probe and noise."""

    @property
    def u_k(self) -> Array:
        """Spindle less column and table less column, (n, 2)."""
        return self.temperatures_c[:, :2] - self.temperatures_c[:, 2:3]

    @property
    def dc_gain(self) -> Array:
        """True DC gains. [um/K]"""
        return machine(self.kind).dc_gain

    def columns(self) -> dict[str, Array]:
        """The log by column name, as the readers of logs take it."""
        names = ("T_spindle_c", "T_table_c", "T_column_c", "T_hall_c")
        found = {name: self.temperatures_c[:, k] for k, name in enumerate(names)}
        time_s = self.step_s * np.arange(len(self.z_um), dtype=np.float64)
        return {"time_s": time_s, **found, "Z_um": self.z_um}


def _wander(count: int, step_s: float, std: float, tau_s: float, rng: np.random.Generator) -> Array:
    keep = np.exp(-step_s / tau_s)
    moves = rng.normal(0.0, std * np.sqrt(1.0 - keep**2), count)
    moves[0] = rng.normal(0.0, std)
    return lfilter([1.0], [1.0, -keep], moves)


def power(count: int, step_s: float, rng: np.random.Generator) -> Array:
    """Share of full power: speeds hold for 10 to 75 minutes, a third of them are stops."""
    power = np.zeros(count)
    begin = 0
    while begin < count:
        speed = 0.0 if rng.random() < 1.0 / 3.0 else rng.uniform(0.3, 1.0)
        length = int(rng.uniform(600.0, 4500.0) / step_s)
        power[begin : begin + length] = speed**1.6
        begin += length
    return power


def _states(which: Machine, w: Array, step_s: float) -> Array:
    """Return C x at every row for inputs (q1, q2, h) that hold from row to row, (n, rows of C)."""
    values, vectors = np.linalg.eig(which.a)
    b = np.linalg.solve(vectors, np.column_stack([which.b, which.hall]).astype(complex))
    keep = np.exp(values * step_s)
    driven = w @ (b * (np.expm1(values * step_s) / values)[:, None]).T
    seen = which.c @ vectors
    found = np.zeros((len(w), len(seen)))
    for mode in range(len(values)):
        if values[mode].imag < 0:
            continue
        state = lfilter([0.0, 1.0], [1.0, -keep[mode]], driven[:, mode])
        twice = 2.0 if values[mode].imag > 0 else 1.0
        found += twice * np.real(state[:, None] * seen[None, :, mode])
    return found


def log(
    kind: str,
    hours: float,
    seed: int,
    *,
    step_s: float = 1.0,
    probe_um_per_h: float = 0.0,
    hall_um_per_k: float = 0.6,
    heat: Array | None = None,
) -> Log:
    """Return a cold test; the hall moves by kelvins a day, the floor follows it by two hours.

    `heat` are shares of the full power of both sources, (n, 2), in place of random ones.
    """
    rng = np.random.default_rng([KINDS.index(kind), seed])
    count = round(hours * 3600.0 / step_s)
    time_s = step_s * np.arange(count)
    hall = rng.uniform(0.5, 1.5) * np.sin(2 * np.pi * (time_s / 86400.0 + rng.random()))
    hall += lfilter(
        [step_s / 900.0], [1.0, step_s / 900.0 - 1.0], _wander(count, step_s, 0.6, 2e4, rng)
    )
    hall -= hall[0]
    which = machine(kind)
    drawn = np.column_stack([power(count, step_s, rng) for _ in range(2)])
    heat = drawn if heat is None else heat
    none = np.zeros(count)
    by_heat = _states(which, np.column_stack([heat, none]), step_s)
    by_hall = _states(which, np.column_stack([none, none, hall]), step_s)
    share = step_s / 7200.0
    drift = _wander(count, step_s, DRIFT_UM, DRIFT_S, rng)
    drift += hall_um_per_k * lfilter([share], [1.0, share - 1.0], hall)
    drift += probe_um_per_h * time_s / 3600.0
    # What an ideal model of the two true inputs says: the hall moves them too.
    true = by_heat + by_hall
    temperatures = 20.0 + np.column_stack([true[:, :3], hall])
    temperatures += rng.normal(0.0, NOISE_K, temperatures.shape)
    clean = true[:, 3] if kind == "direct" else by_heat[:, 3]
    return Log(
        kind=kind,
        step_s=step_s,
        temperatures_c=STEP_K * np.round(temperatures / STEP_K),
        z_um=true[:, 3] + drift - drift[0] + rng.normal(0.0, NOISE_UM, count),
        clean_um=clean,
    )
