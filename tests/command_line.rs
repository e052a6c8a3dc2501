//! The command line by itself: codes, streams, and words of advice.

use crate::fixture::{Folder, ended};

#[test]
fn it_says_its_version_and_refuses_what_it_does_not_know() {
    let folder = Folder::new("version");
    let (code, out, _) = ended(&mut folder.armor(&["--version"]));
    assert_eq!((code, out), (0, format!("armor {}\n", env!("CARGO_PKG_VERSION"))));
    let (code, out, err) = ended(&mut folder.armor(&["fly"]));
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
}

#[test]
fn a_broken_file_is_refused_with_every_finding_and_its_place() {
    let folder = Folder::new("broken");
    folder.write(
        "broken.xml",
        "<armor version=\"1\">\n  <system name=\"s\">\n    <component name=\"a\" kind=\"no-such\"/>\n    \
         <link from=\"a.x\" to=\"b.y\"/>\n  </system>\n</armor>\n",
    );
    for command in ["check", "run"] {
        let (code, out, err) = ended(&mut folder.armor(&[command, "broken.xml"]));
        assert_eq!((code, out.as_str()), (1, ""), "{command}: {err}");
        assert!(err.contains("broken.xml:3:") && err.contains("no-such"), "{command}: {err}");
        assert!(err.contains("broken.xml:4:"), "{command}: {err}");
    }
    assert!(!folder.path().join("out").exists(), "a refused run leaves nothing");
    let (code, out, _) = ended(&mut folder.armor(&["check", "broken.xml", "--format", "json"]));
    assert_eq!(code, 1);
    for line in out.lines() {
        let finding: serde_json::Value = serde_json::from_str(line).expect("JSON Lines");
        assert!(finding["code"].is_string() && finding["line"].is_u64(), "{finding}");
    }
}

#[test]
fn a_missing_file_is_a_finding_too() {
    let folder = Folder::new("missing");
    let (code, _, err) = ended(&mut folder.armor(&["check", "nothing.xml"]));
    assert_eq!(code, 1);
    assert!(err.contains("nothing.xml"), "{err}");
}

#[test]
fn every_kind_is_described() {
    let folder = Folder::new("describe");
    let (code, out, err) = ended(&mut folder.armor(&["describe", "--format", "json"]));
    assert_eq!(code, 0, "{err}");
    for line in out.lines() {
        let manifest: serde_json::Value = serde_json::from_str(line).expect("JSON Lines");
        let kind = manifest["kind"].as_str().expect("a kind");
        let (code, out, err) = ended(&mut folder.armor(&["describe", kind]));
        assert_eq!(code, 0, "{err}");
        assert!(out.starts_with(kind), "{out}");
    }
    let (code, _, err) = ended(&mut folder.armor(&["describe", "no-such"]));
    assert_eq!(code, 1);
    assert!(err.contains("no-such"), "{err}");
}

#[test]
fn tools_without_a_system_say_how_to_start_one() {
    let folder = Folder::new("no-system");
    for tool in [&["ps"][..], &["graph"], &["echo", "a.b"], &["hz", "a.b"], &["mission", "show"]] {
        let (code, out, err) = ended(&mut folder.armor(tool));
        assert_eq!((code, out.as_str()), (1, ""), "{tool:?}: {err}");
        assert!(err.contains("armor run"), "{tool:?}: {err}");
    }
}

#[test]
fn shells_get_completions() {
    let folder = Folder::new("completions");
    for shell in ["bash", "zsh", "fish"] {
        let (code, out, _) = ended(&mut folder.armor(&["completions", shell]));
        assert_eq!(code, 0);
        assert!(out.contains("describe"), "{shell}");
    }
}
