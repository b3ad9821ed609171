#!/usr/bin/env bash
# Installs what building, testing and running need on Debian 12. Does nothing, silently, when all of it is there.
set -euo pipefail

packages=(
  # to build
  ca-certificates cmake g++ git ninja-build pkg-config
  libcli11-dev libembree-dev libfmt-dev libglm-dev libopenimageio-dev libtinyobjloader-dev nlohmann-json3-dev
  libjs-d3
  ocl-icd-opencl-dev opencl-clhpp-headers opencl-headers
  # to run: an OpenCL device on the CPU, and the bunny that one scene shows
  glmark2-data pocl-opencl-icd
  # to test, and to remake the scenes
  chromium chromium-driver clang clang-format doxygen libclang-rt-14-dev libgtest-dev mesa-opencl-icd oclgrind python3
)

if ! command -v apt-get dpkg-query >/dev/null; then
  echo "setup: expected Debian 12 or a relative (no apt-get here); install the like of: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done
((${#missing[@]})) || exit 0

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "setup: expected root or sudo; as root, run: apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "setup: installing ${missing[*]}"
"${as_root[@]}" apt-get -qq update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "${missing[@]}" >/dev/null
