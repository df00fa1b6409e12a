"""The programs of a fleet's cluster, as its page states them: options, variables, addresses."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from dask import config
from distributed.cli import dask_scheduler, dask_worker

from tests.system.fleet.cluster import SETTINGS, as_environment, make_certificate
from thermaxis.cli import build_parser
from thermaxis.runtime.history import check_url


@pytest.fixture(scope="module")
def services(root: Path) -> dict[str, Any]:
    page = (root / "docs" / "how-to" / "fleet-cluster.md").read_text("utf-8")
    (compose,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    return yaml.safe_load(compose.replace("${HEAD}", "10.0.0.5"))["services"]


def test_the_variables_are_those_with_which_programs_are_killed_and_dask_knows_each(
    services, tmp_path
):
    stated = services["worker"]["environment"]
    killed = as_environment({**SETTINGS, **make_certificate(tmp_path)})
    assert stated.keys() - {"OMP_NUM_THREADS"} == killed.keys()
    assert {name: stated[name] for name in as_environment(SETTINGS)} == as_environment(SETTINGS)
    assert all(services[one]["environment"].items() >= stated.items() for one in ("init", "night"))
    unknown = object()
    for name in killed:
        key = name.removeprefix("DASK_").replace("__", ".").replace("_", "-").lower()
        assert config.get(key, unknown) is not unknown, key


def test_every_command_is_one(services):
    for name in ("init", "night"):
        program, *words = services[name]["command"]
        arguments = build_parser(["fleet"]).parse_args(words)
        assert (program, arguments.action) == ("thermaxis", name)
        assert check_url(arguments.registry, key="REGISTRY") is None
    for name, made in (("scheduler", dask_scheduler), ("worker", dask_worker)):
        program, kind, *words = services[name]["command"]
        assert (program, kind) == ("dask", name)
        with made.main.make_context(name, words) as context:
            assert context.params["tls_ca_file"] is None  # the variables say it
    assert context.params["nthreads"] == 1
    assert context.params["scheduler"] == "tls://10.0.0.5:8786"
    assert services["night"]["command"][-1] == context.params["scheduler"]


def test_what_ends_is_started_again_and_no_more_is_reached_than_must_be(services):
    for name in ("database", "scheduler", "worker"):
        assert services[name]["restart"] == "always"
    assert services["database"]["command"] == ["-c", "listen_addresses=127.0.0.1"]
    assert all(
        mount.endswith(":ro")
        for name, one in services.items()
        if name != "database"
        for mount in one["volumes"]
    )
