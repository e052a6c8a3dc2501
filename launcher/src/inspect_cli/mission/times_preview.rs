//! `armor mission times`: where robots come too close to each other, and how probable it is that limits
//! are kept.

use anyhow::Result;
use armor_robotfile::timing::{
    CHANCE_DRAWS, DrawnChance, MissionChances, MissionPreview, RobotEncounter, SpeedChoice,
};
use serde_json::{Value, json};

use crate::print::{Table, print_line, print_text, terminal_width};

/// Prints the encounters at each choice of speeds, and of which robots they are not known.
///
/// # Errors
/// If it cannot be printed.
pub(super) fn print_encounters(preview: &MissionPreview) -> Result<()> {
    let open: Vec<_> = preview.schedule(SpeedChoice::Nominal).open_robots().collect();
    for (robot, step) in &open {
        let robot = &preview.robots[*robot];
        let step = robot.steps.get(*step).map_or("its first step", String::as_str);
        print_line(format_args!(
            "where {} is from {step} on is not known: neither are its encounters",
            robot.route
        ))?;
    }
    if preview.robots.len() < 2 {
        return Ok(());
    }
    let rows: Vec<_> = list_encounters(preview).map(|it| encounter_row(preview, it)).collect();
    if rows.is_empty() {
        return print_line("no two robots come closer to each other than their radii allow");
    }
    print_line("two robots come closer to each other than their radii allow:")?;
    let headings = ["times", "robots", "from", "to", "nearest", "of", "where", "steps"];
    print_text(Table::new(&headings, rows).format(terminal_width()))
}

/// Prints how many of the draws keep each limit, and in how many two robots meet.
///
/// # Errors
/// If it cannot be printed.
pub(super) fn print_chances(preview: &MissionPreview, chances: &MissionChances) -> Result<()> {
    let draws = CHANCE_DRAWS.get();
    if !preview.limits.is_empty() {
        print_line(format_args!("kept in {draws} draws of all speeds:"))?;
        let headings = ["route", "step", "limit", "kept", "95 % interval"];
        let limits = preview.limits.iter().zip(&chances.limits);
        let mut rows: Vec<_> = limits
            .map(|(limit, chance)| {
                let route = preview.robots[limit.robot].route.clone();
                chance_row([route, limit.step.clone(), limit.words.clone()], *chance)
            })
            .collect();
        if preview.limits.len() > 1 {
            let all = ["all".to_owned(), String::new(), String::new()];
            rows.push(chance_row(all, chances.all));
        }
        print_text(Table::new(&headings, rows).format(terminal_width()))?;
    }
    if preview.robots.len() < 2 {
        return Ok(());
    }
    if chances.encounters.is_empty() {
        return print_line(format_args!("no two robots come too close in {draws} draws"));
    }
    print_line(format_args!("too close in {draws} draws of all speeds:"))?;
    let headings = ["robot", "other", "", "too close", "95 % interval"];
    let rows = chances.encounters.iter().map(|([one, other], chance)| {
        let names = [one, other].map(|robot| preview.robots[*robot].route.clone());
        let [one, other] = names;
        chance_row([one, other, String::new()], Some(*chance))
    });
    print_text(Table::new(&headings, rows.collect()).format(terminal_width()))
}

/// One object for each encounter.
///
/// # Errors
/// If it cannot be printed.
pub(super) fn print_encounter_records(preview: &MissionPreview) -> Result<()> {
    for (speeds, encounter) in list_encounters(preview) {
        let routes = encounter.robots.map(|robot| preview.robots[robot].route.as_str());
        print_line(json!({ "encounter": {
            "times": speeds.word(),
            "routes": routes,
            "steps": name_steps(preview, encounter),
            "from_s": encounter.from_s,
            "to_s": encounter.to_s,
            "nearest_s": encounter.nearest_s,
            "nearest_m": encounter.nearest_m,
            "radii_m": encounter.reach_m,
            "at": encounter.at.map(|at| [at.x_m(), at.y_m()]),
        }}))?;
    }
    Ok(())
}

/// One object for each limit, one for all of them, and one for each pair of robots that meets.
///
/// # Errors
/// If it cannot be printed.
pub(super) fn print_chance_records(
    preview: &MissionPreview,
    chances: &MissionChances,
) -> Result<()> {
    for (limit, chance) in preview.limits.iter().zip(&chances.limits) {
        let route = &preview.robots[limit.robot].route;
        let (step, words) = (&limit.step, &limit.words);
        let of = json!({ "route": route, "step": step, "limit": words });
        print_line(json!({ "kept": chance_record(of, *chance) }))?;
    }
    print_line(json!({ "all_kept": chance_record(json!({}), chances.all) }))?;
    for (robots, chance) in &chances.encounters {
        let routes = robots.map(|robot| preview.robots[robot].route.as_str());
        print_line(
            json!({ "too_close": chance_record(json!({ "routes": routes }), Some(*chance)) }),
        )?;
    }
    Ok(())
}

fn chance_record(mut of: Value, chance: Option<DrawnChance>) -> Value {
    of["share"] = json!(chance.map(DrawnChance::share));
    of["interval"] = json!(chance.map(DrawnChance::interval));
    of["draws"] = json!(CHANCE_DRAWS);
    of
}

fn list_encounters(
    preview: &MissionPreview,
) -> impl Iterator<Item = (SpeedChoice, &RobotEncounter)> {
    SpeedChoice::NAMED.into_iter().flat_map(|(_, speeds)| {
        preview.schedule(speeds).encounters.iter().map(move |encounter| (speeds, encounter))
    })
}

fn encounter_row(
    preview: &MissionPreview,
    (speeds, encounter): (SpeedChoice, &RobotEncounter),
) -> Vec<String> {
    let [one, other] = encounter.robots.map(|robot| preview.robots[robot].route.as_str());
    let [a, b] = encounter.at;
    let steps = name_steps(preview, encounter).map(|step| step.unwrap_or("-"));
    vec![
        speeds.word().to_owned(),
        format!("{one}, {other}"),
        format!("{:.1} s", encounter.from_s),
        format!("{:.1} s", encounter.to_s),
        format!("{:.2} m", encounter.nearest_m),
        format!("{:.2} m", encounter.reach_m),
        format!("{} {}", between(a.x_m(), b.x_m()), between(a.y_m(), b.y_m())),
        steps.join(", "),
    ]
}

/// The middle of two coordinates, in whole centimetres; never `-0.00`.
fn between(one_m: f64, other_m: f64) -> String {
    format!("{:.2}", ((one_m + other_m) * 50.0).round() / 100.0 + 0.0)
}

/// The steps of both robots; none before the first and after the last.
fn name_steps<'a>(preview: &'a MissionPreview, encounter: &RobotEncounter) -> [Option<&'a str>; 2] {
    let name = |number: usize| {
        let robot = &preview.robots[encounter.robots[number]];
        encounter.steps[number].and_then(|step| robot.steps.get(step)).map(String::as_str)
    };
    [name(0), name(1)]
}

fn chance_row(of: [String; 3], chance: Option<DrawnChance>) -> Vec<String> {
    let mut row = Vec::from(of);
    match chance {
        Some(chance) => {
            let [low, high] = chance.interval();
            row.push(percent(chance.share()));
            row.push(format!("{} to {}", percent(low), percent(high)));
        }
        None => row.extend(["?".to_owned(), String::new()]),
    }
    row
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}
