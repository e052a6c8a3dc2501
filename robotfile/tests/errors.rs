//! The catalogue in `docs/errors`: every code has a page; the example in it gives that code and no
//! other, prints what the page shows, and has no finding in its fixed form; the index is current.
//!
//! With `ARMOR_BLESS=1` the tests write what is printed into the pages, and the index, instead of
//! comparing them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use armor_robotfile::{
    Code, Colours, FindingOrigin, Findings, Manifests, Override, PageExample, Reading, check,
    needed_paths, passed_dates, read,
};
use armor_wire::manifest::Manifest;

/// The name of the checked file in the findings.
const MAIN: &str = "robot.xml";
/// The data files that exist next to the examples.
const EXISTING_FILES: [&str; 2] = ["run.log", "run & jump.log"];
/// Lines of the index between which the tables are written.
const INDEX_BEGIN: &str = "<!-- The index: written by the test, not by hand. -->\n";
const INDEX_END: &str = "<!-- End of the index. -->\n";

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Faulty,
    Fixed,
}

fn pages() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors")
}

fn page_path(code: Code) -> PathBuf {
    pages().join(format!("{}.md", code.as_str()))
}

/// The kinds that the examples use.
fn manifests() -> Manifests {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/example_kinds.json");
    let manifests: Vec<Manifest> =
        serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    manifests.into_iter().map(|manifest| (manifest.kind.clone(), manifest)).collect()
}

/// Examples that are too long for a page.
fn generated_example(code: Code, form: Form) -> Option<PageExample> {
    let system = |inner: String| {
        format!("<armor version=\"1\">\n  <system>\n{inner}  </system>\n</armor>\n")
    };
    let is_faulty = form == Form::Faulty;
    let arm = if is_faulty { "" } else { "    <component name=\"arm\" kind=\"arm\"/>\n" };
    let one_more = |limit: usize| if is_faulty { limit + 1 } else { limit };
    let text = match code {
        Code::TooLong => {
            let len = if is_faulty { armor_robotfile::MAX_FILE_BYTES } else { 1000 };
            system(format!("    <!-- {} -->\n{arm}", "log ".repeat(len / 4)))
        }
        Code::TooMany => {
            let line = |n| format!("    <component name=\"arm-{n}\" kind=\"arm\"/>\n");
            system((1..=one_more(armor_robotfile::MAX_ELEMENTS)).map(line).collect())
        }
        Code::More => {
            let count = if is_faulty { armor_robotfile::MAX_FINDINGS + 1 } else { 0 };
            system("    <componant/>\n".repeat(count) + arm)
        }
        _ => return None,
    };
    Some(PageExample { files: vec![(MAIN.to_owned(), text.into_bytes())], overrides: Vec::new() })
}

fn example(code: Code, form: Form) -> PageExample {
    let of_page = match form {
        Form::Faulty => code.faulty_example(),
        Form::Fixed => code.fixed_example(),
    };
    let missing_file = PageExample { files: Vec::new(), overrides: Vec::new() };
    of_page
        .or_else(|| generated_example(code, form))
        .or((code == Code::Unreadable).then_some(missing_file))
        .unwrap_or_else(|| panic!("{code:?} has no example"))
}

/// Returns all findings of `armor check robot.xml`.
fn check_example(code: Code, form: Form, manifests: &Manifests) -> Findings {
    let example = example(code, form);
    let mut reading = read(Path::new(MAIN), &mut |path| {
        example.file(path.to_str().unwrap()).map(<[u8]>::to_vec).ok_or_else(|| {
            io::Error::new(io::ErrorKind::NotFound, "No such file or directory (os error 2)")
        })
    });
    let mut overrides = Vec::new();
    for set in &example.overrides {
        match Override::parse(set, Path::new("")) {
            Ok(set) => overrides.push(set),
            Err(finding) => reading.findings.extend([*finding]),
        }
    }
    let Reading { configuration, mut findings, .. } = check(reading, &overrides, Some(manifests));
    if let Some(configuration) = configuration {
        let paths = needed_paths(&configuration, manifests);
        let exists = |path: &Path| {
            EXISTING_FILES.iter().any(|file| path == Path::new(file))
                || path.to_str().is_some_and(|path| example.file(path).is_some())
        };
        let missing = paths.iter().filter(|needed| !exists(&needed.path));
        findings.extend(missing.map(|needed| needed.refuse(&io::ErrorKind::NotFound.into())));
        findings.extend(passed_dates(&configuration, "2030-01-01T00:00Z".parse().unwrap()));
    }
    findings
}

/// Compares the file with the text, or writes it under `ARMOR_BLESS`.
fn assert_current(path: &Path, text: &str) {
    if std::env::var_os("ARMOR_BLESS").is_some() {
        fs::write(path, text).unwrap();
    }
    let written = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(text, written, "{} is out of date: run with ARMOR_BLESS=1", path.display());
}

/// Returns the page with its title and with `printed` in its `text` block.
fn current_page(code: Code, printed: Option<&str>) -> String {
    let path = page_path(code);
    let page = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (_, text) = page.split_once('\n').unwrap();
    let page = format!("# {}: {}\n{text}", code.as_str(), code.title());
    let Some(printed) = printed else { return page };
    let parts: Vec<_> = page.split("```text\n").collect();
    let [before, block] = parts[..] else { panic!("{code:?}: a page has one text block") };
    let (_, after) = block.split_once("```\n").unwrap();
    format!("{before}```text\n{printed}```\n{after}")
}

#[test]
fn every_example_gives_its_code_as_its_page_shows_and_none_when_fixed() {
    let manifests = manifests();
    for code in Code::ALL.iter().copied() {
        if code.origin() != FindingOrigin::File {
            assert_current(&page_path(code), &current_page(code, None));
            continue;
        }
        let findings = check_example(code, Form::Faulty, &manifests);
        let all_printed = findings.render(Colours::No);
        let (own, others): (Vec<_>, Vec<_>) =
            findings.iter().partition(|finding| finding.code == code);
        let is_listed = code == Code::More && others.iter().all(|f| f.code == Code::UnknownElement);
        assert!(!own.is_empty() && (others.is_empty() || is_listed), "{code:?}:\n{all_printed}");
        assert!(own.iter().all(|finding| !finding.remedy.is_empty()), "{code:?} has no remedy");
        let printed: Vec<_> = own.iter().map(|finding| finding.render(Colours::No)).collect();
        assert_current(&page_path(code), &current_page(code, Some(&printed.join("\n"))));
        let fixed = check_example(code, Form::Fixed, &manifests);
        assert!(fixed.is_empty(), "{code:?}, fixed:\n{}", fixed.render(Colours::No));
    }
}

#[test]
fn the_index_lists_every_code() {
    let path = pages().join("README.md");
    let index = fs::read_to_string(&path).unwrap();
    let (before, rest) = index.split_once(INDEX_BEGIN).unwrap();
    let (_, after) = rest.split_once(INDEX_END).unwrap();
    let mut tables = String::new();
    for section in Code::SECTIONS {
        tables += &format!("\n## {}\n| code | meaning |\n| --- | --- |\n", section.title);
        let mut codes = section.codes.to_vec();
        codes.sort_by_key(|code| number_of(*code));
        for code in codes {
            tables += &format!("| [{0}]({0}.md) | {1} |\n", code.as_str(), code.title());
        }
    }
    assert_current(&path, &format!("{before}{INDEX_BEGIN}{tables}\n{INDEX_END}{after}"));
}

/// The number of a code, whatever its letter.
fn number_of(code: Code) -> u32 {
    code.as_str()[1..].parse().expect("a number")
}

#[test]
fn the_index_is_in_the_order_of_the_codes() {
    let index = fs::read_to_string(pages().join("README.md")).unwrap();
    let (_, tables) = index.split_once(INDEX_BEGIN).unwrap();
    let (tables, _) = tables.split_once(INDEX_END).unwrap();
    for table in tables.split("\n## ").skip(1) {
        let codes = table.lines().filter_map(|line| line.strip_prefix("| [")?.split(']').next());
        let numbers: Vec<u32> = codes.map(|code| code[1..].parse().unwrap()).collect();
        assert!(!numbers.is_empty() && numbers.is_sorted(), "{table}");
    }
}

#[test]
fn every_page_belongs_to_a_code() {
    let codes: BTreeSet<_> = Code::ALL.iter().map(|code| format!("{}.md", code.as_str())).collect();
    for entry in fs::read_dir(pages()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(codes.contains(&name) || name == "README.md", "{name}");
    }
}
