//! The launcher and its processes: started, watched, stopped and killed. The components are plain
//! scripts, because the launcher must supervise programs that do not use the SDK, too.

use std::os::unix::fs::MetadataExt;

use rustix::process::Signal;

use crate::fixture::{
    Folder, Run, has_control_groups, is_alive, kill_together, run_to_end, send_signal, wait_for,
};

/// Leaves its process id and that of a child of its own, which ignores what a script can ignore.
const FAMILY: &str = "trap '' TERM HUP INT; sleep 600 & echo $$ $! > \"$ARMOR_OUT/family\"; wait";

#[test]
fn a_killed_launcher_leaves_nothing_behind() {
    let folder = Folder::new("kill");
    folder.script("family", FAMILY);
    let mut run = folder.run("out", &[&folder.system("family", &["a family"])]);
    let family = wait_for("the family", || {
        let text = std::fs::read_to_string(run.out().join("family")).ok()?;
        let pids: Vec<i32> = text.split_whitespace().filter_map(|pid| pid.parse().ok()).collect();
        (pids.len() == 2).then_some(pids)
    });
    let mut all = run.children();
    all.extend(family);
    assert!(all.len() >= 6, "registry, configd, group killers, the script and its child: {all:?}");
    run.signal(Signal::KILL);
    assert_eq!(run.code(), None, "it ends by the signal");
    wait_for("the end of all", || all.iter().all(|pid| !is_alive(*pid)).then_some(()));
    let (code, _, err) = run_to_end(&mut folder.armor(&["ps"]));
    assert_eq!(code, 1);
    assert!(err.contains("no system is running"), "its run file is stale: {err}");
}

#[test]
fn what_has_left_its_process_group_outlives_neither_its_component_nor_the_run() {
    let folder = Folder::new("sessions");
    // A child in a session of its own, whose parent has ended, too.
    let script = "setsid sh -c 'sleep 600 & echo $! >> \"$ARMOR_OUT/left\"'; echo here; ";
    folder.script("leaver", &format!("{script} exec sleep 600"));
    let file = folder.system("sessions", &["a leaver"]);
    let left = |run: &Run, number: usize| {
        wait_for("a process that has left", || {
            let text = std::fs::read_to_string(run.out().join("left")).ok()?;
            text.lines().nth(number)?.parse::<i32>().ok()
        })
    };
    for signal in [Signal::INT, Signal::KILL] {
        let mut run = folder.run(&format!("out-{signal:?}"), &[&file]);
        let first = left(&run, 0);
        assert!(is_alive(first), "as long as its component runs");
        let component = wait_for("the component", || {
            let of_script = |pid: &i32| !run.is_own(*pid);
            run.children().into_iter().find(of_script)
        });
        send_signal(component, Signal::KILL);
        let second = left(&run, 1);
        assert!(!is_alive(first), "its component has died");
        assert!(is_alive(second));
        run.signal(signal);
        let expected = (signal == Signal::INT).then_some(130);
        assert_eq!(run.code(), expected, "{}", run.log());
        wait_for("its end", || (!is_alive(second)).then_some(()));
    }
}

/// Leaves a process that is in no group, session and variable of its component, and has no parent.
const HIDER: &str = "setsid env -i /bin/sh -c 'sleep 600 & echo $! >> \"$0/left\"' \"$ARMOR_OUT\"; \
                     echo here; exec sleep 600";

/// The process with this number that a component has left.
fn left_process(out: &std::path::Path, number: usize) -> i32 {
    wait_for("a process that was left", || {
        let text = std::fs::read_to_string(out.join("left")).ok()?;
        text.lines().nth(number)?.parse::<i32>().ok()
    })
}

#[test]
fn what_hides_in_no_group_session_and_variable_outlives_neither_its_component_nor_the_run() {
    let folder = Folder::new("hiders");
    if !has_control_groups(&folder) {
        return;
    }
    folder.script("hider", HIDER);
    let file = folder.system("hiders", &["a hider"]);
    for signal in [Signal::INT, Signal::KILL] {
        let mut run = folder.run(&format!("out-{signal:?}"), &[&file]);
        let first = left_process(run.out(), 0);
        assert!(is_alive(first), "as long as its component runs");
        let component =
            wait_for("the component", || run.children().into_iter().find(|pid| !run.is_own(*pid)));
        send_signal(component, Signal::KILL);
        let second = left_process(run.out(), 1);
        assert!(!is_alive(first), "its component has died");
        assert!(is_alive(second));
        run.signal(signal);
        let expected = (signal == Signal::INT).then_some(130);
        assert_eq!(run.code(), expected, "{}", run.log());
        wait_for("its end", || (!is_alive(second)).then_some(()));
    }
}

#[test]
fn what_hides_ends_when_the_launcher_and_one_group_killer_are_killed_together() {
    let folder = Folder::new("one-killer");
    if !has_control_groups(&folder) {
        return;
    }
    folder.script("hider", HIDER);
    let mut run = folder.run("out", &[&folder.system("one-killer", &["a hider"])]);
    let left = left_process(run.out(), 0);
    let killers = run.daemons("group-killer");
    let [killed, _] = killers[..] else { panic!("two group killers: {killers:?}") };
    kill_together(&[killed, run.pid()]);
    assert_eq!(run.code(), None, "it ends by the signal");
    wait_for("its end", || (!is_alive(left)).then_some(()));
}

#[test]
fn what_hides_ends_when_all_that_is_called_armor_is_killed_together() {
    let folder = Folder::new("killall");
    if !has_control_groups(&folder) {
        return;
    }
    folder.script("hider", HIDER);
    let mut run = folder.run("out", &[&folder.system("killall", &["a hider"])]);
    let left = left_process(run.out(), 0);
    let is_called = |pid: &i32, wanted: &str| {
        let name = std::fs::read_to_string(format!("/proc/{pid}/comm"));
        name.is_ok_and(|name| name.trim_end() == wanted)
    };
    wait_for("the names of the group killers", || {
        run.daemons("group-killer").iter().all(|pid| is_called(pid, "group-killer")).then_some(())
    });
    // As `killall -9 armor` does, but only in this run.
    let mut all = run.children();
    all.push(run.pid());
    all.retain(|pid| is_called(pid, "armor"));
    assert!(all.len() >= 3, "launcher, registry and configd: {all:?}");
    kill_together(&all);
    assert_eq!(run.code(), None, "it ends by the signal");
    wait_for("its end", || (!is_alive(left)).then_some(()));
}

#[test]
fn what_hides_from_a_launcher_that_was_killed_with_its_group_killers_ends_with_the_next_run() {
    let folder = Folder::new("no-killer");
    if !has_control_groups(&folder) {
        return;
    }
    folder.script("hider", HIDER);
    folder.script("here", "echo here; exec sleep 600");
    let mut run = folder.run("out", &[&folder.system("no-killer", &["a hider"])]);
    let left = left_process(run.out(), 0);
    let mut all = run.daemons("group-killer");
    assert_eq!(all.len(), 2, "{all:?}");
    all.push(run.pid());
    kill_together(&all);
    assert_eq!(run.code(), None, "it ends by the signal");
    // Any run of this user on this host may do it, also one of another test.
    let mut next = folder.run("next", &[&folder.system("next", &["a here"])]);
    wait_for("its end", || (!is_alive(left)).then_some(()));
    next.wait_for_log("here", 1);
    next.signal(Signal::INT);
    assert_eq!(next.code(), Some(130), "{}", next.log());
}

#[test]
fn a_group_killer_that_was_killed_is_replaced_and_knows_what_runs() {
    let folder = Folder::new("new-killer");
    folder.script("family", FAMILY);
    let mut run = folder.run("out", &[&folder.system("new-killer", &["a family"])]);
    let family = wait_for("the family", || {
        let text = std::fs::read_to_string(run.out().join("family")).ok()?;
        let pids: Vec<i32> = text.split_whitespace().filter_map(|pid| pid.parse().ok()).collect();
        (pids.len() == 2).then_some(pids)
    });
    let first = run.daemons("group-killer");
    first.iter().for_each(|pid| send_signal(*pid, Signal::KILL));
    wait_for("two others", || {
        let now = run.daemons("group-killer");
        (now.len() == 2 && !now.iter().any(|pid| first.contains(pid))).then_some(())
    });
    run.wait_for_log("there is a new one", 1);
    run.signal(Signal::KILL);
    assert_eq!(run.code(), None, "it ends by the signal");
    wait_for("the end of all", || family.iter().all(|pid| !is_alive(*pid)).then_some(()));
}

#[test]
fn an_interrupt_stops_in_order_and_a_second_one_kills() {
    let folder = Folder::new("interrupt");
    folder.script(
        "polite",
        "trap 'echo goodbye; exit 0' TERM; echo here; while :; do sleep 0.05; done",
    );
    folder.script("stubborn", "trap '' TERM; echo here; while :; do sleep 0.05; done");
    let polite = folder.system("polite", &["a polite", "b polite"]);
    let mut run = folder.run("polite", &[&polite]);
    run.wait_for_log("here", 2);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    assert_eq!(run.log().matches("goodbye").count(), 2, "{}", run.log());

    let mut run = folder.run("stubborn", &[&folder.system("stubborn", &["a stubborn"])]);
    run.wait_for_log("here", 1);
    let all = run.children();
    run.signal(Signal::INT);
    run.wait_for_log("stopping", 1);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    wait_for("the end of all", || all.iter().all(|pid| !is_alive(*pid)).then_some(()));
}

#[test]
fn what_a_run_creates_is_for_its_user_only() {
    let folder = Folder::new("private");
    folder.script("here", "echo here; while :; do sleep 0.05; done");
    let mut run = folder.run("out", &[&folder.system("private", &["a here"])]);
    run.wait_for_log("here", 1);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130), "{}", run.log());
    let mut unseen = vec![run.out().to_owned()];
    let mut files = 0;
    while let Some(path) = unseen.pop() {
        let metadata = std::fs::symlink_metadata(&path).expect("it exists");
        let mode = metadata.mode() & 0o777;
        if metadata.is_dir() {
            assert_eq!(mode, 0o700, "{}", path.display());
            let entries = std::fs::read_dir(&path).expect("readable");
            unseen.extend(entries.map(|entry| entry.expect("readable").path()));
        } else {
            assert_eq!(mode, 0o600, "{}", path.display());
            files += 1;
        }
    }
    assert!(files >= 5, "logs, the lock and the version of the file: {files}");
}

#[test]
fn a_process_gets_the_variables_that_the_file_names_and_no_secrets() {
    let folder = Folder::new("environment");
    folder.script(
        "open",
        "echo \"<$MAP_TOKEN> <$SECRET> <$LC_NOTHING> <$GLIBC_TUNABLES>\"; while :; do sleep 0.05; done",
    );
    let file = folder.system("environment", &["a open env=\"MAP_TOKEN ABSENT\"", "b open"]);
    let mut run = folder.armor(&["run", &file, "--for", "2s"]);
    let set = [("MAP_TOKEN", "m"), ("SECRET", "s"), ("LC_NOTHING", "l")];
    let (code, out, err) = run_to_end(run.envs(set).env_remove("ABSENT"));
    let log = out + &err;
    assert_eq!(code, 0, "{log}");
    assert!(log.contains("<m> <> <l> <>") && log.contains("<> <> <l> <>"), "{log}");
    assert!(log.contains("environment.xml:3:"), "where it stands: {log}");
    assert!(log.contains("the variable ABSENT is not set here, so a does not get it"), "{log}");

    folder.write(
        "bad.xml",
        &format!(
            "<armor version=\"1\"><system>{}</system></armor>",
            "<component name=\"a\" kind=\"open\" env=\"MAP-TOKEN\"/>"
        ),
    );
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", "bad.xml"]));
    assert!(code == 1 && err.contains("names of environment variables"), "{err}");
}

#[test]
fn a_component_that_keeps_dying_is_given_up_and_the_others_continue() {
    let folder = Folder::new("dying");
    folder.script("dying", "echo born; exit 7");
    folder.script("done", "echo born; exit 0");
    let file = folder.system("dying", &["a dying", "b done", "c dying restart=\"never\""]);
    let mut run = folder.run("out", &[&file]);
    assert_eq!(run.code(), Some(1), "{}", run.log());
    let log = run.log();
    let births = |name: &str| {
        let about = format!(" {name} ");
        log.lines().filter(|line| line.ends_with("born") && line.contains(&about)).count()
    };
    assert_eq!((births("a"), births("b"), births("c")), (5, 1, 1), "{log}");
    assert!(log.contains("given up"), "{log}");
}

#[test]
fn a_flood_of_log_lines_delays_no_process_and_is_counted() {
    let folder = Folder::new("flood");
    folder.script("flood", "exec yes 'a line of many'");
    folder.script(
        "calm",
        "i=0; while [ $i -lt 20 ]; do i=$((i+1)); echo \"calm $i\"; sleep 0.05; done; exec sleep 600",
    );
    let start = std::time::Instant::now();
    let mut run = folder.run("out", &[&folder.system("flood", &["a flood", "b calm"])]);
    run.wait_for_log("calm 20", 1);
    run.wait_for_log("lines were left out", 2);
    run.signal(Signal::INT);
    assert_eq!(run.code(), Some(130));
    let log = run.log();
    for i in 1..=20 {
        assert!(
            log.lines().any(|line| line.ends_with(&format!("calm {i}"))),
            "calm {i} is missing"
        );
    }
    let lines = log.matches("a line of many").count();
    // The limit allows a burst first, then a fixed rate.
    let most = 10_000 + 2_000 * (start.elapsed().as_secs() as usize + 1);
    assert!((1_000..=most).contains(&lines), "{lines} lines are kept, of at most {most}");
}

#[test]
fn programs_get_json_lines_and_the_end_with_its_code() {
    let folder = Folder::new("json");
    folder.script("odd", "printf 'WARN quote \" and \\\\ and \\377\\n' >&2; exit 0");
    let file = folder.system("odd", &["a odd"]);
    let (code, out, err) = run_to_end(&mut folder.armor(&["run", &file, "--format", "json"]));
    assert_eq!(code, 0, "{err}");
    let lines: Vec<serde_json::Value> =
        out.lines().map(|line| serde_json::from_str(line).expect("JSON Lines")).collect();
    let odd = lines.iter().find(|line| line["name"] == "a" && line["stream"] == "stderr");
    let odd = odd.expect("the component's line");
    assert_eq!(odd["level"], "WARN");
    assert_eq!(odd["message"], "quote \" and \\ and \u{fffd}");
    let end = lines.last().expect("lines");
    assert_eq!((&end["event"], &end["code"]), (&"end".into(), &0.into()));
    assert!(folder.path().join("out/odd/logs/a.log").exists(), "the default folder");
}

#[test]
fn a_run_refuses_a_limit_of_descriptors_that_does_not_suffice_and_raises_one_that_may_be_raised() {
    let folder = Folder::new("descriptors");
    folder.script("sleeper", "echo here; exec sleep 600");
    let components: Vec<_> = (0..19).map(|number| format!("s{number} sleeper")).collect();
    let components: Vec<_> = components.iter().map(String::as_str).collect();
    let file = folder.system("descriptors", &components);
    let limited = |limit: &str, time: &str| {
        let run = folder.armor(&["run", &file, "--out", "out", "--for", time]);
        let mut shell = std::process::Command::new("/bin/sh");
        shell.args(["-c", &format!("ulimit {limit} && exec \"$@\""), "sh"]);
        shell.arg(run.get_program()).args(run.get_args()).current_dir(folder.path());
        for (name, value) in run.get_envs() {
            match value {
                Some(value) => shell.env(name, value),
                None => shell.env_remove(name),
            };
        }
        run_to_end(&mut shell)
    };
    let (code, out, err) = limited("-n 64", "1s");
    let expected = ["needs 166 file descriptors, and the limit is 64", "`ulimit -n 166`"];
    assert!(code == 1 && expected.iter().all(|text| err.contains(text)), "{code} {out}{err}");
    let (code, out, err) = limited("-S -n 64", "6s");
    assert!(code == 0 && !(out.clone() + &err).contains("given up"), "{code} {out}{err}");
    assert_eq!(out.lines().filter(|line| line.ends_with(" here")).count(), 19, "{out}");
}

#[test]
fn a_program_that_was_removed_still_restarts_its_daemons() {
    let folder = Folder::new("removed");
    folder.script("sleeper", "echo here; exec sleep 600");
    let file = folder.system("removed", &["a sleeper"]);
    let program = folder.path().join("armor");
    let original = env!("CARGO_BIN_EXE_armor");
    std::fs::hard_link(original, &program)
        .or_else(|_| std::fs::copy(original, &program).map(drop))
        .expect("a second name of the program");
    let mut run = folder.run_program(&program, "out", &[&file]);
    run.wait_for_log("here", 1);
    std::fs::remove_file(&program).expect("it was there");
    for daemon in ["registry", "configd"] {
        let before = wait_for(daemon, || run.daemon(daemon));
        send_signal(before, Signal::KILL);
        wait_for("another one", || run.daemon(daemon).filter(|pid| *pid != before));
        wait_for("the system is whole again", || {
            let (code, out, _) = run_to_end(&mut folder.armor(&["ps"]));
            (code == 0 && out.contains("configd")).then_some(())
        });
    }
    run.signal(Signal::TERM);
    assert_eq!(run.code(), Some(130));
    assert_eq!(run.log().matches("starts again in 0.1 s").count(), 2, "{}", run.log());
}

#[test]
fn two_runs_of_one_system_work_in_parallel() {
    let folder = Folder::new("twice");
    folder.script("sleeper", "echo here; exec sleep 600");
    let file = folder.system("twice", &["a sleeper"]);
    let runs = ["one", "two"].map(|out| folder.run(out, &[&file]));
    for run in &runs {
        run.wait_for_log("here", 1);
    }
    let (code, _, err) = run_to_end(&mut folder.armor(&["ps"]));
    assert_eq!(code, 1);
    let addresses: Vec<&str> = err
        .split_whitespace()
        .filter(|word| word.parse::<std::net::SocketAddr>().is_ok())
        .collect();
    assert_eq!(addresses.len(), 2, "{err}");
    for address in addresses {
        let (code, out, err) = run_to_end(&mut folder.armor(&["ps", "--registry", address]));
        assert_eq!(code, 0, "{err}");
        assert!(out.contains("configd"), "{out}");
    }
}

#[test]
fn killed_daemons_come_back_where_they_were() {
    let folder = Folder::new("daemons");
    folder.script("sleeper", "echo here; exec sleep 600");
    let mut run = folder.run("out", &[&folder.system("daemons", &["a sleeper"])]);
    run.wait_for_log("here", 1);
    let pid_of = |daemon: &str| {
        run.children().into_iter().find(|pid| {
            let command =
                std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            command.split('\0').nth(1) == Some(daemon)
        })
    };
    for daemon in ["registry", "configd"] {
        let before = wait_for(daemon, || pid_of(daemon));
        let environment = std::fs::read(format!("/proc/{before}/environ")).expect("it runs");
        let mut variables = environment.split(|byte| *byte == 0);
        assert!(
            variables.any(|it| it.starts_with(b"GLIBC_TUNABLES=")),
            "its threads share their memory"
        );
        send_signal(before, Signal::KILL);
        wait_for("another one", || pid_of(daemon).filter(|pid| *pid != before));
        wait_for("the system is whole again", || {
            let (code, out, _) = run_to_end(&mut folder.armor(&["ps"]));
            (code == 0 && out.contains("configd")).then_some(())
        });
    }
    run.signal(Signal::TERM);
    assert_eq!(run.code(), Some(130));
    assert_eq!(run.log().matches("here").count(), 1, "the component never noticed");
}

#[test]
fn a_component_uses_of_the_host_what_the_file_allows() {
    let folder = Folder::new("resources");
    folder.script("sleeper", "exec sleep 600");
    let file = folder.system("limited", &["a sleeper nice=\"7\" cpus=\"0\" memory=\"64MiB\""]);
    let run = folder.run("out", &[&file, "--headless", "--components", "components"]);
    let is_sleeper = |pid: &i32| {
        let line = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.starts_with("sleep\0")
    };
    let pid = wait_for("the component", || run.children().into_iter().find(is_sleeper));
    let read =
        |what: &str| std::fs::read_to_string(format!("/proc/{pid}/{what}")).expect("it runs");
    let stat = read("stat");
    let fields: Vec<_> = stat.rsplit_once(')').expect("a name").1.split_whitespace().collect();
    assert_eq!(fields[16], "7", "{stat}");
    assert!(read("status").contains("Cpus_allowed_list:\t0\n"), "{}", read("status"));
    let limits = read("limits");
    let data = limits.lines().find(|line| line.starts_with("Max data size")).expect("a limit");
    assert_eq!(data.split_whitespace().nth(3), Some("67108864"), "{data}");

    let file = folder.system("urgent", &["a sleeper realtime=\"3\""]);
    let run = folder.run("urgent", &[&file, "--headless", "--components", "components"]);
    match wait_for("an end or a component", || {
        let child = run.children().into_iter().find(is_sleeper);
        child.map(Some).or_else(|| run.log().contains("`rtprio`").then_some(None))
    }) {
        Some(pid) => {
            let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
            let (_, fields) = stat.rsplit_once(')').expect("a name");
            let fields: Vec<_> = fields.split_whitespace().collect();
            assert_eq!((fields[37], fields[38]), ("3", "1"), "priority and policy: {stat}");
        }
        // Not every user has the right to it.
        None => assert!(run.log().contains("urgent.xml:3:"), "{}", run.log()),
    }

    // Not every host has the controller, nor every user a group of their own.
    let (_, out, _) = run_to_end(&mut folder.armor(&["doctor", "--format", "json"]));
    let is_about_shares = |line: &&str| line.contains(r#""subject":"cpu shares""#);
    let shares = out.lines().find(is_about_shares).expect("a line about them");
    let file = folder.system("shared", &["a sleeper cpu=\"50%\""]);
    let arguments = [&*file, "--headless", "--components", "components"];
    if shares.contains(r#""condition":"ok""#) {
        let run = folder.run("shared", &arguments);
        let pid = wait_for("the component", || run.children().into_iter().find(is_sleeper));
        let read = |path: &str| std::fs::read_to_string(path).expect("it is mounted");
        let group = read(&format!("/proc/{pid}/cgroup"));
        let group = group.lines().find_map(|line| line.strip_prefix("0::")).expect("a group");
        assert_eq!(read(&format!("/sys/fs/cgroup{group}/cpu.max")).trim(), "50000 100000");
    } else {
        let mut command = folder.armor(&["run"]);
        let (code, _, err) = run_to_end(command.args(arguments));
        assert!(code == 1 && err.contains("shared.xml:3:"), "{code} {err}");
        assert!(err.contains("cpu cannot be limited: "), "{err}");
    }

    let file = folder.system("elsewhere", &["a sleeper cpus=\"1023\""]);
    let (code, _, err) = run_to_end(&mut folder.armor(&["run", &file, "--headless"]));
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("elsewhere.xml:3:") && err.contains("no processor 1023"), "{err}");
}
