"""Run a compensation on a machine: sources, sinks, the loop, the historian."""
