use super::*;
use crate::scratch::ScratchFolder;

fn script(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    // Written aside by another process, so that no thread of this one still has it open for
    // writing when it is executed.
    let status = std::process::Command::new("/bin/sh")
        .args(["-c", "printf '%b' \"$1\" > \"$0\" && chmod +x \"$0\""])
        .arg(path)
        .arg(text.replace('\\', "\\\\"))
        .status()
        .expect("sh runs");
    assert!(status.success());
}

fn manifest(kind: &str) -> String {
    format!(
        r#"{{"armor_manifest":1,"kind":"{kind}","summary":"x","inputs":[],"outputs":[],"parameters":[]}}"#
    )
}

fn describing(kind: &str) -> String {
    format!("#!/bin/sh\necho '{}'", manifest(kind))
}

/// Gathered without the user's cache.
fn gathered(scratch: &ScratchFolder, directories: &[PathBuf], files: &[&Path]) -> Catalogue {
    let cache = Cache::at(scratch.path().join("cache/manifests.json"));
    Catalogue::gather_with(&cache, None, directories, files.iter().copied()).expect("gathered")
}

fn list_messages(catalogue: &Catalogue) -> Vec<String> {
    catalogue.findings(None).iter().map(ToString::to_string).collect()
}

#[test]
fn executables_describe_themselves_and_broken_ones_are_findings() {
    let scratch = ScratchFolder::new("kinds");
    let there = |name: &str| scratch.path().join("components").join(name);
    script(&there("good"), &describing("arm"));
    let newer = manifest("x").replace("1,", "2,\"colour\":3,");
    let older = manifest("x").replace("1,", "1,\"protocol\":3,");
    let twice = manifest("x").replace(
        "\"parameters\":[",
        r#""parameters":[{"name":"a","type":"text"},{"name":"a","type":"text"}"#,
    );
    let broken = [
        (
            "silent",
            "#!/bin/sh\necho ignored >&2; echo gone wrong >&2; exit 3",
            "W0119",
            "code 3: gone wrong",
        ),
        (
            "script",
            "#!/bin/sh\necho 'Traceback' >&2\n\
             echo \"ModuleNotFoundError: No module named 'armor'\" >&2; exit 1",
            "W0119",
            "code 1: its Python, /bin/sh, has no module `armor`",
        ),
        (
            "vision",
            "#!/bin/sh\n# /// script\n# dependencies = [\"armor\", \"eyes<5\"]\n# ///\n\
             echo \"ModuleNotFoundError: No module named 'eyes'\" >&2; exit 1",
            "W0119",
            "install what the script names: /bin/sh -m pip install 'eyes<5'; or",
        ),
        ("nothing", "#!/bin/sh", "W0119", "ended before it printed its manifest"),
        ("hanging", "#!/bin/sh\nsleep 600 & sleep 600", "W0126", "within"),
        ("detached", "#!/bin/sh\nsetsid sleep 3 & exit 1", "W0119", "code 1"),
        ("endless", "#!/bin/sh\nexec yes", "W0119", "MiB"),
        ("garbage", "#!/bin/sh\necho hello", "W0119", "printed \"hello\", which is no manifest"),
        ("usage", "#!/bin/sh\necho 'Usage: usage FILE'", "W0119", "\"Usage: usage FILE\""),
        (
            "strict",
            "#!/bin/sh\necho \"error: unexpected argument '--describe' found\" >&2\n\
             echo 'For more information' >&2; exit 2",
            "W0119",
            "with code 2: \"error: unexpected argument '--describe' found\"",
        ),
        (
            "chatty",
            &format!("#!/bin/sh\necho 'opening /dev/x'\necho '{}'", manifest("y")),
            "W0119",
            "more than its manifest: \"opening /dev/x\" is before it",
        ),
        (
            "late",
            &format!("#!/bin/sh\necho '{}'\necho bye", manifest("y")),
            "W0119",
            "\"bye\" is after it",
        ),
        ("bytes", "#!/bin/sh\nprintf '\\377\\376'", "W0119", "not UTF-8"),
        ("newer", &format!("#!/bin/sh\necho '{newer}'"), "W0127", "version 2"),
        ("older", &format!("#!/bin/sh\necho '{older}'"), "W0127", "version 3 of the protocol"),
        ("twice", &format!("#!/bin/sh\necho '{twice}'"), "W0119", "a occurs twice"),
        ("alien", "#!/no/such/python\n", "W0119", "missing"),
        ("README", "A text file from a stick without modes.", "W0128", "no program"),
    ];
    for (name, text, ..) in &broken {
        script(&there(name), text);
    }
    std::fs::write(there("notes.md"), "not executable").expect("writable");
    let catalogue = gathered(&scratch, &[], &[&scratch.path().join("rover.xml")]);
    let arm = &catalogue.kinds["arm"];
    assert!(matches!(&arm.origin, Origin::Executable(path) if path.ends_with("good")));
    let messages = list_messages(&catalogue);
    for (name, _, code, why) in &broken {
        let path = format!("{}: ", there(name).display());
        let of = messages.iter().find(|finding| finding.contains(&path));
        let of = of.unwrap_or_else(|| panic!("{name} in {messages:#?}"));
        assert!(of.contains(code) && of.contains(why), "{of}");
    }
    assert_eq!(messages.len(), broken.len(), "{messages:#?}");
}

#[test]
fn odd_entries_of_a_folder_are_findings_and_the_rest_works() {
    let scratch = ScratchFolder::new("odd");
    let there = |name: &str| scratch.path().join(name);
    script(&there("good"), &describing("arm"));
    std::os::unix::fs::symlink("circle", there("circle")).expect("a link");
    std::os::unix::fs::symlink("nothing", there("dangling")).expect("a link");
    std::os::unix::fs::symlink("good", there("again")).expect("a link");
    std::os::unix::fs::symlink(".", there("itself")).expect("a link");
    let pipe = std::process::Command::new("mkfifo").arg(there("pipe")).status();
    assert!(pipe.expect("mkfifo runs").success());
    std::fs::write(there("secret"), "x").expect("writable");
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o000);
    std::fs::set_permissions(there("secret"), mode).expect("a mode");
    let catalogue = gathered(&scratch, &[scratch.path().into()], &[]);
    assert!(catalogue.kinds["arm"].rivals.is_empty(), "a link to it is no second one");
    let messages = list_messages(&catalogue);
    for name in ["circle", "dangling", "pipe", "secret"] {
        let name = there(name).display().to_string();
        let found = messages.iter().any(|one| one.contains(&name) && one.contains("W0129"));
        assert!(found, "{name} in {messages:#?}");
    }
    assert_eq!(messages.len(), 4, "{messages:#?}");
}

#[test]
fn a_kind_claimed_twice_names_both_and_is_an_error_where_it_is_used() {
    let scratch = ScratchFolder::new("claimed");
    script(&scratch.path().join("one"), &describing("arm"));
    script(&scratch.path().join("two"), &describing("arm"));
    script(&scratch.path().join("third"), &describing("leg"));
    let catalogue = gathered(&scratch, &[scratch.path().into()], &[]);
    assert!(catalogue.kinds.contains_key("leg"));
    let unused = list_messages(&catalogue);
    assert!(unused.len() == 1 && unused[0].contains("W0130"), "{unused:#?}");
    assert!(unused[0].contains("one") && unused[0].contains("two"), "{unused:#?}");
    let file = br#"<armor version="1"><system><component name="a" kind="arm"/></system></armor>"#;
    let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.to_vec()));
    let used = catalogue.findings(reading.configuration.as_ref());
    assert!(used.len() == 1 && used[0].code == Code::KindTwice, "{used:#?}");
    assert_eq!(used[0].at.as_ref().map(|at| at.text()), Some("arm"));
}

#[test]
fn a_folder_that_was_asked_for_must_be_there() {
    let scratch = ScratchFolder::new("asked");
    let catalogue = gathered(&scratch, &["/no/such/folder".into()], &[]);
    assert!(catalogue.kinds.contains_key("driver"), "the others are found");
    let messages = list_messages(&catalogue);
    assert!(messages.len() == 1 && messages[0].contains("/no/such/folder"), "{messages:#?}");
    assert!(messages[0].contains("E0125"), "{messages:#?}");
}

/// A script that counts how many times it is run.
fn counting(scratch: &ScratchFolder, kind: &str) -> PathBuf {
    let path = scratch.path().join("c/counting");
    let asked = scratch.path().join("asked");
    let text = format!("#!/bin/sh\necho >> '{}'\necho '{}'", asked.display(), manifest(kind));
    script(&path, &text);
    path
}

fn times_asked(scratch: &ScratchFolder) -> usize {
    std::fs::read(scratch.path().join("asked")).map_or(0, |bytes| bytes.len())
}

#[test]
fn an_executable_is_asked_once_until_it_is_another_one() {
    let scratch = ScratchFolder::new("cached");
    let kinds = || {
        let catalogue = gathered(&scratch, &[scratch.path().join("c")], &[]);
        assert!(list_messages(&catalogue).is_empty(), "{:#?}", list_messages(&catalogue));
        catalogue.kinds
    };
    let path = counting(&scratch, "one");
    for _ in 0..3 {
        assert!(kinds().contains_key("one"));
    }
    assert_eq!(times_asked(&scratch), 1);
    // Rebuilt in place, of the same length and with the old time of modification.
    let modified = path.metadata().and_then(|metadata| metadata.modified()).expect("a time");
    counting(&scratch, "two");
    let file = std::fs::File::open(&path).expect("there");
    file.set_modified(modified).expect("the old time");
    for _ in 0..2 {
        assert!(kinds().contains_key("two"));
    }
    assert_eq!(times_asked(&scratch), 2);
}

#[test]
fn a_script_of_python_is_asked_again_when_a_module_next_to_it_changes() {
    let scratch = ScratchFolder::new("cached-modules");
    // The interpreter of the #! line decides; this one is a shell.
    let interpreter = scratch.path().join("bin/python3");
    std::fs::create_dir_all(scratch.path().join("bin")).expect("writable");
    std::os::unix::fs::symlink("/bin/sh", &interpreter).expect("writable");
    let path = scratch.path().join("c/arm");
    let module = scratch.path().join("c/parts/hand.py");
    std::fs::create_dir_all(module.parent().expect("a folder")).expect("writable");
    let write_module = |kind: &str| {
        std::fs::write(&module, format!("echo '{}'", manifest(kind))).expect("writable");
    };
    write_module("one");
    script(&path, &format!("#!{}\n. '{}'", interpreter.display(), module.display()));
    let kinds = || gathered(&scratch, &[scratch.path().join("c")], &[]).kinds;
    assert!(kinds().contains_key("one"));
    write_module("two");
    assert!(kinds().contains_key("two"), "{:?}", kinds().keys());
    // Another module that appears counts, too.
    std::fs::write(scratch.path().join("c/parts/finger.py"), "").expect("writable");
    let identity = Identity::of(&path).expect("it exists");
    std::fs::remove_file(scratch.path().join("c/parts/finger.py")).expect("it exists");
    assert_ne!(Identity::of(&path).expect("it exists"), identity);
}

#[test]
fn a_damaged_or_unwritable_cache_only_costs_time() {
    let scratch = ScratchFolder::new("damaged");
    counting(&scratch, "one");
    let file = scratch.path().join("cache/manifests.json");
    let kinds = || gathered(&scratch, &[scratch.path().join("c")], &[]).kinds;
    kinds();
    let whole = std::fs::read_to_string(&file).expect("remembered");
    let mut asked = times_asked(&scratch);
    let other = whole.replace("\"version\":1", "\"version\":9");
    for damaged in ["", "{", &whole[..whole.len() / 2], &other, "\u{0}\u{0}\u{0}"] {
        std::fs::write(&file, damaged).expect("writable");
        assert!(kinds().contains_key("one"));
        asked += 1;
        assert_eq!(times_asked(&scratch), asked, "{damaged:?}");
        assert!(kinds().contains_key("one"));
        assert_eq!(times_asked(&scratch), asked, "repaired after {damaged:?}");
    }
    // Obstacles: a folder where the file should be, then a file where its folder should be.
    std::fs::remove_file(&file).expect("there");
    std::fs::create_dir_all(file.join("in")).expect("a folder");
    assert!(kinds().contains_key("one"));
    std::fs::remove_dir_all(scratch.path().join("cache")).expect("there");
    std::fs::write(scratch.path().join("cache"), "").expect("a file");
    assert!(kinds().contains_key("one"));
    assert_eq!(times_asked(&scratch), asked + 2);
}

#[test]
fn one_that_hangs_costs_its_seconds_once_until_it_is_touched() {
    let scratch = ScratchFolder::new("hanging");
    let path = scratch.path().join("c/arm");
    let asked = scratch.path().join("asked");
    script(&path, &format!("#!/bin/sh\necho >> '{}'\nsleep 600", asked.display()));
    let catalogue = || gathered(&scratch, &[scratch.path().join("c")], &[]);
    for _ in 0..3 {
        let messages = list_messages(&catalogue());
        assert!(messages.len() == 1 && messages[0].contains("W0126"), "{messages:#?}");
    }
    assert_eq!(times_asked(&scratch), 1);
    let file = br#"<armor version="1"><system><component name="a" kind="arm"/></system></armor>"#;
    let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.to_vec()));
    let catalogue = catalogue();
    let manifests = catalogue.manifests();
    let mut reading = armor_robotfile::check(reading, &[], Some(&manifests));
    catalogue.point_to_broken(&mut reading.findings);
    let unknown = reading.findings.iter().find(|finding| finding.code == Code::UnknownKind);
    let remedy = unknown.map(|finding| finding.remedy.as_str()).unwrap_or_default();
    assert!(remedy.ends_with("c/arm exists, but did not describe itself (W0126)"), "{remedy}");
    let file = std::fs::File::open(&path).expect("there");
    file.set_modified(std::time::SystemTime::now()).expect("touched");
    gathered(&scratch, &[scratch.path().join("c")], &[]);
    assert_eq!(times_asked(&scratch), 2);
}

#[test]
fn a_folder_that_is_named_twice_is_looked_into_once() {
    let scratch = ScratchFolder::new("named-twice");
    let there = scratch.path().join("components");
    std::fs::create_dir_all(&there).expect("a folder");
    std::os::unix::fs::symlink("gone", there.join("arm")).expect("a link");
    let again = there.join("../components");
    let file = scratch.path().join("rover.xml");
    let messages = list_messages(&gathered(&scratch, &[there, again], &[&file]));
    assert!(messages.len() == 1 && messages[0].contains("W0129"), "{messages:#?}");
}

#[test]
fn our_programs_with_a_window_are_found_or_their_build_is_suggested() {
    let scratch = ScratchFolder::new("companions");
    let cache = Cache::at(scratch.path().join("cache/manifests.json"));
    let (there, empty) = (scratch.path().join("there"), scratch.path().join("empty"));
    script(&there.join("armor-operator-view"), &describing("operator-view"));
    script(&there.join("armor-something"), &describing("something"));
    let gathered = |own: &Path, directories: &[PathBuf]| {
        Catalogue::gather_with(&cache, Some(own), directories, []).expect("gathered")
    };
    // Its folder may be a component directory, too.
    let catalogue = gathered(&there, &[]);
    assert!(catalogue.kinds.contains_key("operator-view"), "it is in the folder");
    assert!(!catalogue.kinds.contains_key("something"), "other programs are not ours");
    let both = gathered(&there, std::slice::from_ref(&there));
    assert!(both.kinds["operator-view"].rivals.is_empty(), "the same one is no second one");
    let remedy = |catalogue: &Catalogue| {
        let file = br#"<armor version="1"><system><component name="a" kind="operator-view"/></system></armor>"#;
        let reading = armor_robotfile::read("a.xml".as_ref(), &mut |_| Ok(file.to_vec()));
        let mut reading = armor_robotfile::check(reading, &[], Some(&catalogue.manifests()));
        catalogue.point_to_broken(&mut reading.findings);
        let unknown = reading.findings.iter().find(|finding| finding.code == Code::UnknownKind);
        unknown.map(|finding| finding.remedy.clone()).unwrap_or_default()
    };
    assert_eq!(remedy(&catalogue), "", "it is known");
    let without = remedy(&gathered(&empty, &[]));
    assert!(without.contains("cargo build --release -p armor-operator-view"), "{without}");
    script(&empty.join("armor-operator-view"), "#!/bin/sh\nexit 3");
    let broken = gathered(&empty, &[]);
    assert!(list_messages(&broken)[0].contains("code 3"), "{:#?}", list_messages(&broken));
    assert!(remedy(&broken).contains("did not describe itself"), "{}", remedy(&broken));
}

/// Returns the remedy for the unknown kind `arm` of the file `rover.xml` in the folder.
fn remedy_for_arm(scratch: &ScratchFolder) -> String {
    let file = scratch.path().join("rover.xml");
    let text = br#"<armor version="1"><system><component name="a" kind="arm"/></system></armor>"#;
    let reading = armor_robotfile::read(&file, &mut |_| Ok(text.to_vec()));
    let catalogue = gathered(scratch, &[], &[&file]);
    let mut reading = armor_robotfile::check(reading, &[], Some(&catalogue.manifests()));
    catalogue.point_to_broken(&mut reading.findings);
    let unknown = reading.findings.iter().find(|finding| finding.code == Code::UnknownKind);
    unknown.map(|finding| finding.remedy.clone()).unwrap_or_default()
}

#[test]
fn a_script_with_an_underscore_is_of_the_kind_with_a_dash_and_a_file_of_that_name_is_none() {
    let scratch = ScratchFolder::new("underscore");
    let there = |name: &str| scratch.path().join("components").join(name);
    script(&there("arm.xml"), "<armor/>");
    script(&there("a_r.py"), "#!/bin/sh\nexit 3");
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    std::fs::set_permissions(there("arm.xml"), mode).expect("a mode");
    let remedy = remedy_for_arm(&scratch);
    assert!(!remedy.contains("chmod") && remedy.contains("looked in armor itself"), "{remedy}");
    assert!(is_named(&there("a_r.py"), "a-r") && !is_named(&there("a_r.py"), "ar"));
}

#[test]
fn an_unknown_kind_is_answered_with_where_it_was_looked_for() {
    let scratch = ScratchFolder::new("looked");
    let components = scratch.path().join("components");
    let missing = format!("looked in armor itself; in {}, which does not", components.display());
    let remedy = remedy_for_arm(&scratch);
    assert!(remedy.contains(&missing), "{remedy}");
    std::fs::create_dir_all(&components).expect("a folder");
    std::fs::write(components.join("notes.md"), "text").expect("writable");
    let remedy = remedy_for_arm(&scratch);
    assert!(remedy.ends_with(&format!("in {}", components.display())), "{remedy}");
    std::fs::write(components.join("gripper.py"), "#!/usr/bin/python3").expect("writable");
    let remedy = remedy_for_arm(&scratch);
    assert!(remedy.ends_with("gripper.py"), "{remedy}");
    assert!(remedy.contains("is a script, but is not executable: chmod +x"), "{remedy}");
    std::fs::write(components.join("arm.py"), "print()").expect("writable");
    let remedy = remedy_for_arm(&scratch);
    assert!(remedy.ends_with("arm.py") && remedy.contains("chmod +x"), "{remedy}");
}

#[test]
fn an_executable_of_another_kind_than_its_file_name_is_named() {
    let scratch = ScratchFolder::new("renamed");
    let path = scratch.path().join("components/arm");
    script(&path, &describing("gripper"));
    let remedy = remedy_for_arm(&scratch);
    let wanted = format!("{} is the kind gripper: write kind=\"gripper\"", path.display());
    assert_eq!(remedy, wanted);
}
