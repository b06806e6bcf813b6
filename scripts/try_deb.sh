#!/usr/bin/env bash
# try_deb.sh [ROOT]: builds the Debian package and tries it in a clean Debian 12: makes a root folder with mmdebstrap (in ROOT,
# default: a temporary one), installs the package there with apt, and explores an installed world. Needs root and
# mmdebstrap; apt's sources are those of this machine. The log is in build/try_deb.log.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
  echo "try_deb.sh: $*" >&2
  exit 1
}
[[ $(id -u) -eq 0 ]] || fail "must run as root (chroot)"
command -v mmdebstrap >/dev/null || fail "mmdebstrap is missing: apt-get install mmdebstrap"

scripts/package.sh
package=$(ls build/package/packages/stairwell_*.deb)
if [[ $# -gt 0 ]]; then
  root=$1
  [[ ! -e $root ]] || fail "$root exists already"
else
  root=$(mktemp -d)/root
  trap 'rm -rf --one-file-system "$(dirname "$root")"' EXIT
fi
sources=()
for file in /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources; do
  [[ -s $file ]] && sources+=("$file")
done
mmdebstrap --quiet --variant=apt --skip=check/qemu bookworm "$root" "${sources[@]}" >build/try_deb.log 2>&1 ||
  fail "no clean root: see build/try_deb.log"
cp "$package" "$root/tmp/"
cp /etc/resolv.conf "$root/etc/resolv.conf"

status=0
chroot "$root" /bin/sh -eux 2>&1 <<'END' | tee -a build/try_deb.log || status=$?
export PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C
cd /tmp
cat /etc/debian_version
apt-get -qq update
apt-get install -y --no-install-recommends ./stairwell_*.deb
stairwell --version
dpkg -L stairwell
stairwell world info /usr/share/stairwell/worlds/duplex.sdf
stairwell explore /usr/share/stairwell/worlds/duplex.sdf --uavs 2 --time-limit 40 --quiet --out /tmp/run
stairwell map info /tmp/run/map.bt
stairwell map compare /tmp/run/map.bt /usr/share/stairwell/worlds/duplex.sdf
stairwell plan /usr/share/stairwell/worlds/duplex.sdf --from -3,-2,1 --to 3,2,1 --planner agent2d --slice --quiet
stairwell map render /tmp/run/map.bt -o /tmp/run/map.png
ls -l /tmp/run
apt-get remove -y stairwell
test ! -e /usr/share/stairwell
END
[[ $status -eq 0 ]] || fail "the package does not work in a clean Debian 12 (exit code $status); see build/try_deb.log"
echo "try_deb.sh: $(basename "$package") installs, explores and goes again on a clean Debian 12"
