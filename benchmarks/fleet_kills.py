"""A fleet's nights while its programs are killed at random: none lost, none doubled, all the same.

python benchmarks/fleet_kills.py             30 kills
python benchmarks/fleet_kills.py 8 3         8 kills, of seed 3
"""

import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.system.fleet.cluster import VICTIMS, Cluster, found_in, make_fleet, undisturbed
from tests.system.postgres import PASSWORD, new_server

MACHINES_A_KILL = 5


def main(kills: int, seed: int) -> int:
    folder, machines = Path(tempfile.mkdtemp(prefix="fleet_kills")), MACHINES_A_KILL * (kills + 2)
    victims = random.Random(seed).choices(VICTIMS, k=kills)  # noqa: S311 - no secret
    begin_s = time.monotonic()
    with new_server() as server:
        cluster = Cluster(folder, server)
        make_fleet(folder, server.url, PASSWORD, machines)
        try:
            done = cluster.do_nights(victims, seed)
            found = found_in(server.url, PASSWORD)
        finally:
            cluster.end()
    took_s = time.monotonic() - begin_s
    alone = undisturbed(folder, machines)
    nights = [one for one in found if one and isinstance(one[0], str)]
    print(f"{done} kills in {took_s:.0f} s: {dict(Counter(victims[:done]))}")
    print(f"coordinators that nobody killed ended with {dict(Counter(cluster.codes))}")
    print(f"{len(nights)} nights of {machines} machines; as undisturbed: {found == alone}")
    for one, other in zip(found, alone, strict=False):
        if one != other:
            print(one, "is not", other)
    return int(found != alone)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*(given + [30, 1][len(given) :])))
