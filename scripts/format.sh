#!/usr/bin/env bash
# Formats the code; with --check only says what is not formatted, and fails.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t files < <(find include host kernels tests -name '*.[ch]pp' -o -name '*.cl' -o -name '*.h' | sort)
if [[ ${1-} == --check ]]; then
  clang-format --dry-run --Werror "${files[@]}" || { echo "format: run scripts/format.sh" >&2; exit 1; }
else
  clang-format -i "${files[@]}"
fi
