#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# debian_camera.sh FOLDER: prints the path of arv-fake-gv-camera-0.8, Debian's GigE Vision camera for
# tests. Its package needs a desktop's libraries that the camera itself does not: so it is downloaded
# once (100 KB) and unpacked into FOLDER, never installed. Ends with 77 and the reason if
# that is not possible.
set -euo pipefail
readonly folder=$1 camera=usr/bin/arv-fake-gv-camera-0.8

if command -v arv-fake-gv-camera-0.8; then exit 0; fi
mkdir -p "$folder"
cd "$folder"
exec 9>lock
flock 9
if [ ! -x $camera ]; then
  for tool in apt-get dpkg-deb; do
    command -v $tool >/dev/null || { echo "$tool is not installed" >&2; exit 77; }
  done
  timeout 60 apt-get download aravis-tools >log 2>&1 ||
    { echo "aravis-tools cannot be downloaded: $(tail -n 1 log)" >&2; exit 77; }
  dpkg-deb -x aravis-tools_*.deb .
fi
printf '%s\n' "$PWD/$camera"
