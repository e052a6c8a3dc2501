#!/usr/bin/env bash
# Builds the documentation as a book into `book/`; open `book/index.html`. Needs mdBook 0.5:
# `cargo install --locked mdbook`, or MDBOOK names the program.
set -euo pipefail
cd "$(dirname "$0")/.."
"${MDBOOK:-mdbook}" build 2>&1 | tee book.log
# mdBook reports a broken chapter or theme as a warning and continues.
if grep -E 'WARN|ERROR' book.log; then exit 1; fi
rm book.log
# A link to Markdown outside of the book, such as `../ARCHITECTURE.md`, is no page of it: mdBook
# has changed its ending all the same. From `book/` it leads to the file in the repository.
sed -Ei 's|(href="\.\./[^"#]*)\.html|\1.md|g' book/*.html
sed -Ei 's|(href="\.\./\.\./[^"#]*)\.html|\1.md|g' book/*/*.html
test -s book/index.html && test -s book/errors/E0001.html
