"""The IDE from a wheel, away from the source tree: its examples came with it."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, expect

from ide.front_end import ROOT, built
from ide.page.driver import figure, until


def _unpacked(folder: Path) -> Path:
    """What the wheel would install."""
    built()
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    environment = {**os.environ, "TMCM34X_CORE": "python"}
    subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    site = folder / "site"
    zipfile.ZipFile(wheel).extractall(site)
    return site


def test_the_gallery_of_an_installed_wheel_opens_an_example_with_its_machine(
    tmp_path: Path, window: Callable[[str], Page]
):
    site = _unpacked(tmp_path)
    (folder := tmp_path / "empty").mkdir()
    environment = {**os.environ, "PYTHONPATH": str(site)}
    where = [sys.executable, "-c", "import tmcm34x; print(tmcm34x.__file__)"]
    found = subprocess.run(
        where, cwd=folder, env=environment, capture_output=True, text=True, check=True
    ).stdout
    assert Path(found.strip()).is_relative_to(site)
    command = [sys.executable, "-m", "tmcm34x", "ide", "--no-browser"]
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        page = window(process.stdout.readline().split()[2])
        page.locator(".tile", has_text="Pick and place").click()
        expect(page.locator(".lane .place")).to_contain_text("pick-and-place")
        page.get_by_role("button", name="Run", exact=True).click()
        until(page, lambda: figure(page, 0, "position") != 0)
        assert list(folder.iterdir()) == []
        page.close()
    finally:
        process.terminate()
        process.stdout.close()
        process.wait(60)
