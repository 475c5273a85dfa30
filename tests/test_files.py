"""Where the paths of users lead."""

import errno

import pytest

from tmcm34x.files import followed, real_path


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "away").symlink_to("back")
    (tmp_path / "back").symlink_to("away")
    (tmp_path / "behind").symlink_to("circle/../link")
    (tmp_path / "link").symlink_to("file")
    (tmp_path / "broken").symlink_to("missing")
    (tmp_path / "file").touch()
    return tmp_path.resolve()


@pytest.mark.parametrize(
    ("name", "place"),
    [("link", "file"), ("x/../link", "file"), ("broken", "missing"), ("new/name", "new/name"), ("", "")],
)
def test_a_path_is_followed_to_its_end(folder, name, place):
    assert followed(folder / name) == real_path(folder / name) == folder / place


@pytest.mark.parametrize("name", ["circle", "away", "back", "circle/x"])
def test_links_in_a_circle_lead_nowhere(folder, name):
    with pytest.raises(OSError, match="Too many levels of symbolic links"):
        followed(folder / name)
    assert real_path(folder / name).is_relative_to(folder)


@pytest.mark.parametrize("name", ["behind", "away/../link", "x/../circle/../link"])
def test_no_link_behind_a_circle_is_left(folder, name):
    """Whether the circle counts depends on the version of Python; what stands behind it is a link in no case."""
    try:
        assert followed(folder / name) == folder / "file"
    except OSError as error:
        assert error.errno == errno.ELOOP


def test_a_name_that_the_system_refuses_is_left_to_its_opening(folder):
    assert followed(folder / ("x" * 300)) == folder / ("x" * 300)
    with pytest.raises(ValueError, match="null"):
        followed("a\0b")
