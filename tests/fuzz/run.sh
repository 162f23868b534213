#!/usr/bin/env bash
# tests/fuzz/run.sh <seconds> [<target>...]: builds the fuzz targets (of tests/fuzz/<target>_fuzz.cc) with libFuzzer, clang,
# AddressSanitizer and UBSan in build/fuzz and runs each for so long on one core; prints how often, how fast, and what
# was found. What was found, and the corpus that grew, stay in build/fuzz/<target>. Exit code 1 if anything was found.
set -euo pipefail
cd "$(dirname "$0")/../.."
. cmake/setup.sh
[[ ${1:-} =~ ^[0-9]+$ ]] || fail "usage: tests/fuzz/run.sh <seconds> [<target>...]"
seconds=$1
shift
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  for file in tests/fuzz/*_fuzz.cc; do targets+=("$(basename "$file" _fuzz.cc)"); done
fi
programs=("${targets[@]/#/circline_}")
install_packages "${BUILD_PACKAGES[@]}" clang libclang-rt-dev
build fuzz "${programs[@]/%/_fuzz}"

found=0
echo "| target | executions | a second | found |"
echo "| --- | --- | --- | --- |"
for target in "${targets[@]}"; do
  folder=build/fuzz/$target said=nothing corpora=("build/fuzz/$target/corpus")
  [ ! -d "tests/fuzz/seeds/$target" ] || corpora+=("tests/fuzz/seeds/$target")
  mkdir -p "$folder"/{corpus,artifacts}
  build/fuzz/bin/circline_"$target"_fuzz -max_total_time="$seconds" -print_final_stats=1 -timeout=60 -rss_limit_mb=4096 \
    -artifact_prefix="$folder/artifacts/" "${corpora[@]}" > "$folder/log" 2>&1 ||
    { said="see $folder/log" found=1; }
  runs=$(sed -nE 's/^stat::number_of_executed_units: +([0-9]+)$/\1/p' "$folder/log")
  echo "| $target | ${runs:-?} | $((${runs:-0} / (seconds > 0 ? seconds : 1))) | $said |"
done
exit "$found"
