"""Files appear whole or not at all, however writing ends."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from thermal_robot.files import checksum, whole, write_bytes, write_text


def test_what_is_written_takes_the_place_at_once(tmp_path):
    file = tmp_path / "model.json"
    with whole(file) as place:
        place.write_text("half")
        assert not file.exists()
        assert place.suffix == ".json"
        place.write_text("all of it")
    assert file.read_text() == "all of it"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("ends", [ValueError, KeyboardInterrupt, OSError])
def test_a_failure_leaves_what_was_there_and_nothing_else(tmp_path, ends):
    file = tmp_path / "model.json"
    file.write_text("before")

    def fails():
        with whole(file) as place:
            place.write_text("half")
            raise ends

    with pytest.raises(ends):
        fails()
    assert file.read_text() == "before"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(("write", "content"), [(write_text, "text"), (write_bytes, b"text")])
def test_no_folder_is_an_error_that_names_the_file_and_leaves_nothing(tmp_path, write, content):
    file = tmp_path / "nowhere" / "model.json"
    with pytest.raises(FileNotFoundError, match="No such file") as caught:
        write(file, content)
    assert (caught.value.filename, caught.value.filename2) == (str(file), None)
    assert ".thermal-robot-" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_another_file_keeps_its_name(tmp_path):
    with pytest.raises(FileNotFoundError) as caught, whole(tmp_path / "copy.txt") as place:
        place.write_bytes((tmp_path / "original.txt").read_bytes())
    assert caught.value.filename == str(tmp_path / "original.txt")


WRITER = """
import sys
from thermal_robot.files import whole
with whole(sys.argv[1]) as place, place.open("w") as file:
    for _ in range(20_000_000):
        file.write("x" * 4096)
        file.flush()
        print("wrote", flush=True)
"""


@pytest.mark.skipif(os.name != "posix", reason="kills a process")
@pytest.mark.parametrize("seed", range(3))
def test_a_killed_process_leaves_what_was_there(tmp_path, seed):
    file = tmp_path / "table.csv"
    file.write_text("before")
    with subprocess.Popen([sys.executable, "-c", WRITER, str(file)], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(0.02 * seed)
        process.send_signal(signal.SIGKILL)
    assert file.read_text() == "before"
    assert all(other.name.startswith(".") for other in tmp_path.iterdir() if other != file)


FULL = """
import resource, signal, sys
from thermal_robot.files import write_text
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
try:
    write_text(sys.argv[1], "x" * 1_000_000)
except OSError as error:
    sys.exit(error.strerror)
"""


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files")
def test_a_full_disk_leaves_what_was_there_and_nothing_else(tmp_path):
    file = tmp_path / "page.html"
    file.write_text("before")
    found = subprocess.run([sys.executable, "-c", FULL, str(file)], capture_output=True, text=True)
    assert found.returncode == 1
    assert "File too large" in found.stderr
    assert file.read_text() == "before"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.skipif(os.name != "posix", reason="links and permissions of POSIX")
def test_a_link_stays_a_link_and_permissions_stay(tmp_path):
    file, link = tmp_path / "real.json", tmp_path / "link.json"
    file.write_text("before")
    file.chmod(0o640)
    link.symlink_to(file)
    write_text(link, "after")
    assert link.is_symlink()
    assert file.read_text() == "after"
    assert file.stat().st_mode & 0o777 == 0o640
    plain, new = tmp_path / "plain", tmp_path / "new"
    plain.touch()
    write_bytes(new, b"x")
    assert new.stat().st_mode == plain.stat().st_mode


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="has no devices as files")
def test_what_is_no_file_is_written_to(tmp_path):
    code = "from thermal_robot.files import write_text; write_text('/dev/stdout', 'told'); print(', and more')"
    assert subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE).stdout == b"told, and more\n"
    with (tmp_path / "out").open("a") as file:  # a shell's >>
        subprocess.run([sys.executable, "-c", code], stdout=file, check=True)
    assert (tmp_path / "out").read_text() == "told, and more\n"
    assert len(list(tmp_path.iterdir())) == 1


KINDS = {"d.json", "r.html", "m.json", "p.csv", "p.parquet", "f.png"}


def every_output(folder, *how):
    script = os.path.join(os.path.dirname(__file__), "every_output.py")
    command = [sys.executable, script, str(folder), *how]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True, timeout=300).stdout)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills processes")
def test_a_process_killed_at_any_instant_leaves_every_file_absent_old_or_whole(tmp_path):
    found = every_output(tmp_path, "killed", "150")
    assert found["torn"] == []
    # the kills did come while files were being written
    assert set(found["interrupted"]) == KINDS
    assert sum(n > 0 for n in found["interrupted"].values()) >= 4


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="limits the size of files")
def test_a_full_disk_is_an_error_for_every_file_and_leaves_what_was_there(tmp_path):
    for name in KINDS:
        (tmp_path / name).write_text("before")
    raised = every_output(tmp_path, "full")
    assert set(raised) == KINDS
    assert all("too large" in reason for reason in raised.values()), raised
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == dict.fromkeys(KINDS, "before")


def test_a_checksum_is_that_of_the_standard(tmp_path):
    """The SHA-256 of "abc" as FIPS 180-4 prints it."""
    file = tmp_path / "abc.txt"
    file.write_bytes(b"abc")
    assert checksum(file) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
