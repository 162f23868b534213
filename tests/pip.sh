#!/usr/bin/env bash
# tests/pip.sh: the Python package by pip in a virtual environment, as README.md has it, and its tests
# there; in build/pip. It compiles the libraries: some minutes; tests/run.sh --full runs it.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/setup.sh
install_packages "${BUILD_PACKAGES[@]}" pybind11-dev python3-dev python3-numpy python3-setuptools python3-wheel \
  python3-venv python3-pytest python3-pil python3-matplotlib

rm -rf build/pip/venv
say "installing by pip (log: build/pip/install.log)"
command=$(sed -nE 's/^    (python3 -m venv .*pip install.*)/\1/p' README.md | sed 's,venv &&,build/pip/venv \&\&,; s,venv/bin,build/pip/venv/bin,')
CIRCLINE_BUILD_DIR=$PWD/build/pip/build quietly build/pip/install.log bash -c "PATH=/usr/bin:\$PATH; $command"
# Not the package of the system, nor that of another build.
unset PYTHONPATH
where=$(build/pip/venv/bin/python -c 'import circline; print(circline.__file__)')
[[ $where == "$PWD"/build/pip/venv/* ]] || fail "imports $where"
build/pip/venv/bin/python -m pytest -q -p no:cacheprovider tests/python
