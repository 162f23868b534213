#!/usr/bin/env bash
# tests/compilers.sh: builds the four libraries, shared and warnings as errors, with each compiler,
# language standard and build type, in build/compilers, and prints a table of what came of it. Several
# files are compiled as one. 45 minutes on two cores; tests/run.sh --full runs it. Exit code 1 if one
# did not build.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh
install_packages "${BUILD_PACKAGES[@]}" g++-12 clang-14 clang-19

failed=0
echo "| compiler | C++17, Release | C++17, Debug | C++20, Release | C++20, Debug |"
echo "| --- | --- | --- | --- | --- |"
for compiler in g++-12 clang++-14 clang++-19; do
  row="| $compiler ($("$compiler" -dumpfullversion 2> /dev/null || "$compiler" -dumpversion)) |"
  for standard in 17 20; do
    for type in Release Debug; do
      folder=build/compilers/$compiler-$standard-$type said=built
      mkdir -p "$folder"
      { cmake -S . -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_STANDARD=$standard \
          -DCMAKE_BUILD_TYPE=$type -DCIRCLINE_WERROR=ON -DBUILD_SHARED_LIBS=ON \
          -DCMAKE_SHARED_LINKER_FLAGS=-Wl,-z,defs -DCIRCLINE_BUILD_APPS=OFF -DCIRCLINE_BUILD_TESTS=OFF \
          -DCIRCLINE_BUILD_BENCHMARKS=OFF -DCMAKE_UNITY_BUILD=ON -DCIRCLINE_PRECOMPILE=ON &&
        cmake --build "$folder"; } > "$folder.log" 2>&1 || { said="failed: $folder.log"; failed=1; }
      row+=" $said |"
    done
  done
  echo "$row"
done
exit "$failed"
