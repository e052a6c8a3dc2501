#!/usr/bin/env bash
# Builds the reference of the headers for C and C++ as HTML: sdk/c/reference.sh FOLDER
# Needs doxygen. A comment that it cannot read is an error.
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: $0 FOLDER   (the reference begins at FOLDER/html/index.html)" >&2
  exit 2
fi
command -v doxygen >/dev/null || { echo "$0: doxygen is missing; install it: sudo apt-get install doxygen" >&2; exit 1; }
mkdir -p "$1"
REFERENCE="$(cd "$1" && pwd)"
export REFERENCE
cd "$(dirname "$0")/../.."
doxygen sdk/c/Doxyfile
echo "the reference begins at $REFERENCE/html/index.html"
