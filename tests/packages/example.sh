#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# example.sh BUILD: installs the component dev into an empty folder and builds the example against it.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$1" --component dev --prefix "$work/usr" >"$work/log" || { cat "$work/log"; exit 1; }
cmake -S "$here/example" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$work/usr" -DCMAKE_BUILD_TYPE=Release
cmake --build "$work/build"
"$work/build/hanging_energy" | tee "$work/out"
# 1/2 B curvature^2 over the patch: 1/2 8e-6 (pi / 0.4)^2 0.2 0.2 J = 9.87 uJ.
awk '/^bending/ { exit !($2 > 9.77 && $2 < 9.97) }' "$work/out"
