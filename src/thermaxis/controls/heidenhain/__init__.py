"""HEIDENHAIN: what its controls share, and a file for each."""
