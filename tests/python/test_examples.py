"""The examples of docs/examples/python, as anyone runs them."""

import os
import subprocess
import sys

import pytest
import scenes
from PIL import Image

EXAMPLES = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "examples", "python")

CALIBRATION = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   { rows: 3, cols: 3, dt: d, data: [600., 0., 320., 0., 600., 240., 0., 0., 1.] }
distortion_coefficients: !!opencv-matrix
   { rows: 1, cols: 5, dt: d, data: [0., 0., 0., 0., 0.] }
"""


@pytest.fixture
def inputs(tmp_path):
    photo, calibration = tmp_path / "disc.png", tmp_path / "calib.yml"
    Image.fromarray(scenes.disc_photo()).save(photo)
    calibration.write_text(CALIBRATION)
    return str(photo), str(calibration)


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
