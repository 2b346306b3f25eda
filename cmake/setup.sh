# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Functions shared by ./demo and ./check: install missing Debian packages, configure, build.
# Sourced by them in the project's root folder, with `set -euo pipefail`.

readonly BUILD_DIR=build/release
readonly PACKAGE_LIST=cmake/debian-packages.txt
readonly SETUP_LOG=build/setup.log

say() { printf '%s\n' "$*" >&2; }

# packages_of SECTION...: prints the packages in these sections of the package list.
packages_of() {
  local section
  for section in "$@"; do
    sed -n "/^\[$section\]/,/^\[/p" "$PACKAGE_LIST" | sed -e 's/#.*//' -e '/^\[/d' -e '/^ *$/d' -e 's/ *$//'
  done
}

# missing_of PACKAGE...: prints those that are not installed. Uses dpkg only: no network, no root.
missing_of() {
  local package installed
  installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "$@" 2>/dev/null || true)
  for package in "$@"; do
    grep -qxF "$package installed" <<<"$installed" || printf '%s\n' "$package"
  done
}

# True for root, or for a user allowed by sudo (asking for a password only on a terminal).
can_become_root() {
  [ "$(id -u)" = 0 ] && return 0
  command -v sudo >/dev/null || return 1
  sudo -n true 2>/dev/null || { [ -t 0 ] && sudo -v; }
}
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }

# run_logged COMMAND...: writes its output to the log, and shows the end of it on failure.
run_logged() {
  "$@" >>"$SETUP_LOG" 2>&1 </dev/null && return 0
  say "This step failed: $*"
  tail -n 20 "$SETUP_LOG" >&2
  say "The whole output is in $SETUP_LOG."
  return 1
}

# install_packages SECTION...: installs only the missing packages of these sections.
install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    say "This script is made for Debian 12. Elsewhere, install the packages of $PACKAGE_LIST"
    say "under your system's names, then: cmake --preset release && cmake --build --preset release"
    exit 2
  fi
  local wanted missing
  mapfile -t wanted < <(packages_of "$@")
  mapfile -t missing < <(missing_of "${wanted[@]}")
  [ "${#missing[@]}" = 0 ] && return 0
  if ! can_become_root; then
    say "${#missing[@]} Debian packages are missing, and installing them needs root. Run this once as root, then come back:"
    say "apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
    exit 2
  fi
  say "Installing ${#missing[@]} Debian packages: ${missing[*]}"
  mkdir -p build
  run_logged as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 update
  run_logged as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 \
    install -y --no-install-recommends "${missing[@]}"
}

# build_project ON|OFF: builds all programs, with or without the tests. Existing build files are
# kept (ninja reconfigures if a CMake file changed), so a second run costs nothing.
build_project() {
  local tests=$1
  if [ ! -f $BUILD_DIR/build.ninja ] ||
    { [ "$tests" = ON ] && ! grep -q '^DRAPE_BUILD_TESTS:BOOL=ON' $BUILD_DIR/CMakeCache.txt; }; then
    say "Configuring $BUILD_DIR"
    mkdir -p build
    run_logged cmake --preset release -DDRAPE_BUILD_TESTS="$tests"
  fi
  say "Building $BUILD_DIR (minutes the first time, nothing when it is up to date)"
  cmake --build $BUILD_DIR --parallel "$(nproc)" >&2
}
