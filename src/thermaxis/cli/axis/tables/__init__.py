"""Compensation tables of controls: made from a run, read back, checked."""
