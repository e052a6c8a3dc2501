//! The book of `docs/SUMMARY.md`: each page is in it once, each link leads to a page and a heading
//! that exist, and each path of the repository that a page names exists. `docs/book.sh` builds it.
//!
//! `ARMOR_BLESS=1` writes the list of the pages of `docs/errors` into SUMMARY.md.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use armor_house::workspace_root;

/// What is in the book's folder and no page of it.
const NO_PAGES: [&str; 1] = ["SUMMARY.md"];
/// Folders that are not of the repository, or hold no documents of it.
const OTHER_FOLDERS: [&str; 5] = ["target", "out", "book", "node_modules", ".git"];

fn docs() -> PathBuf {
    workspace_root().join("docs")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All Markdown files below `folder`, as paths relative to it.
fn markdown_files(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_symlink() || OTHER_FOLDERS.contains(&name.as_str()) {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.insert(path.strip_prefix(folder).unwrap().to_owned());
            }
        }
    }
    found
}

/// The text without code blocks; the number of each line stays.
fn without_blocks(text: &str) -> String {
    let mut fence: Option<String> = None;
    let lines = text.lines().map(|line| {
        let trimmed = line.trim_start();
        let ticks: String = trimmed.chars().take_while(|c| *c == '`').collect();
        match &fence {
            Some(open) if ticks.len() >= open.len() && trimmed == ticks => fence = None,
            Some(_) => {}
            None if ticks.len() >= 3 => fence = Some(ticks),
            None => return line,
        }
        ""
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The code spans of a line, and the line without them.
fn split_code_spans(line: &str) -> (Vec<&str>, String) {
    let (mut spans, mut rest) = (Vec::new(), String::new());
    for (number, piece) in line.split('`').enumerate() {
        if number % 2 == 1 {
            spans.push(piece);
        } else {
            rest += piece;
        }
    }
    (spans, rest)
}

/// A link of a page, with the number of its line.
struct Link {
    line: usize,
    target: String,
}

fn links_of(text: &str) -> Vec<Link> {
    let mut links = Vec::new();
    for (line, number) in without_blocks(text).lines().zip(1..) {
        let (_, prose) = split_code_spans(line);
        for after in prose.split("](").skip(1) {
            let target = after.split(')').next().unwrap_or_default().to_owned();
            links.push(Link { line: number, target });
        }
    }
    links
}

/// The anchors of a page's headings, as GitHub and mdBook form them.
fn anchors_of(text: &str) -> BTreeSet<String> {
    let mut count = BTreeMap::new();
    let mut anchors = BTreeSet::new();
    for line in without_blocks(text).lines().filter(|line| line.starts_with('#')) {
        let title = line.trim_start_matches('#').trim();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let anchor = kept.collect::<String>().to_lowercase().replace(' ', "-");
        let earlier = count.entry(anchor.clone()).or_insert(0);
        anchors.insert(if *earlier == 0 { anchor } else { format!("{anchor}-{earlier}") });
        *earlier += 1;
    }
    anchors
}

/// A path without `.` and `..`.
fn normalized(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(out.pop()),
            other => out.push(other),
        }
    }
    out
}

/// The pages that SUMMARY.md names, in its order.
fn chapters() -> Vec<PathBuf> {
    let summary = read(&docs().join("SUMMARY.md"));
    links_of(&summary).into_iter().map(|link| link.target.into()).collect()
}

#[test]
fn each_page_is_in_the_book_once() {
    let chapters = chapters();
    let mut once = BTreeSet::new();
    let twice: Vec<_> = chapters.iter().filter(|page| !once.insert((*page).clone())).collect();
    assert!(twice.is_empty(), "docs/SUMMARY.md names these pages twice: {twice:?}");
    let pages = markdown_files(&docs());
    let is_page =
        |page: &&PathBuf| !NO_PAGES.iter().any(|other| page.as_path() == Path::new(other));
    let forgotten: Vec<_> =
        pages.iter().filter(is_page).filter(|page| !once.contains(*page)).collect();
    assert!(forgotten.is_empty(), "add these pages to docs/SUMMARY.md: {forgotten:?}");
    let missing: Vec<_> = once.difference(&pages).collect();
    assert!(missing.is_empty(), "docs/SUMMARY.md names pages that do not exist: {missing:?}");
}

#[test]
fn each_finding_is_in_the_book_under_its_title() {
    let path = docs().join("SUMMARY.md");
    let summary = read(&path);
    let mut findings = String::new();
    for page in markdown_files(&docs().join("errors")) {
        let page = page.display().to_string();
        if page != "README.md" {
            let text = read(&docs().join("errors").join(&page));
            let title = text.lines().next().unwrap_or_default().trim_start_matches("# ");
            findings += &format!("  - [{title}](errors/{page})\n");
        }
    }
    let is_finding = |line: &&str| line.contains("](errors/") && !line.contains("README.md");
    let listed: String =
        summary.lines().filter(is_finding).map(|line| format!("{line}\n")).collect();
    if listed != findings && std::env::var_os("ARMOR_BLESS").is_some() {
        let others = summary.lines().filter(|line| !is_finding(line));
        let lines = others.map(|line| match line.contains("](errors/README.md)") {
            true => format!("{line}\n{findings}"),
            false => format!("{line}\n"),
        });
        fs::write(path, lines.collect::<String>()).unwrap();
    } else {
        assert!(
            listed == findings,
            "run again with ARMOR_BLESS=1: docs/SUMMARY.md lists\n{listed}"
        );
    }
}

#[test]
fn each_link_leads_somewhere() {
    let root = workspace_root();
    let mut faults = Vec::new();
    let mut anchors = BTreeMap::new();
    for page in markdown_files(&root) {
        for Link { line, target } in links_of(&read(&root.join(&page))) {
            let is_elsewhere = target.contains("://") || target.starts_with("mailto:");
            if is_elsewhere {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let folder = page.parent().unwrap_or(Path::new(""));
            let file = if file.is_empty() { page.clone() } else { normalized(&folder.join(file)) };
            let path = root.join(&file);
            let at = format!("{}:{line}: {target}", page.display());
            if !path.exists() {
                faults.push(format!("{at}: there is no {}", file.display()));
            } else if !anchor.is_empty() && path.is_file() {
                let known = anchors.entry(file).or_insert_with(|| anchors_of(&read(&path)));
                if !known.contains(anchor) {
                    faults.push(format!("{at}: that page has no heading #{anchor}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether a code span is written as a path of one file or folder.
fn is_path(span: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '.' | '-' | '_');
    span.contains('/') && span.chars().all(is_plain) && !span.contains("NAME")
}

#[test]
fn each_path_of_the_repository_that_a_page_names_exists() {
    let root = workspace_root();
    let is_folder =
        |name: &str| !name.is_empty() && root.join(name).is_dir() && !OTHER_FOLDERS.contains(&name);
    // The pages of the findings name files in the folder of a reader.
    let pages = markdown_files(&docs()).into_iter().filter(|page| !page.starts_with("errors"));
    let pages = pages.map(|page| Path::new("docs").join(page));
    let others = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(PathBuf::from);
    let mut faults = Vec::new();
    for page in pages.chain(others) {
        for (line, number) in without_blocks(&read(&root.join(&page))).lines().zip(1..) {
            for span in split_code_spans(line).0.into_iter().filter(|span| is_path(span)) {
                let top = span.split('/').next().unwrap_or_default();
                if is_folder(top) && !root.join(span).exists() {
                    faults.push(format!("{}:{number}: there is no {span}", page.display()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn links_and_anchors_are_read_as_a_browser_does() {
    let text =
        "# A `<b>` c\n[x](y.md#z) `[no](link)`\n```\n# no\n[no](link)\n```\n## A b c\n## A b c\n";
    let targets: Vec<_> = links_of(text).into_iter().map(|link| (link.line, link.target)).collect();
    assert_eq!(targets, [(2, "y.md#z".to_owned())]);
    let anchors: Vec<_> = anchors_of(text).into_iter().collect();
    assert_eq!(anchors, ["a-b-c", "a-b-c-1", "a-b-c-2"]);
}
