#!/usr/bin/python3
"""What Python costs: estimate() on 300 points beside the same call in C++, and detection in two
threads beside one.

  apps/benchmark/python_speed.py [BUILD]      BUILD: build/release, built with -DCIRCLINE_BUILD_PYTHON=ON

Times are of the processor for the first, of the wall for the second, which needs two idle cores.
"""

import json
import pathlib
import resource
import subprocess
import sys
import threading
import time

BUILD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/release").resolve()
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(BUILD / "python"), str(HERE / "../../tests/python")]

import numpy as np  # noqa: E402
import scenes  # noqa: E402

import circline  # noqa: E402

CPP_ROW = "BM_EstimatePoseCircleAndLinesUnfitted"  # refine_benchmark.cc: the same scenes and calls.
NUM_SCENES = 16


def cpp_microseconds() -> float:
    out = subprocess.run(
        [BUILD / "bin/circline_benchmark", f"--benchmark_filter={CPP_ROW}$", "--benchmark_format=json"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return json.loads(out)["benchmarks"][0]["cpu_time"] / 1e3


def observed_scenes() -> list:
    """As AddPaperLike of refine_benchmark.cc draws them."""
    rng = np.random.default_rng(1)
    observed = []
    for seed in range(NUM_SCENES):
        tilt, turn = rng.uniform(0.5, 0.9), rng.uniform(-0.5, 0.5)
        observations = scenes.observations(seed=seed, tilt=tilt, turn=turn)
        observations.circles[0].radius = 0.0
        observed.append(observations)
    return observed


def python_microseconds() -> float:
    observed = observed_scenes()
    for observations in observed:
        circline.estimate(observations)
    runs = 30
    started = time.process_time()
    for _ in range(runs):
        for observations in observed:
            circline.estimate(observations)
    return (time.process_time() - started) / runs / NUM_SCENES * 1e6


waits = 0  # How often a thread has let go of the processor of itself: for the other's lock.


def seconds_of_detection(num_threads: int, photos: int = 24) -> float:
    """Of `photos` photos, shared out to the threads."""
    photo, camera = scenes.disc_photo(), scenes.photo_camera()

    def work() -> None:
        global waits
        before = resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw
        for _ in range(photos // num_threads):
            circline.detect(photo, camera)
        waits += resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw - before

    threads = [threading.Thread(target=work) for _ in range(num_threads)]
    started = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return time.perf_counter() - started


def main() -> None:
    rounds = 5  # In turn, so that what else the machine does falls on both.
    pairs = sorted((python_microseconds(), cpp_microseconds()) for _ in range(rounds))
    ratios = sorted(p / c for p, c in pairs)
    python, cpp = pairs[rounds // 2]
    print(f"estimate, 300 points: Python {python:.0f} us, C++ {cpp:.0f} us, "
          f"ratio {ratios[rounds // 2]:.2f} (median of {rounds})")
    speed_ups = sorted(seconds_of_detection(1) / seconds_of_detection(2) for _ in range(rounds))
    print(f"detection, two threads: {speed_ups[rounds // 2]:.2f} x one; {waits} waits in "
          f"{2 * 24 * rounds} photos")


if __name__ == "__main__":
    main()
