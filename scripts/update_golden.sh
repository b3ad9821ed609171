#!/usr/bin/env bash
# Makes tests/golden/*.png anew with the release build. Look at them before committing: git diff shows which changed.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --preset release --log-level=WARNING
cmake --build --preset release --target halfshade_tests -- --quiet
HALFSHADE_UPDATE_GOLDEN=1 build/release/halfshade_tests --gtest_filter='*Golden*' --gtest_brief=1
