#!/usr/bin/env bash
# bare_root.sh ROOT [SUITE]: a bare Debian 12, or another suite, in that folder, unless it is there; Debian 12 with this
# machine's sources of packages, each with its resolver, certificates and settings of pip. As root.
set -euo pipefail
root=$(realpath -m "$1")
wanted=${2:-bookworm}
mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE)' 'Created-By: Packages' |
  sed -n 's/ bookworm$//p' | sed -n 1p)
if [ ! -e "$root/var/lib/dpkg/status" ]; then
  rm -rf "$root"
  mkdir -p "$(dirname "$root")"
  debootstrap --variant=minbase "$wanted" "$root" "$mirror" >"$root.log" || {
    tail -5 "$root.log"
    exit 1
  }
fi
if [ "$wanted" = bookworm ]; then
  rm -f "$root/etc/apt/sources.list"
  cp -r /etc/apt/. "$root/etc/apt/"
else
  # A mirror may stand still.
  echo 'Acquire::Check-Valid-Until "false";' >"$root/etc/apt/apt.conf.d/90mirror"
fi
cp -L /etc/resolv.conf "$root/etc/" 2>/dev/null || true
cp /etc/pip.conf "$root/etc/" 2>/dev/null || true
if [ -e /usr/share/ca-certificates ]; then
  rm -rf "$root/etc/ssl/certs"
  mkdir -p "$root/etc/ssl"
  cp -rL /etc/ssl/certs "$root/etc/ssl/"
  # Else a package's update-ca-certificates forgets this machine's own.
  cp -r /usr/local/share/ca-certificates "$root/usr/local/share/" 2>/dev/null || true
fi
