//! Rehearsals: drawn plans in the worlds of the simulator, played by `armor mission rehearse`; how far the
//! times that were predicted are from those driven.
//!
//! A plan is drawn by its seed: points in free space that a robot can reach, two to four legs between them,
//! speeds, a stay, and a no-go zone next to the legs. Its grid is the truth of the world.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use armor_grid::{Cell, Grid, Occupancy, Point2, distance_transform};
use armor_simulator::world::World;
use serde_json::Value;

use crate::reliability::dice::FaultDice;

/// The worlds, each a drawing of `missions/worlds`.
const WORLDS: [&str; 5] = ["office", "rooms", "ring", "hall", "warehouse"];
/// The robot, with the components of `missions/drawn.xml`.
const ROBOT: &str = include_str!("../../missions/drawn.xml");
const RESOLUTION_M: f64 = 0.05;
const RADIUS_M: f64 = 0.25;
/// Points keep this from walls and furniture: the planner refuses a goal where the robot cannot stand.
const ROOM_M: f64 = 0.45;
/// The straight distance of two points of a leg.
const LEG_M: (f64, f64) = (1.5, 9.0);
/// The drawn speeds, in metres per second.
const SPEEDS: [f64; 4] = [0.4, 0.5, 0.6, 0.8];
/// Half the side of the no-go zone, and what its centre keeps from each leg: with its corner, its margin of
/// 0.2 m and the robot.
const ZONE_M: f64 = 0.3;
const ZONE_APART_M: f64 = 1.0;
/// Attempts to draw a point, a zone, or a plan that the check accepts.
const TRIES: usize = 400;
/// The goals: shares, and counts of runs.
const ERROR_GOAL: f64 = 0.1;

/// What is rehearsed.
pub struct RehearsalOptions {
    /// The program `armor`; by default the one next to this program.
    pub program: Option<PathBuf>,
    /// The worlds; all without one.
    pub worlds: Vec<String>,
    /// Plans in each world.
    pub plans: u64,
    /// The seed of the first plan.
    pub seed: u64,
    /// Times real time.
    pub speed: f64,
}

/// The figures of all runs.
#[derive(Default)]
struct RehearsalFigures {
    runs: usize,
    /// Shares by which legs took longer than predicted.
    legs: Vec<f64>,
    /// The same of what remained at half-way.
    half_way: Vec<f64>,
    /// Runs that did not end at their goal.
    not_at_goal: usize,
    /// Runs outside the proven duration.
    too_long: usize,
    /// Steps outside of their earliest and latest times.
    outside: usize,
    steps: usize,
    /// Zones that a robot was in.
    entered: usize,
    zones: usize,
}

/// Rehearses and prints the table.
///
/// # Errors
/// If a plan cannot be drawn or rehearsed.
pub fn measure_rehearsals(options: &RehearsalOptions) -> Result<()> {
    let program = match &options.program {
        Some(program) => program.clone(),
        None => std::env::current_exe()?.with_file_name("armor"),
    };
    ensure!(program.exists(), "{} does not exist: give --armor", program.display());
    if let Some(unknown) = options.worlds.iter().find(|it| !WORLDS.contains(&it.as_str())) {
        bail!("there is no world `{unknown}` to rehearse in, but {}", WORLDS.join(", "));
    }
    let folder = std::env::temp_dir().join(format!("armor-bench-{}", std::process::id()));
    let mut rows = Vec::new();
    let mut all = RehearsalFigures::default();
    for world in WORLDS {
        if !options.worlds.is_empty() && !options.worlds.iter().any(|wanted| wanted == world) {
            continue;
        }
        let site = RehearsalSite::open(world, &folder)?;
        let mut figures = RehearsalFigures::default();
        for number in 0..options.plans {
            site.rehearse(&program, options.seed + number, options.speed, &mut figures)?;
        }
        rows.push(figures.to_row(world));
        all.add(figures);
    }
    rows.push(all.to_row("all"));
    println!(
        "| world | runs | legs | error of a leg, p90 | mean | ETA at half-way, p90 | steps outside their \
         bounds | not at the goal | outside the proven duration | in a no-go zone |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for row in rows {
        println!("{row}");
    }
    println!("| *goal* | | | ≤ {0:.0} % | | ≤ {0:.0} % | | | 0 | 0 |", ERROR_GOAL * 100.0);
    let _ = std::fs::remove_dir_all(folder);
    Ok(())
}

/// A world, and the folder of its plans.
struct RehearsalSite {
    world: String,
    folder: PathBuf,
    /// Cells that the robot can reach from its start with room around it, and their numbers.
    open: Grid<bool>,
    cells: Vec<Cell>,
}

impl RehearsalSite {
    fn open(name: &str, folder: &Path) -> Result<Self> {
        let worlds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/worlds");
        let file = worlds.join(format!("{name}.svg"));
        let world = World::read_from(&file, &Default::default())
            .with_context(|| file.display().to_string())?;
        let cells = world.free_space(RESOLUTION_M)?;
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder)?;
        write_grid(&cells, &folder)?;
        let room = distance_transform(&cells.map(|cell| *cell != Occupancy::Free));
        let roomy = room.map(|room_m| f64::from(*room_m) > ROOM_M);
        let open = reach_from(&roomy, roomy.geometry().cell_at(Point2::default()));
        let cells = open.iter().filter(|(_, is_open)| **is_open).map(|(cell, _)| cell).collect();
        Ok(Self { world: file.display().to_string(), folder, open, cells })
    }

    /// Draws a plan, rehearses it, and adds its figures.
    fn rehearse(
        &self,
        program: &Path,
        seed: u64,
        speed: f64,
        figures: &mut RehearsalFigures,
    ) -> Result<()> {
        let mut dice = FaultDice::new(seed);
        let file = self.folder.join(format!("plan-{seed}.xml"));
        for _ in 0..TRIES {
            std::fs::write(&file, self.draw_plan(&mut dice)?)?;
            let check = Command::new(program).arg("check").arg(&file).output()?;
            if check.status.success() {
                let mut command = Command::new(program);
                command.args(["mission", "rehearse", "--format", "json", "--speed"]);
                let output = command.arg(speed.to_string()).arg(&file).output()?;
                let text = String::from_utf8_lossy(&output.stdout);
                return figures.read_records(&text).with_context(|| {
                    let said = String::from_utf8_lossy(&output.stderr).into_owned();
                    format!("{}: {said}", file.display())
                });
            }
        }
        bail!("{}: no plan was accepted", self.folder.display())
    }

    /// The text of a plan; the check may refuse it, where its zone closes a path.
    fn draw_plan(&self, dice: &mut FaultDice) -> Result<String> {
        let (system, _) = ROBOT.split_once("  <!-- Simulator, mapper").context("the robot")?;
        let system = system.replace("worlds/office.svg", &self.world);
        // The planner knows what the times are computed with.
        let system = system.replace(
            "<component name=\"chart\" kind=\"chart\"/>",
            "<component name=\"chart\" kind=\"chart\"><parameter name=\"grid\" \
             value=\"grid.yaml\"/></component>",
        );
        let link = "<link from=\"mapper.map\" to=\"planner.map\"/>";
        let system = system.replace(link, &link.replace("mapper", "chart"));
        let mut points = vec![Point2::default()];
        let mut steps = String::new();
        let legs = 2 + dice.draw_below(3);
        let stays_after = dice.draw_below(legs);
        for leg in 0..legs {
            let from = points[points.len() - 1];
            let to = self.draw_point(dice, from)?;
            points.push(to);
            let speed_mps = dice.choose(&SPEEDS).copied().unwrap_or(SPEEDS[0]);
            writeln!(
                steps,
                "      <leg name=\"l{leg}\" to=\"P{}\" speed=\"{speed_mps}m/s\" by=\"3min\"/>",
                leg + 1
            )?;
            if leg == stays_after {
                writeln!(steps, "      <stay name=\"s1\" for=\"2s\"/>")?;
            }
        }
        let mut map = String::new();
        for (number, point) in points.iter().enumerate() {
            writeln!(
                map,
                "      <point name=\"P{number}\" at=\"{:.2} {:.2}\"/>",
                point.x_m, point.y_m
            )?;
        }
        if let Some(Point2 { x_m, y_m }) = self.draw_zone(dice, &points) {
            let (west, east) = (x_m - ZONE_M, x_m + ZONE_M);
            let (south, north) = (y_m - ZONE_M, y_m + ZONE_M);
            writeln!(
                map,
                "      <zone name=\"closed\" kind=\"no-go\" margin=\"0.2m\" shape=\"{west:.2},{south:.2} \
                 {east:.2},{south:.2} {east:.2},{north:.2} {west:.2},{north:.2}\"/>"
            )?;
        }
        Ok(format!(
            "{system}  <mission name=\"plan\" goal=\"over\" safe=\"hold\">\n    <map grid=\"grid.yaml\">\n\
             {map}    </map>\n    <route name=\"red\" mover=\"way.route\" pace=\"driver.speed\" \
             pose=\"mapper.pose\" start=\"P0\" out=\"over\" radius=\"{RADIUS_M}m\">\n{steps}      \
             <otherwise on=\"blocked late\" do=\"hold\"/>\n    </route>\n    <place name=\"over\"/>\n    \
             <place name=\"hold\"/>\n  </mission>\n</armor>\n"
        ))
    }

    fn draw_point(&self, dice: &mut FaultDice, from: Point2) -> Result<Point2> {
        for _ in 0..TRIES {
            let Some(cell) = dice.choose(&self.cells) else { break };
            let point = self.open.geometry().centre(*cell);
            if (LEG_M.0..LEG_M.1).contains(&from.distance_m(point)) {
                return Ok(point);
            }
        }
        bail!("{}: no point is near enough to {from:?}", self.folder.display())
    }

    /// The centre of a zone that no leg comes near to, if there is one.
    fn draw_zone(&self, dice: &mut FaultDice, points: &[Point2]) -> Option<Point2> {
        (0..TRIES).find_map(|_| {
            let centre = self.open.geometry().centre(*dice.choose(&self.cells)?);
            let is_apart =
                |leg: &[Point2]| distance_to_leg_m(centre, leg[0], leg[1]) > ZONE_APART_M;
            points.windows(2).all(is_apart).then_some(centre)
        })
    }
}

fn distance_to_leg_m(point: Point2, from: Point2, to: Point2) -> f64 {
    let along = Point2::new(to.x_m - from.x_m, to.y_m - from.y_m);
    let length_m2 = (along.x_m * along.x_m + along.y_m * along.y_m).max(1e-9);
    let dot = (point.x_m - from.x_m) * along.x_m + (point.y_m - from.y_m) * along.y_m;
    point.distance_m(from.toward(to, (dot / length_m2).clamp(0.0, 1.0)))
}

/// The cells of `open` that are connected with the nearest one to a cell.
fn reach_from(open: &Grid<bool>, start: Cell) -> Grid<bool> {
    let mut reached = Grid::filled(*open.geometry(), false);
    let is_open = |cell: Cell| open.get(cell) == Some(&true);
    let all = open.iter().filter(|(_, is_open)| **is_open).map(|(cell, _)| cell);
    let nearest = all.min_by(|one, two| one.distance(start).total_cmp(&two.distance(start)));
    let mut queue: Vec<Cell> = nearest.into_iter().collect();
    while let Some(cell) = queue.pop() {
        if is_open(cell) && !std::mem::replace(&mut reached[cell], true) {
            queue.extend(cell.edge_neighbours());
        }
    }
    reached
}

/// Writes the truth as a map of `map_server`.
fn write_grid(cells: &Grid<Occupancy>, folder: &Path) -> Result<()> {
    let geometry = cells.geometry();
    let mut picture = format!("P5\n{} {}\n255\n", geometry.width, geometry.height).into_bytes();
    for row in cells.values().chunks(geometry.width).rev() {
        picture.extend(row.iter().map(|cell| match cell {
            Occupancy::Free => 254,
            Occupancy::Occupied => 0,
            Occupancy::Unknown => 205,
        }));
    }
    std::fs::write(folder.join("grid.pgm"), picture)?;
    let corner = geometry.centre(Cell::new(0, 0));
    let half_m = geometry.resolution_m / 2.0;
    let description = format!(
        "image: grid.pgm\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        geometry.resolution_m,
        corner.x_m - half_m,
        corner.y_m - half_m
    );
    Ok(std::fs::write(folder.join("grid.yaml"), description)?)
}

impl RehearsalFigures {
    /// Adds what a rehearsal has printed.
    fn read_records(&mut self, text: &str) -> Result<()> {
        let mut has_ended = false;
        for line in text.lines() {
            let record: Value = serde_json::from_str(line).context("a line is no JSON")?;
            let number = |value: &Value, key: &str| value.get(key).and_then(Value::as_f64);
            if record.get("step").is_some() {
                self.steps += 1;
                self.outside += usize::from(record["within"] == Value::Bool(false));
                let is_leg = record["leg"] == Value::Bool(true);
                let both = number(&record, "length_s").zip(number(&record, "nominal_length_s"));
                if let Some((driven_s, nominal_s)) = both.filter(|it| is_leg && it.1 > 0.0) {
                    self.legs.push(driven_s / nominal_s - 1.0);
                }
            } else if let Some(zone) = record.get("zone") {
                self.zones += 1;
                self.entered += usize::from(zone["entered"] == Value::Bool(true));
            } else if let Some(end) = record.get("end") {
                has_ended = true;
                self.runs += 1;
                self.not_at_goal += usize::from(end["outcome"] != "goal");
                self.too_long += usize::from(end["within_proven"] == Value::Bool(false));
                let errors = end["half_way_errors"].as_array();
                self.half_way.extend(errors.into_iter().flatten().filter_map(Value::as_f64));
                eprintln!("{end}");
            }
        }
        ensure!(has_ended, "it has not ended");
        Ok(())
    }

    fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.legs.extend(other.legs);
        self.half_way.extend(other.half_way);
        self.not_at_goal += other.not_at_goal;
        self.too_long += other.too_long;
        self.outside += other.outside;
        self.steps += other.steps;
        self.entered += other.entered;
        self.zones += other.zones;
    }

    fn to_row(&self, name: &str) -> String {
        let percent =
            |share: Option<f64>| share.map_or("-".into(), |it| format!("{:.1} %", it * 100.0));
        let mean =
            (!self.legs.is_empty()).then(|| self.legs.iter().sum::<f64>() / self.legs.len() as f64);
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} of {} | {} | {} | {} of {} |",
            self.runs,
            self.legs.len(),
            percent(find_p90(&self.legs)),
            percent(mean),
            percent(find_p90(&self.half_way)),
            self.outside,
            self.steps,
            self.not_at_goal,
            self.too_long,
            self.entered,
            self.zones
        )
    }
}

/// The smallest size that nine of ten errors are not above.
fn find_p90(errors: &[f64]) -> Option<f64> {
    let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let rank = (sizes.len() * 9).div_ceil(10);
    sizes.get(rank.checked_sub(1)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_counted() {
        let mut figures = RehearsalFigures::default();
        let text = r#"{"position":{}}
{"step":"l1","leg":true,"length_s":11.0,"nominal_length_s":10.0,"within":true}
{"step":"s1","leg":false,"length_s":2.0,"nominal_length_s":2.0,"within":false}
{"zone":{"entered":true}}
{"end":{"outcome":"safe","within_proven":false,"half_way_errors":[-0.5]}}"#;
        figures.read_records(text).expect("records");
        assert!((figures.legs[0] - 0.1).abs() < 1e-9 && figures.legs.len() == 1);
        assert_eq!(
            figures.to_row("x"),
            "| x | 1 | 1 | 10.0 % | 10.0 % | 50.0 % | 1 of 2 | 1 | 1 | 1 of 1 |"
        );
        assert!(figures.read_records("").is_err(), "nothing has ended");
    }

    #[test]
    fn every_world_has_plans_and_a_seed_repeats_them() {
        let folder = std::env::temp_dir().join(format!("armor-plans-{}", std::process::id()));
        for world in WORLDS {
            let site = RehearsalSite::open(world, &folder).expect(world);
            let draw = |seed| site.draw_plan(&mut FaultDice::new(seed)).expect(world);
            assert_eq!(draw(1), draw(1));
            assert_ne!(draw(1), draw(2));
        }
        std::fs::remove_dir_all(folder).expect("it is there");
    }
}
