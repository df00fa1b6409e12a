"""What the status server costs: the share of a core and the memory of a program with nothing else.

    python benchmarks/status_server_cost.py [--seconds 20]

A child process shows a status of four outputs and two channels ten times a second; this program
looks on in the ways of `docs/how-to/status-server.md`, section 6, one after the other.
"""

import argparse
import asyncio
import multiprocessing
import os
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

from asyncua import Client, ua

from tests.unit.runtime.status_server_parts import Box, status, viewers
from thermaxis.runtime import StatusServer, SystemClock

CYCLE_S = 0.1
NODES = 120


async def serve(pipe: Connection) -> None:
    server = StatusServer(viewers(), Box(), SystemClock())
    await server.open()
    pipe.send(server.port)
    told = status("X_um", "Y_um", "Z_um", "C_um")
    while not pipe.poll():
        told = replace(told, number=told.number + 1, utc=SystemClock().utc())
        server.publish(told)
        await asyncio.sleep(CYCLE_S)
    await server.close()


def child(pipe: Connection) -> None:
    asyncio.run(serve(pipe))


def used_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Deaf:
    """A subscriber that only takes what it is told."""

    def datachange_notification(self, *_: object) -> None:
        """Take a value."""


async def look(port: int, pid: int, how: str, seconds: float) -> float:
    """Return the share of a core while a client looks on. [percent]"""
    async with Client(f"opc.tcp://127.0.0.1:{port}/thermaxis") as client:
        space = await client.get_namespace_index("urn:thermaxis:runtime")
        whole = client.get_node(ua.NodeId("Status/Everything", space))
        nodes = await nodes_of(client, space)
        if how == "subscribed":
            subscription = await client.create_subscription(100, Deaf())
            await subscription.subscribe_data_change(nodes)
        began_s, before_s = time.monotonic(), used_s(pid)
        while time.monotonic() - began_s < seconds:
            await asyncio.sleep(0.5)
            if how == "everything":
                await whole.read_value()
            elif how == "all nodes":
                await client.read_attributes(nodes)
                await asyncio.sleep(0.5)
        return 100.0 * (used_s(pid) - before_s) / (time.monotonic() - began_s)


async def nodes_of(client: Client, space: int) -> list[object]:
    found: list[object] = []
    waiting = [client.get_node(ua.NodeId("Thermaxis", space))]
    while waiting and len(found) < NODES:
        for one in await waiting.pop(0).get_children():
            if await one.read_node_class() is ua.NodeClass.Variable:
                found.append(one)
            else:
                waiting.append(one)
    return found[:NODES]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    seconds = parser.parse_args().seconds
    here, there = multiprocessing.Pipe()
    running = multiprocessing.get_context("spawn").Process(target=child, args=(there,))
    running.start()
    port, pid = here.recv(), running.pid or 0
    for how in ("nobody", "everything", "all nodes", "subscribed"):
        print(f"{how:<12} {asyncio.run(look(port, pid, how, seconds)):5.2f} % of a core")
    memory = Path(f"/proc/{pid}/status").read_text().partition("VmRSS:")[2].split()[0]
    print(f"memory       {int(memory) / 1024.0:5.0f} MB")
    here.send("end")
    running.join()


if __name__ == "__main__":
    main()
