#!/usr/bin/env bash
# Shows circline on real photographs, on Debian 12: installs the packages that are missing, builds in
# build/release, fetches the photographs (they come with two Debian packages), runs circline_compare
# on the four sets described in apps/demo/*.yaml, circline_reconstruct on one photograph and
# circline_calibrate on photographs of which nothing is known. The results are in build/demo.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh

# compare <set> <folder>: copies the photographs that the scene file names next to a copy of it, so
# that build/demo/<set> can be opened, changed and run again by hand.
compare() {
  local set=$1 folder=$2 dir=build/demo/$1 file
  mkdir -p "$dir"
  cp "apps/demo/$set.yaml" "$dir/scene.yaml"
  sed -nE 's/.*file: "([^"]+)".*/\1/p' "$dir/scene.yaml" | while read -r file; do
    if [ -f "$folder/$file" ]; then
      cp "$folder/$file" "$dir/$file"
    elif [ -f "$folder/$file.gz" ]; then
      gunzip -c "$folder/$file.gz" > "$dir/$file"
    else
      fail "no $file in $folder"
    fi
  done
  echo
  say "$set: $(sed -n '3s/^# //p' "$dir/scene.yaml")"
  build/release/bin/circline_compare --scene="$dir/scene.yaml" --output="$dir/out"
}

install_packages "${BUILD_PACKAGES[@]}"
build release circline_compare circline_reconstruct circline_calibrate

find_folder opencv-doc /usr/share/doc/opencv-doc/examples/data
compare chessboard "$found"
find_folder visp-images-data /usr/share/visp-images-data/ViSP-images
compare disc "$found/mire-2"
compare box "$found/mire-2"
compare dots "$found/calibration"

echo
say "disc: a model of the plate, with measurements, from one photograph"
build/release/bin/circline_reconstruct --scene=build/demo/disc/scene.yaml --image=image.0007.pgm \
  --output=build/demo/disc/model
cat build/demo/disc/model/measurements.csv

for side in left right; do
  echo
  say "calibration: the $side camera of the chessboards, neither its lens nor the board known"
  build/release/bin/circline_calibrate --images="build/demo/chessboard/$side*.jpg" \
    --output="build/demo/calibration/$side"
  grep -A 3 'id: "'"$side"'"' build/demo/chessboard/scene.yaml | grep -o 'camera_matrix: [^]]*]' |
    sed 's/^/  by OpenCV, from the known board: /'
done

echo
say "the reports, with a picture of every photograph:"
for set in chessboard disc box dots; do
  echo "  $PWD/build/demo/$set/out/report.html"
done
for side in left right; do
  echo "  $PWD/build/demo/calibration/$side/report.html"
done
