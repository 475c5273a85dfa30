"""The image file: complete at any moment, one user at a time."""

import os
import random
import signal
import subprocess
import sys
import threading

import pytest

from tmcm34x.server import EepromFile, EepromFileError

WRITER = """
import sys
from tmcm34x.server.eeprom_file import EepromFile
file = EepromFile(sys.argv[1])
images = [bytes([n]) * 20_000 for n in range(256)]
print("ready", flush=True)
while True:
    for image in images:
        file.save(image)
"""


def test_a_missing_file_has_no_image(tmp_path):
    assert EepromFile(tmp_path / "new").load() is None
    assert not list(tmp_path.iterdir())


def test_what_was_saved_is_loaded(tmp_path):
    path = tmp_path / "image"
    file = EepromFile(path)
    file.save(b"first")
    file.save(b"second")
    file.close()
    assert EepromFile(path).load() == b"second"
    assert list(tmp_path.iterdir()) == [path]


def test_the_mode_of_the_file_is_kept(tmp_path):
    path = tmp_path / "image"
    path.write_bytes(b"old")
    path.chmod(0o600)
    EepromFile(path).save(b"new")
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_symbolic_link_stays_one(tmp_path):
    target, link = tmp_path / "image", tmp_path / "link"
    target.write_bytes(b"old")
    link.symlink_to(target)
    EepromFile(link).save(b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("replaced", [False, True])
def test_a_file_in_use_is_refused_until_it_is_closed(tmp_path, replaced):
    path = tmp_path / "image"
    path.write_bytes(b"old")
    first = EepromFile(path)
    if replaced:
        first.save(b"new")
    with pytest.raises(EepromFileError, match=f"{path}: in use by another process"):
        EepromFile(path)
    first.close()
    EepromFile(path).close()


def test_of_two_that_find_no_file_only_one_may_create_it(tmp_path):
    path = tmp_path / "image"
    first, second = EepromFile(path), EepromFile(path)
    first.save(b"first")
    with pytest.raises(EepromFileError, match="File exists"):
        second.save(b"second")
    assert path.read_bytes() == b"first"


def test_a_left_over_of_a_killed_process_is_no_hindrance(tmp_path):
    path = tmp_path / "image"
    (tmp_path / ".image.new").write_bytes(b"half an image, longer than the new one")
    file = EepromFile(path)
    file.save(b"whole")
    assert path.read_bytes() == b"whole"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("path", ["/no/such/folder/image", "/proc/image"])
def test_a_folder_that_cannot_be_written_is_refused(path):
    with pytest.raises(EepromFileError, match=path) as caught:
        EepromFile(path).save(b"image")
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_image(tmp_path):
    with pytest.raises(EepromFileError, match="Is a directory"):
        EepromFile(tmp_path).load()


def test_a_full_disk_leaves_the_old_image(tmp_path):
    path = tmp_path / "image"
    path.write_bytes(b"old")
    script = (
        "import resource, signal, sys\n"
        "from tmcm34x.server.eeprom_file import EepromFile, EepromFileError\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try:\n"
        "    EepromFile(sys.argv[1]).save(bytes(20_000))\n"
        "except EepromFileError as error:\n"
        "    print(error)\n"
    )
    result = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True)
    assert result.stdout == f"{path}: File too large\n"
    assert path.read_bytes() == b"old"


def test_a_process_killed_at_any_point_leaves_a_whole_image(tmp_path):
    path = tmp_path / "image"
    path.write_bytes(bytes(20_000))
    delays = random.Random(34)
    seen = set()
    for _ in range(12):
        with subprocess.Popen([sys.executable, "-c", WRITER, path], stdout=subprocess.PIPE) as writer:
            assert writer.stdout.readline() == b"ready\n"
            timer = threading.Timer(delays.random() * 0.04, writer.send_signal, [signal.SIGKILL])
            timer.start()
            assert writer.wait(10) == -signal.SIGKILL
            timer.join()
        image = path.read_bytes()
        assert len(image) == 20_000
        assert len(set(image)) == 1
        seen.add(image[0])
    assert len(seen) > 1  # they did write
    assert {entry.name for entry in tmp_path.iterdir()} <= {"image", ".image.new"}
    assert os.access(path, os.R_OK)
