"""What a new user types, on a clean clone in a clean environment.

Proves that the two commands of the README do all the set-up, that a plain installation carries
every file it needs, and that the promised times are kept.
"""

import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path
from urllib import request

import pytest

from tests.in_time import LONGEST_S

pytestmark = pytest.mark.system


def clean_environment() -> dict[str, str]:
    """Return the environment without what the tests' own Python has put there.

    Nothing is compiled beforehand: nobody waits for it here.
    """
    left_out = ("VIRTUAL_ENV", "PYTHONPATH", "MAKEFLAGS", "MAKELEVEL", "MFLAGS", "COLUMNS")
    kept = {k: v for k, v in os.environ.items() if k not in left_out and "PYTEST" not in k}
    return kept | {"PIP_NO_COMPILE": "1"}


@pytest.fixture(scope="module")
def clone(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a fresh clone of what is committed."""
    folder = tmp_path_factory.mktemp("clone") / "thermaxis"
    subprocess.run(["git", "clone", "--quiet", str(root), str(folder)], check=True)
    return folder


@pytest.fixture(scope="module")
def done(clone: Path) -> subprocess.CompletedProcess[str]:
    """Return what came of the command of the README, which makes an environment of its own."""
    return subprocess.run(
        ["make", "demo"],
        cwd=clone,
        env=clean_environment(),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


def test_make_demo_on_a_clean_clone_writes_the_certificate(
    clone: Path, done: subprocess.CompletedProcess[str]
) -> None:
    assert done.returncode == 0, done.stderr
    assert "ISO 230-2:2014" in done.stdout
    assert "demo/certificate.pdf" in done.stdout
    assert (clone / "demo" / "certificate.pdf").read_bytes().startswith(b"%PDF-")
    results = json.loads((clone / "demo" / "results.json").read_text(encoding="utf-8"))
    named = {a["position"] for a in results["adjacent_difference"]["forward"]["anomalies"]}
    assert named == {3}
    tracked = subprocess.run(
        ["git", "status", "--porcelain"], cwd=clone, capture_output=True, text=True, check=True
    )
    assert tracked.stdout == ""


EXTRAS = "argon2", "asyncua", "cryptography", "prometheus_client", "sqlalchemy", "websockets"


@pytest.mark.usefixtures("done")
def test_a_plain_installation_carries_every_file(clone: Path, tmp_path: Path) -> None:
    """As on a machine without make: pip installs the folder, the command runs elsewhere.

    What it depends on is read where the demo has it, without what only extras bring.
    """
    venv.create(tmp_path / "env")
    python = tmp_path / "env" / ("Scripts" if os.name == "nt" else "bin") / "python"
    pip = [sys.executable, "-m", "pip", "--python", python]
    subprocess.run(
        [*pip, "install", "--quiet", "--no-deps", clone], env=clean_environment(), check=True
    )
    (there,) = (tmp_path / "env").rglob("site-packages")
    (others,) = (clone / ".venv").rglob("lib/*/site-packages")
    (there / "others.pth").write_text(f"{others}\n", encoding="utf-8")
    (there / "sitecustomize.py").write_text(
        f"import sys; sys.modules.update(dict.fromkeys({EXTRAS!r}))\n", encoding="utf-8"
    )
    code = "import thermaxis; print(thermaxis.__file__)"
    told = subprocess.run([python, "-I", "-c", code], capture_output=True, text=True, check=True)
    assert Path(told.stdout.strip()).is_relative_to(there)
    work = tmp_path / "work"
    work.mkdir()
    shutil.copy(clone / "examples" / "y_axis_50_cycles.rtl", work / "run.rtl")
    words = ["evaluate", "run.rtl", "--json", "-", "--report", "c.pdf", "--report", "c.html"]
    done = subprocess.run(
        [python, "-m", "thermaxis", *words],
        cwd=work,
        env=clean_environment(),
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert json.loads(done.stdout)["test"]["time_source"] == "interpolated"
    assert (work / "c.pdf").read_bytes().startswith(b"%PDF-")
    assert "<html" in (work / "c.html").read_text(encoding="utf-8")
    assert certificate_of_the_app(python, work).startswith(b"%PDF-")


def certificate_of_the_app(python: Path, work: Path) -> bytes:
    """Return the certificate of a run that is dropped on the page of a plain installation."""
    words = [python, "-m", "thermaxis", "app", "--port", "0", "--no-browser"]
    with subprocess.Popen(
        words, cwd=work, env=clean_environment(), stdout=subprocess.PIPE, encoding="utf-8"
    ) as app:
        assert app.stdout is not None
        address = app.stdout.readline().strip()
        origin = address.partition("/?")[0]
        opener = request.build_opener(request.HTTPCookieProcessor())
        opener.addheaders = [("Origin", origin), ("Content-Type", "application/octet-stream")]
        assert b"run-form" in opener.open(address).read()
        run = (work / "run.rtl").read_bytes()
        evaluated = opener.open(f"{origin}/positioning/upload?name=run.rtl", run).read()
        key = json.loads(evaluated)["id"]
        certificate: bytes = opener.open(f"{origin}/positioning/certificate/{key}").read()
        opener.open(f"{origin}/end", b"").close()
        assert app.wait(timeout=LONGEST_S) == 0
    return certificate


@pytest.mark.parametrize("script", ["start_up.py", "many_runs.py"])
def test_the_promised_times_are_kept(root: Path, script: str) -> None:
    for _ in range(3):  # a busy machine may spoil one measurement
        done = subprocess.run(
            [sys.executable, root / "benchmarks" / script],
            cwd=root,
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        if done.returncode == 0:
            return
    pytest.fail(done.stdout + done.stderr)
