#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# manuals.sh OUT BIN PROGRAM...: manual pages (OUT/man1/*.1.gz) and the bash completion
# (OUT/completions/drape) of the programs in BIN, from their --help.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$1 bin=$2
shift 2
rm -rf "$out"
mkdir -p "$out/man1" "$out/completions" "$out/tables"
cited() { sed -n "s/^$1: *//p" "$here/../CITATION.cff"; }

# table NAME COMMAND...: what the program and its subcommands declare, once, into a file.
table() {
  local name=$1 sub
  shift
  "$@" --help >"$out/help"
  awk -v kind=program -v name="$name" -f "$here/help.awk" "$out/help"
  # Only a name in the list begins in the third column.
  for sub in $(sed -n '/^Subcommands:/,$s/^  \([a-z-]\+\) .*/\1/p' "$out/help"); do
    "$@" "$sub" --help | awk -v kind=command -v name="$sub" -f "$here/help.awk"
  done
}

# make KEY NAME COMMAND...: the page NAME, and entries of a bash array: KEY, its options and
# subcommands; KEY:SUBCOMMAND, its options; KEY:OPTION, the values that it takes from a list.
make() {
  local key=$1 name=$2
  shift 2
  table "$name" "$@" >"$out/tables/$name"
  awk -v version="$(cited version)" -v date="$(cited date-released)" -f "$here/manual.awk" "$out/tables/$name" |
    gzip -9n >"$out/man1/$name.1.gz"
  [ "$name" = drape ] || awk -F '\t' -v key="$key" '
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
    END { for (w in words) printf "  [\x27%s\x27]=\x27%s\x27\n", w, words[w] }' "$out/tables/$name" |
    sort >>"$out/words"
}

commands=()
for program in "$@"; do
  make "${program#drape-}" "$program" "$bin/$program"
  [ "$program" = drape ] || commands+=("${program#drape-}")
done
# The commands that are no program: those with an argument, but `import`, which is capture's, and
# `bench`, which is.
for command in $("$bin/drape" --help | sed -n '/^commands/,/^$/s/^  \([a-z-]\+\) [A-Z].*/\1/p'); do
  [ "$command" = bench ] && continue
  [ "$command" = import ] || make "$command" "drape-$command" "$bin/drape" "$command"
  commands+=("$command")
done
{
  printf '# bash completion of drapebench, made from the --help of its programs\n'
  printf 'declare -gA _drape_words=(\n'
  printf "  ['drape']='%s --help --version'\n" "${commands[*]}"
  cat "$out/words"
  printf ')\n'
  cat "$here/completion.bash"
} >"$out/completions/drape"
rm -r "$out/tables" "$out/help" "$out/words"
