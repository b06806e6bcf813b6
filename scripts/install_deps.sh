#!/usr/bin/env bash
# Installs the Debian packages that the build needs; only those that are missing.
set -euo pipefail

packages=(
  cmake ninja-build g++ ccache pkg-config
  liboctomap-dev libdynamicedt3d-dev octomap-tools
  libpcl-dev libeigen3-dev libompl-dev libfcl-dev libembree-dev
  libsdformat-dev libassimp-dev libpng-dev
  libcli11-dev libyaml-cpp-dev nlohmann-json3-dev catch2
  python3
)

fail() {
  echo "install_deps.sh: $*" >&2
  exit 1
}

command -v dpkg-query >/dev/null || fail "this is not a Debian system; install these by hand: ${packages[*]}"

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ "$status" == installed ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || fail "not root and no sudo; as root run: apt-get install ${missing[*]}"
  as_root=(sudo)
fi

echo "Installing with apt: ${missing[*]}"
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o Acquire::Retries=3)
"${apt[@]}" update </dev/null || fail "'apt-get update' failed: is the network up and /etc/apt/sources.list right?"
"${apt[@]}" install -y --no-install-recommends "${missing[@]}" </dev/null ||
  fail "apt could not install: ${missing[*]} (Debian 12 has all of them; see apt's message above)"
