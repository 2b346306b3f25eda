# SPDX-License-Identifier: Apache-2.0
# Sourced with $1, the folder of the programs: a run of bench1 with one drape and few particles in
# $work/out, and checks that a foreign tool is installed. Exit code 77: it is not.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
PATH=$(realpath "$1"):$PATH
need() { "${@:2}" >/dev/null 2>&1 || { echo "$1 is not installed"; exit 77; }; }
# Exit code 1 is a verdict, which does not matter here.
verdict() { "$@" >"$work/log" 2>&1 || [ $? = 1 ] || { cat "$work/log"; exit 1; }; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

small_run() {
  cp -r "$root/rigs/bench1" "$work/rig"
  sed -i 's/^spacing_mm = .*/spacing_mm = 10/; s/^segments = .*/segments = [1]/; s|"scenes/A.toml", ||; s|, "scenes/E.toml"||' "$work/rig/rig.toml"
  grep -q '"scenes/C.toml"\]' "$work/rig/rig.toml"
  verdict drape run "$work/rig" --single --out "$work/out" --label small --operator nobody
}
