# SPDX-License-Identifier: Apache-2.0
_drape() {
  local word all offered=() files=() current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} key=${1##*/} at=1
  if [[ $key == drape ]]; then
    if ((COMP_CWORD == 1)); then
      mapfile -t COMPREPLY < <(compgen -W "${_drape_words[drape]}" -- "$current")
      return
    fi
    key=${COMP_WORDS[1]} at=2
    [[ $key == import ]] && key=capture:import
  fi
  key=${key#drape-}
  local program=$key
  for (( ; at < COMP_CWORD; at++)); do
    [[ ${COMP_WORDS[at]} != -* && -v _drape_words["$program:${COMP_WORDS[at]}"] ]] &&
      key=$program:${COMP_WORDS[at]}
  done
  if [[ $before == -* && -v _drape_words["$program:$before"] ]]; then
    offered=(${_drape_words["$program:$before"]})
  else
    all=${_drape_words["$program"]-}
    [[ $key == "$program" ]] || all+=" ${_drape_words["$key"]-}"
    for word in $all; do
      # A subcommand stands once; options are offered where one was begun.
      [[ $word == -* && $current == -* || $word != -* && $key == "$program" ]] && offered+=("$word")
    done
    [[ $current == -* ]] || mapfile -t files < <(compgen -f -- "$current")
  fi
  mapfile -t COMPREPLY < <(compgen -W "${offered[*]}" -- "$current")
  COMPREPLY+=("${files[@]}")
}
complete -o filenames -F _drape drape
