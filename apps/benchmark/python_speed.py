#!/usr/bin/python3
"""What Python costs: estimate() on 300 points beside the same call in C++, and detection in two
threads beside one, and beside two processes, which share no lock.

  apps/benchmark/python_speed.py [BUILD]      BUILD: build/release, built with -DCIRCLINE_BUILD_PYTHON=ON

Times are of the processor for the first, of the wall for the second, which needs two idle cores;
beside processes it does not, as other programs slow both alike. All are measured in turn.
"""

import concurrent.futures
import json
import multiprocessing
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
PHOTO, CAMERA = scenes.disc_photo(), scenes.photo_camera()


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


def detect(photos: int) -> None:
    for _ in range(photos):
        circline.detect(PHOTO, CAMERA)


def seconds_of_detection(num_threads: int, photos: int = 24) -> float:
    """Of `photos` photos, shared out to the threads."""
    def work() -> None:
        global waits
        before = resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw
        detect(photos // num_threads)
        waits += resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw - before

    threads = [threading.Thread(target=work) for _ in range(num_threads)]
    started = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return time.perf_counter() - started


def seconds_of_processes(pool: concurrent.futures.Executor, photos: int = 24) -> float:
    started = time.perf_counter()
    list(pool.map(detect, [photos // 2, photos // 2]))
    return time.perf_counter() - started


def main() -> None:
    rounds = 5  # In turn, so that what else the machine does falls on both.
    pairs = sorted((python_microseconds(), cpp_microseconds()) for _ in range(rounds))
    ratios = sorted(p / c for p, c in pairs)
    python, cpp = pairs[rounds // 2]
    print(f"estimate, 300 points: Python {python:.0f} us, C++ {cpp:.0f} us, "
          f"ratio {ratios[rounds // 2]:.2f} (median of {rounds})")
    context = multiprocessing.get_context("fork")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        seconds_of_processes(pool)
        seconds = [(seconds_of_detection(1), seconds_of_detection(2), seconds_of_processes(pool))
                   for _ in range(rounds)]
    speed_up = sorted(one / two for one, two, _ in seconds)[rounds // 2]
    beside = sorted(processes / two for _, two, processes in seconds)[rounds // 2]
    print(f"detection, two threads: {speed_up:.2f} x one, {beside:.2f} x two processes; {waits} waits in "
          f"{2 * 24 * rounds} photos")


if __name__ == "__main__":
    main()
