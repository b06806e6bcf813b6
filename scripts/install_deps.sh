#!/usr/bin/env bash
# Installs the Debian packages that the build needs; only those that are missing.
set -euo pipefail

packages=(
  cmake ninja-build g++ ccache pkg-config
  liboctomap-dev libdynamicedt3d-dev octomap-tools
  libpcl-dev libeigen3-dev libompl-dev libfcl-dev libembree-dev
  libsdformat-dev libassimp-dev libpng-dev zlib1g-dev
  libcli11-dev libyaml-cpp-dev nlohmann-json3-dev catch2
  libtorch-dev libopenblas0-openmp
  python3
  doxygen
)

# For scripts/fuzz.sh and the tests of the replay in a browser, which do without.
optional=(clang-14 libclang-rt-14-dev)
command -v chromium >/dev/null || optional+=(chromium)
command -v npm >/dev/null || optional+=(nodejs npm)

fail() {
  echo "install_deps.sh: $*" >&2
  exit 1
}

command -v dpkg-query >/dev/null || fail "this is not a Debian system; install these by hand: ${packages[*]}"

# The packages named that are not installed.
not_installed() {
  local package
  for package in "$@"; do
    if [[ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != installed ]]; then
      echo "$package"
    fi
  done
}

mapfile -t missing < <(not_installed "${packages[@]}")
mapfile -t missing_optional < <(not_installed "${optional[@]}")
if [[ ${#missing[@]} -eq 0 && ${#missing_optional[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    [[ ${#missing[@]} -eq 0 ]] && exit 0
    fail "not root and no sudo; as root run: apt-get install ${missing[*]}"
  fi
  as_root=(sudo)
fi

echo "Installing with apt: ${missing[*]} ${missing_optional[*]}"
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o Acquire::Retries=3)
if ! "${apt[@]}" update </dev/null; then
  [[ ${#missing[@]} -eq 0 ]] && exit 0
  fail "'apt-get update' failed: is the network up and /etc/apt/sources.list right?"
fi
if [[ ${#missing[@]} -gt 0 ]]; then
  "${apt[@]}" install -y --no-install-recommends "${missing[@]}" </dev/null ||
    fail "apt could not install: ${missing[*]} (Debian 12 has all of them; see apt's message above)"
fi
if [[ ${#missing_optional[@]} -gt 0 ]]; then
  "${apt[@]}" install -y --no-install-recommends "${missing_optional[@]}" </dev/null ||
    echo "install_deps.sh: no fuzzing or no browser tests: apt could not install ${missing_optional[*]}" >&2
fi
