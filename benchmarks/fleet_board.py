"""The morning board of a large fleet: from a request to its page, in seconds.

python -m benchmarks.fleet_board             10,000 machines, 14 nights each
python -m benchmarks.fleet_board 1000 14
"""

import asyncio
import json
import random
import sqlite3
import sys
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx2 as httpx

from tests.unit.fleet import fleet_machines as machines
from thermaxis import __version__
from thermaxis.board import board_application, board_settings
from thermaxis.codes import Message, Place
from thermaxis.fleet import (
    Cause,
    Judgement,
    NightOutcome,
    NightResult,
    OutputNight,
    Registry,
    Sign,
    SignKind,
    judgement_as_json,
    night_as_json,
)

HERE = "http://127.0.0.1:8470"


def night_of(rng: random.Random, model_sha256: str, day) -> dict[str, object]:
    left = rng.lognormvariate(0.5, 0.3)
    output = OutputNight(
        rows=1440,
        fit_percent=80.0,
        uncompensated_um=20.0,
        rmse_um=left,
        mae_um=0.8 * left,
        mean_um=rng.gauss(0.0, 0.3),
        max_um=4.0 * left,
        touches=96,
        held_mae_um=left,
        offset_mae_um=0.6 * left,
        within_two_sigma=0.95,
    )
    return night_as_json(
        NightResult(
            machine="",
            day=day,
            model_sha256=model_sha256,
            outcome=NightOutcome.VERIFIED,
            minutes=1440,
            outputs={"Z_um": output},
            signs=tuple(Sign(kind, "Z_um", "spindle", 0.1, 0.1, 0.1, 0.1) for kind in SignKind),
        )
    )


def filled(path: Path, count: int, nights: int) -> None:
    """Write the rows of a fleet as the registry would, in one go."""
    rng = random.Random(1)  # noqa: S311 - no secret
    now = datetime.now(UTC).replace(tzinfo=None).isoformat(" ")
    machine = machines.machine_of("M")
    Registry.make(f"sqlite:///{path}", "lake").close()
    days = [(machines.LAST + timedelta(days=k)).isoformat() for k in range(nights)]
    some = [
        (days[k], json.dumps(night_of(rng, machine.model_sha256, None)))
        for k in range(nights)
        for _ in range(100)
    ]
    with sqlite3.connect(path) as connection:
        connection.executemany(
            "insert into machines (id, name, kind, channels, model_sha256, added_utc)"
            " values (?, ?, ?, '{}', ?, ?)",
            ((k, f"M{k:05}", f"kind {k % 7}", machine.model_sha256, now) for k in range(count)),
        )
        connection.executemany(
            "insert into models (machine_id, sha256, why, content, added_utc)"
            " values (?, ?, 'first', ?, ?)",
            ((k, machine.model_sha256, machine.model, now) for k in range(count)),
        )
        connection.executemany(
            "insert into nights (machine_id, day, model_sha256, version, outcome, result,"
            " added_utc) values (?, ?, ?, ?, 'verified', ?, ?)",
            (
                (k, day, machine.model_sha256, __version__, result, now)
                for night in range(nights)
                for k in range(count)
                for day, result in [some[100 * night + k % 100]]
            ),
        )
        connection.executemany(
            "insert into judged (machine_id, day, judgement) values (?, ?, ?)",
            ((k, days[-1], named_of(k)) for k in range(0, count, 100)),
        )


def named_of(number: int) -> str:
    """Return what is thought of a machine that is named."""
    evidence = (Message("fault-drift", {"departure_um": 3.5}, Place(channel="Z_um")),)
    judgement = Judgement(
        machine=f"M{number:05}",
        kind=f"kind {number % 7}",
        day=machines.LAST,
        named=True,
        causes=(Cause.DRIFT,),
        since=machines.LAST,
        output="Z_um",
        evidence=evidence,
    )
    return json.dumps(judgement_as_json(judgement))


async def asked(path: Path, pages: list[str]) -> None:
    settings = board_settings()
    with Registry(f"sqlite:///{path}") as registry:
        application = board_application(registry, settings, ["127.0.0.1:8470"])
        transport = httpx.ASGITransport(application)
        async with httpx.AsyncClient(transport=transport, base_url=HERE) as client:
            for page in pages:
                begin_s, cpu_s = time.perf_counter(), time.process_time()
                answer = await client.get(page)
                wall_s, cpu_s = time.perf_counter() - begin_s, time.process_time() - cpu_s
                size = len(answer.content) / 1000
                print(
                    f"{page}: {answer.status_code}, {wall_s:.2f} s, of them {cpu_s:.2f} s of"
                    f" processor, {size:.0f} kB"
                )


def main(count: int, nights: int) -> None:
    with tempfile.TemporaryDirectory(prefix="board_") as folder:
        path = Path(folder) / "registry.db"
        filled(path, count, nights)
        print(f"{count} machines, {nights} nights each: {path.stat().st_size / 1e6:.0f} MB")
        asyncio.run(asked(path, ["/", "/", "/?text=M0001", "/machine?name=M00007"]))


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*(given + [10_000, 14][len(given) :]))
