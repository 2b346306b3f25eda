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

# commands_of NAME COMMAND...: prints its subcommands and theirs, named "import", "print cloth".
commands_of() {
  local name=$1 sub
  shift
  # Only names in the list begin in the third column.
  for sub in $("$@" --help | sed -n '/^Subcommands:/,$s/^  \([a-z-]\+\) .*/\1/p'); do
    "$@" "$sub" --help | awk -v kind=command -v name="${name:+$name }$sub" -f "$here/help.awk"
    commands_of "${name:+$name }$sub" "$@" "$sub"
  done
}

# make KEY NAME COMMAND...: writes the page NAME, and entries of a bash array: KEY, its options and
# subcommands; KEY:SUBCOMMAND, its options and subcommands; KEY:OPTION, its allowed values.
make() {
  local key=$1 name=$2
  shift 2
  { "$@" --help | awk -v kind=program -v name="$name" -f "$here/help.awk"
    commands_of "" "$@"; } >"$out/tables/$name"
  awk -v version="$(cited version)" -v date="$(cited date-released)" -f "$here/manual.awk" "$out/tables/$name" |
    gzip -9n >"$out/man1/$name.1.gz"
  [ "$name" = drape ] || awk -F '\t' -v key="$key" -v typed=" ${typed[*]} " '
    # A command of drape itself starts a separate key.
    function key_of(path) { return index(typed, " " top " ") ? path : key ":" path }
    $1 == "program" { where = key }
    $1 == "command" {
      top = $2
      sub(/ .*/, "", top)
      gsub(/ /, ":", $2)
      where = key_of($2)
      above = key
      if ($2 ~ /:/) { above = $2; sub(/:[^:]*$/, "", above); above = key_of(above) }
      sub(/.*:/, "", $2)
      words[above] = words[above] " " $2
    }
    $1 == "option" && $5 !~ /positional/ {
      gsub(/,/, " ", $2)
      words[where] = words[where] " " $2
      count = split($2, names, " ")
      if ($3 ~ /^\{.*\}$/) for (i = 1; i <= count; ++i) {
        values = substr($3, 2, length($3) - 2)
        gsub(/,/, " ", values)
        words[where ":" names[i]] = values
      }
    }
    END { for (w in words) printf "  [\x27%s\x27]=\x27%s\x27\n", w, words[w] }' "$out/tables/$name" |
    sort >>"$out/words"
}

# The words before the arguments in the list of commands.
read -ra typed < <("$bin/drape" --help | awk '/^  [a-z]/ {
  sub(/^  /, "")
  sub(/  .*/, "")
  count = split($0, parts, ", ")
  for (i = 1; i <= count; ++i) { sub(/ .*/, "", parts[i]); if (!seen[parts[i]]++) printf "%s ", parts[i] }
} END { print "" }')
for program in "$@"; do make "${program#drape-}" "$program" "$bin/$program"; done
for command in run check new; do make $command drape-$command "$bin/drape" $command; done
make calib:images drape-calib-images "$bin/drape" calib images
{
  printf '# bash completion of drapebench, made from the --help of its programs\n'
  printf 'declare -gA _drape_words=(\n'
  printf "  ['drape']='%s --help --version'\n" "${typed[*]}"
  cat "$out/words"
  printf ')\n'
  cat "$here/completion.bash"
} >"$out/completions/drape"
rm -r "$out/tables" "$out/words"
