#!/usr/bin/env bash
# Runs the table of behaviours against components in Rust, Python, C and C++.
#   tests/conformance/run.sh ARMOR PROBE_IN_RUST PYTHON
# PYTHON is one that has the packages `armor` and numpy.
set -euo pipefail
cd "$(dirname "$0")/../.."
armor="$(realpath "$1")"
rust="$(realpath "$2")"
python="$3"
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
quietly() { "$@" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }; }

quietly sdk/c/install.sh "$out/prefix"
quietly cmake -S tests/conformance -B "$out/build" -DCMAKE_PREFIX_PATH="$out/prefix"
quietly cmake --build "$out/build" --parallel 2
"$python" tests/conformance/run.py --armor "$armor" --source "$rust" --path "$(dirname "$python")" \
  --probe "rust=$rust" --probe python=tests/conformance/probe.py --probe "c=$out/build/c/probe" \
  --probe "cpp=$out/build/cpp/probe" --document docs/languages.md
