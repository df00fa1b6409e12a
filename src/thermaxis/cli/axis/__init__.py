"""Commands that measure an axis."""
