#!/usr/bin/env bash
# Runs all tests of circline on Debian 12: installs the packages that are missing, builds in
# build/release, runs the tests, installs into a temporary prefix and builds a user of the installed
# package. The last line is `N passed, N failed`; the exit code is 0 if none failed.
#
#   tests/run.sh              the tests
#   tests/run.sh --sanitize   the same under AddressSanitizer and UBSan, built with clang in
#                             build/sanitize; few trials where many serve a statistic only, and no
#                             installed package
#   tests/run.sh --full       the same with long draws where a statistic or a search for rare cases
#                             takes a sample else, the Debian packages in a bare chroot (as root),
#                             the Python package by pip, the table of compilers, ThreadSanitizer, and
#                             ten minutes of each fuzz target; three hours more
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh

preset=release longest_s=1500
packages=("${BUILD_PACKAGES[@]}")
case "$*" in
  "") ;;
  --sanitize) preset=sanitize packages+=(clang libclang-rt-dev) ;;
  --full)
    export CIRCLINE_AMBIGUITY_SCENES=20000 CIRCLINE_PENCIL_SCENES=100000
    export CIRCLINE_PROPERTY_SCENES=10000000 CIRCLINE_FUZZ_CALLS=50000000
    export CIRCLINE_FOCAL_SCENES=100000 CIRCLINE_SOAK_CALLS=1000000 CIRCLINE_TRACK_FRAMES=100000
    export CIRCLINE_STREAMED_PHOTOS=100000
    longest_s=7200
    ;;
  *) fail "usage: tests/run.sh [--sanitize | --full]" ;;
esac

install_packages "${packages[@]}"
build "$preset"

log=build/$preset-tests.log
say "running the tests (log: $log)"
ctest --test-dir "build/$preset" -j "$(nproc)" --timeout "$longest_s" --output-on-failure > "$log" 2>&1 || true

# Whatever is neither a start nor a success: the failures with their output.
if ! grep -q '^100% tests passed' "$log"; then
  grep -vE '^ *(Start +[0-9]+:|[0-9]+/[0-9]+ Test .*( Passed |\*\*\*Skipped ))' "$log" || true
fi
skipped=$(grep -cF '***Skipped' "$log" || true)
# Tests of the installed package are ctest's own, inside one of ours: theirs are in its output.
inside=$(grep -F '***Skipped' "build/$preset/Testing/Temporary/LastTest.log" | grep -c 'Test *#' || true)
[ "$((skipped + inside))" -eq 0 ] ||
  say "$((skipped + inside)) tests skipped: what they need is not on this machine"

# "97% tests passed, 3 tests failed out of 100"
read -r failed total < <(sed -nE 's/^[0-9]+% tests passed, ([0-9]+) tests failed out of ([0-9]+)$/\1 \2/p' "$log") || true
[ -n "${total:-}" ] || { cat "$log" >&2; fail "no tests were run"; }

# That it runs; what of the boxes' sizes falls short is in what it prints.
boxes() {
  [ -d ../shared/data ] || return 77
  /usr/bin/python3 apps/benchmark/boxes.py ../shared/data --output=build/boxes | tee build/boxes.log || true
  tail -n 1 build/boxes.log | grep -qE '^[0-9]+ passed'
}

if [ "$*" = --full ]; then
  for script in tests/packages.sh tests/pip.sh tests/compilers.sh tests/threads.sh boxes "tests/fuzz/run.sh 600"; do
    status=0
    $script || status=$?
    total=$((total + 1))
    case $status in
      0) ;;
      77) skipped=$((skipped + 1)) && say "$script skipped" ;;
      *) failed=$((failed + 1)) ;;
    esac
  done
fi
echo "$((total - skipped - failed)) passed, $failed failed"
[ "$failed" -eq 0 ]
