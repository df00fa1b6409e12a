"""What packs the program: metadata, container, release and citation name what is there."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from thermaxis import __version__
from thermaxis.cli import _EXTRAS, build_parser


@pytest.fixture(scope="module")
def project(root: Path) -> dict[str, Any]:
    return tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]


def test_extras_bring_what_a_command_says_that_they_bring(project: dict[str, Any]) -> None:
    extras = project["optional-dependencies"]
    brought = {
        extra: {re.split(r"[\[<>=]", line)[0].lower().replace("-", "_") for line in lines}
        for extra, lines in extras.items()
    }
    assert {"machine", "fleet"} <= set(extras)
    assert not {"screen", "runtime"} & set(extras)
    packages = {"argon2": "argon2_cffi", "distributed": "dask"}
    for package, extra in _EXTRAS.items():
        assert packages.get(package, package) in brought[extra], package
    assert "thermaxis[machine]" in extras["fleet"]


def test_every_dependency_has_a_lowest_version(project: dict[str, Any]) -> None:
    lines = [*project["dependencies"], *project["optional-dependencies"]["machine"]]
    assert [line for line in lines if ">=" not in line] == []


def test_the_container_file_installs_an_extra_that_is_and_runs_commands_that_are(
    root: Path, project: dict[str, Any]
) -> None:
    text = (root / "Containerfile").read_text("utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    instructions = [line.partition(" ")[::2] for line in lines]
    known = ["FROM", "COPY", "RUN", "USER", "WORKDIR", "VOLUME", "STOPSIGNAL", "ENTRYPOINT", "CMD"]
    assert [word for word, _ in instructions] == known
    told = dict(instructions)
    assert set(re.findall(r"\)\[(\w+)\]", told["RUN"])) <= set(project["optional-dependencies"])
    for copied in told["COPY"].split()[:-1]:
        assert copied.startswith("dist/thermaxis-") or (root / copied).is_file()
    assert told["ENTRYPOINT"] == '["thermaxis"]'
    assert told["USER"] == "thermaxis"
    default = yaml.safe_load(told["CMD"])
    assert build_parser([default[0]]).parse_args(default).command == "run"
    shown = re.search(r" thermaxis +#? *screen (\S+)$", text, re.MULTILINE)
    assert shown is not None
    assert build_parser(["screen"]).parse_args(["screen", shown[1]]).command == "screen"


def test_the_release_tries_every_python_and_system_and_runs_commands_that_are(root: Path) -> None:
    text = (root / ".github" / "workflows" / "release.yml").read_text("utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    assert jobs["publish"]["needs"] == ["try", "lowest"]
    assert jobs["try"]["needs"] == "packages"
    matrix = jobs["try"]["strategy"]["matrix"]
    assert matrix["python"] == ["3.11", "3.12", "3.13", "3.14"]
    assert {name.partition("-")[0] for name in matrix["os"]} == {"ubuntu", "windows", "macos"}
    makefile = (root / "Makefile").read_text("utf-8")
    for target in re.findall(r"run: make (\w+)", text):
        assert f"\n{target}: " in makefile
    for words in re.findall(r"run: thermaxis (.*)", text):
        name, *rest = words.split()
        assert build_parser([name]).parse_args([name, *rest]).command == name


def test_the_citation_names_the_version_and_no_person_who_wrote_it(root: Path) -> None:
    cited = yaml.safe_load((root / "CITATION.cff").read_text("utf-8"))
    assert cited["version"] == __version__
    assert cited["authors"] == [{"name": "The thermaxis developers"}]
    assert [paper["year"] for paper in cited["references"]] == [2017, 2021]
