"""The report for a bug runs where packages are missing, and tells nothing of a person."""

import getpass
import os
import platform
import re
import subprocess
import sys
import time
from importlib import metadata

from thermaxis import __version__
from thermaxis.cli import main


def test_it_states_versions_platform_extras_encodings_and_time_zone(capsys):
    assert main(["doctor"]) == 0
    told = capsys.readouterr().out
    assert len(told.splitlines()) < 30
    for shown in (
        f"thermaxis   {__version__}",
        platform.python_version(),
        f"numpy {metadata.version('numpy')}",
        f"asyncua {metadata.version('asyncua')}",
        f"UTC{time.strftime('%z')}",
        "utf-8",
    ):
        assert shown in told
    assert re.search(r"^fleet .*dask", told, re.MULTILINE)


def test_it_names_no_person_computer_or_folder(capsys):
    main(["doctor"])
    told = capsys.readouterr().out
    words = set(re.findall(r"[\w.-]+", told))
    assert not {getpass.getuser(), platform.node()} & words
    assert os.sep not in told.replace("yes/no", "")


def test_a_package_that_is_missing_is_said_and_ends_with_code_1():
    code = """
import sys
from importlib import metadata
real = metadata.version
def version(name):
    if name in ("numpy", "dask"):
        raise metadata.PackageNotFoundError(name)
    return real(name)
metadata.version = version
sys.modules.update(dict.fromkeys(("numpy", "polars", "pydantic")))
from thermaxis.cli import main
sys.exit(main(["doctor"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "numpy MISSING" in done.stdout
    assert re.search(r"^fleet +without dask$", done.stdout, re.MULTILINE)
