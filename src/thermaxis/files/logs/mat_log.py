"""Thermal logs in files of MATLAB, ``.mat``: vectors, matrices and structures of them."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from thermaxis.codes import Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.logs._columns import (
    LogTable,
    build_log,
    parse_log_heading,
    plan_columns,
)
from thermaxis.files.logs._mat5 import mat5_arrays
from thermaxis.files.settings import ThermalMapping
from thermaxis.files.table import damage_named, first_few, read_start
from thermaxis.positioning import FloatArray
from thermaxis.thermal import ThermalLog
from thermaxis.thermal.log import unit_of_name

FILE_LIMIT_BYTES = 500_000_000
"""Largest file. [byte]"""
MOST_VALUES = 200_000_000
"""Largest number of values of all variables. [1]"""
_MOST_DEPTH = 4
_MOST_COLUMNS = 4096


def read_thermal_mat(
    path: Path | str, *, mapping: ThermalMapping | None = None, sample_time_s: float | None = None
) -> ThermalLog:
    """Read a thermal log from a file of MATLAB.

    Variables and fields of structures are columns by their names; a matrix of k columns becomes
    k channels, numbered before the unit: `T_C` becomes `T_1_C`, `T_2_C`. What is not as long as
    the times is left out with a remark. Tables and timetables are stored in a form that only
    MATLAB reads: save their columns as vectors.
    """
    name = str(path)
    begins, _ = read_start(path, 520, limit_bytes=FILE_LIMIT_BYTES)
    is_hdf5 = b"\x89HDF\r\n\x1a\n" in (begins[:8], begins[512:520])
    with damage_named(Place(name)):
        if is_hdf5:
            variables = _read_hdf5(path)
        elif begins[126:128] in (b"IM", b"MI") and 0 not in begins[:4]:
            variables = _read_level_5(Path(path).read_bytes())
        elif 0 in begins[:4] and len(begins) > 20:
            variables = _read_level_4(path)
        else:
            raise ValueError("no mark of MATLAB")
    vectors = dict(_vectors(variables))
    if not vectors:
        raise MeasurementFileError("no_vector", file=name)
    rows = _rows_of(vectors, mapping)
    kept = {key: values for key, values in vectors.items() if values.size == rows}
    others = [key for key, values in vectors.items() if values.size != rows]
    headings = tuple(kept)
    plan = plan_columns(Place(name), headings, mapping)
    table = LogTable(
        place=Place(name),
        headings=headings,
        rows=rows,
        read=lambda index: kept[headings[index]],
        remarks=(remark("variables_left_out", names=first_few(others)),) if others else (),
    )
    return build_log(table, plan, name=Path(name).stem, sample_time_s=sample_time_s)


def _rows_of(vectors: Mapping[str, FloatArray], mapping: ThermalMapping | None) -> int:
    """Return the length of the times, or else of the longest vector."""
    stated = None if mapping is None else mapping.time_column
    if stated is not None and stated in vectors:
        return vectors[stated].size
    ranked = [
        (heading.time_rank, place, values.size)
        for place, (key, values) in enumerate(vectors.items())
        if (heading := parse_log_heading(key)).time_rank is not None and values.size > 1
    ]
    return min(ranked)[2] if ranked else max(values.size for values in vectors.values())


def _vectors(variables: Mapping[str, FloatArray]) -> Iterator[tuple[str, FloatArray]]:
    """Yield every vector, and the columns of every matrix."""
    for key, values in variables.items():
        if values.ndim > 2 or values.size == 0:
            continue
        if values.ndim < 2 or min(values.shape) == 1:
            yield key, values.reshape(-1)
            continue
        across = values.T if values.shape[0] < values.shape[1] else values
        if across.shape[1] > _MOST_COLUMNS:
            continue
        unit = f"_{key.rpartition('_')[2]}" if unit_of_name(key) else ""
        stem = key.removesuffix(unit) if unit else key
        for column in range(across.shape[1]):
            yield f"{stem}_{column + 1}{unit}", np.ascontiguousarray(across[:, column])


def _read_level_5(content: bytes) -> dict[str, FloatArray]:
    found: dict[str, FloatArray] = {}
    for name, values in mat5_arrays(content):
        key, number = name, 2
        while key in found:
            key, number = f"{name}_{number}", number + 1
        found[key] = values
    return found


def _read_level_4(path: Path | str) -> dict[str, FloatArray]:
    from scipy import io  # noqa: PLC0415  takes a tenth of a second

    read = cast("Callable[..., dict[str, object]]", io.loadmat)
    try:
        variables = read(str(path), appendmat=False)
    except io.matlab.MatReadError as error:
        raise ValueError(str(error)) from error
    found: dict[str, FloatArray] = {}
    for key, value in variables.items():
        if isinstance(value, np.ndarray):
            array = cast("np.ndarray[Any, np.dtype[Any]]", value)
            if array.dtype.kind in "bifu":
                found[key] = array.astype(np.float64)
    return found


def _read_hdf5(path: Path | str) -> dict[str, FloatArray]:
    try:
        import h5py  # noqa: PLC0415 - an extra
    except ImportError:
        raise MeasurementFileError("package_missing", package="h5py", file=path) from None
    found: dict[str, FloatArray] = {}
    with cast("Any", h5py).File(str(path), "r") as file:
        _collect_hdf5("", file, found, path=str(path), depth=0)
    return found


def _collect_hdf5(
    name: str, node: Any, found: dict[str, FloatArray], *, path: str, depth: int
) -> None:
    """Add the arrays of a group; MATLAB's axes are in reverse order in such a file."""
    if depth > _MOST_DEPTH or name.startswith("#"):
        return
    if hasattr(node, "keys"):
        for key in list(node.keys())[:_MOST_COLUMNS]:
            inner = str(key)
            _collect_hdf5(
                inner if inner not in found else f"{name}_{inner}",
                node[key],
                found,
                path=path,
                depth=depth + 1,
            )
        return
    if getattr(node, "dtype", None) is None or node.dtype.kind not in "bifu" or node.ndim > 2:
        return
    total = float(np.prod(np.array(node.shape, dtype=np.float64)))
    if total + sum(values.size for values in found.values()) > MOST_VALUES:
        raise MeasurementFileError("log_too_large", most=MOST_VALUES, file=path)
    if node.attrs.get("MATLAB_class", b"double") != b"char":
        found[name] = np.asarray(node[()], dtype=np.float64).T
