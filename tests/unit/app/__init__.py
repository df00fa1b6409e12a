"""Tests of the app, part by part."""
