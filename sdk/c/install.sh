#!/usr/bin/env bash
# Builds the package for C and C++ and installs it: sdk/c/install.sh PREFIX
# Needs Rust; what it installs does not. CMake finds it with -DCMAKE_PREFIX_PATH=PREFIX, pkg-config with
# PKG_CONFIG_PATH=PREFIX/lib/pkgconfig.
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: $0 PREFIX   (such as /usr/local, or a folder of your own)" >&2
  exit 2
fi
mkdir -p "$1"
prefix="$(cd "$1" && pwd)"
cd "$(dirname "$0")"
command -v cargo >/dev/null || { echo "$0: cargo is missing; install Rust from https://rustup.rs" >&2; exit 1; }

cargo build --release --locked -p armor-c
target="$(cargo metadata --format-version 1 --no-deps --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')"
version="$(sed -n 's/^version = "\(.*\)"/\1/p' ../../Cargo.toml | head -n 1)"
interface="${version%.*}"

install -d "$prefix/include/armor" "$prefix/lib/pkgconfig" "$prefix/lib/cmake/Armor"
install -m 644 include/*.h include/*.hpp "$prefix/include/armor/"
install -m 644 "$target/release/libarmor.a" "$prefix/lib/"
install -m 755 "$target/release/libarmor.so" "$prefix/lib/libarmor.so.$version"
ln -sf "libarmor.so.$version" "$prefix/lib/libarmor.so.$interface"
ln -sf "libarmor.so.$interface" "$prefix/lib/libarmor.so"
fill() { sed -e "s|@VERSION@|$version|g" -e "s|@INTERFACE@|$interface|g" "cmake/$1" >"$prefix/lib/$2/$1"; }
fill ArmorConfig.cmake cmake/Armor
fill ArmorConfigVersion.cmake cmake/Armor
fill armor.pc pkgconfig
echo "Armor $version for C and C++ is installed in $prefix"
