#!/usr/bin/env bash
# tests/threads.sh: what runs in several threads, built with ThreadSanitizer (clang) in build/threads: estimates and
# trackers at once, AdjustPhotos in three threads, and the tests of the programs, the studio among them. Some minutes;
# tests/run.sh --full runs it. Exit code 1 for a race; threads.supp names what is left to other libraries.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh
install_packages "${BUILD_PACKAGES[@]}" clang libclang-rt-dev
build threads circline_{refine_test,apps_test,compare,calibrate,track,reconstruct,simulate,studio}
export TSAN_OPTIONS="suppressions=$PWD/tests/threads.supp"
CIRCLINE_SOAK_CALLS=2000 build/threads/bin/circline_refine_test --gtest_filter='Threads.*:ParallelFor.*:AdjustPhotos.SameBits*'
# ThreadSanitizer's own memory is beyond any limit.
build/threads/bin/circline_apps_test --gtest_filter='-*Memory*:ComparePeers.*'
