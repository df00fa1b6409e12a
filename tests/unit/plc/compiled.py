"""The exported block as an object: its Structured Text, put into C and compiled, call by call."""

import ctypes
import tempfile
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tests.unit.plc.equal_parts import CBlock, CLibrary, c_block, c_library, columns, st_block
from thermaxis.plc import Block, PlcSettings

MOST_INSTANCES = 8


@lru_cache(maxsize=200)
def _library(
    name: str, text: CBlock
) -> tuple[CLibrary, tempfile.TemporaryDirectory[str], list[int]]:
    folder = tempfile.TemporaryDirectory(prefix="plc-")
    return CLibrary(c_library({name: text}, Path(folder.name), "-O0")), folder, [0]


class Compiled:
    """An instance of a block: inputs are set, outputs are read, by their names."""

    def __init__(
        self, block: Block, *, language: str = "st", texts: Mapping[str, str] | None = None
    ):
        name = f"st_{block.name}" if language == "st" else block.name
        text = st_block(block, texts or block.st(), name) if language == "st" else c_block(block)
        library, self._folder, used = _library(name, text)
        self._place, used[0] = used[0] % MOST_INSTANCES, used[0] + 1
        self._run: Callable[..., None] = library.function(name)
        self._inputs, self._outputs = columns(block)
        self._kinds = {
            v.name: v.kind.value for v in (*block.interface.inputs, *block.interface.outputs)
        }
        self._in = np.zeros(1 + len(self._inputs))
        self._out = np.zeros(len(self._outputs))
        self._values: dict[str, Any] = {}
        self.switch_on()

    def switch_on(self) -> None:
        """Begin as after power-on."""
        self._in[0] = 1.0

    def __setattr__(self, name: str, value: Any) -> None:
        inputs = self.__dict__.get("_inputs", ())
        if name in inputs:
            self._in[1 + inputs.index(name)] = value
        else:
            super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        values, inputs = self.__dict__.get("_values", {}), self.__dict__.get("_inputs", ())
        if name in inputs:
            return float(self._in[1 + inputs.index(name)])
        if name not in values:
            raise AttributeError(name)
        return values[name]

    def values(self) -> dict[str, Any]:
        """Return every output of the last call."""
        return dict(self._values)

    def call(self) -> None:
        """Do one call with the inputs as they stand."""
        self._run(self._in.ctypes.data_as(_DOUBLES), self._out.ctypes.data_as(_DOUBLES),
                  ctypes.c_long(1), ctypes.c_int(self._place))  # fmt: skip
        self._in[0] = 0.0
        kinds = {"number": float, "BOOL": bool, "INT": int}
        for name, value in zip(self._outputs, self._out.tolist(), strict=True):
            self._values[name] = kinds[self._kinds[name]](value)

    def tell(self, told: Mapping[str, Any]) -> None:
        """Set inputs by their names and do one call."""
        for name, value in told.items():
            setattr(self, name, value)
        self.call()

    def step(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """Do what one call of the block does."""
        self.tell(told)
        return self.values()


_DOUBLES = ctypes.POINTER(ctypes.c_double)


def compiled(settings: PlcSettings, **more: Any) -> Compiled:
    """Return an instance of the block of some settings."""
    return Compiled(Block(settings=settings), **more)
