#!/usr/bin/env bash
# tests/commands.sh <folder> <prefix> [mpi]: runs every command of circline's programs that README.md and docs show, those
# that are indented, in the folder, against the installation: on photos of a sheet of discs that are made here under the
# names that the commands have. Simulations are cut short, the studio is stopped once it has answered. Then
# the array of jobs of docs/clusters.md, by a stand-in for Slurm. With `mpi` that page's commands of MPI instead, with
# as many processes as it says on whatever cores are there. Commands of other programs are not run here: a list below
# says what runs them, and one that is not in it fails.
set -euo pipefail
tests=$(cd "$(dirname "$0")" && pwd)
top=$tests/..
rm -rf "$1" && mkdir -p "$1"/{photos,frames,more,set,sparse/0,build/demo} && cd "$1"
PATH="$2/bin:$PATH"

# photo <tilt> <turn>: 4 x 3 black discs of radius 0.1, 0.3 apart, a unit ahead; the camera of disc_calibration.yml.
photo() {
  awk -v a="$1" -v b="$2" 'BEGIN {
    ca = cos(a); sa = sin(a); cb = cos(b); sb = sin(b)
    print "P2\n640 480\n255"
    for (v = 0; v < 480; ++v) for (u = 0; u < 640; ++u) {
      # The ray in the frame of the sheet, whose origin is at (0, 0, 1.6).
      x = (u - 320) / 600; y = (v - 240) / 600
      X = cb * x - sb * (sa * y + ca); Y = ca * y - sa; Z = sb * x + cb * (sa * y + ca)
      oX = 1.6 * sb * ca; oY = 1.6 * sa; oZ = -1.6 * cb * ca
      s = -oZ / Z; px = oX + s * X; py = oY + s * Y
      i = int((px + 0.6) / 0.3); j = int((py + 0.45) / 0.3)
      grey = 210
      if (px > -0.6 && px < 0.6 && py > -0.45 && py < 0.45) {
        d = sqrt((px + 0.45 - 0.3 * i) ^ 2 + (py + 0.3 - 0.3 * j) ^ 2) - 0.1
        grey = 40 + 170 / (1 + exp(-d * 600))
      }
      print int(grey)
    }
  }'
}
# Programs go by what is in a file, not by the end of its name.
photo 0.5 0.1 > photos/img01.jpg
photo -0.4 0.3 > photos/img02.jpg
photo 0.1 -0.5 > photos/img03.jpg
for k in 0 1 2 3 4; do
  photo 0.4 "0.0$k" > "frames/$k.png"
done
cp photos/* more
cp photos/img01.jpg photo.pgm
cp "$tests/disc_calibration.yml" calib.yml
circline_calibrate --images=photos --output=made > said.txt 2>&1
cp made/scene.yaml set/scene.yaml
sed -i 's,"file": "[^"]*/,"file": ",' set/scene.yaml
cp photos/* set
ln -s ../../set build/demo/disc
{ echo 'YUV4MPEG2 W640 H480 F25:1 Ip A1:1 Cmono'
  for k in 0 1 2 3 4; do
    echo FRAME
    tail -n +4 "frames/$k.png" | LC_ALL=C awk '{ printf "%c", $1 + 0 }'
  done
} > walk.mp4
circline_compare --images=photos --camera=calib.yml --output=model --export_as=colmap > said.txt 2>&1
find model -name '*.txt' -exec cp {} sparse/0 \;
for k in 0 1; do
  circline_compare --scene=set/scene.yaml --shard=$k/2 --output="shard$k" > said.txt 2>&1
done
mkdir -p out && cp -r shard0 out/shard-0
export SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_COUNT=2 SLURM_CPUS_PER_TASK=1

# shown <first words>: the commands that begin with one of them.
shown() {
  awk -v words="$1" '/^```/ { fenced = !fenced }
       !fenced && /^    / { line = line substr($0, 5)
         if (sub(/\\$/, "", line)) next
         if (line ~ "^(" words ") ") print line }
       { line = "" }' "$top/README.md" "$top/CONTRIBUTING.md" "$top"/docs/*.md "$top"/docs/guide/*.md
}
words='circline_[a-z]+|python3 -c|/usr/bin/time'
[ "${3:-}" != mpi ] || words='mpirun|srun'
shown "$words" > shown.txt
shown '[^ ]*/[^ ]+|apt|apt-get|cmake|ctest|g[+][+]|python3|[A-Z_]+=[^ ]+ .*' > others.txt
while read -r command; do
  case $command in
    "python3 -c"* | /usr/bin/time*) ;;  # Here.
    apps/demo.sh* | tests/run.sh* | .ci/run* | ctest* | apps/benchmark/photographs.py* | apps/benchmark/peers.py*) ;;  # .ci/run
    apt-get* | "cmake --preset release -DCIRCLINE_WITH_"*) ;;                                   # .ci/run
    "cmake --workflow --preset package" | "apt install ./build/package/"*) ;;                   # tests/packages.sh
    "python3 -m venv"*) ;;                                                                      # tests/pip.sh
    tests/fuzz/run.sh* | tests/threads.sh* | *apps/benchmark/boxes.py*) ;;                     # tests/run.sh --full
    *first_pose* | */pose* | "python3 photo_to_pose.py"*) ;;                                    # tests/first_pose.sh
    *) echo "run by no test: $command" && exit 1 ;;
  esac
done < others.txt
run=0
while read -r command; do
  command=$(sed -E 's/ +# .*//; s/ \[[^]]*\]//g' <<< "$command")
  echo "\$ $command"
  rm -rf out
  status=0
  case $command in
    circline_simulate*) command+=" --trials=2" ;;
    python3*) command=/usr/bin/${command//1178/80} ;;  # A small photo, else the same.
    /usr/bin/time*) command=${command#*-v } ;;
    circline_studio*) command="timeout 5 $command --port=0" ;;
    mpirun*) command=${command/--map-by slot:PE=4/--oversubscribe} ;;
    srun*) command=$(sed -E 's/srun --ntasks=([0-9]+) .*--mpi=pmix/mpirun --oversubscribe -np \1/' <<< "$command") ;;
  esac
  timeout 240 bash -o pipefail -ec "$command" > said.txt 2>&1 < /dev/null || status=$?
  case $command in
    /usr/bin/python3*) ;;
    *circline_studio*) [ "$status" -eq 124 ] && grep -q http://127.0.0.1: said.txt && status=0 ;;
    *) [ "$status" -ne 0 ] || [ -n "$(find out -type f -size +0)" ] || { echo "nothing in out"; exit 1; } ;;
  esac
  [ "$status" -eq 0 ] || { cat said.txt; echo "exit code $status"; exit 1; }
  run=$((run + 1))
done < shown.txt
if [ "${3:-}" = mpi ]; then
  [ "$run" -ge 2 ]
else
  [ "$run" -ge 25 ]
  mkdir bin
  cat > bin/sbatch <<'END'
#!/usr/bin/env bash
# Stands in for Slurm: runs a command, or an array of jobs one after the other, now.
for argument; do
  case $argument in
    --wrap=*) exec bash -c "${argument#--wrap=}" ;;
    --*) ;;
    *) script=$argument ;;
  esac
done
last=$(sed -nE 's/^#SBATCH --array=0-([0-9]+)$/\1/p' "$script")
for k in $(seq 0 "$last"); do
  SLURM_ARRAY_TASK_ID=$k SLURM_ARRAY_TASK_COUNT=$((last + 1)) bash -e "$script" >&2
done
echo 1
END
  chmod +x bin/sbatch
  page=$top/docs/clusters.md
  sed -n '/^    #!\/bin\/bash/,/--resume$/s/^    //p' "$page" > compare.sbatch
  sed -nE '/^    (job=|sbatch )/s/^    //p' "$page" > array.sh
  rm -rf out
  PATH="$PWD/bin:$PATH" bash -eu array.sh > said.txt 2>&1 || { cat said.txt; exit 1; }
  circline_compare --scene=set/scene.yaml --output=whole > said.txt 2>&1
  cmp whole/results.jsonl out/all/results.jsonl
  run=$((run + 2))
fi
echo "$run commands"
