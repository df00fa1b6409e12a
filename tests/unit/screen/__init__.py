"""Tests of the screen, part by part."""
