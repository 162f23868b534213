#!/usr/bin/env bash
# tests/packages.sh: the Debian packages, built in build/package, in a bare bookworm chroot: installed
# by apt, both as docs/guide/first_pose.md says, every example built and run against them, every
# command of the documentation run, and removed. Needs root, debootstrap and a mirror; some ten
# minutes. tests/run.sh --full runs it; exit code 77: not root.
#
#   tests/packages.sh [--keep]      --keep: leaves the chroot, build/chroot, as it is at the end
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh

[ "$(id -u)" -eq 0 ] || { echo "skipped: only root can make a chroot"; exit 77; }
install_packages "${BUILD_PACKAGES[@]}" help2man debootstrap dpkg-dev fakeroot pybind11-dev python3-dev python3-numpy
# The two commands of the guide, which README.md has, too.
mapfile -t install < <(awk '/^## / { road = $2 } road == "Install" && /^    / { print substr($0, 5) }' docs/guide/first_pose.md)
for command in "${install[@]}"; do
  grep -qF "    $command" README.md || fail "README.md does not say: $command"
done
rm -f build/package/*.deb
say "${install[0]} (log: build/package.log)"
CIRCLINE_WERROR=${CIRCLINE_WERROR:-OFF}
quietly build/package-configure.log cmake --preset package -DCIRCLINE_WERROR="$CIRCLINE_WERROR"
quietly build/package.log bash -c "${install[0]}"
packages=(build/package/*.deb)
say "made ${packages[*]##*/}"

chroot_dir=$PWD/build/chroot
rm -rf "$chroot_dir"
say "making a chroot (log: build/chroot.log)"
quietly build/chroot.log debootstrap --variant=minbase bookworm "$chroot_dir"
# Of the caller's settings none that would have the compiler called by another program.
inside() {
  chroot "$chroot_dir" env -u CMAKE_CXX_COMPILER_LAUNCHER DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"
}
# What the host knows of mirrors, the chroot needs, too.
for settings in apt.conf.d sources.list.d sources.list; do
  [ ! -e "/etc/apt/$settings" ] || cp -rL "/etc/apt/$settings" "$chroot_dir/etc/apt/"
done
quietly build/chroot-update.log inside apt-get update
before=$(inside find / -xdev -name '*circline*')
mkdir -p "$chroot_dir/source/build/package"
cp "${packages[@]}" "$chroot_dir/source/build/package"
cp -r docs tests apps README.md CONTRIBUTING.md "$chroot_dir/source"
find_folder visp-images-data /usr/share/visp-images-data/ViSP-images
cp -r "$found/mire-2" "$chroot_dir/source/frames"
echo 'APT::Get::Assume-Yes "true"; APT::Install-Recommends "false";' > "$chroot_dir/etc/apt/apt.conf.d/99test"
quietly build/chroot-install.log inside sh -c "cd /source && ${install[1]}"

say "what the packages hold"
inside circline_compare --version
inside sh -c 'zcat /usr/share/man/man1/circline_compare.1.gz | grep -q "list_solvers"'
inside python3 -c 'import circline; print("circline", circline.__version__)'
needed=$(inside sh -c 'ldd /usr/bin/circline_compare | grep circline')
grep -qE 'libcircline_refine\.so\.[0-9]+ => (/usr)?/lib/' <<< "$needed" || fail "not its own libraries: $needed"
libraries=("$chroot_dir"/usr/lib/*/libcircline_*.so.*.*.*)
[ ${#libraries[@]} -eq 4 ] || fail "libraries: ${libraries[*]}"
cmake -D "libraries=$(IFS=';'; echo "${libraries[*]}")" -D nm=nm -P tests/exports.cmake
for file in "$chroot_dir/usr/bin/circline_compare" "$chroot_dir"/usr/lib/python3/dist-packages/circline/_circline*.so; do
  dynamic=$(objdump -p "$file")
  ! grep -qE 'RUNPATH|RPATH' <<< "$dynamic" || fail "$file has an RPATH"
done

say "examples against the packages"
quietly build/chroot-tools.log inside apt-get install -y --no-install-recommends g++ make cmake ninja-build pkg-config
quietly build/chroot-pytest.log inside sh -c '
  apt-get install -y --no-install-recommends python3-pytest python3-matplotlib &&
  cd /source && python3 -m pytest -q -p no:cacheprovider tests/python'
quietly build/chroot-commands.log inside sh -c '
  cd /source && tests/first_pose.sh /tmp/first_pose /usr /usr/lib/python3/dist-packages /usr/bin/python3 &&
  tests/commands.sh /tmp/commands /usr'
tail -n 5 build/chroot-commands.log
quietly build/chroot-consumer.log inside sh -c '
  cmake -S /source/tests/consumer -B /tmp/consumer -G Ninja -DCMAKE_BUILD_TYPE=Release -DCIRCLINE_FRAMES=/source/frames &&
  cmake --build /tmp/consumer && ctest --test-dir /tmp/consumer --output-on-failure'
! grep -F '***Skipped' build/chroot-consumer.log || fail "not all examples ran"


say "removing the packages"
rm -rf "$chroot_dir/source" "$chroot_dir"/tmp/*
quietly build/chroot-remove.log inside sh -c 'apt-get purge -y "libcircline*" circline-tools python3-circline'
after=$(inside find / -xdev -name '*circline*' -not -path "/var/lib/dpkg/*")
[ "$before" = "$after" ] || fail "left behind: $after"
[ "${1:-}" = --keep ] || rm -rf "$chroot_dir"
say "installed, used and removed without a trace"
