"""The room of measured runs: figures, certificate, trend, table, plan."""

from thermaxis.app.axis._room import AxisRoom as AxisRoom
