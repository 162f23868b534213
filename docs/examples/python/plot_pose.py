"""Draws what is found in a photo, and every pose of its plane: plot_pose.py PHOTO CALIBRATION OUT"""

import sys

import matplotlib

matplotlib.use("Agg")  # To a file; no window is opened.
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

import circline


def main(photo_file: str, calibration: str, out: str) -> None:
    photo = np.asarray(Image.open(photo_file).convert("L"))
    camera = circline.load_cameras(calibration)[0]
    observations = circline.detect(photo, camera)
    estimate = circline.estimate(observations)

    figure, axes = plt.subplots(figsize=(10, 7))
    axes.imshow(photo, cmap="gray")
    for circle in observations.circles:
        axes.plot(*np.asarray(circle.points).T, ".", markersize=1, color="orange")
    for pencil, color in zip(observations.pencils, ("red", "green", "blue")):
        for line in pencil.lines:
            axes.plot(*np.asarray(line.points)[[0, -1]].T, color=color, linewidth=1)

    for k, pose in enumerate(estimate.hypotheses):
        # The normal of each circle, one radius long: the hypotheses lean to different sides.
        for circle in pose.circles:
            tip = circle.center + circle.radius * circle.normal
            ends = camera.project(np.stack([circle.center, tip]))
            first = circle.id == pose.circles[0].id
            label = f"pose {k}: {100 * pose.probability:.0f} %" if first else None
            axes.plot(*ends.T, color=f"C{k}", linewidth=2, label=label)
    axes.set(xlim=(0, photo.shape[1]), ylim=(photo.shape[0], 0), title=estimate.decided_by)
    if estimate.hypotheses[0].circles:
        axes.legend()
    figure.savefig(out)


if __name__ == "__main__":
    main(*sys.argv[1:4])
