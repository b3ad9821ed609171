#!/usr/bin/env bash
# Measures the figures of docs/hard-cases.md anew, which the tests then compare with. Look at `git diff` before committing.
#
#   scripts/update_hard_cases.sh [BUILD_FOLDER]    build/release by default
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/release}
export POCL_CACHE_DIR="${POCL_CACHE_DIR:-$PWD/$build/pocl_cache}"
mkdir -p "$POCL_CACHE_DIR"
# Cases that fail are measured too: the tests tell about them.
HALFSHADE_HARD_CASES_TABLE=docs/hard-cases.md "$build/halfshade_tests" --gtest_brief=1 --gtest_filter='*/HardCases.*' || true
git --no-pager diff --stat docs/hard-cases.md
