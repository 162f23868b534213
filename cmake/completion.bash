# bash completion for circline's programs: their flags, as --help lists them, and files after a `=`.
_circline() {
  local word=${COMP_WORDS[COMP_CWORD]} IFS=$'\n'
  # Bash takes a flag, its `=` and its value for three words.
  [ "$word" != "=" ] || word=
  COMPREPLY=()
  if [ "${COMP_WORDS[COMP_CWORD - 1]}" = "=" ] || [ "${COMP_WORDS[COMP_CWORD]}" = "=" ]; then
    compopt -o filenames 2> /dev/null
    COMPREPLY=($(compgen -f -- "$word"))
  elif [[ $word == -* ]]; then
    compopt -o nospace 2> /dev/null
    COMPREPLY=($(compgen -W "$("$1" --help 2> /dev/null | sed -nE 's/^  (--[a-z0-9_]+)( \(.*)?$/\1=/p')" -- "$word"))
  fi
}
# It is installed under the name of each program, by which bash finds it.
complete -F _circline "${BASH_SOURCE[0]##*/}"
