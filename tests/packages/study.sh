# SPDX-License-Identifier: Apache-2.0
# Sourced by the tests of the job scripts: what it means that two runs of a study are equal.

# same_study WHOLE CUT KILLS: one table, the same bytes of every file of a drape, and stores that are merged
# from four parts of each and hold the same rows as one import of the undisturbed study. Of a killed
# run a temporary file may be left per kill, and its lock.
same_study() {
  local whole=$1 cut=$2 side part table stores=$work/stores
  cmp "$whole/study.csv" "$cut/study.csv"
  diff -rq -x sheet.run.json -x '*.lock' -x lock -x parts -x '*.tmp*' "$whole" "$cut"
  [ "$(find "$cut" -name '*.tmp*' | wc -l)" -le "$3" ]
  rm -rf "$stores"
  mkdir "$stores"
  for side in whole cut; do
    for part in 0-3 4-7 89ab c-f; do
      local folders=("${!side}"/[$part]?)
      [ -d "${folders[0]}" ] || continue
      drape-results import "${folders[@]}" --apart --store "$stores/$side-$part.sqlite" --quiet
    done
    drape-results merge "$stores/$side"-*.sqlite --store "$stores/$side.sqlite" --quiet
  done
  drape-results import "$whole" --apart --store "$stores/one.sqlite" --quiet
  for side in whole cut one; do
    for table in fabric sheet gap simulation; do
      drape-results sql "SELECT * FROM $table ORDER BY 1" --csv --store "$stores/$side.sqlite"
    done >"$stores/$side.csv"
  done
  cmp "$stores/one.csv" "$stores/cut.csv"
  cmp "$stores/whole.sqlite" "$stores/cut.sqlite"
  drape-results sql "SELECT count(*) AS n FROM simulation" --csv --store "$stores/cut.sqlite" | tail -n 1 >"$stores/rows"
  [ "$(cat "$stores/rows")" = "$(($(wc -l <"$cut/study.csv") - 1))" ]
}

# A random pause below $1 milliseconds.
pause() { sleep "$(awk -v ms=$((RANDOM * 32768 + RANDOM)) -v most="$1" 'BEGIN {print ms % most / 1000}')"; }

# So that kills strike again when all is done, half of what is there is taken away.
take_half_away() { find "$1" -name sheet.run.json | sort | awk 'NR % 2' | xargs -r rm -f; }
