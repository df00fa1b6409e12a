"""Commands that identify and verify thermal models."""
