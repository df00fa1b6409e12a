"""Work in a process of its own: whatever a command does, the screen goes on and nothing stays."""

import asyncio
import os
import signal
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from thermaxis.web.work import BusyError, Ending, Limits, Outcome
from thermaxis.web.work._work import MOST_WAITING, Work, remove_leftovers

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the limits are those of Linux")

PYTHON = (sys.executable, "-I", "-S")
QUICK = Limits(longest_s=50.0)
"""Real time is the subject here: commands are processes. A bound in seconds is one that only a
command without an end can reach, however loaded the computer is."""
NEVER_S = 600.0
"""Longer than any test may take: a command that is not ended fails by the limit of the test."""


def a_program(tmp_path: Path, text: str) -> tuple[str, ...]:
    path = tmp_path / "command.py"
    path.write_text(textwrap.dedent(text))
    return (*PYTHON, str(path))


def run(
    tmp_path: Path, text: str, *words: str, limits: Limits = QUICK, **more: object
) -> tuple[Outcome, dict[str, bytes]]:
    """Run a program of the test; return what came, and the files before they are removed."""

    async def all_of_it() -> tuple[Outcome, dict[str, bytes]]:
        work = Work(a_program(tmp_path, text), where=tmp_path)
        outcome = await work.run_command(words, limits=limits, **more)
        contents = {name: path.read_bytes() for name, path in outcome.files.items()}
        outcome.folder.remove()
        work.close()
        return outcome, contents

    found = asyncio.run(all_of_it())
    assert not list(tmp_path.glob("thermaxis-work-*"))
    return found


def gone(pid: int) -> bool:
    """Say whether a process has ended; a corpse that nobody has taken away yet counts."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return True
    return state in "ZX"


def wait_until_gone(pid: int) -> bool:
    end_s = time.monotonic() + 20.0
    while not gone(pid) and time.monotonic() < end_s:
        time.sleep(0.02)
    return gone(pid)


def test_a_command_finds_its_inputs_and_its_outputs_are_found(tmp_path: Path) -> None:
    (tmp_path / "far.bin").write_bytes(b"\x00\x01")
    outcome, files = run(
        tmp_path,
        """
        import sys
        from pathlib import Path
        print("printed", sys.argv[1:])
        print("said", file=sys.stderr)
        Path("out").write_bytes(Path("near").read_bytes() + Path("far").read_bytes())
        sys.exit(3)
        """,
        "a b",
        "$HOME; echo",
        inputs={"near": b"near ", "far": tmp_path / "far.bin"},
        outputs=("out", "never"),
    )
    assert outcome.ending is Ending.DONE
    assert outcome.code == 3
    assert outcome.printed == "printed ['a b', '$HOME; echo']\n"
    assert outcome.said == "said\n"
    assert files == {"out": b"near \x00\x01"}


def test_its_folder_is_private_and_its_environment_bare(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("THERMAXIS_PASSWORD", "wagtail")
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    outcome, _ = run(
        tmp_path,
        """
        import os
        print(oct(os.stat(".").st_mode & 0o777), os.getcwd() == os.environ["HOME"])
        print(sorted(set(os.environ) - {"LC_CTYPE"}), os.nice(0), os.getsid(0) == os.getpid())
        print(len(os.listdir("/proc/self/fd")))
        """,
    )
    first, second, third = outcome.printed.splitlines()
    assert first == "0o700 True"
    assert "THERMAXIS_PASSWORD" not in second
    assert "PYTHON" not in second
    own = os.nice(0)
    assert second.endswith(f"] {min(own + 10, 19)} True")
    assert int(third) <= 4  # the three streams, and the folder that is just being listed


def test_a_command_that_hangs_is_stopped_with_its_children(tmp_path: Path) -> None:
    text = f"""
        import os, signal, subprocess, sys, time
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep({NEVER_S})"])
        open("pids", "w").write(f"{{os.getpid()}} {{child.pid}} ")
        time.sleep({NEVER_S})
        """
    for longest_s in (1.0, 5.0, 25.0):  # where the first time is too short to begin at all
        outcome, files = run(tmp_path, text, limits=Limits(longest_s=longest_s), outputs=("pids",))
        assert outcome.ending is Ending.TOO_LONG
        assert outcome.code is None
        if files.get("pids", b"").endswith(b" "):
            break
    pids = [int(word) for word in files["pids"].split()]
    assert len(pids) == 2
    assert all(wait_until_gone(pid) for pid in pids)


def test_children_that_outlive_their_command_are_ended_too(tmp_path: Path) -> None:
    outcome, files = run(
        tmp_path,
        """
        import subprocess, sys
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        open("pid", "w").write(str(child.pid))
        """,
        outputs=("pid",),
    )
    assert outcome.ending is Ending.DONE
    assert wait_until_gone(int(files["pid"]))


@pytest.mark.proof
def test_a_command_that_computes_for_ever_ends_at_the_limit_of_the_processor(
    tmp_path: Path,
) -> None:
    outcome, _ = run(
        tmp_path,
        """
        import resource
        resource.setrlimit(resource.RLIMIT_CPU, (1, resource.getrlimit(resource.RLIMIT_CPU)[1]))
        while True: pass
        """,
        limits=Limits(longest_s=NEVER_S),
    )
    assert outcome.ending is Ending.TOO_LONG


def test_a_command_that_eats_memory_floods_or_crashes_ends_so(tmp_path: Path) -> None:
    outcome, _ = run(
        tmp_path,
        "hoard = [bytes(50_000_000) for _ in range(40)]",
        limits=Limits(longest_s=50.0, memory_bytes=400_000_000),
    )
    assert (outcome.ending, outcome.code) == (Ending.DONE, 1)
    assert "MemoryError" in outcome.said
    flood = Limits(longest_s=50.0, said_bytes=100_000, file_bytes=900_000_000)
    outcome, _ = run(tmp_path, "while True: print('x' * 65536)", limits=flood)
    assert (outcome.ending, len(outcome.printed)) == (Ending.TOO_MUCH, 100_000)
    # one that fails before anybody looks is told as a flood all the same
    outcome, _ = run(
        tmp_path, "import os; os.write(1, bytes(300_000)); raise OSError", limits=flood
    )
    assert outcome.ending is Ending.TOO_MUCH
    outcome, _ = run(tmp_path, "import os; os.kill(os.getpid(), 11)")
    assert (outcome.ending, outcome.code) == (Ending.KILLED, -signal.SIGSEGV)


def test_no_file_grows_past_its_limit(tmp_path: Path) -> None:
    outcome, files = run(
        tmp_path,
        """
        with open("large", "wb", buffering=0) as stream:
            for _ in range(30): stream.write(bytes(100_000))
        """,
        limits=Limits(longest_s=50.0, file_bytes=1_000_000),
        outputs=("large",),
    )
    assert outcome.code == 1
    assert len(files["large"]) == 1_000_000


def test_many_small_files_are_stopped_by_their_sum(tmp_path: Path) -> None:
    outcome, _ = run(
        tmp_path,
        """
        import itertools, os
        os.mkdir("below")
        for k in itertools.count():
            with open(f"below/{k}", "wb") as stream: stream.write(bytes(20_000))
        """,
        limits=Limits(longest_s=50.0, folder_bytes=1_000_000),
    )
    assert outcome.ending is Ending.TOO_MUCH


def test_an_output_that_is_no_plain_file_is_not_there(tmp_path: Path) -> None:
    _, files = run(
        tmp_path,
        "import os; os.symlink('/etc/hostname', 'link'); os.mkdir('folder')",
        outputs=("link", "folder"),
    )
    assert not files


def test_an_input_cannot_leave_the_folder(tmp_path: Path) -> None:
    for name in ("../out", "/out", ".hidden", "a/b", ""):
        with pytest.raises(ValueError, match=r".*"):
            run(tmp_path, "", inputs={name: b""})
    assert not list(tmp_path.glob("out"))


def test_one_runs_at_a_time_a_few_wait_and_more_are_refused(tmp_path: Path) -> None:
    text = f"""
        import os, time
        marks = {str(tmp_path)!r} + "/marks"
        with open(marks, "a") as stream: stream.write("+")
        time.sleep(0.05)
        with open(marks, "a") as stream: stream.write("-")
        """

    async def crowd() -> tuple[list[object], Outcome]:
        work = Work(a_program(tmp_path, text), where=tmp_path)
        calls = [work.run_command((), limits=QUICK) for _ in range(MOST_WAITING + 3)]
        found = await asyncio.gather(*calls, return_exceptions=True)
        after = await work.run_command((), limits=QUICK)
        work.close()
        return [*found], after

    found, after = asyncio.run(crowd())
    assert sum(isinstance(one, BusyError) for one in found) == 2
    assert sum(isinstance(one, Outcome) for one in found) == MOST_WAITING + 1
    assert after.ending is Ending.DONE
    assert (tmp_path / "marks").read_text() == "+-" * (MOST_WAITING + 2)


def test_the_program_itself_can_be_run(tmp_path: Path) -> None:
    async def help_of_evaluate() -> Outcome:
        work = Work(where=tmp_path)
        outcome = await work.run_command(("evaluate", "--help"), limits=Limits(longest_s=30.0))
        work.close()
        return outcome

    outcome = asyncio.run(help_of_evaluate())
    assert outcome.code == 0
    assert "_ISO230.dat" in outcome.printed


def test_the_loop_of_events_goes_on_while_a_command_floods_and_eats(tmp_path: Path) -> None:
    """Between two turns its thread computes hardly: by the processor's time, not by the clock."""

    async def longest_turn() -> float:
        work = Work(
            a_program(
                tmp_path,
                """
                import sys
                hoard = []
                while True:
                    hoard.append(bytes(1_000_000))
                    print("x" * 1_000_000)
                """,
            ),
            where=tmp_path,
        )
        longest_s = 0.0
        limits = Limits(longest_s=1.0, memory_bytes=500_000_000, said_bytes=1 << 40)
        running = asyncio.create_task(work.run_command((), limits=limits))
        while not running.done():
            began_s = time.thread_time()
            await asyncio.sleep(0.01)
            longest_s = max(longest_s, time.thread_time() - began_s)
        work.close()
        return longest_s

    assert asyncio.run(longest_turn()) < 0.5


def tells_its_number(pid: Path) -> str:
    """Return a program that writes the number of its process, and sleeps on."""
    return f"""
        import os, time
        open({str(pid)!r} + ".new", "w").write(str(os.getpid()))
        os.rename({str(pid)!r} + ".new", {str(pid)!r})
        time.sleep(600)
        """


def test_a_cancelled_command_is_ended_and_its_folder_removed(tmp_path: Path) -> None:
    async def cancelled() -> int:
        pid = tmp_path / "pid"
        work = Work(a_program(tmp_path, tells_its_number(pid)), where=tmp_path)
        running = asyncio.create_task(work.run_command((), limits=Limits(longest_s=NEVER_S)))
        while not pid.exists():
            await asyncio.sleep(0.02)
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        [root] = tmp_path.glob("thermaxis-work-*")
        async with asyncio.timeout(20.0):  # it is removed beside the pages
            while sorted(path.name for path in root.iterdir()) != ["lock", "settings"]:
                await asyncio.sleep(0.02)
        with work.place():  # and its place is free again
            work.close()
        return int(pid.read_text())

    assert wait_until_gone(asyncio.run(cancelled()))


KILLED_SCREEN = """
import asyncio, sys
from pathlib import Path
from thermaxis.web.work._work import Limits, Work

async def main():
    work = Work((sys.executable, "-I", "-S", sys.argv[1]), where=Path(sys.argv[2]))
    await work.run_command((), limits=Limits(longest_s=600.0))

asyncio.run(main())
"""


def test_a_killed_screen_takes_its_command_along_and_its_folder_is_removed_later(
    tmp_path: Path,
) -> None:
    pid = tmp_path / "pid"
    program = a_program(tmp_path, tells_its_number(pid))
    script = tmp_path / "screen.py"
    script.write_text(KILLED_SCREEN)
    with subprocess.Popen([sys.executable, str(script), program[-1], str(tmp_path)]) as screen:
        end_s = time.monotonic() + 20.0
        while not pid.exists() and time.monotonic() < end_s:
            time.sleep(0.02)
        assert pid.exists()
        assert remove_leftovers(tmp_path) == 0  # it lives, so its folder is not left
        screen.send_signal(signal.SIGKILL)
        screen.wait()
    assert wait_until_gone(int(pid.read_text()))
    assert len(list(tmp_path.glob("thermaxis-work-*"))) == 1
    assert remove_leftovers(tmp_path) == 1
    assert not list(tmp_path.glob("thermaxis-work-*"))


def test_only_our_own_private_folders_count_as_left(tmp_path: Path) -> None:
    elsewhere = tmp_path / "precious"
    elsewhere.mkdir()
    (elsewhere / "lock").touch()
    (tmp_path / "thermaxis-work-link").symlink_to(elsewhere)
    (tmp_path / "thermaxis-work-file").touch()
    shared = tmp_path / "thermaxis-work-open"
    shared.mkdir()
    shared.chmod(0o755)
    young = tmp_path / "thermaxis-work-young"
    young.mkdir(mode=0o700)
    assert remove_leftovers(tmp_path) == 0
    os.utime(young, (time.time() - 120.0,) * 2)
    assert remove_leftovers(tmp_path) == 1
    assert not young.exists()
    assert elsewhere.exists()
    assert shared.exists()


def test_folders_are_private_from_the_first_moment(tmp_path: Path) -> None:
    work = Work(where=tmp_path)
    folder = work.folder()
    for path in (folder.path, folder.path.parent):
        assert stat.S_IMODE(path.stat().st_mode) == 0o700
    folder.remove()
    folder.remove()
    assert not folder.path.exists()
    work.close()
    assert not list(tmp_path.iterdir())


def test_everybody_has_one_place_and_a_kind_leaves_some_to_the_others(tmp_path: Path) -> None:
    work = Work(PYTHON, where=tmp_path)
    with work.place("novak", kind="export", most=2):
        assert [work.is_held_by(one) for one in ("novak", "svoboda")] == [True, False]
        with pytest.raises(BusyError) as own, work.place("novak"):
            pass
        assert own.value.own
        with work.place("svoboda", kind="export", most=2):
            with pytest.raises(BusyError), work.place("cerny", kind="export", most=2):
                pass
            with work.place("cerny"), work.place("dvorak"):
                assert MOST_WAITING + 1 == 4
                with pytest.raises(BusyError) as full, work.place("kral"):
                    pass
                assert not full.value.own
    with work.place("novak"):  # and all are free again
        pass


def test_a_folder_is_emptied_but_for_what_is_kept(tmp_path: Path) -> None:
    work = Work(PYTHON, where=tmp_path)
    folder = work.folder()
    (folder.path / "kept.pdf").write_bytes(bytes(700))
    (folder.path / "run.csv").write_bytes(bytes(9000))
    (folder.path / "cache").mkdir()
    (folder.path / "cache" / "x").write_bytes(bytes(5000))
    (folder.path / "elsewhere").symlink_to(tmp_path, target_is_directory=True)
    folder.leave_only([folder.path / "kept.pdf"])
    assert [path.name for path in folder.path.iterdir()] == ["kept.pdf"]
    assert tmp_path.exists()
    work.close()
