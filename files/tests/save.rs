//! A file is saved whole or not at all.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use armor_files::{replace_private_file, save_atomically as save, save_private_file};

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("save").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

#[test]
fn a_new_version_keeps_the_mode_and_no_temporary_file_remains() {
    let folder = folder("mode");
    let path = folder.join("a.xml");
    save(&path, b"new").unwrap();
    for wanted in [0o600, 0o640, 0o664] {
        fs::set_permissions(&path, fs::Permissions::from_mode(wanted)).unwrap();
        save(&path, format!("{wanted:o}").as_bytes()).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), format!("{wanted:o}"));
        assert_eq!(mode(&path), wanted);
    }
    assert_eq!(names(&folder), ["a.xml"]);
    save(&folder.join("x".repeat(255)), b"new").unwrap();
}

#[test]
fn symbolic_links_stay_and_their_target_is_replaced() {
    let folder = folder("links");
    fs::create_dir(folder.join("robots")).unwrap();
    fs::write(folder.join("robots/rover.xml"), "old").unwrap();
    symlink("robots/rover.xml", folder.join("middle.xml")).unwrap();
    symlink(folder.join("middle.xml"), folder.join("mine.xml")).unwrap();
    save(&folder.join("mine.xml"), b"new").unwrap();
    assert_eq!(fs::read_to_string(folder.join("robots/rover.xml")).unwrap(), "new");
    assert!(fs::symlink_metadata(folder.join("mine.xml")).unwrap().is_symlink());
    assert_eq!(names(&folder.join("robots")), ["rover.xml"]);

    symlink("robots/next.xml", folder.join("dangling.xml")).unwrap();
    save(&folder.join("dangling.xml"), b"first").unwrap();
    assert_eq!(fs::read_to_string(folder.join("robots/next.xml")).unwrap(), "first");

    symlink("circle.xml", folder.join("circle.xml")).unwrap();
    let error = save(&folder.join("circle.xml"), b"").unwrap_err();
    assert!(error.to_string().contains("in a circle"), "{error}");
}

#[test]
fn what_is_private_follows_no_symbolic_link() {
    let folder = folder("private-link");
    let (precious, link) = (folder.join("precious"), folder.join("map.png"));
    fs::write(&precious, "kept").unwrap();
    symlink(&precious, &link).unwrap();
    for save_private in [save_private_file, replace_private_file] {
        let error = save_private(&link, b"overwritten").unwrap_err().to_string();
        assert!(error.contains("map.png") && error.contains("symbolic link"), "{error}");
    }
    assert_eq!(fs::read_to_string(&precious).unwrap(), "kept");
    assert_eq!(names(&folder), ["map.png", "precious"]);
    fs::remove_file(&link).unwrap();
    save_private_file(&link, b"a map").unwrap();
    assert_eq!((fs::read_to_string(&link).unwrap().as_str(), mode(&link)), ("a map", 0o600));
}

#[test]
fn a_file_that_cannot_be_saved_is_reported_and_unchanged() {
    let folder = folder("refused");
    let save_error = |path: &Path| save(path, b"x").unwrap_err().to_string();
    let missing = folder.join("gone/a.xml");
    let text = save_error(&missing);
    assert!(text.starts_with(&format!("{} was not saved: ", missing.display())), "{text}");
    assert!(text.contains("No such file"), "{text}");
    assert!(save_error(&folder).contains("not a regular file"));
    assert!(save_error(Path::new("/")).contains("not a regular file"));
    assert!(save_error(Path::new("/dev/null")).contains("not a regular file"));
    assert!(save_error(Path::new("")).contains("names no file"));
    fs::write(folder.join("a.xml"), "a").unwrap();
    assert!(save_error(&folder.join("a.xml/b.xml")).contains("Not a directory"));
    assert_eq!(names(&folder), ["a.xml"]);
    assert_eq!(fs::read_to_string(folder.join("a.xml")).unwrap(), "a");
}

/// Root may write what is read-only, so this shows something only to other users.
#[test]
fn a_read_only_file_is_not_replaced() {
    let folder = folder("read-only");
    let path = folder.join("a.xml");
    fs::write(&path, "old").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
    if fs::OpenOptions::new().write(true).open(&path).is_ok() {
        println!("skipped: this user may write read-only files");
        return;
    }
    assert!(save(&path, b"new").unwrap_err().to_string().contains("cannot be written"));
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

#[test]
fn a_reader_finds_one_version_or_the_other() {
    let folder = folder("readers");
    let path = folder.join("a.xml");
    let versions = ["a".repeat(100_000), "b".repeat(30_000)];
    save(&path, versions[0].as_bytes()).unwrap();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut seen = 0;
            while !over.load(Ordering::Acquire) || seen == 0 {
                let text = fs::read_to_string(&path).unwrap();
                assert!(versions.contains(&text), "{} bytes", text.len());
                seen += 1;
            }
            seen
        });
        // Two concurrent writers, each with its own temporary file.
        let writers: Vec<_> = versions
            .iter()
            .map(|version| {
                let path = &path;
                scope.spawn(move || (0..50).for_each(|_| save(path, version.as_bytes()).unwrap()))
            })
            .collect();
        writers.into_iter().for_each(|writer| writer.join().unwrap());
        over.store(true, Ordering::Release);
        assert!(reader.join().unwrap() > 0);
    });
    assert_eq!(names(&folder), ["a.xml"]);
}

/// The number of a process that has ended.
fn dead_pid() -> u32 {
    let mut child = std::process::Command::new("true").spawn().unwrap();
    child.wait().unwrap();
    child.id()
}

#[test]
fn what_a_killed_process_left_is_removed_by_the_next_save() {
    let folder = folder("leftovers");
    let path = folder.join("a.xml");
    let leftover = folder.join(format!(".armor-{}-x1.new", dead_pid()));
    let of_a_running_process = format!(".armor-{}-x2.new", std::os::unix::process::parent_id());
    let of_this_process = format!(".armor-{}-x3.new", std::process::id());
    let of_another_program = ".armor-notes.new";
    fs::write(&leftover, b"half of it").unwrap();
    for kept in [of_a_running_process.as_str(), &of_this_process, of_another_program] {
        fs::write(folder.join(kept), b"").unwrap();
    }
    save(&path, b"new").unwrap();
    let mut kept = [&*of_a_running_process, &of_this_process, of_another_program, "a.xml"];
    kept.sort_unstable();
    assert_eq!(names(&folder), kept);
}

/// Its process number means nothing here: it runs in another container, or on another host.
#[test]
fn what_a_writer_elsewhere_has_locked_stays() {
    let folder = folder("locked");
    let path = folder.join("a.xml");
    let written = folder.join(format!(".armor-{}-x1.new", dead_pid()));
    let writer = fs::File::create(&written).unwrap();
    writer.lock().unwrap();
    save(&path, b"new").unwrap();
    assert!(written.exists());
    drop(writer);
    save(&path, b"newer").unwrap();
    assert_eq!(names(&folder), ["a.xml"]);
}

#[test]
fn a_pending_file_is_locked_and_named_after_its_process() {
    let folder = folder("pending");
    let pending = armor_files::PendingFile::create(&folder.join("a.xml")).unwrap();
    let all = names(&folder);
    let [name] = all.as_slice() else { panic!("{all:?}") };
    assert!(name.starts_with(&format!(".armor-{}-", std::process::id())), "{name}");
    let other = fs::File::open(folder.join(name)).unwrap();
    assert!(other.try_lock().is_err());
    drop(pending);
    assert!(names(&folder).is_empty());
}
