"""A fleet on programs of their own."""
