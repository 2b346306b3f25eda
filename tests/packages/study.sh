# SPDX-License-Identifier: Apache-2.0
# Sourced by the tests of the job scripts: compares two runs of a study.

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
    mv "${!side}" "$stores/study" # a store holds where its sheets lay
    for part in 0-3 4-7 89ab c-f; do
      local folders=("$stores/study"/[$part]?)
      [ -d "${folders[0]}" ] || continue
      drape-results import "${folders[@]}" --apart --store "$stores/$side-$part.sqlite" --quiet
    done
    drape-results merge "$stores/$side"-*.sqlite --store "$stores/$side.sqlite" --quiet
    mv "$stores/study" "${!side}"
  done
  drape-results import "$whole" --apart --store "$stores/one.sqlite" --quiet
  for side in whole cut one; do
    for table in fabric sheet gap simulation; do
      drape-results sql "SELECT * FROM $table ORDER BY 1" --csv --quiet --store "$stores/$side.sqlite"
    done >"$stores/$side.csv"
  done
  cmp "$stores/one.csv" "$stores/cut.csv"
  cmp "$stores/whole.sqlite" "$stores/cut.sqlite"
  drape-results sql "SELECT count(*) AS n FROM simulation" --csv --quiet --store "$stores/cut.sqlite" | tail -n 1 >"$stores/rows"
  [ "$(cat "$stores/rows")" = "$(($(wc -l <"$cut/study.csv") - 1))" ]
}

# begin PLAN CUT KILLS: counts the drapes; kills are spread over them.
begin() {
  mkdir -p "$2"
  drape study status "$1" --out "$2" --quiet >/dev/null || [ $? = 1 ]
  step=$((2 * ($(wc -l <"$2/study.csv") - 1) / $3 + 1))
}
ended_drapes() { find "$1" -name sheet.run.json | wc -l; }
# Waits for a random time on a machine of any speed: until up to $step more drapes of CUT are done and up to a tenth
# of a second has passed; less if the command BUSY, given last, fails.
random_moment() {
  local cut=$1 next pause_ms=40
  next=$(($(ended_drapes "$cut") + RANDOM % step))
  shift
  while [ "$(ended_drapes "$cut")" -lt "$next" ] && "$@"; do
    sleep "$(printf '%d.%03d' $((pause_ms / 1000)) $((pause_ms % 1000)))"
    pause_ms=$((pause_ms < 1000 ? 2 * pause_ms : pause_ms)) # counting takes time from the drapes
  done
  sleep "0.0$((RANDOM % 100))"
}

# Removes half of the results when all is done, so that kills can strike again.
take_half_away() { find "$1" -name sheet.run.json | sort | awk 'NR % 2' | xargs -r rm -f; }
