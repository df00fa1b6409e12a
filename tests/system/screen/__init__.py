"""Tests of the screen in a real browser, beside a running loop."""
