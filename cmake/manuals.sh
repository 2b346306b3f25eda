#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# manuals.sh OUT BIN PROGRAM...: manual pages (OUT/man1/*.1.gz) and the bash completion
# (OUT/completions/drape) of the programs in BIN, from what they declare themselves.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$1 bin=$2
shift 2
rm -rf "$out"
mkdir -p "$out/man1" "$out/completions"
cited() { sed -n "s/^$1: *//p" "$here/../CITATION.cff"; }

# page NAME COMMAND...
page() {
  "${@:2}" --help-declarations |
    awk -v version="$(cited version)" -v date="$(cited date-released)" -f "$here/manual.awk" |
    gzip -9n >"$out/man1/$1.1.gz"
}

# words KEY COMMAND...: entries of a bash array: KEY, its options and subcommands; KEY:SUBCOMMAND, its
# options; KEY:OPTION, the values that it takes, where it takes one of a list.
words() {
  "${@:2}" --help-declarations | awk -F '\t' -v key="$1" '
    $1 == "program" { where = key }
    $1 == "command" { where = key ":" $2; words[key] = words[key] " " $2 }
    $1 == "option" && $5 !~ /positional/ {
      gsub(/,/, " ", $2)
      words[where] = words[where] " " $2
      count = split($2, names, " ")
      if ($3 ~ /^\{.*\}$/) for (i = 1; i <= count; ++i) {
        values = substr($3, 2, length($3) - 2)
        gsub(/,/, " ", values)
        words[key ":" names[i]] = values
      }
    }
    END { for (w in words) printf "  [\x27%s\x27]=\x27%s\x27\n", w, words[w] }' | sort
}

commands=()
for program in "$@"; do
  page "$program" "$bin/$program"
  [ "$program" = drape ] || commands+=("${program#drape-}")
done
mapfile -t own < <("$bin/drape" --help-declarations | sed -n 's/^own\t//p')
for command in "${own[@]}"; do page "drape-$command" "$bin/drape" "$command"; done
{
  printf '# bash completion of drapebench, made from the declarations of its programs\n'
  printf 'declare -gA _drape_words=(\n'
  printf "  ['drape']='%s --help --version'\n" "${own[*]} import ${commands[*]}"
  for command in "${own[@]}"; do words "$command" "$bin/drape" "$command"; done
  for command in "${commands[@]}"; do words "$command" "$bin/drape-$command"; done
  printf ')\n'
  cat "$here/completion.bash"
} >"$out/completions/drape"
