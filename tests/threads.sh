#!/usr/bin/env bash
# tests/threads.sh: what runs in several threads, built with ThreadSanitizer (clang) in build/threads: estimates and
# trackers at once, AdjustPhotos in three threads. Some minutes; tests/run.sh --full runs it.
# Exit code 1 for a race.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh
install_packages "${BUILD_PACKAGES[@]}" clang libclang-rt-dev
build threads circline_refine_test
CIRCLINE_SOAK_CALLS=2000 build/threads/bin/circline_refine_test --gtest_filter='Threads.*:ParallelFor.*:AdjustPhotos.SameBits*'
