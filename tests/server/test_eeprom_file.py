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


def test_a_link_that_leads_nowhere_leads_to_the_first_image(tmp_path):
    (tmp_path / "link").symlink_to("image")
    EepromFile(tmp_path / "link").save(b"new")
    assert (tmp_path / "image").read_bytes() == b"new"


def test_a_link_in_a_circle_is_no_file(tmp_path):
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "link").symlink_to("circle")
    for name in ("circle", "link", "circle/image"):
        with pytest.raises(EepromFileError, match=f"{name}: Too many levels of symbolic links"):
            EepromFile(tmp_path / name)


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


def test_what_killed_processes_have_left_is_removed(tmp_path):
    path = tmp_path / "im[a]ge*"
    path.write_bytes(b"old")
    stale, other = tmp_path / ".im[a]ge*.0123456789abcdef.new", tmp_path / ".image.0123456789abcdef.new"
    stale.write_bytes(b"half an image, longer than the new one")
    other.write_bytes(b"of another module")
    file = EepromFile(path)
    file.save(b"whole")
    assert path.read_bytes() == b"whole"
    assert set(tmp_path.iterdir()) == {path, other}


def test_the_new_file_of_a_living_process_is_left_alone(tmp_path):
    path = tmp_path / "image"
    path.write_bytes(b"old")
    file = EepromFile(path)
    new = file.prepare(b"new")
    file._remove_left_overs()
    assert new.path.exists()
    file.publish(new)
    assert path.read_bytes() == b"new"


def test_links_that_somebody_has_put_there_are_not_followed(tmp_path, monkeypatch):
    """The name of the new file cannot be guessed; and if it could, nothing would be written through a link."""
    path, victim = tmp_path / "image", tmp_path / "victim"
    path.write_bytes(b"old")
    victim.write_bytes(b"precious")
    monkeypatch.setattr("secrets.token_hex", lambda _: "guessed")
    for link in (tmp_path / ".image.new", tmp_path / ".image.guessed.new"):
        link.symlink_to(victim)
    file = EepromFile(path)
    with pytest.raises(EepromFileError, match="File exists"):
        file.save(b"new")
    assert (victim.read_bytes(), path.read_bytes()) == (b"precious", b"old")


def test_entries_are_appended_and_a_new_image_has_none(tmp_path):
    path = tmp_path / "image"
    file = EepromFile(path)
    file.save(b"image")
    file.append(b" one")
    file.append(b" two")
    assert path.read_bytes() == b"image one two"
    assert file.load() == b"image one two"
    file.append(b" three")
    new = file.prepare(b"next")
    file.publish(new, b" four")
    file.append(b" five")
    assert path.read_bytes() == b"next four five"


@pytest.mark.parametrize("kind", ["fifo", "device"])
def test_what_is_no_file_is_refused_at_once(tmp_path, kind):
    path = tmp_path / "image" if kind == "fifo" else "/dev/null"
    if kind == "fifo":
        os.mkfifo(path)
    with pytest.raises(EepromFileError, match="not a file"):
        EepromFile(path)


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
        "file = EepromFile(sys.argv[1])\n"
        "file.load()\n"
        "for action, data in ((file.save, bytes(20_000)), (file.append, bytes(998)), (file.append, b'!')):\n"
        "    try:\n"
        "        action(data)\n"
        "    except EepromFileError as error:\n"
        "        print(error)\n"
    )
    result = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=True)
    assert result.stdout == f"{path}: File too large\n{path}: the disk is full\n"
    assert path.read_bytes() == b"old!"
    assert list(tmp_path.iterdir()) == [path]


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
    EepromFile(path).close()
    assert list(tmp_path.iterdir()) == [path]
