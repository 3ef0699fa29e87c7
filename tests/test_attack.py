"""What was found by attack: hostile texts, closed streams, damaged caches, kills, edited files."""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from shipped import load_shipped

import parakin as pk
from parakin.cli import main

POSIX = pytest.mark.skipif(os.name != "posix", reason="needs POSIX")
CLI = [sys.executable, "-m", "parakin.cli"]
TRICEPT = (Path(pk.__file__).parent / "machines" / "tricept.yaml").read_text(encoding="utf-8")


def run_shell(command, **options):
    return subprocess.run(["sh", "-c", command], capture_output=True, timeout=120, check=False, **options)


def is_one_line(text):
    text = text.decode(errors="replace") if isinstance(text, bytes) else text
    return len(text.strip().splitlines()) == 1 and "Traceback" not in text


# Control characters.


@pytest.mark.parametrize("character", ["\\e", "\\0", "\\x9b", "\\u202e", "\\x7f"])
def test_a_machines_title_holds_no_control_character(tmp_path, character):
    text = TRICEPT.replace("name: tricept\n", f'name: tricept\ntitle: "a{character}[31mRED"\n')
    text = "\n".join(line for n, line in enumerate(text.splitlines()) if not line.startswith("title:") or n < 3)
    path = tmp_path / "m.yaml"
    path.write_text(text)
    with pytest.raises(pk.InputError, match=r"m.yaml:\d+: .*control character") as caught:
        pk.load(path)
    assert caught.value.args[0].isprintable()


@pytest.mark.parametrize("line", ["PARTNO a\x1b[31m", "PPRINT hi\x9b31m", "$$ a\x1b]0;x\x07", "F\x1bOO/1"])
def test_a_cl_file_holds_no_control_character(tmp_path, line):
    path = tmp_path / "a.cls"
    path.write_text(f"UNITS/MM\n{line}\nFEDRAT/100\nGOTO/0,0,0\nGOTO/1,0,0\n")
    with pytest.raises(pk.InputError, match=r"a.cls:2: a control character"):
        pk.read_path(path)


def test_a_cl_file_of_dos_and_windows_is_read(tmp_path):
    path = tmp_path / "a.cls"
    path.write_bytes(b"UNITS/MM\r\nPPRINT \x93d\xfcnn\x94\r\nFEDRAT/100\r\nGOTO/0,0,0\r\nGOTO/1,0,0\r\n\x1a")
    assert "\u201cd\u00fcnn\u201d" in pk.read_path(path).events[0].text


def test_a_gcode_message_holds_no_control_character(tmp_path):
    path = tmp_path / "a.ngc"
    path.write_bytes("G21 G90 G94\n(MSG,a\x9b31m)\nG0 X0 Y0 Z0\nG1 X1 F100\nM2\n".encode())
    with pytest.raises(pk.InputError, match=r"a.ngc:2: a control character"):
        pk.read_path(path)


def test_file_names_do_not_act_on_the_terminal(tmp_path, capsys):
    assert main(["post", str(tmp_path / "a\x1b[31m.cls"), "-m", "tricept"]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_a_title_is_escaped_in_markdown(tmp_path):
    path = tmp_path / "m.yaml"
    text = "\n".join(line for line in TRICEPT.splitlines() if not line.startswith("title:"))
    path.write_text(text.replace("name: tricept", "name: tricept\ntitle: <script>alert(1)</script>"))
    page = pk.make_linuxcnc_configuration(pk.load(path))["tricept.md"]
    assert "<script>" not in page
    assert "&lt;script&gt;" in page


# Streams.


@POSIX
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("command", ["machines", "show tricept --json", "--help"])
def test_a_full_stdout(command):
    done = run_shell(f"{' '.join(CLI)} {command} > /dev/full")
    assert done.returncode == 2
    assert is_one_line(done.stderr)
    assert b"No space left" in done.stderr


@POSIX
def test_a_closed_stdout():
    done = run_shell(f"{' '.join(CLI)} machines >&-")
    assert done.returncode == 2
    assert is_one_line(done.stderr)


@POSIX
def test_a_closed_stderr():
    done = run_shell(f"{' '.join(CLI)} show tricpt 2>&-")
    assert (done.returncode, done.stdout) == (2, b"")


@POSIX
def test_a_pipe_that_closes_early():
    done = run_shell(f"{' '.join(CLI)} --help | head -1")
    assert done.stderr == b""


@POSIX
def test_a_file_name_that_is_no_text(tmp_path):
    part = os.path.join(os.fsencode(tmp_path), b"part\xff.cls")  # noqa: PTH118  a name of bytes
    with open(part, "wb") as file:  # noqa: PTH123
        file.write(b"UNITS/MM\nFEDRAT/3000\nGOTO/0,0,-1600\nGOTO/10,0,-1600\n")
    for more in ([], ["--json"]):
        arguments = [*CLI, "post", part, "-m", "tricept", "-o", str(tmp_path / "out"), "--target", "linuxcnc", *more]
        done = subprocess.run(arguments, capture_output=True, check=False)
        assert b"Traceback" not in done.stderr
        assert done.returncode == 0, done.stderr


@POSIX
def test_a_pipe_is_no_part(tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe.apt")
    for part in (tmp_path / "pipe.apt", "/dev/null"):
        assert main(["post", str(part), "-m", "tricept"]) == 2
        assert capsys.readouterr().err == f"{part}: cannot be read: a pipe or a device; expected a plain file\n"


# The cache of compiled kernels.


KERNEL = """
import numpy as np
from parakin.export.tables.decimal_text import format_cells
out = np.zeros(99, np.uint8)
print(format_cells(np.ones((1, 2)), np.ones(2), np.full(2, 4), out), out.tobytes())
"""


def run_kernel(folder, before=""):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "HOME": "/nonexistent"}
    return subprocess.run(
        [sys.executable, "-c", before + KERNEL], capture_output=True, text=True, env=environment, check=False
    )


def test_a_damaged_cache_is_made_anew(tmp_path):
    before = run_kernel(tmp_path)
    assert before.returncode == 0, before.stderr
    files = [path for path in tmp_path.rglob("*") if path.suffix in (".nbi", ".nbc")]
    assert files
    for number, path in enumerate(files):
        content = bytearray(path.read_bytes())
        if number % 3 == 0:
            content = content[: len(content) // 2]
        elif number % 3 == 1:
            content[len(content) // 2] ^= 0xFF
        else:
            content = bytearray()
        path.write_bytes(content)
    after = run_kernel(tmp_path)
    assert (after.returncode, after.stdout, after.stderr) == (0, before.stdout, "")
    assert run_kernel(tmp_path).stdout == before.stdout


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs POSIX")
def test_nowhere_to_cache(tmp_path):
    (tmp_path / "file").write_text("")
    no_locator = "from numba.core import caching; caching.CompileResultCacheImpl._locator_classes = []"
    done = run_kernel(tmp_path / "file" / "below", no_locator)
    assert done.returncode == 0, done.stderr
    assert "NUMBA_CACHE_DIR" in done.stderr


# Kills.


SLOW = """
import sys, time
import parakin as pk
def slow(file):
    file.write(b"half")
    file.flush()
    print("writing", flush=True)
    time.sleep(60)
pk.write_files(sys.argv[1], {"a": "new", "b": slow})
"""


@POSIX
@pytest.mark.parametrize("exists", [True, False])
def test_what_a_kill_leaves_is_swept_by_the_next_run(tmp_path, exists):
    folder = tmp_path / "out"
    if exists:
        folder.mkdir()
        (folder / "a").write_text("old")
    with subprocess.Popen([sys.executable, "-c", SLOW, str(folder)], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        # while it lives, another run leaves its files alone
        pk.write_files(folder if exists else tmp_path, {"c": "c"})
        assert list(tmp_path.rglob("b"))
        process.send_signal(signal.SIGKILL)
    assert (folder / "a").read_text() == "old" if exists else not folder.exists()
    pk.write_files(folder, {"a": "new", "b": "new"})
    assert sorted(path.name for path in folder.iterdir()) == (["a", "b", "c"] if exists else ["a", "b"])
    assert not list(tmp_path.rglob("*.part"))


KILLED_BETWEEN = """
import os, signal, sys
import parakin as pk
replace, left = os.replace, [int(sys.argv[2])]
def count_down(*arguments):
    replace(*arguments)
    left[0] -= 1
    if not left[0]:
        os.kill(os.getpid(), signal.SIGKILL)
os.replace = count_down
pk.write_files(sys.argv[1], {"a": "new", "b": "new"})
"""


@POSIX
@pytest.mark.parametrize(("moved", "held"), [(1, ["old", "old"]), (2, ["new", "old"])])  # the note moves first, whole
def test_a_set_torn_by_a_kill_says_so_until_it_is_complete(tmp_path, moved, held):
    pk.write_files(tmp_path, {"a": "old", "b": "old"})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
    subprocess.run([sys.executable, "-c", KILLED_BETWEEN, str(tmp_path), str(moved)], check=False, timeout=120)
    assert [(tmp_path / name).read_text() for name in "ab"] == held
    (note,) = tmp_path.glob("parakin-incomplete-*.txt")
    assert note.read_text().splitlines()[1:] == ["a", "b"]
    pk.write_files(tmp_path, {"a": "newer", "c": "new"})  # b is still the old one
    assert note.exists()
    pk.write_files(tmp_path, {"a": "newest", "b": "newest"})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]


def test_a_set_is_not_torn_by_an_interruption(tmp_path, monkeypatch):
    replace = os.replace

    def interrupted(*arguments):
        replace(*arguments)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("parakin.export.files.os.replace", interrupted)
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").write_text("old")
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)  # in a shell's background it is ignored
    try:
        with pytest.raises(KeyboardInterrupt):
            pk.write_files(tmp_path, {"a": "new", "b": "new"})
    finally:
        signal.signal(signal.SIGINT, inherited)
    assert [(tmp_path / name).read_text() for name in "ab"] == ["new", "new"]


def test_a_missing_folder_appears_with_all_of_its_files(tmp_path, monkeypatch):
    def refused(*arguments):
        raise AssertionError("one by one")

    monkeypatch.setattr("parakin.export.files.os.replace", refused)
    pk.write_files(tmp_path / "deep" / "new", {"a": "a", "b": "b"})
    assert sorted(path.name for path in (tmp_path / "deep" / "new").iterdir()) == ["a", "b"]


@pytest.mark.parametrize("name", ["", "a/b", "/etc/x"])
def test_a_name_is_no_path(tmp_path, name):
    with pytest.raises(pk.InputError, match="no file name"):
        pk.write_files(tmp_path, {name: "a"})


# Files of LinuxCNC's configuration that somebody edited.


@pytest.mark.parametrize("end", ["_kins.c", ".ini", ".hal", ".tbl", ".ngc", ".md"])
def test_an_edited_file_is_not_overwritten(tmp_path, capsys, end):
    folder = tmp_path / "m"
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 0
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 0  # as it was written
    assert before == {path.name: path.read_bytes() for path in folder.iterdir()}
    edited = folder / f"linear_delta{end}"
    edited.write_bytes(edited.read_bytes() + b"\n; mine")
    (folder / "linear_delta.md" if end != ".md" else folder / "linear_delta.ini").unlink()
    after = {path.name: path.read_bytes() for path in folder.iterdir()}
    capsys.readouterr()
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 2
    error = capsys.readouterr().err
    assert is_one_line(error)
    assert str(edited) in error
    assert "--force" in error
    assert after == {path.name: path.read_bytes() for path in folder.iterdir()}  # nothing is written
    assert main(["linuxcnc", "linear_delta", "-o", str(folder), "--force"]) == 0
    assert before == {path.name: path.read_bytes() for path in folder.iterdir()}


def test_line_ends_are_no_edit_and_another_machine_is_none(tmp_path):
    folder = tmp_path / "m"
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 0
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 0
    (folder / "linear_delta.ini").write_text("[EMC]\n")
    assert main(["linuxcnc", "linear_delta", "-o", str(folder)]) == 2


# Options.


@pytest.mark.parametrize("text", ["XY=1", "YZ=1", "XYZABC=1"])
def test_an_axis_of_place_is_one_letter(tmp_path, capsys, text):
    path = tmp_path / "a.cls"
    path.write_text("UNITS/MM\nFEDRAT/3000\nGOTO/0,0,-1600\nGOTO/10,0,-1600\n")
    assert main(["post", str(path), "-m", "tricept", "--place", text]) == 2
    assert is_one_line(capsys.readouterr().err)


# Slow motions.


def test_a_very_slow_program_takes_little_memory(tmp_path):
    """5,000 minutes at 0.0001 mm/min: a sample of its speed each millisecond would fill the memory."""
    path = tmp_path / "a.cls"
    path.write_text("UNITS/MM\nFEDRAT/0.0001,MMPM\nGOTO/0,0,0\nGOTO/0.25,0,0\nGOTO/0.5,0,0\nFINI\n")
    job = pk.prepare(load_shipped("tricept"), pk.read_path(path), workpiece=pk.workpiece(Z=-1400))
    assert job.seconds > 100_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    (program,) = pk.write_files(tmp_path, {"a.ngc": pk.make_linuxcnc_program(job.trajectory)})
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB
    assert len(program.read_text().splitlines()) < 1000


def test_a_path_of_many_years_is_told_and_not_planned(tmp_path):
    part = tmp_path / "slow.cl"
    part.write_text("FEDRAT/1e-9,MMPM\nGOTO/0,0,-1400\nGOTO/10,0,-1400\n")
    job = pk.prepare(load_shipped("tricept"), pk.read_path(part))
    assert job.posted.first is None and job.trajectory is None
    told = re.match(r"(.*):3: the path takes ([\d,]+) years at its feeds", job.unplanned)
    assert told[1] == str(part)
    assert float(told[2].replace(",", "")) == pytest.approx(10 / 1e-9 / 60 / 24 / 365.25, rel=0.01)


def test_thousands_of_kilometres_out_of_reach_are_not_counted_and_warn_of_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("parakin.toolpath.timing.joint_path.place_rows", None)
    part = tmp_path / "far.cl"
    part.write_text("FEDRAT/1000,MMPM\nGOTO/0,0,-1400\nGOTO/1000000000,0,0\nGOTO/-1000000000,0,0,1,0,0\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        job = pk.prepare(load_shipped("tricept"), pk.read_path(part))
    assert job.posted.first is not None and job.unplanned == "a path of 3,000 km, too long to be timed"
