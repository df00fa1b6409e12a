"""The room of thermal logs: what is in them, a model of them, its verification."""

from thermaxis.app.thermal._room import ThermalRoom as ThermalRoom
