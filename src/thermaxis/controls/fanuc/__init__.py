"""Fanuc: NC program of a plan, and the stored pitch error compensation."""

from thermaxis.controls.fanuc._fanuc import CONTROL as CONTROL
