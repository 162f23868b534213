# shellcheck shell=bash
# What tests/run.sh, apps/demo.sh and .ci/run have in common; sourced by them in the top folder.

# Debian packages: what builds circline, its apps, tests and benchmarks.
# shellcheck disable=SC2034
BUILD_PACKAGES=(g++ cmake ninja-build libeigen3-dev libceres-dev libopencv-dev libgoogle-glog-dev
                libgflags-dev nlohmann-json3-dev libgtest-dev libbenchmark-dev)

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
