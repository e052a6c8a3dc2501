#!/usr/bin/env bash
# Builds the packages for Debian: launcher/packages/build.sh OUT
# Needs Rust, cargo-deb (`cargo install cargo-deb`) and dpkg-dev. With maturin, the Python package is built too.
# What goes into which package stands in [package.metadata.deb] of its Cargo.toml.
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: $0 OUT" >&2
  exit 2
fi
mkdir -p "$1"
out="$(cd "$1" && pwd)"
cd "$(dirname "$0")/../.."
for tool in cargo cargo-deb dpkg-shlibdeps; do
  command -v "$tool" >/dev/null || { echo "$0: $tool is missing; see docs/install.md" >&2; exit 1; }
done

# The program by itself: cargo builds what a package names together with one set of features for all, and
# the program is to be the one that `cargo install` builds. install.sh builds the library for C and C++.
cargo build --release --locked -p armor
cargo build --release --locked -p armor-designer -p armor-operator-view -p armor-foxglove

# The files that the programs write, where the manifests look for them.
stage=target/packages
armor=target/release/armor
rm -rf "$stage"
mkdir -p "$stage"/{man,bash,zsh,fish}
"$armor" man "$stage/man"
"$armor" completions bash >"$stage/bash/armor"
"$armor" completions zsh >"$stage/zsh/_armor"
"$armor" completions fish >"$stage/fish/armor.fish"
"$armor" sdk "$stage/sdk"
sdk/c/install.sh "$stage/c"

packages=(armor armor-designer armor-operator-view armor-foxglove armor-c)
if command -v maturin >/dev/null; then
  maturin build --profile wheel --locked --manifest-path sdk/python/Cargo.toml --out "$out"
  mkdir -p "$stage/python"
  python3 -m zipfile -e "$out"/armor-*-abi3-*.whl "$stage/python"
  packages+=(armor-python)
else
  echo "$0: maturin is missing, so the package python3-armor is not built" >&2
fi
for package in "${packages[@]}"; do
  cargo deb --no-build --locked -p "$package" --output "$out/"
done
