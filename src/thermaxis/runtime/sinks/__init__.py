"""Where corrections go."""
