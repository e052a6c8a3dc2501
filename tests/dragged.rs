//! Points of the map are moved while a simulated robot drives to them: the file changes, and with it the
//! leg that is coming, or the one that is driven.

mod turning;

use std::path::Path;
use std::time::Instant;

use armor_executive::journal;
use armor_executive::{Cause, JournalEntry, JournalRecord};

use crate::fixture::{Folder, Run, wait_for};
use turning::TruthFollower;

/// The drawn mission at the speed of the host, with two legs: along the corridor, slowly, and back to the
/// door and into the studio.
fn drawing() -> String {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let text = std::fs::read_to_string(missions.join("drawn.xml")).expect("missions/drawn.xml");
    let world = missions.join("worlds/office.svg");
    let text = text.replace("worlds/office.svg", world.to_str().expect("UTF-8"));
    let text = text.replace(r#"name="speed" value="5""#, r#"name="speed" value="1""#);
    let text = text.replace(
        r#"<leg name="l1" to="corridor-end" speed="0.9m/s" by="1min"/>"#,
        r#"<leg name="l1" to="corridor-end" speed="0.4m/s" by="1min"/>"#,
    );
    let (head, rest) = text.split_once(r#"<stay name="s1""#).expect("the stay");
    let (_, tail) = rest.split_once(r#"<otherwise on="#).expect("the exits");
    format!(r#"{head}<otherwise on={tail}"#)
}

/// Replaces the file, as most editors do: by a second one that is renamed.
fn save(folder: &Folder, text: &str) {
    let temporary = folder.write("drawn.new", text);
    std::fs::rename(temporary, folder.path().join("drawn.xml")).expect("renamed");
}

fn records(run: &Run) -> Vec<JournalRecord> {
    let path = run.out().join("executive.journal");
    journal::read(&path).map(|journal| journal.records).unwrap_or_default()
}

/// Waits for a record of a mission that has not ended.
fn awaited<T>(run: &Run, what: &str, find: impl Fn(&JournalEntry) -> Option<T>) -> T {
    wait_for(&format!("{what}; the log:\n{}", run.log()), || {
        let records = records(run);
        let found = records.iter().find_map(|record| find(&record.entry));
        let is_over = records.iter().any(|it| matches!(it.entry, JournalEntry::Ended { .. }));
        assert!(found.is_some() || !is_over, "the mission ended before {what}:\n{}", run.log());
        found
    })
}

/// Waits until a version is played; returns the components that it starts again.
fn played(run: &Run, number: u64) -> Vec<String> {
    awaited(run, &format!("version {number}"), |entry| match entry {
        JournalEntry::Changed { version, restarts, .. } if version.number == number => {
            Some(restarts.clone())
        }
        _ => None,
    })
}

/// Waits until the robot is sent to a point.
fn sent_to(run: &Run, point: &str) {
    mover_sent_to(run, "way", point);
}

fn mover_sent_to(run: &Run, mover: &str, point: &str) {
    awaited(run, &format!("the way of {mover} to {point}"), |entry| match entry {
        JournalEntry::Activating { component, values, .. } if component == mover => {
            values.iter().any(|value| value.text == point).then_some(())
        }
        _ => None,
    });
}

/// The positions where the robot truly was.
fn read_truth(run: &Run) -> Vec<[f64; 2]> {
    let text = std::fs::read_to_string(run.out().join("truth.csv")).expect("truth.csv");
    let row = |line: &str| {
        let mut numbers = line.split(',').skip(2).map(|it| it.parse().expect("a number"));
        [numbers.next().expect("x"), numbers.next().expect("y")]
    };
    text.lines().skip(1).map(row).collect()
}

// Slow (about half a minute): two legs at the speed of the host.
#[test]
fn points_that_are_dragged_while_a_robot_drives_are_driven_to() {
    let folder = Folder::new("dragged");
    let drawn = drawing();
    save(&folder, &drawn);
    let file = folder.path().join("drawn.xml");
    let mut run = folder.run("out", &[file.to_str().expect("UTF-8"), "--headless"]);
    sent_to(&run, "6,0");

    // The point of the coming leg: no component is disturbed.
    let coming = drawn.replace(r#"at="2.15 -3""#, r#"at="2.15 -2.5""#);
    assert_ne!(coming, drawn);
    save(&folder, &coming);
    assert_eq!(played(&run, 2), [] as [&str; 0]);

    // The point of this leg into the kitchen, which no robot enters: the file is refused with the reason.
    save(&folder, &coming.replace(r#"at="6 0""#, r#"at="-3 -3""#));
    run.wait_for_log("the last good one, stays in force", 1);
    run.wait_for_log("E0304", 1);
    assert!(run.log().contains("kitchen"), "{}", run.log());

    // The point of this leg: only its mover is started again, and the robot drives to the new point.
    let current = coming.replace(r#"at="6 0""#, r#"at="4.4 0""#);
    save(&folder, &current);
    assert_eq!(played(&run, 3), ["way"]);
    sent_to(&run, "4.4,0");

    assert_eq!(run.code(), Some(0), "{}", run.log());
    let sent = records(&run).into_iter().filter_map(|record| match record.entry {
        JournalEntry::Activating { component, values, .. } if component == "way" => {
            Some(values.iter().map(|value| value.text.clone()).collect::<Vec<_>>().join(" "))
        }
        _ => None,
    });
    assert_eq!(sent.collect::<Vec<_>>(), ["6,0", "4.4,0", "2.15,0", "2.15,-2.5"]);
    let fired = records(&run).into_iter().filter_map(|record| match record.entry {
        JournalEntry::Took { cause: Cause::Transition(name), .. } => Some(name),
        _ => None,
    });
    assert_eq!(fired.collect::<Vec<_>>(), ["red.l1.done", "red.l2.done", "red.l3.done"]);
    let driven = read_truth(&run);
    let furthest_m = driven.iter().map(|at| at[0]).fold(0.0, f64::max);
    let deepest_m = driven.iter().map(|at| at[1]).fold(0.0, f64::min);
    println!("dragged: {furthest_m:.2} m along the corridor, {deepest_m:.2} m into the studio");
    assert!((3.9..5.5).contains(&furthest_m), "{furthest_m:.2} m along the corridor");
    assert!((-2.75..-2.1).contains(&deepest_m), "{deepest_m:.2} m into the studio");
}

/// How many points are dragged in the measurement; `ARMOR_DRAGS` names another number.
const DRAGS: usize = 100;
/// How many of them before the robots have come to the end of their first leg.
const DRAGS_OF_A_RUN: usize = 30;
/// What is before the names of the components, routes and points of each robot.
const ROBOTS: [&str; 3] = ["", "b-", "c-"];

/// The mission with further robots, each with components of its own in a world of its own, and a route like
/// that of the first one to points of its own. The first simulator is the clock of all. The check that the end
/// stays in reach is about all routes together.
fn with_more_robots(text: &str) -> String {
    let own = ["simulator", "mapper", "way", "planner", "driver"];
    let parts = |text: &str, start: &str, end: &str| {
        let from = text.find(start).expect("its begin");
        let to = from + text[from..].find(end).expect("its end");
        (from, to)
    };
    let (from, to) = parts(text, r#"<component name="simulator""#, "</system>");
    let is_shared = |line: &&str| {
        line.contains(r#""writer""#) || line.contains("writer.") || line.contains(r#"name="chart""#)
    };
    let lines: Vec<_> = text[from..to].lines().filter(|line| !is_shared(line)).collect();
    let (route_from, route_to) = parts(text, "<route ", "</route>");
    let route = &text[route_from..route_to];
    let guard = route.find(r#"<otherwise name="weak""#).expect("the guard");
    let route = &route[..guard];
    let (point_from, point_to) = parts(text, "<point ", "<zone ");
    let (mut components, mut routes, mut points) = (String::new(), String::new(), String::new());
    for prefix in &ROBOTS[1..] {
        let mut part = lines.join("\n");
        let mut drawn = route.replace(r#"name="red""#, &format!(r#"name="{prefix}red""#));
        for name in own {
            part = part
                .replace(
                    &format!(r#"<component name="{name}""#),
                    &format!(r#"<component name="{prefix}{name}""#),
                )
                .replace(&format!(r#"from="{name}."#), &format!(r#"from="{prefix}{name}."#))
                .replace(&format!(r#"to="{name}."#), &format!(r#"to="{prefix}{name}."#));
            drawn = drawn.replace(&format!(r#"="{name}."#), &format!(r#"="{prefix}{name}."#));
        }
        let mut marks = text[point_from..point_to].to_owned();
        for point in ["P0", "corridor-end", "door", "studio"] {
            let renamed = format!(r#""{prefix}{point}""#);
            drawn = drawn.replace(&format!(r#""{point}""#), &renamed);
            marks = marks.replace(&format!(r#""{point}""#), &renamed);
        }
        components += &part;
        routes += &format!("{drawn}</route>\n    ");
        points += &marks;
    }
    let end = route_to + "</route>".len();
    [
        &text[..to],
        &components,
        &text[to..point_to],
        &points,
        &text[point_to..end],
        "\n    ",
        &routes,
        &text[end..],
    ]
    .concat()
}

/// The ends of the present leg, by turns: the robot is between them, so that it must turn around.
const ENDS_M: [f64; 2] = [-3.0, 6.0];

/// Measures, from the moment at which the file is replaced: how long it takes until a version with another
/// point is played, coming and current ones in turn, until the robot truly turns to the current one, and
/// until a point in a zone is refused.
fn measure_drags(name: &str, drawn: String, robots: &[&str]) {
    let folder = Folder::new(name);
    // So slow that the robots are in their first leg for two minutes. Wherever the points are, its exits
    // lead to the one rally point.
    let drawn = drawn
        .replace(r#"<rally name="R2" at="7 0"/>"#, "")
        .replace(r#"speed="0.4m/s" by="1min""#, r#"speed="0.05m/s" by="1h""#)
        .replace(r#"rally-by="1min""#, r#"rally-by="1h""#);
    let drags = std::env::var("ARMOR_DRAGS").ok().and_then(|it| it.parse().ok()).unwrap_or(DRAGS);
    let mut taken_s: [Vec<f64>; 4] = Default::default();
    let numbers: Vec<usize> = (0..drags).collect();
    for (run, numbers) in numbers.chunks(DRAGS_OF_A_RUN).enumerate() {
        save(&folder, &drawn);
        let file = folder.path().join("drawn.xml");
        let run = folder.run(&format!("out-{run}"), &[file.to_str().expect("UTF-8"), "--headless"]);
        for robot in robots {
            mover_sent_to(&run, &format!("{robot}way"), "6,0");
        }
        drag(&run, &folder, (&drawn, robots), numbers, &mut taken_s);
        assert!(!run.log().contains("retreats"), "{}", run.log());
    }
    let names =
        ["coming, played", "current, sent to it", "into a zone, refused", "current, turns to it"];
    for (what, times) in names.iter().zip(&mut taken_s) {
        times.sort_by(f64::total_cmp);
        let (middle, last) = (times[times.len() / 2], times[times.len() - 1]);
        let nine_of_ten = times[times.len() * 9 / 10];
        println!(
            "dragged: {} robots: {what}: {} times, median {middle:.2} s, nine of ten within \
             {nine_of_ten:.2} s, at most {last:.2} s",
            robots.len(),
            times.len()
        );
    }
}

/// Drags a point for each of the numbers, and adds how long each took: coming, current, in a zone, and until
/// the robot turned to the current one.
fn drag(
    run: &Run,
    folder: &Folder,
    (drawn, robots): (&str, &[&str]),
    numbers: &[usize],
    taken_s: &mut [Vec<f64>; 4],
) {
    let follow = |robot: &&str| TruthFollower::of(run, folder, &format!("{robot}simulator"));
    let followers: Vec<_> = robots.iter().map(follow).collect();
    let mut ends = vec![[ENDS_M[1], 0.0]; robots.len()];
    let mut text = drawn.to_owned();
    let (mut version, mut refusals) = (1, 0);
    for number in numbers.iter().copied() {
        // Each robot in turn, each with a coming point, that of its leg, and one in a zone.
        let index = number / 3 % robots.len();
        let (robot, follower) = (robots[index], &followers[index]);
        let offset = format!("{:.3}", 0.001 * (number + 1) as f64);
        let moved = |text: &str, point: &str, to: &str| {
            let (head, rest) =
                text.split_once(&format!(r#"name="{robot}{point}" at=""#)).expect("a point");
            let (_, tail) = rest.split_once('"').expect("its end");
            format!(r#"{head}name="{robot}{point}" at="{to}"{tail}"#)
        };
        let end_m = ENDS_M[usize::from(ends[index][0] < 0.0)] + 0.001 * (number + 1) as f64;
        let end_m = (end_m * 1e3).round() / 1e3;
        let next = match number % 3 {
            0 => moved(&text, "studio", &format!("2.15 -2.{}", &offset[2..])),
            1 => {
                follower.wait_until_it_faces(ends[index]);
                ends[index] = [end_m, 0.0];
                moved(&text, "corridor-end", &format!("{end_m} 0"))
            }
            _ => moved(&text, "corridor-end", "-3 -3"),
        };
        let start = Instant::now();
        save(folder, &next);
        match number % 3 {
            2 => {
                refusals += 1;
                run.wait_for_log("the last good one, stays in force", refusals);
                taken_s[2].push(start.elapsed().as_secs_f64());
                save(folder, &text);
                run.wait_for_log("the file is again that of version", refusals);
            }
            kind => {
                version += 1;
                let restarts = played(run, version);
                if kind == 1 {
                    assert_eq!(restarts, [format!("{robot}way")]);
                    mover_sent_to(run, &format!("{robot}way"), &format!("{end_m},0"));
                } else {
                    assert_eq!(restarts, [] as [&str; 0]);
                }
                taken_s[kind].push(start.elapsed().as_secs_f64());
                if kind == 1 {
                    let turned = follower.wait_until_it_turns(start, ends[index]);
                    taken_s[3].push(turned.as_secs_f64());
                }
                text = next;
            }
        }
    }
}

#[test]
#[ignore = "a measurement of about two minutes; it prints its figures"]
fn a_hundred_points_are_dragged_while_a_robot_drives() {
    measure_drags("drags", drawing(), &ROBOTS[..1]);
}

#[test]
#[ignore = "a measurement of about three minutes; it prints its figures"]
fn a_hundred_points_are_dragged_while_three_robots_drive() {
    measure_drags("drags-of-three", with_more_robots(&drawing()), &ROBOTS);
}
