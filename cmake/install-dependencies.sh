#!/usr/bin/env bash
# Installs everything antipode's library, examples, tests and benchmarks build with (Debian 12, Ubuntu 22.04 or newer).
set -euo pipefail

packages=(
  build-essential cmake ninja-build git
  libeigen3-dev libopencv-dev libceres-dev catch2 libgmock-dev
  libcli11-dev libyaml-cpp-dev libfmt-dev nlohmann-json3-dev zlib1g-dev
)

# Used where the distribution has them, and not missed where it does not: bags of ROS 1, and a test that writes some.
optional=(librosbag-storage-dev python3-rosbag python3-sensor-msgs)

missing=()
for package in "${packages[@]}"; do
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != installed ]; then
    missing+=("$package")
  fi
done
for package in "${optional[@]}"; do
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != installed ] &&
    apt-cache show "$package" >/dev/null 2>&1; then
    missing+=("$package")
  fi
done
[ ${#missing[@]} -eq 0 ] && exit 0

sudo=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "install-dependencies: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
  sudo="sudo"
fi
echo "Installing: ${missing[*]}"
# Waits if another installation holds the lock.
apt() { $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 "$@"; }
apt update
apt install -y --no-install-recommends "${missing[@]}"
