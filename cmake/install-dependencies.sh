#!/usr/bin/env bash
# Installs everything antipode's library, examples, tests and benchmarks build with (Debian 12 or
# newer, Ubuntu 24.04. Ubuntu 22.04 has Ceres 2.0, which is too old for the SLAM), and the packages
# that the arguments name.
set -euo pipefail

packages=(
  build-essential cmake ninja-build git
  libeigen3-dev libopencv-dev libceres-dev catch2 libgmock-dev
  libcli11-dev libyaml-cpp-dev libfmt-dev nlohmann-json3-dev libjpeg-dev libdeflate-dev zlib1g-dev
  liblz4-dev libsqlite3-dev libzstd-dev
  "$@"
)

# Used where the distribution has them, and not missed where it does not: bags of ROS 1, and a test that writes some.
optional=(librosbag-storage-dev python3-rosbag python3-sensor-msgs)

is_installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ]; }
# Those of the arguments that are not installed, and that apt knows.
available() {
  for package in "$@"; do
    if ! is_installed "$package" && apt-cache show "$package" >/dev/null 2>&1; then echo "$package"; fi
  done
}

missing=()
for package in "${packages[@]}"; do
  is_installed "$package" || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || [ -n "$(available "${optional[@]}")" ] || exit 0

sudo=""
if [ "$(id -u)" -ne 0 ]; then
  [ ${#missing[@]} -gt 0 ] || command -v sudo >/dev/null || exit 0
  command -v sudo >/dev/null || { echo "install-dependencies: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
  sudo="sudo"
fi
# Waits if another installation holds the lock.
apt() { $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 "$@"; }
apt update
if [ ${#missing[@]} -gt 0 ]; then
  echo "Installing: ${missing[*]}"
  apt install -y --no-install-recommends "${missing[@]}"
fi
mapfile -t more < <(available "${optional[@]}")
if [ ${#more[@]} -gt 0 ]; then
  echo "Installing: ${more[*]}"
  apt install -y --no-install-recommends "${more[@]}" || echo "not installed, and not needed: ${more[*]}"
fi
