#!/usr/bin/env bash
# Renders a small frame with every method in Oclgrind and fails on anything it reports. Needs the release build (test.sh makes it).
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
HALFSHADE_DEVICE=Oclgrind oclgrind --check-api --data-races --log "$folder/log" \
  build/release/halfshade render data/scenes/boxes.json --method all --light-buffers -o "$folder" \
  --resolution 64x64 --light-res 64
if [[ -s $folder/log ]]; then
  head -n 40 "$folder/log" >&2
  echo "oclgrind: expected no report (found those above)" >&2
  exit 1
fi
echo "oclgrind: nothing to report"
