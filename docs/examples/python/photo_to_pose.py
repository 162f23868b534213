"""From a photo to the poses that it admits: photo_to_pose.py PHOTO CALIBRATION"""

import sys

import numpy as np
from PIL import Image

import circline

photo = np.asarray(Image.open(sys.argv[1]).convert("L"))
camera = circline.load_cameras(sys.argv[2])[0]
estimate = circline.estimate(circline.detect(photo, camera))
for pose in estimate.hypotheses:
    print(f"probability {pose.probability:.2f}, rms {pose.rms_px:.2f} px")
    print(np.column_stack([pose.cam_from_world.rotation, pose.cam_from_world.translation]).round(4))
