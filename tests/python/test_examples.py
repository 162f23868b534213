"""The examples of docs/examples/python, as anyone runs them."""

import os
import subprocess
import sys

import pytest
import scenes
from PIL import Image

TESTS = os.path.join(os.path.dirname(__file__), "..")
EXAMPLES = os.path.join(TESTS, "..", "docs", "examples", "python")


@pytest.fixture
def inputs(tmp_path):
    photo = str(tmp_path / "disc.png")
    Image.fromarray(scenes.disc_photo()).save(photo)
    return photo, os.path.join(TESTS, "disc_calibration.yml")


def run(name, *arguments):
    return subprocess.run(
        [sys.executable, os.path.join(EXAMPLES, name), *arguments],
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def test_photo_to_pose(inputs):
    said = run("photo_to_pose.py", *inputs)
    assert said.count("probability 0.50") == 2


def test_plot_pose(inputs, tmp_path):
    picture = tmp_path / "pose.png"
    run("plot_pose.py", *inputs, str(picture))
    assert Image.open(picture).size[0] > 500
