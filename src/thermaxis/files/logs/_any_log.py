"""Tell the format of a thermal log from what is in it."""

from functools import partial
from pathlib import Path

from thermaxis.files.logs.csv_log import read_thermal_csv
from thermaxis.files.logs.mat_log import read_thermal_mat
from thermaxis.files.logs.parquet_log import read_thermal_parquet
from thermaxis.files.logs.tdms_log import read_thermal_tdms
from thermaxis.files.logs.xlsx_log import read_thermal_xlsx
from thermaxis.files.settings import ThermalMapping, read_thermal_mapping
from thermaxis.files.table import FALLBACK_ENCODING, read_start
from thermaxis.thermal import ThermalLog

_LARGEST_BYTES = 20_000_000_000  # of Parquet; each other format has a lower limit
_MATLAB = b"MATLAB"
_HDF5 = b"\x89HDF\r\n\x1a\n"
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"


def read_thermal_log(
    path: Path | str,
    *,
    mapping: ThermalMapping | Path | str | None = None,
    sample_time_s: float | None = None,
    fallback_encoding: str = FALLBACK_ENCODING,
) -> ThermalLog:
    """Read a thermal log from a file of any format that is known here.

    The format is told from the content: CSV, Parquet, a workbook, a file of MATLAB or of LabVIEW;
    an old file of MATLAB (version 4), which has no mark, from its name.

    Parameters
    ----------
    mapping : ThermalMapping, Path or str, optional
        What the columns are, or the file that says so.
    sample_time_s : float, optional
        Length of the blocks over which means are taken while reading. Default: rows as they
        are. [s]
    fallback_encoding : str
        Encoding of a CSV file that is not UTF-8. Default: cp1250.

    Returns
    -------
    ThermalLog
        Rows in order of time; the remarks say what was done to get there.

    Raises
    ------
    MeasurementFileError
        If the file cannot be read, is of no known format, or does not hold what its format
        promises.
    ConfigurationError
        If the mapping file is wrong, or there is no such fallback encoding.
    DataError
        If the sample time cannot be used, or the times make no order.
    """
    if isinstance(mapping, Path | str):
        mapping = read_thermal_mapping(mapping)
    start, _ = read_start(path, 520, limit_bytes=_LARGEST_BYTES)
    if start.startswith(b"PAR1"):
        read = read_thermal_parquet
    elif start.startswith(b"TDSm"):
        read = read_thermal_tdms
    elif start.startswith((b"PK\x03\x04", b"PK\x05\x06", _OLD_WORKBOOK)):
        read = read_thermal_xlsx
    elif _is_matlab(path, start):
        read = read_thermal_mat
    else:
        read = partial(read_thermal_csv, fallback_encoding=fallback_encoding)
    return read(path, mapping=mapping, sample_time_s=sample_time_s)


def _is_matlab(path: Path | str, start: bytes) -> bool:
    marked = start.startswith((_MATLAB, _HDF5)) or start[512:520] == _HDF5
    return marked or (Path(path).suffix.casefold() == ".mat" and b"\x00" in start)
