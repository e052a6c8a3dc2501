//! The command line without a running system: exit codes, streams and advice.

use std::fs::File;
use std::process::Stdio;

use crate::fixture::{Folder, run_to_end};

#[test]
fn it_prints_its_version_and_refuses_unknown_arguments() {
    let folder = Folder::new("version");
    let (code, out, _) = run_to_end(&mut folder.armor(&["--version"]));
    assert_eq!((code, out), (0, format!("armor {}\n", env!("CARGO_PKG_VERSION"))));
    let (code, out, err) = run_to_end(&mut folder.armor(&["fly"]));
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
        let (code, out, err) = run_to_end(&mut folder.armor(&[command, "broken.xml"]));
        assert_eq!((code, out.as_str()), (1, ""), "{command}: {err}");
        assert!(err.contains("broken.xml:3:") && err.contains("no-such"), "{command}: {err}");
        assert!(err.contains("broken.xml:4:"), "{command}: {err}");
    }
    assert!(!folder.path().join("out").exists(), "a refused run leaves nothing");
    let (code, out, _) =
        run_to_end(&mut folder.armor(&["check", "broken.xml", "--format", "json"]));
    assert_eq!(code, 1);
    for line in out.lines() {
        let finding: serde_json::Value = serde_json::from_str(line).expect("JSON Lines");
        assert!(finding["code"].is_string() && finding["line"].is_u64(), "{finding}");
    }
}

#[test]
fn a_missing_file_is_a_finding_too() {
    let folder = Folder::new("missing");
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", "nothing.xml"]));
    assert_eq!(code, 1);
    assert!(err.contains("nothing.xml"), "{err}");
}

#[test]
fn what_is_no_text_is_named_instead_of_printed() {
    let folder = Folder::new("no-text");
    folder.executable("components/tank", "#!/bin/sh\nexit\n");
    folder.write("blob", "\u{1}\u{0}\u{2}");
    let check = |file: &str| run_to_end(&mut folder.armor(&["check", file]));
    let program = env!("CARGO_BIN_EXE_armor");
    for (file, what) in [
        ("components/tank", "is a program"),
        (program, "is a program"),
        ("blob", "is not text"),
        ("components", "it is a folder"),
    ] {
        let (code, out, err) = check(file);
        assert!(code == 1 && out.is_empty() && err.starts_with("error[E0003]"), "{out}{err}");
        let is_readable = |c: char| c == '\n' || !c.is_control();
        assert!(err.contains(what) && err.len() < 1000 && err.chars().all(is_readable), "{err}");
        assert_eq!(err.contains("armor describe KIND"), file != "blob", "{err}");
    }
}

#[test]
fn help_fits_a_terminal_of_eighty_columns() {
    let folder = Folder::new("help");
    for arguments in [&["--help"][..], &["run", "--help"], &["eval", "--help"], &["ps", "-h"]] {
        let (code, out, _) = run_to_end(&mut folder.armor(arguments));
        assert_eq!(code, 0);
        let too_long: Vec<_> = out.lines().filter(|line| line.chars().count() > 80).collect();
        assert!(out.len() > 200 && too_long.is_empty(), "{arguments:?}: {too_long:#?}");
    }
}

#[test]
fn an_occupied_port_is_explained_once() {
    let folder = Folder::new("occupied");
    folder.script("arm", "exit");
    folder.write("fine.xml", FINE);
    let held = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = held.local_addr().expect("it listens").to_string();
    let holder = format!("process {} (", std::process::id());
    for arguments in
        [&["registry", "--listen", &address][..], &["run", "fine.xml", "--registry", &address]]
    {
        let (code, _, err) = run_to_end(&mut folder.armor(arguments));
        assert_eq!(code, 1, "{err}");
        assert_eq!(err.matches("already listens there").count(), 1, "{err}");
        assert!(err.contains(&holder) && !err.contains("os error"), "{err}");
    }
}

const FINE: &str = "<armor version=\"1\">\n  <system>\n    <component name=\"arm\" kind=\"arm\"/>\n  </system>\n</armor>\n";

#[test]
fn several_files_are_checked_and_warnings_fail_if_strict() {
    let folder = Folder::new("strict");
    folder.script("arm", "exit");
    folder.write("fine.xml", FINE);
    let loose = FINE.replace(
        "</system>",
        "</system>\n  <mission goal=\"b\"><place name=\"a\" initial=\"true\"/><place name=\"b\"/>\
         <transition name=\"go\" from=\"a\" to=\"b\" operator=\"true\"/></mission>",
    );
    folder.write("loose.xml", &loose);
    folder.write("wrong.xml", &FINE.replace("kind=\"arm\"", "kind=\"amr\""));
    let check =
        |arguments: &[&str]| run_to_end(&mut folder.armor(&[&["check"], arguments].concat()));
    let (code, out, err) = check(&["fine.xml", "loose.xml"]);
    assert!(code == 0 && out.starts_with("fine.xml is fine\nloose.xml: b comes"), "{out}{err}");
    assert!(err.ends_with("\n1 warning\nsee `armor explain W0213`\n"), "{err}");
    let (code, ..) = check(&["fine.xml", "loose.xml", "--strict"]);
    assert_eq!(code, 1);
    assert_eq!(check(&["fine.xml", "--strict"]).0, 0);
    let (code, out, err) = check(&["loose.xml", "wrong.xml", "fine.xml"]);
    assert!(code == 1 && out.ends_with("\nfine.xml is fine\n"), "{out}{err}");
    assert!(
        err.contains("did you mean arm?") && err.matches("see `armor explain").count() == 1,
        "{err}"
    );
    assert!(err.ends_with("\n1 error\nsee `armor explain E0105`\n"), "{err}");
    let (code, out, err) = check(&["loose.xml", "wrong.xml", "--format", "json"]);
    assert_eq!((code, err.as_str()), (1, ""), "{out}");
    let codes: Vec<String> = out
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON Lines"))
        .map(|finding| format!("{}:{}", finding["file"], finding["code"]).replace('"', ""))
        .collect();
    assert_eq!(codes, ["loose.xml:W0213", "loose.xml:N0247", "wrong.xml:E0105"]);
    assert_eq!(check(&[]).0, 2);
}

#[test]
fn a_file_that_a_parameter_needs_must_be_there() {
    let folder = Folder::new("needs");
    let system = r#"<component name="player" kind="carmen-player"><parameter name="file" value="run.log"/></component>"#;
    folder.write("a.xml", &format!("<armor version=\"1\"><system>{system}</system></armor>"));
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", "a.xml"]));
    assert!(code == 0 && err.contains("warning[W0118]: player.file names run.log"), "{err}");
    let (_, _, err) =
        run_to_end(&mut folder.armor(&["check", "a.xml", "--set", "player.file=other"]));
    assert!(err.contains("W0118") && err.contains("player.file=other"), "{err}");
    folder.write("run.log", "");
    let (_, _, err) = run_to_end(&mut folder.armor(&["check", "a.xml"]));
    assert!(!err.contains("W0118"), "{err}");
}

/// Returns the output that the page of an error code shows.
fn shown(code: &str) -> String {
    let page = format!("{}/../docs/errors/{code}.md", env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(page).expect("a page");
    let block = page.split("```text\n").nth(1).expect("a block of what is printed");
    block.split("```").next().expect("its end").to_owned()
}

#[test]
fn faults_of_component_directories_are_reported_as_their_pages_show() {
    let manifest = |version: u32, kind: &str| {
        let rest = r#""summary":"x","inputs":[],"outputs":[],"parameters":[]"#;
        format!("#!/bin/sh\necho '{{\"armor_manifest\":{version},\"kind\":\"{kind}\",{rest}}}'\n")
    };
    let twice = |kind: &'static str| {
        move |folder: &Folder| {
            folder.executable("components/one", &manifest(1, kind));
            folder.executable("components/two", &manifest(1, kind));
        }
    };
    let arm = |text: String| move |folder: &Folder| folder.executable("components/arm", &text);
    let dangling = |folder: &Folder| {
        let components = folder.path().join("components");
        std::fs::create_dir_all(&components).expect("a folder");
        std::os::unix::fs::symlink("gone", components.join("arm")).expect("a link");
    };
    type Prepare = Box<dyn Fn(&Folder)>;
    let cases: [(&str, Prepare); 8] = [
        ("W0119", Box::new(arm("#!/bin/sh\necho hello\n".into()))),
        ("E0124", Box::new(twice("arm"))),
        ("E0125", Box::new(|_| {})),
        ("W0126", Box::new(arm("#!/bin/sh\nsleep 600\n".into()))),
        ("W0127", Box::new(arm(manifest(2, "arm")))),
        ("W0128", Box::new(arm("an arm\n".into()))),
        ("W0129", Box::new(dangling)),
        ("W0130", Box::new(twice("hand"))),
    ];
    for (code, prepare) in cases {
        let folder = Folder::new(code);
        folder.write("robot.xml", FINE);
        prepare(&folder);
        let mut arguments = vec!["check", "robot.xml"];
        if code == "E0125" {
            arguments.extend(["--components", "parts"]);
        }
        let (_, _, err) = run_to_end(&mut folder.armor(&arguments));
        let here = folder.path().canonicalize().expect("it is there");
        let printed = err.replace(&format!("{}/", here.display()), "");
        assert!(
            printed.contains(&shown(code)),
            "{code}: the page shows\n{}\nbut\n{printed}",
            shown(code)
        );
    }
}

#[test]
fn every_finding_is_explained() {
    let folder = Folder::new("explain");
    let explain =
        |arguments: &[&str]| run_to_end(&mut folder.armor(&[&["explain"], arguments].concat()));
    let (code, out, _) = explain(&["e0104"]);
    assert!(code == 0 && out.starts_with("# E0104: an input is fed twice\n"), "{out}");
    let (code, out, _) = explain(&[]);
    assert!(code == 0 && out.contains("\nW0213  no safe place\n"), "{out}");
    for line in explain(&["--format", "json"]).1.lines() {
        let listed: serde_json::Value = serde_json::from_str(line).expect("JSON Lines");
        assert!(listed["title"].is_string() && listed["severity"].is_string(), "{line}");
    }
    let (code, _, err) = explain(&["E9999"]);
    assert!(code == 1 && err.contains("armor explain"), "{err}");
}

#[test]
fn every_kind_is_described() {
    let folder = Folder::new("describe");
    let (code, out, err) = run_to_end(&mut folder.armor(&["describe", "--format", "json"]));
    assert_eq!(code, 0, "{err}");
    for line in out.lines() {
        let manifest: serde_json::Value = serde_json::from_str(line).expect("JSON Lines");
        let kind = manifest["kind"].as_str().expect("a kind");
        let (code, out, err) = run_to_end(&mut folder.armor(&["describe", kind]));
        assert_eq!(code, 0, "{err}");
        assert!(out.starts_with(kind), "{out}");
    }
    let (code, _, err) = run_to_end(&mut folder.armor(&["describe", "no-such"]));
    assert_eq!(code, 1);
    assert!(err.contains("no-such"), "{err}");
}

#[test]
fn messages_are_listed_shown_and_exported_in_every_language() {
    let folder = Folder::new("messages");
    let schema = "Reading{celsius:f64(degC),where:Place<Inside,Outside>}";
    let hash = armor_wire::schema::hash_text(schema);
    let port = format!(
        r#"{{"id":"out","type":"Reading","schema":"{schema}","schema_hash":"{hash:016x}"}}"#
    );
    let manifest = format!(
        r#"{{"armor_manifest":1,"kind":"sensor","summary":"a sensor","inputs":[],"outputs":[{port}],"parameters":[]}}"#
    );
    folder.executable("components/sensor", &format!("#!/bin/sh\necho '{manifest}'\n"));
    let armor =
        |arguments: &[&str]| run_to_end(&mut folder.armor(&[&["message"], arguments].concat()));
    let (code, out, err) = armor(&["list"]);
    assert_eq!(code, 0, "{err}");
    for line in ["LaserScan ", "Reading ", "Place "] {
        assert!(out.lines().any(|it| it.starts_with(line)), "{line}: {out}");
    }
    let (code, out, err) = armor(&["show", "Reading"]);
    assert_eq!(code, 0, "{err}");
    for part in ["celsius  f64", "degC", "Inside", "sensor.out  output", schema] {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (_, out, _) = armor(&["show", "LaserScan", "--format", "json"]);
    let shown: serde_json::Value = serde_json::from_str(&out).expect("one line of JSON");
    assert_eq!(shown["fields"][2]["unit"], "rad");
    assert_eq!(shown["fields"][2]["doc"], "Angle of the first ray.");
    for (language, part) in [
        ("rust", "pub struct Reading {"),
        ("python", "class Reading(Message):"),
        ("c", "ARMOR_STRUCT(armor_reading, \"Reading\","),
        ("cpp", "ARMOR_MESSAGE_NAMED(\"Reading\", Reading, (celsius, \"degC\"), where)"),
        ("json", "\"unit\": \"degC\""),
    ] {
        let (code, out, err) = armor(&["export", "Reading", "--lang", language]);
        assert!(code == 0 && out.contains(part), "{language}: {out}{err}");
        let (code, out, err) = armor(&["export", "Reading", "--lang", language, "-o", "written"]);
        assert!(code == 0 && out.is_empty() && err.contains("written is written"), "{err}");
        let written = std::fs::read_to_string(folder.path().join("written")).expect("a file");
        assert!(written.contains(part), "{written}");
    }
    let (code, _, err) = armor(&["export", "Readin", "--lang", "c"]);
    assert!(code == 1 && err.contains("did you mean Reading?"), "{err}");
    let (code, _, err) = armor(&["list", "--file", "nothing.xml"]);
    assert!(code == 1 && err.contains("nothing.xml is not a file"), "{err}");
}

#[test]
fn tools_without_a_system_print_how_to_start_one() {
    let folder = Folder::new("no-system");
    for tool in [
        &["ps"][..],
        &["graph"],
        &["top", "--once"],
        &["echo", "a.b"],
        &["hz", "a.b"],
        &["bw", "a.b"],
        &["plot", "a.b.c"],
        &["trace"],
        &["delay", "a.b"],
        &["web"],
        &["data", "list"],
        &["data", "info", "a.b"],
        &["data", "find", "a"],
        &["data", "pub", "a.b", "Twist"],
        &["watch", "a"],
        &["restart", "a"],
        &["stop", "--all"],
        &["log", "a", "debug"],
        &["logs"],
        &["mission", "show"],
    ] {
        let (code, out, err) = run_to_end(&mut folder.armor(tool));
        assert_eq!((code, out.as_str()), (1, ""), "{tool:?}: {err}");
        assert!(err.contains("armor run"), "{tool:?}: {err}");
    }
}

#[test]
fn shells_get_completions() {
    let folder = Folder::new("completions");
    for shell in ["bash", "zsh", "fish"] {
        let (code, out, _) = run_to_end(&mut folder.armor(&["completions", shell]));
        assert_eq!(code, 0);
        assert!(out.contains("describe"), "{shell}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::new("manual-pages");
    let (code, out, err) = run_to_end(&mut folder.armor(&["man", "pages"]));
    assert!(code == 0 && out.contains("manual pages are in pages"), "{out}{err}");
    for page in ["armor.1", "armor-top.1", "armor-data-pub.1", "armor-mission-fire.1"] {
        let text = std::fs::read_to_string(folder.path().join("pages").join(page)).expect(page);
        assert!(text.contains(".TH"), "{page}: {text}");
    }
    let (code, out, _) = run_to_end(&mut folder.armor(&["man"]));
    assert!(code == 0 && out.contains(".TH"), "{out}");
}

#[test]
fn a_closed_pipe_is_the_quiet_end_of_every_command() {
    let folder = Folder::new("closed-pipe");
    folder.script("arm", "exit");
    folder.write("fine.xml", FINE);
    folder.write("ugly.xml", &FINE.replace("  <system>", "<system>"));
    folder.write("net.net", "net n\ntr t a -> b\npl a (1)\n");
    for arguments in [
        &["completions", "bash"][..],
        &["man"],
        &["--help"],
        &["component", "--help"],
        &["component", "driver", "--help"],
        &["describe"],
        &["describe", "simulator"],
        &["describe", "--format", "json"],
        &["message", "list"],
        &["message", "show", "LaserScan"],
        &["message", "export", "LaserScan", "--lang", "python"],
        &["explain"],
        &["explain", "E0105"],
        &["check", "fine.xml"],
        &["check", "fine.xml", "--format", "json"],
        &["fmt", "ugly.xml"],
        &["net", "info", "net.net"],
        &["net", "check", "net.net"],
        &["param", "list", "--file", "fine.xml"],
        &["new", "blinker"],
        &["sdk", "copied"],
    ] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let mut command = folder.armor(arguments);
        command.stdout(writer).stderr(Stdio::piped());
        let ended = command.spawn().expect("armor starts").wait_with_output().expect("it ends");
        let err = String::from_utf8_lossy(&ended.stderr);
        assert_eq!((ended.status.code(), err.as_ref()), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn a_file_can_come_from_a_pipe() {
    let folder = Folder::new("stdin");
    folder.script("arm", "exit");
    let from_stdin = |text: &str| {
        let file = File::open(folder.write("piped", text)).expect("it exists");
        run_to_end(folder.armor(&["check", "-"]).stdin(file))
    };
    let (code, out, err) = from_stdin(FINE);
    assert_eq!((code, out.as_str()), (0, "<stdin> is fine\n"), "{err}");
    let (code, _, err) = from_stdin(&FINE.replace("kind=\"arm\"", "kind=\"amr\""));
    assert!(code == 1 && err.contains("<stdin>:3:") && err.contains("did you mean arm?"), "{err}");
}

#[test]
fn an_unknown_kind_names_where_it_was_looked_for() {
    let folder = Folder::new("unknown-kind");
    folder.write("robot.xml", &FINE.replace("kind=\"arm\"", "kind=\"gripper\""));
    let check = || run_to_end(&mut folder.armor(&["check", "robot.xml"])).2;
    let err = check();
    assert!(err.contains("/components, which does not exist"), "{err}");
    std::fs::create_dir(folder.path().join("components")).expect("writable");
    folder.write("components/gripper", "#!/bin/sh\n");
    let err = check();
    assert!(err.contains("components/gripper exists, but is not executable: chmod +x"), "{err}");
}
