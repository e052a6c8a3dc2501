#!/usr/bin/env bash
# Builds the wheels for other computers: sdk/python/packages/wheels.sh FOLDER
# For Linux with glibc 2.17 or newer (manylinux2014), on x86-64 and on ARM (aarch64). Needs maturin, zig as
# the linker, and Rust's library for each: pip install maturin ziglang; rustup target add aarch64-unknown-linux-gnu
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: $0 FOLDER" >&2
  exit 2
fi
mkdir -p "$1"
out="$(cd "$1" && pwd)"
cd "$(dirname "$0")/../../.."
for target in x86_64 aarch64; do
  maturin build --profile wheel --locked --zig --compatibility manylinux2014 --target "$target-unknown-linux-gnu" \
    --manifest-path sdk/python/Cargo.toml --out "$out"
done
