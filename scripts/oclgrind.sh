#!/usr/bin/env bash
# Renders a small frame in Oclgrind by every method, in both shapes of the kernels, and fails on anything it reports.
# Needs the release build (test.sh makes it).
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for shape in wide narrow; do
  HALFSHADE_KERNEL_SHAPE=$shape HALFSHADE_DEVICE=Oclgrind oclgrind --check-api --data-races --log "$folder/log" \
    build/release/halfshade render data/scenes/boxes.json --method all --samples 16 --light-buffers -o "$folder" \
    --resolution 64x64 --light-res 64
  if [[ -s $folder/log ]]; then
    head -n 40 "$folder/log" >&2
    echo "oclgrind: expected no report on $shape kernels (found those above)" >&2
    exit 1
  fi
done
echo "oclgrind: nothing to report"
