"""The closed forms by themselves."""

import numpy as np
import pytest
import scenes

import circline


def test_closed_forms_give_back_what_was_projected():
    circle = circline.CirclePose([0.3, 0.2, -0.932737905308882], [0.1, 0.2, 5.0])
    conic = circline.project_circle(circle)
    poses = circline.circle_poses(conic)
    assert len(poses) == 2
    assert min(np.abs(p.normal - circle.normal).max() for p in poses) < 1e-9
    with pytest.raises(circline.Refused):
        circline.circle_poses(np.eye(3))
    R = scenes.rotation()
    C = R @ [0, 0, 1]
    line = lambda p, d: np.cross(p, d)  # noqa: E731: the plane of a point and a direction.
    p0, p1 = np.array([0, 0, 5.0]), np.array([0.4, 0.1, 5.0])
    x_lines = [line(p0, R[:, 0]), line(p1, R[:, 0])]
    y_lines = [line(p0, R[:, 1]), line(p1, R[:, 1])]
    found = circline.rotation_from_line_pairs(x_lines, y_lines)
    assert np.abs(np.abs(found.T @ R) - np.eye(3)).max() < 1e-9
    conic = circline.project_circle(circline.CirclePose(C * -np.sign(C[2]), [0.2, 0.1, 6.0]))
    best, deviation = circline.rotation_from_circle_and_frame(conic, x_lines[0], y_lines[0])[0]
    assert deviation < 1e-9 and np.abs(np.abs(best.T @ R) - np.eye(3)).max() < 1e-7


def test_circles_out_of_view_have_no_image():
    tilted = [0.6, 0, -0.8]
    behind, partly, nowhere = [0, 0, -5], [0, 0, 0.5], [np.nan, 0, 5]
    for normal, center in (
        (tilted, behind), (tilted, partly), (tilted, nowhere), ([1, 0, 0], [0, 0, 5]), ([0] * 3,) * 2
    ):
        with pytest.raises(ValueError, match="circle about .* has no ellipse as image"):
            circline.project_circle(circline.CirclePose(normal, center))
