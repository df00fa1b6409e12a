"""The block as a co-simulation unit of the Functional Mock-up Interface, with its C inside."""

from hashlib import sha256
from io import BytesIO
from typing import Final, Literal
from zipfile import ZipFile, ZipInfo

from thermaxis import __version__
from thermaxis.plc._block import Block
from thermaxis.plc._library import folded
from thermaxis.plc._template import rendered

FMI_VERSIONS: Final = (3, 2)
"""Versions of the interface that units are made for. [1]"""
_UNITS = {
    "s": 's="1"',
    "mm": 'm="1" factor="0.001"',
    "um": 'm="1" factor="1e-6"',
    "degC": 'K="1" offset="273.15"',
    "1": "",
    "mm/mm": "",
}


def fmu_files(block: Block) -> dict[str, bytes]:
    """Return a block as co-simulation units of FMI 3.0 and 2.0, by file.

    A unit has the C sources of library and block, and no binary: who imports it compiles them,
    with the headers of FMI and ``-ffp-contract=off``. A step of so many cycles calls the block so
    often with the same inputs; another step is refused. Inputs and outputs are those of the block;
    `cycle_time_s` begins with the cycle. The same block gives the same bytes.

    Not protected: where `cycle_time_s` is not wired to a measured time, nobody sees a step that
    comes late. A simulation is none of the machine's safety.

    Returns
    -------
    dict of str to bytes
        The units, each a zip file.

    References
    ----------
    Functional Mock-up Interface 3.0.2, sections 2.2 (functions, prefix), 2.4 (model description),
    2.5 (zip file, build description); 2.0.5, chapter 4.
    """
    return {f"{block.name}.fmi{fmi}.fmu": _unit(block, fmi) for fmi in FMI_VERSIONS}


def _unit(block: Block, fmi: Literal[2, 3]) -> bytes:
    texts, face = block.c(), block.interface
    number = "Real" if fmi == 2 else "Float64" if block.settings.double else "Float32"
    variables = (*face.inputs, *face.outputs, *face.identity)
    about = {
        "fmi": fmi,
        "name": block.name,
        "version": block.settings.model_sha256 or "not stated",
        "tool": f"thermaxis {__version__}",
        "token": sha256("".join(texts.values()).encode("ascii")).hexdigest(),
        "cycle_s": repr(block.settings.cycle_s),
        "model_only": block.model_only,
        "touched": "thermaxis_touch.c" in texts,
        "face": face,
        "variables": variables,
        "kinds": {"number": number, "BOOL": "Boolean", "INT": "Integer" if fmi == 2 else "Int16"},
        "units": sorted({"s"} | {v.unit for v in variables if v.unit}),
        "base": _UNITS,
        "sources": [name for name in (*texts, "fmu.c") if name.endswith(".c")],
    }
    members = {f"sources/{name}": text for name, text in texts.items()}
    of = {"modelDescription.xml": "fmu.xml.j2", "sources/fmu.c": "fmu.c.j2"}
    if fmi == 3:
        of["sources/buildDescription.xml"] = "fmu_build.xml.j2"
    members |= {name: folded(rendered(template, about)) for name, template in of.items()}
    unit = BytesIO()
    with ZipFile(unit, "w") as packed:
        for name, text in sorted(members.items()):
            # A member of its own date and without compression: the same bytes everywhere.
            packed.writestr(ZipInfo(name), text)
    return unit.getvalue()
