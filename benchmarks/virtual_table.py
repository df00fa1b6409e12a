"""A virtual table, seen by a thermal camera from above while a motor at its left edge warms it.

The table is a thin plate: its temperature does not change through its thickness. It conducts in
plane, gives heat to the air in proportion to its excess temperature, and receives the heat of the
motor through a part of its left edge; the other edges are insulated:

    rho c d dT/dt = k d (d²T/dx² + d²T/dy²) - h (T - T_air) + heat per area

The plate is cut into the pixels of the image. With insulated edges, cosines are the eigenfunctions
of the cut plate, and each one warms up as a first-order term of its own; the field at any time is
their sum, without steps of time. The camera adds normal noise and records hundredths of a degree.

    python -m benchmarks.virtual_table examples     the two images of the examples, the same bytes
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.thermal import FloatArray, ThermalField

EXAMPLE_SEED = 8
"""Seed of the example images; the paper's figure of the table has this number. [1]"""
EXAMPLE_TIMES_S = (0.0, 25_200.0)
"""Times of the example images since the motor started: at once, and after seven hours. [s]"""
EXAMPLE_NAMES = ("field_before.csv", "field_after.csv")
"""Names of the example files."""


@final
@dataclass(frozen=True, slots=True)
class VirtualTable:
    """A plate with a heat source at its left edge."""

    rows: int = 60
    """Pixels over the width of the table. [1]"""
    columns: int = 80
    """Pixels over the length of the table. [1]"""
    pixel_mm: float = 4.0
    """Edge of a pixel. Default: a table of 320 mm x 240 mm. [mm]"""
    thickness_mm: float = 30.0
    """Thickness d of the plate. Default: a plate that stands for a ribbed table. [mm]"""
    conductivity_w_per_mk: float = 50.0
    """Heat conductivity k. Default: grey cast iron, from memory. [W/(m K)]"""
    heat_capacity_j_per_m3k: float = 3.6e6
    """Density times specific heat, rho c. Default: grey cast iron, from memory. [J/(m³ K)]"""
    heat_transfer_w_per_m2k: float = 10.0
    """Heat transfer h from the upper face to still air, with radiation, from memory. [W/(m² K)]"""
    air_c: float = 24.0
    """Temperature of the air, and of the table at the start. Default: the paper's hall. [°C]"""
    power_w: float = 5.0
    """Heat that the motor gives to the table. Default: some kelvin after seven hours. [W]"""
    source_from: float = 0.3
    """Where the source begins on the left edge, as a share of its length from the top. [1]"""
    source_to: float = 0.7
    """Where it ends. [1]"""
    noise_k: float = 0.05
    """Standard deviation of a pixel. Default: the resolution of the paper's camera. [K]"""

    def _source_rows(self) -> FloatArray:
        """Return 1 for every row in which the source touches the edge, else 0, (rows,)."""
        centre = (np.arange(self.rows) + 0.5) / self.rows
        inside = (centre >= self.source_from) & (centre < self.source_to)
        return np.asarray(inside, dtype=np.float64)

    def heating_k_per_s(self) -> FloatArray:
        """Return how fast the source alone warms each pixel, (rows, columns). [K/s]"""
        rows = self._source_rows()
        heat = np.zeros((self.rows, self.columns))
        volume_m3 = (1e-3 * self.pixel_mm) ** 2 * 1e-3 * self.thickness_mm
        heat[:, 0] = rows / np.sum(rows) * self.power_w / (self.heat_capacity_j_per_m3k * volume_m3)
        return heat


def _cosines(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvectors of a row of cells with insulated ends, and their eigenvalues."""
    mode = np.arange(count)[:, None]
    vectors = np.sqrt(2.0 / count) * np.cos(np.pi * mode * (np.arange(count) + 0.5) / count)
    vectors[0] /= np.sqrt(2.0)
    return vectors, np.asarray(2.0 - 2.0 * np.cos(np.pi * mode[:, 0] / count))


def true_temperature_c(table: VirtualTable, time_s: float) -> FloatArray:
    """Return the temperature of a table some time after its motor started.

    Parameters
    ----------
    time_s : float
        Time since then. [s]

    Returns
    -------
    FloatArray
        (rows, columns), without noise. [°C]

    References
    ----------
    Heat conduction in a thin plate with Newton cooling; separation of variables on the cut plate.
    """
    over_rows, values_rows = _cosines(table.rows)
    over_columns, values_columns = _cosines(table.columns)
    diffusion = table.conductivity_w_per_mk / table.heat_capacity_j_per_m3k
    diffusion /= (1e-3 * table.pixel_mm) ** 2
    loss = table.heat_transfer_w_per_m2k
    loss /= table.heat_capacity_j_per_m3k * 1e-3 * table.thickness_mm
    rate = loss + diffusion * (values_rows[:, None] + values_columns)
    source = over_rows @ table.heating_k_per_s() @ over_columns.T
    excess = source / rate * -np.expm1(-rate * time_s)
    return np.asarray(table.air_c + over_rows.T @ excess @ over_columns)


def generate_thermal_field(table: VirtualTable, time_s: float, *, seed: int) -> ThermalField:
    """Take an image of a virtual table.

    Parameters
    ----------
    time_s : float
        Time since its motor started, from 0. [s]
    seed : int
        Seed of the camera's noise, from 0. [1]

    Returns
    -------
    ThermalField
        The image, rounded to hundredths as a camera's software writes them.
    """
    noise = np.random.default_rng(seed).normal(0.0, table.noise_k, (table.rows, table.columns))
    return ThermalField(
        np.round(true_temperature_c(table, time_s) + noise, 2),
        name=f"virtual table after {time_s / 3600.0:g} h",
    )


def format_field_csv(temperature_c: FloatArray, comments: Sequence[str] = ()) -> str:
    """Return a thermal field as CSV text, hundredths of a degree; a missing pixel is empty."""
    lines = [f"# {' '.join(comment.split())}" for comment in comments]
    lines += [
        ",".join("" if math.isnan(v) else f"{v + 0.0:.2f}" for v in row)
        for row in np.round(temperature_c, 2).tolist()
    ]
    return "\n".join(lines) + "\n"


def write_example_fields(folder: Path) -> tuple[Path, ...]:
    """Write the two images of the examples.

    Parameters
    ----------
    folder : Path
        Where they go, as ``field_before.csv`` and ``field_after.csv``.

    Returns
    -------
    tuple of Path
        The files; the same bytes every time.
    """
    table = VirtualTable()
    written: list[Path] = []
    for number, (name, time_s) in enumerate(zip(EXAMPLE_NAMES, EXAMPLE_TIMES_S, strict=True)):
        seed = EXAMPLE_SEED + number
        field = generate_thermal_field(table, time_s, seed=seed)
        comments = (
            "Generated thermal field of a virtual table: no machine was photographed",
            f"time since the motor started: {time_s / 3600.0:g} h",
            f"seed: {seed}",
            f"scale: {table.pixel_mm:g} mm per pixel",
            "unit: degrees Celsius; upper row first",
        )
        text = format_field_csv(field.temperature_c, comments=comments)
        path = folder / name
        path.write_bytes(text.encode())
        written.append(path)
    return tuple(written)


if __name__ == "__main__":
    write_example_fields(Path(sys.argv[1]))
