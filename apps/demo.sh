#!/usr/bin/env bash
# Shows circline on real photographs, on Debian 12: installs the packages that are missing, builds in
# build/release, fetches the photographs (they come with two Debian packages), runs circline_compare
# on the six sets described in apps/demo/*.yaml, circline_reconstruct on one photograph,
# circline_track on a hundred frames of a video and circline_calibrate on photographs of which nothing
# is known. The results are in build/demo.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh

# compare <set>
compare() {
  local dir=build/demo/$1
  lay_out "$1"
  echo
  say "$1: $(sed -n '3s/^# //p' "$dir/scene.yaml")"
  build/release/bin/circline_compare --scene="$dir/scene.yaml" --output="$dir/out"
}

# track <folder>: the first hundred frames of a video in which a camera moves about the disc's plate.
track() {
  local dir=build/demo/track file
  mkdir -p "$dir/frames"
  for file in "$1"/image.00*; do
    case $file in
      *.gz) gunzip -c "$file" > "$dir/frames/$(basename "$file" .gz)" ;;
      *) cp "$file" "$dir/frames" ;;
    esac
  done
  # The camera of apps/demo/disc.yaml, as OpenCV's calibration files have it.
  { echo '%YAML:1.0'; echo '---'
    sed -n '/id: "cam0"/,/}/p' apps/demo/disc.yaml | tr -d '\n' |
      sed -E 's/.*width: ([0-9]+), height: ([0-9]+),/image_width: \1\nimage_height: \2\n/; s/ *(camera_matrix: [^]]*]), */\1\n/; s/ *distortion(: [^]]*]).*/distortion_coefficients\1\n/'
  } > "$dir/camera.yml"
  build/release/bin/circline_track --images="$dir/frames/*.pgm" --camera="$dir/camera.yml" \
    --output="$dir/out" --video_out=overlays.mp4
}

install_packages "${BUILD_PACKAGES[@]}"
build release circline_compare circline_reconstruct circline_calibrate circline_track circline_studio

for set in chessboard disc box dots; do
  compare "$set"
done

echo
say "track: a hundred frames about the disc, everything detected and followed"
find_folder visp-images-data /usr/share/visp-images-data/ViSP-images
track "$found/mire-2"

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
echo "  $PWD/build/demo/track/out/report.html"
for side in left right; do
  echo "  $PWD/build/demo/calibration/$side/report.html"
done

echo
say "next, to click for yourself: a page on this machine that shows the pose of what you click"
echo "  build/release/bin/circline_studio --images=build/demo/disc --camera=build/demo/track/camera.yml"
