"""How many own lines a loop has loaded after two cycles: what has to be read of what acts.

Code lines as `weight.py` counts them, neither blank, comment nor docstring. The machine is
not there, the servers' ports are free ones, and the screen, a process of its own, is left out.

    python benchmarks/loaded.py [examples/machine/lathe.toml]
"""

import re
import shutil
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
from thermaxis.cli import main
code = main(["run", sys.argv[1], "--cycles", "2", "--quiet"])
print(*(m.__file__ for name, m in sys.modules.items() if name.startswith("thermaxis")))
sys.exit(code)
"""


def loaded(configuration: Path) -> Counter[str]:
    """Return the code lines of every own module that a run loads, by its place in `src`."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(configuration.parent, f"{folder}/machine"))
        file = copy / configuration.name
        text = file.read_text("utf-8").partition("[screen]")[0].replace(":4840", ":1")
        file.write_text(re.sub(r"(?m)^port = \d+", "port = 0", text), "utf-8")
        said = subprocess.run(
            [sys.executable, "-c", RUNS, str(file)], check=True, stdout=subprocess.PIPE, text=True
        ).stdout.split()
    paths = [Path(name) for name in said]
    places = {path.as_posix().rpartition("/src/thermaxis/")[2]: path for path in paths}
    return Counter({p: python_lines(path.read_text("utf-8"))["code"] for p, path in places.items()})


def main() -> int:
    found = loaded(Path(sys.argv[1] if sys.argv[1:] else ROOT / "examples/machine/lathe.toml"))
    packages = Counter[str]()
    for place, lines in found.items():
        packages["/".join(place.split("/")[:2]) if place.count("/") else place] += lines
    for package, lines in packages.most_common():
        print(f"{lines:6,} {package}")
    print(f"{found.total():6,} code lines in {len(found)} modules")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
