# SPDX-License-Identifier: Apache-2.0
_drape() {
  local word all offered=() files=() current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} key=${1##*/} at=1
  if [[ $key == drape ]]; then
    if ((COMP_CWORD == 1)); then
      mapfile -t COMPREPLY < <(compgen -W "${_drape_words[drape]}" -- "$current")
      return
    fi
    key=${COMP_WORDS[1]} at=2
  fi
  key=${key#drape-}
  local program=$key
  for (( ; at < COMP_CWORD; at++)); do
    [[ ${COMP_WORDS[at]} != -* && -v _drape_words["$key:${COMP_WORDS[at]}"] ]] && key=$key:${COMP_WORDS[at]}
  done
  all=${_drape_words["$key"]-}
  # A subcommand that does not list the common options takes those of its program.
  [[ " $all " == *" --json "* ]] || for word in ${_drape_words["$program"]-}; do
    [[ $word == -* ]] && all+=" $word"
  done
  for word in "$key:$before" "$program:$before"; do
    [[ $before == -* && ${#offered[@]} == 0 && -v _drape_words["$word"] ]] && offered=(${_drape_words["$word"]})
  done
  if ((${#offered[@]} == 0)); then
    for word in $all; do
      # Options are offered where one was begun.
      [[ $word == -* && $current == -* || $word != -* ]] && offered+=("$word")
    done
    [[ $current == -* ]] || mapfile -t files < <(compgen -f -- "$current")
  fi
  mapfile -t COMPREPLY < <(compgen -W "${offered[*]}" -- "$current")
  COMPREPLY+=("${files[@]}")
}
complete -o filenames -F _drape drape
