"""How many own lines a loop has loaded after two cycles: what has to be read of what acts.

Beside it stands what the process of status server, metrics and history has loaded, a copy of the
loop's. Code lines as `weight.py` counts them, neither blank, comment nor docstring. The machine is
not there, the servers' ports are free ones, and the screen, a process of its own, is left out.

    python benchmarks/loaded.py [examples/machine/lathe.toml]
"""

import re
import shutil
import socket
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.weight import python_lines  # noqa: E402 - found by the line above

RUNS = """
import sys
from pathlib import Path
from thermaxis.cli import main
from thermaxis.runtime import publish

def tell(name):
    own = (m.__file__ for name, m in sys.modules.items() if name.startswith("thermaxis"))
    Path(sys.argv[2], name).write_text("\\n".join(own))

def serve(*arguments):
    from thermaxis.runtime.publish._servers import serve
    serve(*arguments)
    tell("beside")

publish.serve = serve
code = main(["run", sys.argv[1], "--cycles", "2", "--quiet"])
tell("acting")
sys.exit(code)
"""


def loaded(configuration: Path) -> tuple[Counter[str], Counter[str]]:
    """Return the code lines of every own module that a run loads, by its place in `src`.

    First those of the process that acts, then those of the one beside it.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(configuration.parent, f"{folder}/machine"))
        file = copy / configuration.name
        with socket.create_server(("127.0.0.1", 0)) as listener:  # no machine answers there
            port = listener.getsockname()[1]
        text = file.read_text("utf-8").partition("[screen]")[0].replace(":4840", f":{port}")
        file.write_text(re.sub(r"(?m)^port = \d+", "port = 0", text), "utf-8")
        subprocess.run([sys.executable, "-c", RUNS, str(file), folder], check=True)
        said = [Path(folder, name).read_text("utf-8") for name in ("acting", "beside")]
    return _lines(said[0].splitlines()), _lines(said[1].splitlines())


def _lines(files: list[str]) -> Counter[str]:
    places = {file.rpartition("/src/thermaxis/")[2]: Path(file) for file in files}
    return Counter({p: python_lines(path.read_text("utf-8"))["code"] for p, path in places.items()})


def main() -> int:
    every = loaded(Path(sys.argv[1] if sys.argv[1:] else ROOT / "examples/machine/lathe.toml"))
    packages = Counter[str](), Counter[str]()
    for lines, found in zip(packages, every, strict=True):
        for place, count in found.items():
            package = "/".join(place.split("/")[:2]) if place.count("/") else place
            lines[package] += count
    print("acting beside")
    for package in sorted(packages[1], key=lambda name: (-packages[0][name], -packages[1][name])):
        print(f"{packages[0][package]:6,} {packages[1][package]:6,} {package}")
    acting, beside = every
    print(f"{acting.total():6,} {beside.total():6,} code lines")
    print(f"{len(acting):6,} {len(beside):6,} modules")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
