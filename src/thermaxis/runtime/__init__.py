"""Run a compensation on a machine: the loop, its ports, its configuration, its servers.

Sources, sinks and historians are packages of their own below this one. Every name is imported
when it is first asked for: the loop needs no certificate, and a command no OPC UA.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
