"""Values survive copy and pickle, and so reach the processes of a pool."""

import copy
import dataclasses
import pickle

import numpy as np
import scenes

import circline


def test_values_can_be_copied_and_pickled():
    observations = circline.fit(scenes.observations(noise_px=0.0))
    observations.camera.id = "left"
    for same in (copy.deepcopy(observations), pickle.loads(pickle.dumps(observations))):
        assert same.camera.id == "left" and same.camera.distortion == observations.camera.distortion
        same.camera.fx = 1.0
        assert observations.camera.fx != 1.0
        a, b = observations.circles[0].fit, same.circles[0].fit
        assert a.rms_px == b.rms_px and np.array_equal(a.covariance, b.covariance)
    noise = circline.NoiseModel(radius=0.1, camera=circline.CameraSigma(k1=0.2))
    assert copy.copy(noise).camera.k1 == 0.2
    pose = circline.estimate(observations).hypotheses[0].cam_from_world
    assert np.array_equal(copy.deepcopy(pose).rotation, pose.rotation)


def test_observations_are_dataclasses():
    observations = scenes.observations()
    other = dataclasses.replace(observations, message="seen", pencils=[])
    assert other.message == "seen" and other.circles is observations.circles
    fields = dataclasses.asdict(copy.copy(observations))
    assert fields["circles"][0]["id"] == "c0" and fields["camera"].fx == 1000.0


def assert_equal(a: object, b: object) -> None:
    """All that they hold, however deep."""
    assert type(a) is type(b)
    if isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b)
        for one, other in zip(a, b):
            assert_equal(one, other)
    elif type(a).__module__ == "circline._circline":
        for name, field in vars(type(a)).items():
            if isinstance(field, property):
                assert_equal(getattr(a, name), getattr(b, name))
    else:
        assert a == b


def test_results_can_be_copied_and_pickled():
    photos = [scenes.observations(seed=k, tilt=0.7 * np.cos(k), turn=1.3 * k) for k in range(3)]
    photos = [circline.fit(photo) for photo in photos]
    sigma = circline.CameraSigma(log_focal=0.25)
    alone = circline.adjust(photos, rigid="yes")
    poses = [photo.cam_from_world for photo in alone.photos]
    given = circline.adjust(photos, given_poses=[*poses[:2], None])
    assert given.given and not given.photos[2].ok and len(given.photos[0].residuals)
    circle = photos[0].circles[0]
    no_pencils = circline.fit(circline.Observations(camera=photos[0].camera, circles=[circle]))
    values = [
        circline.estimate(photos[0]),
        circline.estimate(photos[0], camera_sigma=sigma),
        circline.estimate(no_pencils),
        alone,
        given,
        circline.CirclePose([0, 0, -1], [0.1, 0.2, 5.0]),
    ]
    for value in values:
        for same in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert_equal(same, value)
    # What only goes in has nothing to be read: by what it does.
    mean = circline.CameraPose(poses[0].rotation, poses[0].translation)
    for name, prior in (
        ("pose_prior", circline.PosePrior(mean, np.diag([1e-4] * 3 + [0.1] * 3))),
        ("gravity_prior", circline.GravityPrior([0, 0, 1], poses[0].rotation[:, 2], 0.002)),
    ):
        same = pickle.loads(pickle.dumps(prior))
        answers = [circline.estimate(photos[0], **{name: p}).hypotheses[0] for p in (prior, same)]
        assert_equal(*answers)
    everything = [value for value in vars(circline).values() if isinstance(value, type)]
    own = [value for value in everything if value.__module__ == "circline._circline"]
    assert all("__setstate__" in vars(value) for value in own if value is not circline.Refused)
