"""Make machine tools accurate while they warm up."""

__version__ = "0.1.0"
