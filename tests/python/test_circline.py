"""The Python package against the truth of scenes made here, and its promises."""

import ast
import gc
import os
import re
import threading
import time
import tracemalloc

import numpy as np
import pytest
import scenes

import circline


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip((np.trace(a @ b.T) - 1) / 2, -1, 1)))


def test_estimates_the_true_pose():
    observations = circline.fit(scenes.observations(noise_px=0.0))
    best = circline.estimate(observations, noise_model=circline.NoiseModel.exact()).hypotheses[0]
    assert best.metric and best.probability > 0.9
    # The senses of the axes are the convention's.
    assert min(
        angle_between(best.cam_from_world.rotation, scenes.rotation() @ np.diag(signs))
        for signs in ([1, 1, 1], [-1, -1, 1], [1, -1, -1], [-1, 1, -1])
    ) < 1e-6
    np.testing.assert_allclose(best.cam_from_world.translation, scenes.TRANSLATION, atol=1e-5)


def test_values_say_what_they_do_not_take():
    with pytest.raises(TypeError, match="read-only|assignment"):
        scenes.camera().distortion[0] = 5.0
    with pytest.raises(TypeError, match="unexpected keyword argument 'project'"):
        circline.Camera(project=1)
    observations = scenes.observations()
    observations.circles[0].inliers = "x"
    with pytest.raises(ValueError, match="inliers"):
        circline.estimate(observations)
    observations.camera = None
    with pytest.raises(ValueError, match="camera cannot be None"):
        circline.estimate(observations)


@pytest.mark.parametrize(
    "part, wrong, said",
    [
        (lambda o: o, "circels", "Observations has no attribute 'circels'; did you mean 'circles'"),
        (lambda o: o.circles[0], "sigma", "CircleObservation has no attribute 'sigma'"),
        (lambda o: o.circles[0], "raduis", "did you mean 'radius'"),
        (lambda o: o.pencils[1], "plain", "did you mean 'plane'"),
        (lambda o: o.pencils[1].lines[0], "xyz", "LineObservation has no attribute 'xyz'$"),
        (lambda o: o.frame, "x_axes", "did you mean 'x_axis'"),
        (lambda o: o.camera, "focal", "'focal'"),
        (lambda o: circline.KnownAngle(), "sigma_rad", "did you mean 'sigma'"),
        (lambda o: circline.KnownLength(), "length", "KnownLength has no attribute 'length'"),
        (lambda o: circline.SceneImage("a", "a", o), "roi", "did you mean 'rois'"),
        (lambda o: circline.NoiseModel(), "contour", "'contour'"),
        (lambda o: circline.NoiseModel().camera, "k2", "'k2'"),
    ],
)
def test_a_misspelt_attribute_is_named(part, wrong, said):
    value = part(scenes.observations())
    with pytest.raises(AttributeError, match=said):
        setattr(value, wrong, 3)
    assert not hasattr(value, wrong)


def test_states_an_error_that_holds():
    chi2 = []
    for seed in range(20):
        observations = circline.fit(
            scenes.observations(seed=seed), noise_model=circline.NoiseModel.exact()
        )
        best = circline.estimate(
            observations, noise_model=circline.NoiseModel.exact(), conic_loss="trivial",
            line_loss="trivial",
        ).hypotheses[0]
        assert best.covariance.shape == (6, 6) and best.rank == 6
        error = best.circles[0].center - scenes.TRANSLATION
        chi2.append(error @ np.linalg.solve(best.covariance[3:, 3:], error))
    # 60 degrees of freedom: 0.1 % on either side.
    assert 30.3 < sum(chi2) < 99.6


def test_a_circle_alone_has_two_poses():
    observations = scenes.observations()
    observations.pencils = []
    estimate = circline.estimate(circline.fit(observations))
    assert len(estimate.hypotheses) == 2
    best = estimate.hypotheses[0]
    assert best.rotation_is_free and best.free_directions.shape == (1, 6)
    assert np.isinf(best.sigma_rotation).any()


def test_says_what_is_missing():
    with pytest.raises(circline.Refused, match="circle|pencil|evidence"):
        circline.estimate(circline.Observations(camera=scenes.camera()))


@pytest.mark.parametrize(
    "spoil, said",
    [
        (lambda o: setattr(o.circles[0], "points", np.zeros((3, 3))), "shape \\(N, 2\\)"),
        (lambda o: setattr(o.circles[0], "points", "rim"), "not an array"),
        (lambda o: setattr(o.circles[0], "sigma_px", "much"), "sigma_px cannot be"),
        (lambda o: setattr(o.pencils[0], "direction", "up"), "x, y, z or free"),
        (lambda o: setattr(o.camera, "fx", -1.0), "focal"),
        (lambda o: setattr(o.pencils[1], "id", "x"), "'x'"),
        (
            lambda o: setattr(o, "known_angles", [circline.KnownAngle(("x", "y"), 90.0)]),
            "radians",
        ),
    ],
)
def test_wrong_input_is_a_value_error(spoil, said):
    observations = scenes.observations()
    spoil(observations)
    with pytest.raises(ValueError, match=said):
        circline.fit(observations)


def test_wrong_options_are_named():
    observations = scenes.observations()
    with pytest.raises(ValueError, match="max_iterations"):
        circline.estimate(observations, max_iterations=0)
    with pytest.raises(ValueError, match="no loss"):
        circline.estimate(observations, conic_loss="hubert")
    with pytest.raises(TypeError):
        circline.estimate(observations, losses="huber")
    with pytest.raises(TypeError, match="focal"):
        circline.Camera(focal=3.0)


def test_a_pose_without_a_rotation_is_refused():
    turned = scenes.rotation()
    circline.CameraPose(turned.astype(np.float32), [0, 0, 1])
    for wrong in (turned @ np.diag([1, 1, -1]), 1.01 * turned, np.full((3, 3), np.nan)):
        with pytest.raises(ValueError, match="rotation must be a rotation"):
            circline.CameraPose(wrong, [0, 0, 1])
    with pytest.raises(ValueError, match="translation finite"):
        circline.CameraPose(turned, [0, 0, np.inf])


def test_results_are_views_that_keep_their_owner():
    observations = circline.fit(scenes.observations())
    best = circline.estimate(observations).hypotheses[0]
    rotation, covariance = best.cam_from_world.rotation, best.covariance
    assert rotation.base is not None and not rotation.flags.writeable
    assert not covariance.flags.writeable
    kept = rotation.copy()
    del best
    gc.collect()
    np.testing.assert_array_equal(rotation, kept)
    with pytest.raises(ValueError):
        rotation[0, 0] = 2.0


def test_detects_in_photos_of_any_layout():
    photo = scenes.disc_photo()
    found = circline.detect(photo, scenes.photo_camera())
    assert len(found.circles) == 1
    contour = np.asarray(found.circles[0].points)
    distance = np.hypot((contour[:, 0] - 330) / 120, (contour[:, 1] - 250) / 70)
    np.testing.assert_allclose(distance, 1.0, atol=0.01)
    # A part of a larger array, rows apart; and one whose pixels lie apart, which is copied.
    wide = np.zeros((480, 700), np.uint8)
    wide[:, :640] = photo
    for same in (wide[:, :640], np.asfortranarray(photo), np.dstack([photo] * 3)):
        again = circline.detect(same, scenes.photo_camera())
        np.testing.assert_allclose(again.circles[0].points, contour, atol=0.05)
    in_box = circline.detect_circle(photo, scenes.photo_camera(), (180, 150, 300, 200))
    np.testing.assert_allclose(in_box.points, contour, atol=0.05)


def test_detects_without_copying_the_photo():
    """numpy tells tracemalloc what arrays it makes."""

    def largest(photo: np.ndarray) -> int:
        tracemalloc.start()
        circline.detect(photo, scenes.photo_camera())
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    photo = scenes.disc_photo()
    wide = np.zeros((480, 700), np.uint8)
    wide[:, :640] = photo
    assert max(largest(photo), largest(wide[:, :640])) < photo.nbytes / 2
    assert largest(np.asfortranarray(photo)) >= photo.nbytes  # Its rows are not packed.


def test_wrong_photos_are_named():
    for photo in (np.zeros((4, 4)), np.zeros((0, 0), np.uint8), np.zeros((4, 4, 2), np.uint8)):
        with pytest.raises(ValueError, match="image"):
            circline.detect(photo, scenes.photo_camera())


def test_fits_leave_outliers_out():
    observations = scenes.observations()
    points = np.array(observations.circles[0].points)
    points[::5] += 25.0
    observations.circles[0].points = points
    problems: list = []
    fitted = circline.fit(observations, problems=problems)
    inliers = np.asarray(fitted.circles[0].inliers, bool)
    assert not inliers[::5].any() and inliers.sum() > 75
    assert fitted.circles[0].fit.conic.shape == (3, 3)
    assert observations.circles[0].fit is None  # The one given is as it was.


def test_calibrates_there_and_back():
    camera = scenes.camera()
    pixels = np.array([[100.0, 200.0], [640.0, 480.0], [1e9, 0.0]])
    rays = camera.calibrate(pixels)
    assert np.isnan(rays[2]).all()
    back = camera.project(np.column_stack([rays[:2], np.ones(2)]))
    np.testing.assert_allclose(back, pixels[:2], atol=1e-8)


def test_cameras_of_results_are_copies():
    observations = circline.fit(scenes.observations())
    sigma = circline.CameraSigma(log_focal=0.25)
    best = circline.estimate(observations, camera_sigma=sigma).hypotheses[0]
    refined = best.camera.fx
    best.camera.fx = 1.0
    assert best.camera.fx == refined > 1.0


def test_a_pinhole_camera_with_distortion_is_refused():
    camera = circline.Camera(fx=600, fy=600, cx=320, cy=240, distortion=[-0.2])
    with pytest.raises(ValueError, match="pinhole camera has no distortion"):
        circline.detect(scenes.disc_photo(), camera)
    with pytest.raises(ValueError, match="'fish' is not one of pinhole, opencv, fisheye"):
        circline.Camera(model="fish")


def stubs_of(kind: type) -> dict:
    """Classes or functions of the module's stubs, by name."""
    with open(os.path.join(os.path.dirname(circline.__file__), "_circline.pyi")) as file:
        parsed = ast.parse(file.read()).body
    return {node.name: node for node in parsed if isinstance(node, kind)}


def test_stubs_name_the_parameters_of_functions():
    """Which stubtest cannot see: pybind11 writes signatures into docstrings."""
    for name, stub in stubs_of(ast.FunctionDef).items():
        signature = getattr(circline, name).__doc__.splitlines()[0]
        stated = [parameter.arg for parameter in stub.args.args + stub.args.kwonlyargs]
        assert stated == re.findall(r"(\w+): ", signature), name
        assert bool(stub.args.kwonlyargs) == ("*, " in signature), name


def test_stubs_name_the_keywords_of_constructors():
    """Which stubtest cannot see: pybind11 knows them as **kwargs."""
    stubs = stubs_of(ast.ClassDef)
    for made in (circline.Camera, circline.CameraSigma, circline.NoiseModel):
        (constructor,) = (
            node for node in stubs[made.__name__].body if getattr(node, "name", "") == "__init__"
        )
        settable = {name for name, field in vars(made).items() if getattr(field, "fset", None)}
        assert {keyword.arg for keyword in constructor.args.kwonlyargs} == settable


def test_adjusts_many_photos():
    photos = [
        scenes.observations(seed=k, tilt=0.7 * np.cos(k), turn=1.3 * k) for k in range(5)
    ]
    for photo in photos:  # A guess of the camera, 5 % off.
        photo.camera.fx = photo.camera.fy = 1050.0
    steps = []
    adjusted = circline.adjust(
        map(circline.fit, photos),
        camera_sigma={"cam0": circline.CameraSigma(log_focal=0.25, principal_point_px=20)},
        progress=lambda *step: steps.append(step),
    )
    assert steps[-1] == ("poses", 5, 5)
    for photo in adjusted.photos:
        assert photo.residuals.shape[1] == 4 and len(photo.residuals) > 100
        sums = (photo.residuals[:, 2:] ** 2).sum()
        assert abs(np.sqrt(sums / len(photo.residuals)) - photo.rms_px) < 0.2 * photo.rms_px
    assert all(photo.ok for photo in adjusted.photos) and len(adjusted.photos) == 5
    assert adjusted.photos[0].covariance.shape == (6, 6)
    (camera,) = adjusted.cameras
    assert camera.covariance.shape == (12, 12) and camera.num_photos == 5
    assert abs(camera.camera.fx - 1000.0) < 4 * camera.sigma_focal_px
    assert 0 < camera.sigma_focal_px < 20


def test_adjusts_photos_of_given_poses():
    photos = [scenes.observations(seed=k, tilt=0.7 * np.cos(k), turn=1.3 * k) for k in range(5)]
    photos = [circline.fit(photo) for photo in photos]
    alone = circline.adjust(photos, rigid="yes")
    assert alone.given is None and alone.directions
    assert abs(np.linalg.norm(alone.directions[0].direction) - 1.0) < 1e-9
    counts, sigmas = zip(*alone.cameras[0].sigma_by_photos)
    assert counts == (1, 2, 4, 5) and sigmas[0] > sigmas[-1] > 0
    given = [
        circline.CameraPose(p.cam_from_world.rotation, 3.0 * p.cam_from_world.translation)
        for p in alone.photos
    ]
    adjusted = circline.adjust(photos, given_poses=[*given[:4], None])
    assert [photo.ok for photo in adjusted.photos] == [True] * 4 + [False]
    frame = adjusted.given
    assert frame.rotation.shape == (3, 3) and frame.translation.shape == (3,)
    seen, world = given[1], adjusted.photos[1].cam_from_world
    rotation = world.rotation @ frame.rotation.T
    assert np.allclose(rotation, seen.rotation, atol=0.01)
    translation = frame.scale * world.translation - rotation @ frame.translation
    assert np.allclose(translation, seen.translation, atol=0.02 * frame.scale)


def test_what_progress_raises_ends_adjust():
    def interrupt(what, done, total):
        raise KeyboardInterrupt(what)

    with pytest.raises(KeyboardInterrupt):
        circline.adjust([circline.fit(scenes.observations(seed=k)) for k in range(3)],
                        num_threads=2, progress=interrupt)


def test_adjust_names_wrong_input():
    with pytest.raises((circline.Refused, ValueError)):
        circline.adjust([])
    with pytest.raises(ValueError, match="rigid"):
        circline.adjust([scenes.observations()], rigid="perhaps")
    with pytest.raises(ValueError, match="no photo has a camera 'cam1', only 'cam0'"):
        circline.adjust([scenes.observations()], camera_sigma={"cam1": circline.CameraSigma()})


def test_simulates_the_paper():
    rows = circline.simulate(trials=4, noise_px=[1.0])
    assert {row["method"] for row in rows} >= {"circle_frame", "line_pairs", "joint"}
    assert all(row["trials"] == 4 for row in rows)


def test_lets_other_threads_run():
    """While one thread computes, Python runs on in another."""
    photo, camera = np.tile(scenes.disc_photo(), (3, 3)), scenes.photo_camera()
    camera.width, camera.height = photo.shape[1], photo.shape[0]
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    started = time.perf_counter()
    circline.detect(photo, camera)
    ended = time.perf_counter()
    done.set()
    ticker.join()
    assert sum(started < t < ended for t in ticks) >= 3


def test_threads_answer_as_one():
    """Detections and estimates of four threads at once are those of one, in all bits."""
    photo, camera = scenes.disc_photo(), scenes.photo_camera()

    def answer():
        hypotheses = circline.estimate(circline.detect(photo, camera)).hypotheses
        return [(h.covariance.tobytes(), h.cam_from_world.rotation.tobytes()) for h in hypotheses]

    alone, together = answer(), []
    threads = [
        threading.Thread(target=lambda: together.extend(answer() for _ in range(3)))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(alone) > 0 and together == [alone] * 12
