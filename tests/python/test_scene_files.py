"""Scene files as the programs read them."""

import os

import pytest
import scenes

import circline

SOURCE = os.path.join(os.path.dirname(__file__), "..", "..")


def test_reads_scene_files():
    images = circline.load_scene(os.path.join(SOURCE, "apps/demo/disc.yaml"))
    assert len(images) > 1 and images[0].observations.camera.fx > 0
    assert images[0].true_rotation is not None and images[0].true_rotation.shape == (3, 3)
    with pytest.raises(ValueError, match="no_such"):
        circline.load_scene("no_such.yaml")


SCENE = """%YAML:1.0
---
cameras:
  - { id: "k", model: "pinhole", camera_matrix: [500., 0., 320., 0., 500., 240., 0., 0., 1.]SIGMA }
images:
  - { file: "a.png", circles: [ { id: "c", roi: [1, 2, 30, 40] } ]TRUTH }
"""


def test_paths_need_not_be_utf8(tmp_path):
    folder = os.fsencode(tmp_path) + b"/\xe9t\xe9"
    try:
        os.mkdir(folder)
    except OSError:
        pytest.skip("the file system takes UTF-8 only")
    with open(folder + b"/scene.yaml", "w", encoding="utf-8") as file:
        file.write(SCENE.replace("SIGMA", "").replace("TRUTH", ""))
    (image,) = circline.load_scene(os.fsdecode(folder + b"/scene.yaml"))
    assert os.fsencode(image.path) == folder + b"/a.png"
    with pytest.raises(ValueError, match="cannot be opened"):
        circline.load_cameras(os.fsdecode(folder + b"/none.yaml"))


def test_scene_files_say_how_well_their_camera_is_known(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.replace("SIGMA", "").replace("TRUTH", ""))
    silent = circline.load_scene(path)[0]
    assert silent.camera_sigma is None and silent.symmetry == "none"
    path.write_text(
        SCENE.replace("SIGMA", ", focal_sigma: 0.25").replace("TRUTH", ', truth: { symmetry: "D4" }')
    )
    image = circline.load_scene(str(path))[0]
    assert image.camera_sigma.log_focal == 0.25 and image.symmetry == "D4"
    assert image.camera_sigma.log_aspect == circline.CameraSigma().log_aspect
    # It reaches the estimate: the focal length is an unknown then.
    observations = circline.fit(scenes.observations())
    known, open_ = (
        circline.estimate(observations, camera_sigma=sigma).hypotheses[0]
        for sigma in (silent.camera_sigma, image.camera_sigma)
    )
    assert known.focal_sigma == 0.0 < open_.focal_sigma
