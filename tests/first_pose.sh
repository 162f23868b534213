#!/usr/bin/env bash
# tests/first_pose.sh <folder> <prefix> [<python path> <python>]: runs the commands of docs/guide/first_pose.md,
# those that are indented, in the folder, with a photo and a calibration made here, against the
# installation, which packages.sh makes by the page's first commands. Without a Python path those of
# Python are left out. On each of the four roads there are fewer than five, the installation's included.
set -euo pipefail
tests=$(cd "$(dirname "$0")" && pwd)
docs=$tests/../docs
rm -rf "$1" && mkdir -p "$1" && cd "$1"
export PATH="$2/bin:$PATH" CMAKE_PREFIX_PATH="$2" PYTHONPATH="${3:-}"
PKG_CONFIG_PATH=$(find "$2"/lib* -name pkgconfig -printf '%p:')
export PKG_CONFIG_PATH
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

# ask <address> <request>: of the studio; a plain one, or the JSON that is posted.
ask() {
  exec 3<> "/dev/tcp/127.0.0.1/$1"
  if [ -z "${3:-}" ]; then
    printf 'GET %s HTTP/1.0\r\nHost: 127.0.0.1:%s\r\n\r\n' "$2" "$1" >&3
  else
    printf 'POST %s HTTP/1.0\r\nHost: 127.0.0.1:%s\r\nContent-Type: application/json\r\nContent-Length: %s\r\n\r\n%s' \
      "$2" "$1" "${#3}" "$3" >&3
  fi
  cat <&3
}

# The page is there, and the pose of what is found on the photo.
studio() {
  local pid port k status=0
  bash -c "exec $1 --port=0" > studio.txt 2>&1 &
  pid=$!
  for ((k = 0; k < 100; ++k)); do
    ! grep -q http://127 studio.txt || break
    sleep 0.1
  done
  port=$(sed -nE 's,.*http://127.0.0.1:([0-9]+)/.*,\1,p' studio.txt)
  ask "$port" / | grep -qi '<html' && ask "$port" /api/images | grep -q photo.pgm &&
    ask "$port" /api/estimate '{"image": "photo.pgm", "scene": {}}' > said.txt || status=$?
  kill "$pid"
  return "$status"
}

# By a file: a bare chroot has no /dev/fd.
awk '/^## / { road = substr($0, 4) } /^```/ { fenced = !fenced }
     !fenced && /^    / { print road ":" substr($0, 5) }' "$docs/guide/first_pose.md" > shown.txt
declare -A commands=()
run=0
while IFS=: read -r road command; do
  commands[$road]=$((${commands[$road]:-0} + 1))
  [ "$road" != Install ] || continue
  case "$command" in
    python3*) [ -n "${3:-}" ] || continue ;;
  esac
  echo "\$ $command"
  # None may wait for somebody; what takes longest is a build.
  case "$command" in
    circline_studio*) studio "$command" ;;
    *) timeout 240 bash -o pipefail -ec "$command" > said.txt < /dev/null ;;
  esac || { status=$?; cat said.txt; echo "exit code $status (124: not done in 240 s)"; exit 1; }
  run=$((run + 1))
  # Every road ends in the two poses of a circle.
  case "$command" in
    circline_compare*) [ "$(grep -c '"probability":0.5' out/results.jsonl)" -ge 2 ] || { cat out/results.jsonl; exit 1; } ;;
    circline_studio*) [ "$(grep -o '"num_hypotheses":2,"probability":0.[45]' said.txt | wc -l)" -ge 2 ] || { head -c 2000 said.txt; exit 1; } ;;
    *photo.pgm*) [ "$(grep -c 'probability 0.50' said.txt)" -eq 2 ] || { cat said.txt; exit 1; } ;;
  esac
done < shown.txt
[ "$run" -ge 7 ]
for road in "From the command line" "In Python" "In C++" "On a page"; do
  count=$((${commands[$road]:-99} + commands[Install]))
  echo "$road: $count commands"
  [ "$count" -lt 5 ] || exit 1
done
