#!/usr/bin/env bash
# Makes the pictures of docs/photographs.md anew, and what that page says was found: fetches the
# photographs (they come with two Debian packages), runs circline_compare on them with a field of
# view of 60 degrees. What a person sees in them stays as it is written there.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh

install_packages "${BUILD_PACKAGES[@]}" python3-opencv
build release circline_compare
folders=()
find_folder opencv-doc /usr/share/doc/opencv-doc/examples/data
folders+=("$found")
find_folder python3-skimage /usr/lib/python3/dist-packages/skimage/data
folders+=("$found")
/usr/bin/python3 apps/gallery.py build/gallery "${folders[@]}"
