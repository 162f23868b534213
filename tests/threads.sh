#!/usr/bin/env bash
# tests/threads.sh: what runs in several threads, built with ThreadSanitizer (clang) in build/threads: estimates and
# trackers at once, AdjustPhotos in three threads, the tests of the programs, the studio among them, and those of the
# Python module. Some minutes; tests/run.sh --full runs it. Not 0 for a race; threads.supp names what is left to other
# libraries.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh
install_packages "${BUILD_PACKAGES[@]}" clang libclang-rt-dev python3-dev pybind11-dev \
  python3-numpy python3-pytest
cmake --preset threads -DCIRCLINE_BUILD_PYTHON=ON -DPython_EXECUTABLE=/usr/bin/python3 > build/threads-configure.log
build threads circline_{refine_test,apps_test,compare,calibrate,track,reconstruct,simulate,studio,python}
export TSAN_OPTIONS="suppressions=$PWD/tests/threads.supp"
CIRCLINE_SOAK_CALLS=2000 build/threads/bin/circline_refine_test --gtest_filter='Threads.*:ParallelFor.*:AdjustPhotos.SameBits*'
# ThreadSanitizer's own memory is beyond any limit.
build/threads/bin/circline_apps_test --gtest_filter='-*Memory*:ComparePeers.*'
# Clang's library ends programs that it is loaded before (Debian 12); gcc's answers the same calls.
LD_PRELOAD=$(readlink -f "$(g++ -print-file-name=libtsan.so)") PYTHONPATH=build/threads/python PYTHONDONTWRITEBYTECODE=1 \
  /usr/bin/python3 -m pytest -q -p no:cacheprovider tests/python
