//! What commands print and how they end, as the pages of `tests/cli` show it. Each page is followed
//! in a copy of the folder with its name; `TRYCMD=overwrite` writes what is printed into the pages.

use std::path::Path;

use trycmd::TestCases;

use crate::fixture::Folder;

const PAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/cli");

#[test]
fn commands_print_and_end_as_the_pages_show() {
    // In this folder no system of this host is found.
    let folder = Folder::new("cli");
    TestCases::new()
        .register_bin("armor", Path::new(env!("CARGO_BIN_EXE_armor")))
        .env("XDG_RUNTIME_DIR", folder.path().display().to_string())
        .env("COLUMNS", "80")
        .case(format!("{PAGES}/*.md"));
}
