# bash completion for turbidock: subcommands and options from its own help.
_turbidock() {
  local current=${COMP_WORDS[COMP_CWORD]} words=""
  if [[ $COMP_CWORD -eq 1 ]]; then
    words=$(turbidock --help 2>/dev/null | sed -n '/^Subcommands:/,$s/^  \([a-z-]*\) .*/\1/p')
  elif [[ $current == -* ]]; then
    words=$(turbidock "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE '^ +(-[a-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+')
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _turbidock turbidock
