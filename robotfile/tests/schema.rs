//! The schema and the reader agree: xmllint accepts what we accept, and refuses what we refuse
//! for its structure. Skipped, saying so, where xmllint is missing; never under CI.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use armor_robotfile::model::Transport;
use armor_robotfile::{SCHEMA, check, read};

/// Codes of the rules that a schema can express. It cannot express the others (references, limits,
/// DOCTYPE).
const STRUCTURAL: &[&str] = &[
    "E0004", "E0009", "E0010", "E0011", "E0012", "E0013", "E0014", "E0015", "E0016", "E0017",
    "E0018", "E0020", "E0101", "E0102", "E0104", "E0144", "E0201", "E0202", "E0210",
];

/// What `everything.xml` puts in, for a file of another name.
const SUBMISSION: &str =
    r#"<armor version="1"><mission><place name="a" initial="true"/></mission></armor>"#;

/// Which of the files xmllint takes; none if it is not installed.
fn accepted_by_xmllint(name: &str, files: &[String]) -> Option<Vec<bool>> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("armor.xsd"), SCHEMA).unwrap();
    let paths: Vec<_> = (0..files.len()).map(|n| format!("{n}.xml")).collect();
    for (path, text) in paths.iter().zip(files) {
        fs::write(folder.join(path), text).unwrap();
    }
    let run = Command::new("xmllint")
        .args(["--noout", "--nonet", "--schema", "armor.xsd"])
        .args(&paths)
        .current_dir(&folder)
        .output();
    let Ok(run) = run else {
        assert!(std::env::var_os("CI").is_none(), "xmllint is not installed");
        println!("skipped: xmllint is not installed");
        return None;
    };
    let stderr = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(!stderr.contains("Schemas parser error"), "{stderr}");
    Some(
        paths
            .iter()
            .map(|path| stderr.lines().any(|line| line == format!("{path} validates")))
            .collect(),
    )
}

/// The codes of our findings.
fn codes(file: &str) -> Vec<&'static str> {
    let reading = read(Path::new("a.xml"), &mut |path| match path.to_str() {
        Some("a.xml") => Ok(file.into()),
        Some("dock.xml") => Ok(SUBMISSION.into()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    });
    check(reading, &[], None).findings.iter().map(|finding| finding.code.as_str()).collect()
}

fn examples() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["../missions/office.xml", "../missions/map-from-log.xml", "tests/everything.xml"]
        .map(|name| fs::read_to_string(folder.join(name)).unwrap())
        .to_vec()
}

#[test]
fn the_schema_takes_the_examples() {
    let examples = examples();
    if let Some(accepted) = accepted_by_xmllint("examples", &examples) {
        assert_eq!(accepted, vec![true; examples.len()]);
    }
}

/// Structural slips: an attribute or a value or an element broken in each place of an example,
/// with the text around it.
fn slips() -> Vec<(String, String)> {
    let mut slips = Vec::new();
    for example in examples() {
        let tags: Vec<usize> = example.match_indices("=\"").map(|(at, _)| at).collect();
        for at in tags {
            let name = example[..at].rfind(' ').unwrap() + 1;
            let end = at + 2 + example[at + 2..].find('"').unwrap() + 1;
            let (before, attribute, after) =
                (&example[..name], &example[name..end], &example[end..]);
            if before.trim_end().ends_with("xml")
                || attribute.contains(':')
                || before.contains("<layout>")
            {
                continue;
            }
            let value = &attribute[..attribute.find('"').unwrap()];
            let mut slip = |put: String| slips.push(around(before, &put, after));
            slip(String::new());
            slip(format!("x{attribute}"));
            slip(format!("{attribute} {attribute}"));
            slip(format!("{attribute}{attribute}"));
            for odd in ["", " ", "-1x", "a a", "a.b", "5s", "7", "-0s", "true"] {
                slip(format!("{value}\"{odd}\""));
            }
        }
        for (at, _) in example.match_indices('<') {
            let (before, after) = example.split_at(at);
            let odd = [
                "text",
                "<other/>",
                "<parameter name=\"p\"/>",
                "</x>",
                "&",
                "<!-- a--b -->",
                "<?a?>",
                "]]>",
            ];
            slips.extend(odd.map(|put| around(before, put, after)));
        }
    }
    slips
}

fn around(before: &str, put: &str, after: &str) -> (String, String) {
    let start = before.floor_char_boundary(before.len().saturating_sub(60));
    let end = after.ceil_char_boundary(60.min(after.len()));
    (format!("{before}{put}{after}"), format!("{}«{put}»{}", &before[start..], &after[..end]))
}

#[test]
fn the_schema_refuses_the_same_structures() {
    let slips = slips();
    assert!(slips.len() > 1000, "{}", slips.len());
    let files: Vec<_> = slips.iter().map(|(file, _)| file.clone()).collect();
    let Some(accepted) = accepted_by_xmllint("slips", &files) else { return };
    let mut refused = 0;
    let mut differences = Vec::new();
    for ((file, place), accepted) in slips.iter().zip(accepted) {
        let codes = codes(file);
        let structural = codes.iter().any(|code| STRUCTURAL.contains(code));
        refused += usize::from(structural);
        if structural && accepted {
            differences.push(format!("only we refuse ({codes:?}): {place}"));
        }
        if codes.is_empty() && !accepted {
            differences.push(format!("only xmllint refuses: {place}"));
        }
    }
    assert!(
        differences.is_empty(),
        "{} differences\n{}",
        differences.len(),
        differences.join("\n---\n")
    );
    println!("{refused} of {} slips are structural, and both refuse them", slips.len());
}

#[test]
fn schema_and_format_name_every_transport() {
    let document = include_str!("../../docs/file-format.md");
    let row = document.lines().find(|line| line.starts_with("| `transport` |")).unwrap();
    for (name, transport) in Transport::NAMED {
        assert_eq!(transport.name(), name);
        let value = format!("<xs:enumeration value=\"{name}\"/>");
        assert!(SCHEMA.contains(&value), "add {value} to robotfile/armor.xsd");
        assert!(row.contains(&format!("`{name}`")), "add {name} to docs/file-format.md: {row}");
    }
}
