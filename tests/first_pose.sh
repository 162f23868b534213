#!/usr/bin/env bash
# tests/first_pose.sh <folder> <prefix> [<python path> <python>]: runs the commands of docs/guide/first_pose.md,
# those that are indented, in the folder, with a photo and a calibration made here, against the
# installation. Without a Python path those of Python are left out.
set -euo pipefail
tests=$(cd "$(dirname "$0")" && pwd)
docs=$tests/../docs
rm -rf "$1" && mkdir -p "$1" && cd "$1"
export PATH="$2/bin:$PATH" CMAKE_PREFIX_PATH="$2" PYTHONPATH="${3:-}"
[ -z "${4:-}" ] || { mkdir bin && ln -s "$4" bin/python3 && PATH="$PWD/bin:$PATH"; }
cp -r "$docs/examples/first_pose" "$docs/examples/python/photo_to_pose.py" .

# A bright disc seen obliquely, with soft edges.
awk 'BEGIN {
  print "P2\n640 480\n255"
  for (y = 0; y < 480; ++y) for (x = 0; x < 640; ++x) {
    inside = (1 - sqrt(((x - 330) / 120) ^ 2 + ((y - 250) / 70) ^ 2)) * 80
    print int(60 + 140 / (1 + exp(-2 * (inside > 300 ? 300 : inside < -300 ? -300 : inside))))
  }
}' > photo.pgm
cp "$tests/disc_calibration.yml" calib.yml

run=0
while read -r command; do
  case "$command" in
    python3*) [ -n "${3:-}" ] || continue ;;
  esac
  echo "\$ $command"
  # None may wait for somebody; what takes longest is a build.
  timeout 240 bash -o pipefail -ec "$command" > said.txt < /dev/null ||
    { status=$?; cat said.txt; echo "exit code $status (124: not done in 240 s)"; exit 1; }
  run=$((run + 1))
  # Every road ends in the two poses of a circle.
  case "$command" in
    circline_*) ;;
    *photo.pgm*) [ "$(grep -c 'probability 0.50' said.txt)" -eq 2 ] || { cat said.txt; exit 1; } ;;
  esac
done < <(awk '/^```/ { fenced = !fenced } !fenced && /^    / { print substr($0, 5) }' "$docs/guide/first_pose.md")
[ "$(grep -c '"probability":0.5' out/results.jsonl)" -ge 2 ] || { cat out/results.jsonl; exit 1; }
[ "$run" -ge 4 ]
