"""Physics of the virtual vertical lathe: where heat arises, how it flows, how the machine bends.

A double-column vertical lathe with a turntable of three metres and a milling spindle in a ram, as
in the paper. Heat of bearings and gears grows with the speed; it flows through a network of
twelve masses to the hall, the foundation and the cooler of the coolant. The masses expand and
bend; nothing here knows a transfer function, and no temperature sensor sees what moves the tool.

Displacements are those of the tool point relative to the workpiece, positive away from it:

* the ram grows downwards, towards the workpiece; the columns lift it;
* the bed, warmed from above by the table's bearing, arches: the columns that stand on it lean back
  and lift the tool, and the table follows the arch as a cone whose rim sinks;
* the table and its bearing grow upwards, towards the tool.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Final, NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.virtual.lathe._network import ThermalNetwork

FloatArray: TypeAlias = NDArray[np.float64]

POSITIONS: Final = ("TCP", "D0", "D1500", "D3000")
"""Where the displacement is measured: tool centre point, and diameters of the table. [mm]"""
DIAMETERS_MM: Final = (0.0, 0.0, 1500.0, 3000.0)
"""Diameter of each position. [mm]"""
SPINDLE_LIMIT_RPM = 3500.0
"""Highest speed of the spindle. [rpm]"""
TABLE_LIMIT_RPM = 200.0
"""Highest speed of the table. [rpm]"""
LOW_GEAR_LIMIT_RPM = 900.0
"""Highest speed of the spindle in the first gear. [rpm]"""


class Node(IntEnum):
    """The masses of the network."""

    SPINDLE_BEARING = 0
    """Front bearing of the spindle."""
    SPINDLE = 1
    """Shaft of the spindle, with the tool."""
    NOSE = 2
    """Lower end of the headstock, around the front bearing."""
    HEADSTOCK = 3
    """The ram above it, with the gearbox."""
    CROSSRAIL = 4
    """Slide and crossrail."""
    COLUMNS = 5
    """Both columns."""
    TABLE_BEARING = 6
    """Ring bearing of the table."""
    TABLE = 7
    """Inner body of the table."""
    RIM = 8
    """Outer body of the table."""
    BED_TOP = 9
    """Upper side of the bed, which carries the bearing."""
    BED_FOOT = 10
    """The bed below, on the foundation."""
    COOLANT = 11
    """Coolant in tank and pipes."""


class Boundary(IntEnum):
    """What the network gives its heat to."""

    HALL = 0
    """Air of the hall."""
    FOUNDATION = 1
    """Ground under the bed."""
    COOLER = 2
    """Evaporator of the coolant's cooler."""


class LatheDuty(NamedTuple):
    """What the machine does at one time, as far as its heat knows."""

    spindle_rpm: float = 0.0
    """Speed of the spindle. [rpm]"""
    gear: int = 1
    """Gear of the spindle, 1 or 2. [1]"""
    table_rpm: float = 0.0
    """Speed of the table. [rpm]"""
    coolant: bool = True
    """Whether the coolant's pump runs."""
    cooler: bool = False
    """Whether the coolant's cooler runs."""


def _masses() -> Mapping[Node, float]:
    return MappingProxyType(
        {
            Node.SPINDLE_BEARING: 90.0,
            Node.SPINDLE: 110.0,
            Node.NOSE: 300.0,
            Node.HEADSTOCK: 1000.0,
            Node.CROSSRAIL: 4500.0,
            Node.COLUMNS: 9000.0,
            Node.TABLE_BEARING: 700.0,
            Node.TABLE: 2600.0,
            Node.RIM: 3800.0,
            Node.BED_TOP: 1800.0,
            Node.BED_FOOT: 11000.0,
        }
    )


def _joints() -> Mapping[tuple[Node, Node], float]:
    return MappingProxyType(
        {
            (Node.SPINDLE_BEARING, Node.SPINDLE): 45.0,
            (Node.SPINDLE_BEARING, Node.NOSE): 260.0,
            (Node.SPINDLE, Node.HEADSTOCK): 8.0,
            (Node.NOSE, Node.HEADSTOCK): 180.0,
            (Node.HEADSTOCK, Node.CROSSRAIL): 55.0,
            (Node.CROSSRAIL, Node.COLUMNS): 120.0,
            (Node.COLUMNS, Node.BED_FOOT): 90.0,
            (Node.TABLE_BEARING, Node.TABLE): 110.0,
            (Node.TABLE_BEARING, Node.BED_TOP): 600.0,
            (Node.TABLE, Node.RIM): 120.0,
            (Node.BED_TOP, Node.BED_FOOT): 300.0,
        }
    )


def _surfaces() -> Mapping[Node, float]:
    return MappingProxyType(
        {
            Node.SPINDLE: 1.5,
            Node.NOSE: 9.0,
            Node.HEADSTOCK: 32.0,
            Node.CROSSRAIL: 95.0,
            Node.COLUMNS: 260.0,
            Node.TABLE: 20.0,
            Node.RIM: 45.0,
            Node.BED_TOP: 30.0,
            Node.BED_FOOT: 110.0,
            Node.COOLANT: 25.0,
        }
    )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LathePhysics:
    """Numbers of the machine. Every default is an assumption of plausible size."""

    mass_kg: Mapping[Node, float] = field(default_factory=_masses)
    """Masses of iron and steel. [kg]"""
    iron_j_per_kg_k: float = 470.0
    """Specific heat of iron. [J/(kg K)]"""
    coolant_j_per_k: float = 2.5e6
    """Heat capacity of the coolant: 600 l. [J/K]"""
    joint_w_per_k: Mapping[tuple[Node, Node], float] = field(default_factory=_joints)
    """Conductances through joints and walls. [W/K]"""
    surface_w_per_k: Mapping[Node, float] = field(default_factory=_surfaces)
    """Conductances to the hall at rest: about 7 W/(m² K). [W/K]"""
    foundation_w_per_k: float = 90.0
    """Conductance from the bed to the foundation. [W/K]"""
    foundation_c: float = 20.0
    """Temperature of the foundation. [°C]"""
    rotating_factor: float = 1.6
    """At full speed rotating surfaces give off so many times more heat than at rest. [1]"""
    bearing_flow_w_per_k: float = 60.0
    """From the table's bearing to the flowing coolant. [W/K]"""
    bed_flow_w_per_k: float = 25.0
    """From the bed's top to the flowing coolant. [W/K]"""
    cooler_w_per_k: float = 220.0
    """From the coolant to the running cooler. [W/K]"""
    cooler_c: float = 8.0
    """Temperature of the cooler. [°C]"""
    cooler_on_c: float = 21.0
    """The cooler starts above. [°C]"""
    cooler_off_c: float = 20.0
    """The cooler stops below. [°C]"""
    pump_w: float = 150.0
    """Heat of the coolant's pump. [W]"""
    spindle_coulomb_w: float = 170.0
    """Heat of the front bearing at full speed that grows with the speed. [W]"""
    spindle_viscous_w: float = 560.0
    """Heat of the front bearing at full speed that grows with its power of 5/3. [W]"""
    gear_w: tuple[float, float] = (180.0, 90.0)
    """Heat of the gearbox at the highest speed of each gear. [W]"""
    table_coulomb_w: float = 700.0
    """Heat of the table's bearing at full speed that grows with the speed. [W]"""
    table_viscous_w: float = 1700.0
    """Heat of the table's bearing at full speed that grows with its power of 5/3. [W]"""
    windage_w: float = 120.0
    """Heat of the air at the table's rim at full speed; it grows with the cube. [W]"""
    expansion_um_per_m_k: float = 11.0
    """Expansion of iron. [µm/(m K)]"""
    ram_m: float = 1.4
    """Length of the ram below its clamp that has the headstock's temperature. [m]"""
    nose_m: float = 0.9
    """Length of the ram's lower end. [m]"""
    tool_m: float = 0.12
    """Length of spindle and tool beyond the front bearing. [m]"""
    table_m: float = 0.55
    """Height of the table. [m]"""
    bearing_m: float = 0.25
    """Height of the table's bearing. [m]"""
    bed_m: float = 1.0
    """Height of the bed over which its upper side is warmer than its foot. [m]"""
    reach_m: float = 2.2
    """From the table's centre to the columns. [m]"""
    cone_radius_m: float = 1.45
    """Radius of the ring on which the table lies: it leans as the arched bed does there. [m]"""

    @property
    def column_m(self) -> float:
        """Height of the clamp of the ram above the bed, which closes the loop. [m]"""
        return self.ram_m + self.nose_m + self.tool_m + self.table_m + self.bearing_m

    def network(self, duty: LatheDuty) -> ThermalNetwork:
        """Return the network while the machine does one thing."""
        n = len(Node)
        capacity = np.full(n, self.coolant_j_per_k)
        for node, mass in self.mass_kg.items():
            capacity[node] = mass * self.iron_j_per_kg_k
        between = np.zeros((n, n))
        joints = dict(self.joint_w_per_k)
        if duty.coolant:
            joints[Node.TABLE_BEARING, Node.COOLANT] = self.bearing_flow_w_per_k
            joints[Node.BED_TOP, Node.COOLANT] = self.bed_flow_w_per_k
        for (one, other), value in joints.items():
            between[one, other] = between[other, one] = value
        outside = np.zeros((n, len(Boundary)))
        for node, value in self.surface_w_per_k.items():
            outside[node, Boundary.HALL] = value
        spindle, table = _share(duty)
        for node, share in ((Node.SPINDLE, spindle), (Node.TABLE, table), (Node.RIM, table)):
            outside[node, Boundary.HALL] *= 1.0 + (self.rotating_factor - 1.0) * share**0.8
        outside[Node.BED_FOOT, Boundary.FOUNDATION] = self.foundation_w_per_k
        if duty.cooler:
            outside[Node.COOLANT, Boundary.COOLER] = self.cooler_w_per_k
        return ThermalNetwork(capacity, between, outside)

    def heat_w(self, duty: LatheDuty) -> FloatArray:
        """Return the heat that arises in every node.

        References
        ----------
        Palmgren's friction torque of a rolling bearing: a part that does not know the speed, and
        one that grows with its power of 2/3; heat is torque times speed.
        """
        spindle, table = _share(duty)
        heat = np.zeros(len(Node))
        heat[Node.SPINDLE_BEARING] = (
            self.spindle_coulomb_w * spindle + self.spindle_viscous_w * spindle ** (5.0 / 3.0)
        )
        highest = LOW_GEAR_LIMIT_RPM if duty.gear == 1 else SPINDLE_LIMIT_RPM
        heat[Node.HEADSTOCK] = self.gear_w[duty.gear - 1] * abs(duty.spindle_rpm) / highest
        heat[Node.TABLE_BEARING] = self.table_coulomb_w * table + self.table_viscous_w * table ** (
            5.0 / 3.0
        )
        heat[Node.RIM] = self.windage_w * table**3
        if duty.coolant:
            heat[Node.COOLANT] = self.pump_w
        return heat

    def shape(self) -> FloatArray:
        """Return by how much each node's kelvin moves the tool point, by position.

        Notes
        -----
        A bed of height h that is ΔT warmer above is curved by α ΔT / h. The columns at the
        distance y stand on the end of the arch and lean by its slope: the tool above the centre
        rises by α ΔT / h * y² / 2. The table lies on a ring of radius r and leans as the bed does
        there: at the radius ρ it sinks by α ΔT / h * r * ρ. Nothing moves at the tool centre
        point if all masses are warmed alike: the lengths of the loop from the workpiece through
        bed, columns and ram back to the tool sum to zero. The probes at the diameters hang on a
        frame that does not expand in the place of the tool, as in the paper.
        """
        alpha = self.expansion_um_per_m_k
        rows = np.zeros((len(POSITIONS), len(Node)))
        rows[:, Node.COLUMNS] += alpha * self.column_m
        rows[:, Node.HEADSTOCK] -= alpha * self.ram_m
        rows[:, Node.NOSE] -= alpha * self.nose_m
        rows[:, Node.TABLE] -= alpha * self.table_m
        rows[:, Node.TABLE_BEARING] -= alpha * self.bearing_m
        rows[0, Node.SPINDLE] -= alpha * self.tool_m
        for row, diameter_mm in zip(rows, DIAMETERS_MM, strict=True):
            arch = self.reach_m**2 / 2.0 + self.cone_radius_m * diameter_mm / 2000.0
            row[Node.BED_TOP] += alpha / self.bed_m * arch
            row[Node.BED_FOOT] -= alpha / self.bed_m * arch
        return rows


def _share(duty: LatheDuty) -> tuple[float, float]:
    """Return both speeds as shares of the highest."""
    return abs(duty.spindle_rpm) / SPINDLE_LIMIT_RPM, abs(duty.table_rpm) / TABLE_LIMIT_RPM


def time_constants_s(network: ThermalNetwork) -> tuple[float, ...]:
    """Return the time constants of a network, the longest first. [s]"""
    return tuple(math.inf if rate == 0.0 else 1.0 / rate for rate in network.rate_per_s.tolist())
