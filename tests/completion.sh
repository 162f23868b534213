#!/usr/bin/env bash
# tests/completion.sh <program>: whether bash completes its flags and the files that they name.
set -euo pipefail
cd "$(dirname "$0")/.."
. cmake/completion.bash

# completions <words...>: what bash would offer for the last one.
completions() {
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _circline "$1"
  printf '%s\n' "${COMPREPLY[@]}"
}
expect() { [ "$1" = "$2" ] || { echo "completed to '$1', not '$2'" >&2; exit 1; }; }

expect "$(completions "$1" --noise_p)" "--noise_px="
expect "$(completions "$1" --outlier_ | tr '\n' ' ')" "--outlier_kind= --outlier_ratio= "
expect "$(completions "$1" --output = READ)" "README.md"
expect "$(completions "$1" --no_such_flag)" ""
