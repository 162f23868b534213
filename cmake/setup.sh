# shellcheck shell=bash
# What tests/run.sh, apps/demo.sh, apps/gallery.sh and .ci/run have in common; sourced by them in the top folder.

# Debian packages: what builds circline, its apps, tests and benchmarks.
# shellcheck disable=SC2034
BUILD_PACKAGES=(g++ cmake ninja-build libeigen3-dev libceres-dev libopencv-dev libgoogle-glog-dev
                libgflags-dev nlohmann-json3-dev libexif-dev libjpeg-dev libcpp-httplib-dev libtinygltf-dev libyaml-dev libtinyxml2-dev pkg-config
                libgtest-dev libbenchmark-dev)

say() { echo "circline: $*"; }
fail() { echo "circline: $*" >&2; exit 1; }

# quietly <log> <command...>: the command's output goes to the log, and to the screen if it fails.
quietly() {
  local log=$1
  shift
  mkdir -p "$(dirname "$log")"
  "$@" > "$log" 2>&1 || { tail -n 60 "$log" >&2; fail "failed (all of it: $log): $*"; }
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  else
    command -v sudo > /dev/null || fail "not root and no sudo; run as root: $*"
    sudo "$@"
  fi
}

# Without this the tools of a minimal system ask questions, or cannot be found by a plain user.
apt() { as_root env DEBIAN_FRONTEND=noninteractive apt-get -q "$@"; }

# install_packages <packages...>: installs the missing ones; does nothing where there are none.
install_packages() {
  local package missing=()
  command -v dpkg-query > /dev/null || { say "not a Debian system: not looking for $*"; return; }
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2> /dev/null | grep -qx installed ||
      missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  say "installing ${missing[*]}"
  quietly build/apt-update.log apt update
  quietly build/apt-install.log apt install -y --no-install-recommends "${missing[@]}"
}

# build <preset> [targets...]: configures and builds into build/<preset>. Warnings are shown, and
# are errors where the environment says CIRCLINE_WERROR=ON.
build() {
  local preset=$1
  shift
  say "building in build/$preset"
  quietly "build/$preset-configure.log" cmake --preset "$preset" \
    -DCIRCLINE_WERROR="${CIRCLINE_WERROR:-OFF}"
  cmake --build "build/$preset" --target "${@:-all}" -j "$(nproc)" -- --quiet
}

# find_folder <package> <folder>: sets `found` to where the package's folder is: in the system if the
# package is installed with all of its files (minimal systems leave out documentation), else unpacked
# below build/, so that half a gigabyte of documentation does not become part of the user's system.
find_folder() {
  local package=$1 folder=$2 unpacked=build/packages/$1
  found=$folder
  [ ! -d "$found" ] || return 0
  found=$unpacked$folder
  [ ! -d "$found" ] || return 0
  say "fetching the photographs of the Debian package $package"
  rm -rf "$unpacked"
  mkdir -p "$unpacked"
  quietly "$unpacked.log" download "$package" "$unpacked"
  dpkg-deb --fsys-tarfile "$unpacked"/*.deb | tar -x -C "$unpacked" ".$folder"
  rm "$unpacked"/*.deb
  [ -d "$found" ] || fail "the package $package has no folder $folder"
}

# lay_out <set>: puts the scene file apps/demo/<set>.yaml and the photographs that it names into
# build/demo/<set>, to be opened, changed and run again by hand.
lay_out() {
  local set=$1 dir=build/demo/$1 file from
  case $set in
    chessboard) find_folder opencv-doc /usr/share/doc/opencv-doc/examples/data ;;
    *) find_folder visp-images-data /usr/share/visp-images-data/ViSP-images ;;
  esac
  mkdir -p "$dir"
  cp "apps/demo/$set.yaml" "$dir/scene.yaml"
  sed -nE 's/.*file: "([^"]+)".*/\1/p' "$dir/scene.yaml" | while read -r file; do
    # Of ViSP's images each kind has a folder of its own.
    for from in "$found" "$found/mire-2" "$found/mbt/cube" "$found/calibration" "$found/mbt-depth/Castle-simu/Images"; do
      [ ! -f "$from/$file" ] || { cp "$from/$file" "$dir/$file"; break; }
      [ ! -f "$from/$file.gz" ] || { gunzip -c "$from/$file.gz" > "$dir/$file"; break; }
    done
    [ -f "$dir/$file" ] || fail "no $file in $found"
  done
}

# download <package> <folder>; a fresh system has no package lists yet.
download() {
  (cd "$2" && apt-get -q download "$1") || { apt update && (cd "$2" && apt-get -q download "$1"); }
}
