#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# prepare.sh FOLDER: makes FOLDER/vmlinuz and FOLDER/initrd.gz, the guest of the V4L2 tests: Debian's
# stock kernel, busybox, and the modules of vivid (the kernel's test driver for cameras) and 9p.
# The kernel package (70 MB) is downloaded once and unpacked, never installed. Ends with 77 and the
# reason if that is not possible.
set -euo pipefail
readonly folder=$1
readonly here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

cannot() {
  printf '%s\n' "$*" >&2
  exit 77
}

mkdir -p "$folder"
cd "$folder"
exec 9>lock
flock 9
if [ -s vmlinuz ] && [ -s initrd.gz ] && [ initrd.gz -nt "$here/init" ] && [ initrd.gz -nt "$here/prepare.sh" ]; then
  exit 0
fi

[ "$(uname -m)" = x86_64 ] || cannot "the guest is an x86-64 machine, this is $(uname -m)"
for tool in apt-get apt-cache dpkg-deb busybox qemu-system-x86_64; do
  command -v "$tool" >/dev/null || cannot "$tool is not installed"
done
busybox=$(command -v busybox)
if [ "$(head -c 4096 "$busybox" | grep -ac ld-linux || true)" != 0 ]; then
  cannot "busybox is not the static one: install busybox-static"
fi

if [ ! -s vmlinuz ] || [ ! -d kernel ]; then
  # The name contains the kernel's version, which the meta package states.
  package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -n 1)
  [ -n "$package" ] || cannot "apt knows no linux-image-amd64: run apt-get update"
  rm -rf download && mkdir download
  (cd download && timeout 120 apt-get download "$package" >log 2>&1) ||
    cannot "$package cannot be downloaded: $(tail -n 1 download/log)"
  rm -rf unpacked && mkdir unpacked
  dpkg-deb --fsys-tarfile download/*.deb | tar -x -C unpacked --wildcards \
    './boot/vmlinuz-*' '*/kernel/drivers/virtio/*' '*/kernel/net/9p/*' '*/kernel/fs/9p/*' \
    '*/kernel/fs/netfs/*' '*/kernel/fs/fscache/*' '*/kernel/drivers/media/mc/*' \
    '*/kernel/drivers/media/v4l2-core/*' '*/kernel/drivers/media/common/*' \
    '*/kernel/drivers/media/rc/rc-core.ko*' '*/kernel/drivers/media/cec/core/*' \
    '*/kernel/drivers/media/test-drivers/vivid/*'
  rm -rf kernel && mv unpacked/lib/modules/*/kernel kernel
  mv unpacked/boot/vmlinuz-* vmlinuz
  rm -rf unpacked download vmlinux
fi
# Unpacked here, the kernel boots faster in an emulated machine. Without xz the packed one is used.
if [ ! -s vmlinux ] && command -v xz >/dev/null; then
  start=$(LC_ALL=C grep -abo -m 1 -P '\xfd7zXZ\x00' vmlinuz | head -n 1 | cut -d : -f 1 || true)
  if [ -n "$start" ]; then
    tail -c "+$((start + 1))" vmlinuz | xz --decompress --stdout --single-stream >unpacked 2>/dev/null || true
    if [ "$(head -c 4 unpacked | tail -c 3)" = ELF ]; then mv unpacked vmlinux; else rm -f unpacked; fi
  fi
fi

# Modules in the order of the dependencies that each states.
declare -A known=()
ordered=()
add_module() {
  local name=${1//-/_} file dependencies dependency
  [ -z "${known[$name]:-}" ] || return 0
  known[$name]=1
  file=$(find kernel -name "${name//_/[-_]}.ko")
  [ -n "$file" ] || cannot "the kernel package has no module $name"
  dependencies=$(grep -a -o -m 1 'depends=[A-Za-z0-9_,-]*' "$file" | head -n 1)
  for dependency in $(tr ',' ' ' <<<"${dependencies#depends=}"); do add_module "$dependency"; done
  ordered+=("$file")
}
for module in virtio_pci 9pnet_virtio 9p vivid; do add_module "$module"; done

rm -rf root && mkdir -p root/bin root/modules
cp "$busybox" root/bin/busybox
cp "$here/init" root/init
chmod +x root/init
for i in "${!ordered[@]}"; do
  cp "${ordered[$i]}" "root/modules/$(printf %02d "$i")-$(basename "${ordered[$i]}")"
done
(cd root && find . | sort | busybox cpio -o -H newc 2>/dev/null | gzip -1) >initrd.new
mv initrd.new initrd.gz
rm -rf root
