#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# manuals.sh OUT BIN PROGRAM...: manual pages (OUT/man1/*.1.gz) and the bash completion (OUT/completions/drape)
# of the programs in BIN, from what they declare themselves.
set -euo pipefail
out=$1 bin=$2
shift 2
rm -rf "$out"
mkdir -p "$out/man1" "$out/completions"

page() { "${@:2}" --help-man | gzip -9n >"$out/man1/$1.1.gz"; }

# table KEY COMMAND...: its --help-words as entries of a bash array.
table() {
  local key=$1 where words
  while IFS=$'\t' read -r where words; do
    [ "$where" = . ] && where=$key || where=$key:$where
    printf "  ['%s']='%s'\n" "$where" "$words"
  done < <("${@:2}" --help-words)
}

own=() commands=()
for program in "$@"; do
  page "$program" "$bin/$program"
  [ "$program" = drape ] || commands+=("${program#drape-}")
done
mapfile -t own < <("$bin/drape" --help-words)
for command in "${own[@]}"; do page "drape-$command" "$bin/drape" "$command"; done
{
  printf '# bash completion of drapebench, made from the declarations of its programs\n'
  printf 'declare -gA _drape_words=(\n'
  printf "  ['drape']='%s --help --version'\n" "${own[*]} import ${commands[*]}"
  for command in "${own[@]}"; do table "$command" "$bin/drape" "$command"; done
  for command in "${commands[@]}"; do table "$command" "$bin/drape-$command"; done
  printf ')\n'
  cat "$(dirname "${BASH_SOURCE[0]}")/completion.bash"
} >"$out/completions/drape"
