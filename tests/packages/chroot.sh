#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# chroot.sh DEBS BASE WORK: the packages of the folder DEBS in a bare Debian 12 (BASE: a tar by
# `mmdebstrap --variant=minbase bookworm BASE`), unpacked into WORK as root: what drapebench-simulate
# adds, a drape without /proc, the recorded bench (`drape run`), and nothing left after removal.
set -euo pipefail
debs=$1 base=$2 work=$3
root=$work/root
rm -rf "$root"
mkdir -p "$root"
tar -C "$root" -xf "$base" --exclude=./dev
mkdir -p "$root/dev" "$root/opt/debs"
for device in "null c 1 3" "zero c 1 5" "random c 1 8" "urandom c 1 9"; do mknod -m 666 "$root/dev/"$device; done
cp /etc/resolv.conf "$root/etc/"
cp "$debs"/drapebench*.deb "$root/opt/debs"
leave() { umount "$root/proc" 2>/dev/null || true; }
trap leave EXIT
in_root() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive LC_ALL=C "$@"; }
files() { (cd "$root" && find . -xdev \( -path ./proc -o -path ./opt -o -path ./tmp -o -path ./var/cache -o -path ./var/lib/apt -o -path ./var/lib/dpkg -o -path ./var/log -o -path ./root \) -prune -o -print | sort); }
mega() { du -sm -x --exclude="$root/opt" --exclude="$root/proc" --exclude="$root/var/cache" --exclude="$root/var/lib/apt" "$root" | cut -f 1; }

in_root apt-get update -qq
files >"$work/before"
before=$(mega)
in_root sh -c 'apt-get install -y -qq --no-install-recommends /opt/debs/drapebench-common_*.deb /opt/debs/drapebench-simulate_*.deb' >"$work/simulate.log" 2>&1
added=$(($(mega) - before))
echo "drapebench-simulate with drapebench-common and what they need: $added MB beyond the base"
[ "$added" -lt 30 ]
in_root sh -c 'dpkg-query -W -f "\${Package}\n" | grep -iE "opencv|aravis|sqlite"' && { echo "a library that a compute node does not need"; exit 1; }

# Without /proc: a sentence and the exit code of a device or input error, no abort.
for command in "drape help" "drape-simulate /usr/share/none.toml --out /tmp/none" "drape study /usr/share/none.toml --out /tmp/none"; do
  code=0
  in_root $command >"$work/noproc" 2>&1 || code=$?
  echo "without /proc, $command: exit code $code: $(head -n 1 "$work/noproc")"
  [ "$code" -lt 10 ] && [ -s "$work/noproc" ] && ! grep -qiE 'terminate called|abort|filesystem error' "$work/noproc"
done
mount -t proc proc "$root/proc"
in_root drape --version
in_root drape-simulate fabric show matsudaira-A --out /root/fabric --quiet
in_root drape-simulate cusick /root/fabric/fabric.toml --spacing-mm 15 --out /root/cusick --quiet

in_root sh -c 'apt-get install -y -qq --no-install-recommends /opt/debs/*.deb' >"$work/all.log" 2>&1
in_root cp -r /usr/share/drapebench/rigs/bench1 /root/bench1
code=0
in_root drape run /root/bench1 --out /root/out --quiet >"$work/run.log" 2>&1 || code=$?
echo "drape run of the recorded bench: exit code $code, $(in_root drape results list --store /root/out/results.sqlite --csv | wc -l) lines of results"
[ "$code" = 0 ] && [ -s "$root/root/out/report.html" ]
in_root sh -c 'apt-get purge -y -qq "drapebench*" && apt-get autoremove --purge -y -qq' >"$work/remove.log" 2>&1
files >"$work/after"
left=$(comm -13 "$work/before" "$work/after")
echo "left after removal: $(grep -c . <<<"$left" || true) files"
! grep -i drape <<<"$left"
