//! Drawn routes before they run: where robots are at each time, where two come too close, and how probable
//! it is that limits are kept.

use std::num::NonZeroU32;
use std::path::Path;

use armor_robotfile::timing::{
    CHANCE_DRAWS, DrawnChance, MissionPreview, SpeedChoice, StraightLengths, Timetable,
};
use armor_robotfile::{Date, read};

const SYSTEM: &str = "<system><component name='way' kind='patrol'/><component name='path' \
    kind='patrol'/><component name='driver' kind='driver'><parameter name='speed' \
    value='1m/s'/></component><component name='wide' kind='driver'><parameter name='speed' \
    value='1m/s'/><parameter name='radius' value='40cm'/></component></system>";
const MARKS: &str = "<point name='P0' at='0 0'/><point name='P1' at='10 0'/>\
    <point name='P2' at='10 8'/><point name='Q0' at='5 -5'/><point name='Q1' at='5 5'/>";

/// A mission with a route `red` from P0 and, with `blue`, one from Q0; each has its attributes and steps.
fn mission(red: [&str; 2], blue: Option<[&str; 2]>) -> String {
    let route = |name: &str, mover: &str, start: &str, [attributes, steps]: [&str; 2]| {
        let pace = if attributes.contains("pace=") { "" } else { "pace='driver.speed' " };
        format!(
            "<route name='{name}' mover='{mover}.route' {pace}start='{start}' {attributes}>\
             {steps}</route>"
        )
    };
    let blue = blue.map(|it| route("blue", "path", "Q0", it)).unwrap_or_default();
    let red = route("red", "way", "P0", red);
    format!(
        "<armor version='1'>{SYSTEM}<mission goal='over' safe='hold'><map>{MARKS}\
         <line name='green' kind='phase' shape='6,-9 6,9' not-before='2026-11-21T14:30:00Z'/></map>\
         {red}{blue}<place name='over'/><place name='hold'/></mission></armor>"
    )
}

/// The mission without its phase line.
fn undated(red: [&str; 2], blue: Option<[&str; 2]>) -> String {
    let text = mission(red, blue);
    let (begin, rest) = text.split_once("<line").expect("a line");
    let (_, rest) = rest.split_once("/>").expect("its end");
    format!("{begin}{rest}")
}

fn preview_at(text: &str, begin: Option<&str>) -> (MissionPreview, Timetable) {
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    let configuration = reading.configuration.expect("a configuration");
    let mission = configuration.mission.expect("a mission");
    let begin = begin.map(|begin| begin.parse::<Date>().expect("a date"));
    let system = &configuration.system;
    let preview = MissionPreview::of_mission(&mission, system, &StraightLengths, begin);
    let table = Timetable::of_mission(&mission, system, &StraightLengths, begin);
    (preview.expect("no circle"), table)
}

fn preview(text: &str) -> MissionPreview {
    preview_at(text, None).0
}

/// `x y` at a time; `?` where it is not known.
fn position(preview: &MissionPreview, speeds: SpeedChoice, robot: usize, time_s: f64) -> String {
    let motion = &preview.schedule(speeds).motions[robot];
    let at = motion.position_at(time_s);
    at.map_or("?".into(), |at| format!("{:.2} {:.2}", at.x_m(), at.y_m()))
}

#[test]
fn a_robot_drives_stops_and_stays_at_its_end() {
    let steps = "<leg name='l1' to='P1'/><stay name='s1' for='4s'/><leg name='l2' to='P2' \
                 speed='2m/s'/>";
    let preview = preview(&undated(["tolerance='25%'", steps], None));
    let check = |speeds, expected: [(f64, &str); 6]| {
        for (time_s, at) in expected {
            assert_eq!(position(&preview, speeds, 0, time_s), at, "{speeds:?} {time_s}");
        }
    };
    let at_first = [(-1.0, "?"), (0.0, "0.00 0.00"), (5.0, "5.00 0.00"), (12.0, "10.00 0.00")];
    let [a, b, c, d] = at_first;
    check(SpeedChoice::Nominal, [a, b, c, d, (16.0, "10.00 4.00"), (18.0, "10.00 8.00")]);
    let early = [(8.0, "10.00 0.00"), (12.0, "10.00 0.00"), (15.2, "10.00 8.00"), (15.3, "?")];
    check(SpeedChoice::Fastest, [(4.0, "5.00 0.00"), early[0], early[1], early[2], early[3], a]);
    let late = [(40.0 / 3.0, "10.00 0.00"), (52.0 / 3.0 + 8.0 / 3.0, "10.00 4.00")];
    check(SpeedChoice::Slowest, [b, (20.0 / 3.0, "5.00 0.00"), late[0], late[1], a, b]);
    let nominal = &preview.schedule(SpeedChoice::Nominal).motions[0];
    assert_eq!(nominal.distance_at(16.0), Some(14.0));
    assert_eq!(nominal.open_step, None);
}

#[test]
fn times_are_those_of_the_timetable() {
    let red = "<leg name='l1' to='P1' by='20s'/><meet name='m1' with='blue'/>\
               <leg name='l2' to='P2' by='20s'/>";
    let blue = "<leg name='l1' to='Q1' speed='0.4m/s' by='1min'/><meet name='m1' with='red' \
                patience='1min'/><leg name='l2' to='Q0' by='20s'/>";
    let text = mission(["", red], Some(["", blue]));
    let (preview, table) = preview_at(&text, Some("2026-11-21T14:29:45Z"));
    assert_eq!(preview.appointments.len(), 7, "{:?}", preview.appointments);
    for (number, appointment) in preview.appointments.iter().enumerate() {
        let route = &preview.robots[appointment.robot].route;
        let is_it = |row: &&armor_robotfile::timing::StepTime| {
            row.route == *route && row.step == appointment.step
        };
        let row = table.steps.iter().find(is_it).expect("a row");
        let expected = [row.earliest, row.nominal, row.latest];
        for ((_, speeds), expected) in SpeedChoice::NAMED.iter().zip(expected) {
            let found = preview.schedule(*speeds).appointments_s[number];
            let expected = expected.map(|time| time.as_secs_f64());
            assert_eq!(found, expected, "{route}.{} {speeds:?}", appointment.step);
        }
    }
    // Red waits at the line from 6 s, 5 s, 7.5 s until 15 s.
    for (speeds, waits_from_s) in [(SpeedChoice::Nominal, 6.0), (SpeedChoice::Slowest, 7.5)] {
        assert_eq!(position(&preview, speeds, 0, waits_from_s), "6.00 0.00");
        assert_eq!(position(&preview, speeds, 0, 15.0), "6.00 0.00");
    }
    // Without a begin nothing after the line is known.
    let unknown = preview_at(&text, None).0;
    let open: Vec<_> = unknown.schedule(SpeedChoice::Nominal).open_robots().collect();
    assert_eq!(open, [(0, 0), (1, 1)], "red at the line, blue at the meeting");
    assert_eq!(unknown.robots[0].steps[0], "l1 to green");
}

#[test]
fn robots_that_cross_meet_when_both_are_at_the_crossing() {
    let text = undated(
        ["tolerance='0' radius='0.5m'", "<leg name='l1' to='P1'/>"],
        Some(["tolerance='0' radius='0.5m'", "<leg name='b1' to='Q1'/>"]),
    );
    let crossing = preview(&text);
    for (_, speeds) in SpeedChoice::NAMED {
        let encounters = &crossing.schedule(speeds).encounters;
        let [encounter] = encounters.as_slice() else { panic!("{encounters:?}") };
        // They approach each other at √2 m/s.
        let around_s = 0.5_f64.sqrt();
        assert!((encounter.from_s - (5.0 - around_s)).abs() < 1e-9, "{encounter:?}");
        assert!((encounter.to_s - (5.0 + around_s)).abs() < 1e-9, "{encounter:?}");
        assert!(encounter.nearest_m < 1e-9 && (encounter.nearest_s - 5.0).abs() < 1e-9);
        assert_eq!((encounter.reach_m, encounter.steps), (1.0, [Some(0), Some(0)]));
    }
    let chances = crossing.draw_chances(1, CHANCE_DRAWS, &|| false).expect("chances");
    let [(robots, chance)] = chances.encounters.as_slice() else { panic!("{chances:?}") };
    assert_eq!((*robots, chance.count), ([0, 1], 1_000));
    // 3 s later the other one is past.
    let later = text.replace("<leg name='b1'", "<stay name='b0' for='3s'/><leg name='b1'");
    let later = preview(&later);
    assert!(later.schedule(SpeedChoice::Nominal).encounters.is_empty());
    assert_eq!(later.draw_chances(1, CHANCE_DRAWS, &|| false).expect("chances").encounters, []);
}

#[test]
fn the_radius_is_that_of_the_route_or_of_its_components_or_the_usual_one() {
    let leg = "<leg name='l1' to='P1'/>";
    for (attributes, expected_m) in
        [("radius='0.3m'", 0.3), ("", 0.18), ("pace='wide.speed'", 0.4), ("components='wide'", 0.4)]
    {
        let preview = preview(&undated([attributes, leg], None));
        assert_eq!(preview.robots[0].radius_m, expected_m, "{attributes}");
    }
}

#[test]
fn a_robot_that_has_ended_is_still_there() {
    let text = undated(
        ["tolerance='0' radius='0.5m'", "<leg name='l1' to='Q1' speed='10m/s'/>"],
        Some(["tolerance='0' radius='0.5m'", "<leg name='b1' to='Q1'/>"]),
    );
    let preview = preview(&text);
    let encounters = &preview.schedule(SpeedChoice::Nominal).encounters;
    let [encounter] = encounters.as_slice() else { panic!("{encounters:?}") };
    assert!((encounter.from_s - 9.0).abs() < 1e-9 && encounter.to_s == 10.0, "{encounter:?}");
    assert_eq!(encounter.steps, [None, Some(0)]);
}

/// The chance that a limit is kept: by 1,000 draws and in its interval.
fn chance(preview: &MissionPreview, limit: usize) -> Option<DrawnChance> {
    preview.draw_chances(7, CHANCE_DRAWS, &|| false).expect("not cancelled").limits[limit]
}

#[test]
fn chances_are_those_of_the_triangular_distribution() {
    // 10 m at 1 m/s times a factor from 0.8 to 1.2: in 10 s by half of the factors, in 11.11 s if the
    // factor is above 0.9, which 1 - (0.1² / (2 · 0.2²)) = 87.5 % are.
    for (by, expected) in
        [("8.3s", 0.0), ("10s", 0.5), ("11.1111111s", 0.875), ("12.5s", 1.0), ("9.0909091s", 0.125)]
    {
        let leg = format!("<leg name='l1' to='P1' by='{by}'/>");
        let preview = preview(&undated(["", &leg], None));
        let chance = chance(&preview, 0).expect("known");
        let [low, high] = chance.interval();
        assert!((low..=high).contains(&expected), "{by}: {chance:?} {low} {high}");
    }
}

#[test]
fn the_chance_of_a_meeting_is_that_of_the_whole_distribution() {
    let red = "<leg name='l1' to='P1'/><meet name='m1' with='blue' patience='1s'/>";
    let blue = "<leg name='l1' to='Q1'/><meet name='m1' with='red' patience='20s'/>";
    let preview = preview(&undated(["", red], Some(["tolerance='10%'", blue])));
    // The factors at 2,000 equal shares of each distribution.
    let factors = |tolerance: f64| {
        (0..2_000).map(move |number| {
            let share = (f64::from(number) + 0.5) / 2_000.0;
            match share < 0.5 {
                true => 1.0 - tolerance + tolerance * (2.0 * share).sqrt(),
                false => 1.0 + tolerance - tolerance * (2.0 - 2.0 * share).sqrt(),
            }
        })
    };
    let both = factors(0.2).flat_map(|red| factors(0.1).map(move |blue| (10.0 / red, 10.0 / blue)));
    let kept = both.filter(|(red_s, blue_s)| blue_s - red_s <= 1.0).count();
    let expected = kept as f64 / 4e6;
    assert!((0.5..0.95).contains(&expected), "{expected}");
    let chance = chance(&preview, 0).expect("known");
    let [low, high] = chance.interval();
    assert!((low..=high).contains(&expected), "{chance:?} {low} {high} {expected}");
    let all = preview.draw_chances(7, CHANCE_DRAWS, &|| false).expect("chances").all;
    assert_eq!(all, Some(chance), "the other limit is always kept");
}

#[test]
fn the_same_seed_gives_the_same_chances_and_a_cancelled_draw_gives_none() {
    let leg = "<leg name='l1' to='P1' by='10s'/><leg name='l2' to='P2' by='8.5s'/>";
    let preview = preview(&undated(["", leg], None));
    let draw = |seed| preview.draw_chances(seed, CHANCE_DRAWS, &|| false).expect("chances");
    assert_eq!(draw(3), draw(3));
    assert_ne!(draw(3), draw(4));
    assert_eq!(preview.draw_chances(3, CHANCE_DRAWS, &|| true), None);
    let few = NonZeroU32::new(10).expect("ten");
    let few = preview.draw_chances(3, few, &|| false).expect("chances");
    assert_eq!(few.limits[0].expect("known").draws.get(), 10);
}

#[test]
fn what_is_not_known_has_no_chance_but_a_leg_after_it_has() {
    let steps = "<stay name='s1' on='way.waypoint'/><leg name='l1' to='P1' by='12s'/>\
                 <leg name='l2' to='P2' by='20s' not-after='2026-11-21T14:30:00Z'/>";
    let preview = preview_at(&undated(["", steps], None), Some("2026-11-21T14:29:00Z")).0;
    let chances = preview.draw_chances(1, CHANCE_DRAWS, &|| false).expect("chances");
    let is_known: Vec<_> = chances.limits.iter().map(Option::is_some).collect();
    let words: Vec<_> = preview.limits.iter().map(|limit| limit.words.as_str()).collect();
    assert_eq!(words, ["by 12 s", "by 20 s", "not after 2026-11-21T14:30:00Z"]);
    assert_eq!((is_known, chances.all), (vec![true, true, false], None));
    let schedule = preview.schedule(SpeedChoice::Fastest);
    assert_eq!(schedule.open_robots().collect::<Vec<_>>(), [(0, 0)]);
    assert_eq!(schedule.motions[0].position_at(0.1), None);
}

#[test]
fn a_route_that_a_place_begins_is_not_known() {
    let leg = "<leg name='l1' to='P1'/>";
    let text = undated(["in='over'", leg], Some(["", "<leg name='b1' to='Q1'/>"]));
    let preview = preview(&text);
    let schedule = preview.schedule(SpeedChoice::Nominal);
    assert_eq!(schedule.open_robots().collect::<Vec<_>>(), [(0, 0)]);
    assert_eq!(schedule.motions[0].position_at(0.0), None);
    assert_eq!(schedule.motions[1].position_at(10.0).map(|at| at.y_m()), Some(5.0));
}

/// Prints what the preview of 8 routes of 50 legs costs, which cross each other:
/// `cargo test -p armor-robotfile costs_of -- --ignored --nocapture`.
#[test]
#[ignore = "prints a measurement"]
fn costs_of_eight_routes_of_fifty_legs() {
    let (mut marks, mut routes) = (String::new(), String::new());
    let mut random = fastrand::Rng::with_seed(8);
    for route in 0..8 {
        let mut legs = String::new();
        for leg in 0..=50 {
            let (x, y) = (random.u32(..400), random.u32(..400));
            marks += &format!("<point name='P{route}-{leg}' at='{x} {y}'/>");
            if leg > 0 {
                legs +=
                    &format!("<leg name='l{leg}' to='P{route}-{leg}' speed='1m/s' by='10min'/>");
            }
        }
        routes += &format!(
            "<route name='r{route}' mover='way.route' start='P{route}-0' radius='0.5m'>{legs}\
             </route>"
        );
    }
    let text = format!(
        "<armor version='1'>{SYSTEM}<mission goal='over' safe='hold'><map>{marks}</map>{routes}\
         <place name='over'/><place name='hold'/></mission></armor>"
    );
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    let configuration = reading.configuration.expect("a configuration");
    let mission = configuration.mission.expect("a mission");
    let begin = std::time::Instant::now();
    let system = &configuration.system;
    let preview = MissionPreview::of_mission(&mission, system, &StraightLengths, None);
    let preview = preview.expect("no circle");
    let shown = begin.elapsed();
    let chances = preview.draw_chances(1, CHANCE_DRAWS, &|| false).expect("chances");
    let counts = SpeedChoice::NAMED.map(|(_, speeds)| preview.schedule(speeds).encounters.len());
    let drawn = begin.elapsed() - shown;
    println!("three schedules {shown:?}, encounters {counts:?}; {CHANCE_DRAWS} draws {drawn:?}");
    println!("pairs that meet: {}", chances.encounters.len());
}
