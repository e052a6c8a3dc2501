//! The items of a planned route as the legs and stays of a drawn one. Pure.

use std::collections::BTreeMap;

use armor_exchange::{MavlinkCommand, PlanItem, PlanNote, PlanPosition, PlannedRoute};
use armor_robotfile::MAX_ROUTE_STEPS;

use super::drawing::{DrawingError, DrawingOptions};
use super::play_order::{MOST_REPEATED, describe_repetition, pass_once, play_items};

/// Shorter stays are none.
const SHORTEST_STAY_S: f64 = 0.001;

/// A leg or stay.
#[derive(Clone, Debug)]
pub(super) struct PlannedStep {
    pub(super) action: StepAction,
    /// What is noted above it, without counterpart.
    pub(super) comments: Vec<String>,
}

#[derive(Clone, Debug)]
pub(super) enum StepAction {
    /// A drive.
    Leg {
        to: PlanPosition,
        /// The name of the point, if the plan has one.
        name: Option<String>,
        /// How messages name the position.
        place: String,
        speed_mps: Option<f64>,
        /// Whether the camera takes pictures on it.
        with_camera: bool,
    },
    /// A stop for some seconds.
    Stay(f64),
    /// A stop until the camera has taken a picture.
    Picture,
}

/// The steps of a route.
#[derive(Debug, Default)]
pub(super) struct PlannedSteps {
    pub(super) steps: Vec<PlannedStep>,
    /// Where the robot is at first, and where a return leads.
    pub(super) home: Option<PlanPosition>,
    /// What is noted behind the last step.
    pub(super) last_comments: Vec<String>,
    /// What has no counterpart.
    pub(super) notes: Vec<PlanNote>,
}

impl PlannedSteps {
    /// Whether it leads nowhere.
    pub(super) fn is_empty(&self) -> bool {
        !self.steps.iter().any(|step| matches!(step.action, StepAction::Leg { .. }))
    }
}

/// Where an item leads the robot.
pub(super) fn position_of(item: &PlanItem) -> Option<PlanPosition> {
    match item {
        PlanItem::Other(command) => command.leads_to(),
        item => item.position(),
    }
}

/// Returns the steps of a route: counted repetitions are written out, unless the route would be too
/// long. `read` are the notes of reading the plan.
///
/// # Errors
/// If it has too many steps even without repetitions.
pub(super) fn plan_steps(
    route: &PlannedRoute,
    home: Option<PlanPosition>,
    options: &DrawingOptions,
    read: &[PlanNote],
) -> Result<PlannedSteps, DrawingError> {
    let items = route.items.as_slice();
    let mut read_notes = BTreeMap::<usize, Vec<String>>::new();
    for note in read {
        if let Some(item) = note.item {
            read_notes.entry(item).or_default().push(note.to_string());
        }
    }
    let play = |order: &[usize], written_out: Result<(), String>| {
        let mut player = ItemPlayer::new(items, home, options, &read_notes);
        order.iter().for_each(|index| player.play_item(*index));
        player.end(&written_out)
    };
    let whole = play_items(items).map(|order| play(&order, Ok(())));
    let most = MAX_ROUTE_STEPS;
    let reason = match whole {
        Some(whole) if whole.steps.len() <= most => return Ok(whole),
        Some(whole) => {
            let count = whole.steps.len();
            format!(
                "written out, the route has {count} legs and stays, and at most {most} are drawn; \
                 plan fewer passes, or divide the route in the planner"
            )
        }
        None => format!(
            "written out, the route has more than {MOST_REPEATED} items, and at most {most} legs and \
             stays are drawn; plan fewer passes"
        ),
    };
    let once = play(&pass_once(items), Err(reason));
    let steps = once.steps.len();
    if steps > most { Err(DrawingError::TooManySteps { steps, most }) } else { Ok(once) }
}

/// Carries out the items one after the other, and keeps what they leave behind.
struct ItemPlayer<'a> {
    items: &'a [PlanItem],
    options: &'a DrawingOptions,
    read: &'a BTreeMap<usize, Vec<String>>,
    steps: PlannedSteps,
    /// Whether an item was carried out before: what is noted of it is noted once.
    noted: Vec<bool>,
    /// Comments for the next step.
    pending: Vec<String>,
    speed_mps: Option<f64>,
    with_camera: bool,
    at: Option<(f64, f64)>,
    current: usize,
}

impl<'a> ItemPlayer<'a> {
    fn new(
        items: &'a [PlanItem],
        home: Option<PlanPosition>,
        options: &'a DrawingOptions,
        read: &'a BTreeMap<usize, Vec<String>>,
    ) -> Self {
        Self {
            items,
            options,
            read,
            steps: PlannedSteps { home, ..PlannedSteps::default() },
            noted: vec![false; items.len()],
            pending: Vec::new(),
            speed_mps: None,
            with_camera: false,
            at: home.as_ref().map(degrees_of),
            current: 0,
        }
    }

    fn play_item(&mut self, index: usize) {
        self.current = index;
        if !self.noted[index] && !matches!(self.items[index], PlanItem::Other(_)) {
            let about = self.read.get(&index).into_iter().flatten();
            self.pending.extend(about.cloned());
        }
        let items = self.items;
        match &items[index] {
            PlanItem::Go { position, stay_s, name } => {
                self.add_leg(position, name.clone());
                if *stay_s > 0.0 {
                    self.add_stay(*stay_s);
                }
            }
            PlanItem::TakeOff { position, .. } => self.lead_to(position.as_ref(), "the take-off"),
            PlanItem::Land(position) => self.lead_to(position.as_ref(), "the landing"),
            PlanItem::Loiter { position, time_s, radius_m } => {
                if let Some(position) = position.filter(|it| self.at != Some(degrees_of(it))) {
                    self.add_leg(&position, None);
                }
                if *radius_m != 0.0 {
                    let radius = radius_m.abs();
                    self.note(format!(
                        "the circle of {radius} m around the position is a stay at it"
                    ));
                }
                self.add_stay(*time_s);
            }
            PlanItem::Return => self.return_home(),
            PlanItem::Delay(seconds) => self.add_stay(*seconds),
            PlanItem::Repeat { .. } => {}
            PlanItem::Speed(speed) => self.set_speed(*speed),
            PlanItem::LookAt(position) => {
                let (latitude, longitude) = degrees_of(position);
                self.note(format!("the camera to {latitude} {longitude} has no counterpart"));
            }
            PlanItem::LookAhead => self.note("the camera ahead has no counterpart".to_owned()),
            PlanItem::TakePictures { interval_s, count } => self.take_pictures(*interval_s, *count),
            PlanItem::StopPictures => self.stop_pictures(),
            PlanItem::Other(command) => self.follow_command(command),
        }
        self.noted[index] = true;
    }

    /// The steps, with what is noted of repetitions.
    fn end(mut self, written_out: &Result<(), String>) -> PlannedSteps {
        let items = self.items;
        for (index, item) in items.iter().enumerate() {
            self.current = index;
            let PlanItem::Repeat { to, times } = item else { continue };
            let text = describe_repetition(index, *to, *times, written_out.clone());
            if let Some(text) = text {
                self.note(text);
            }
        }
        self.steps.last_comments = self.pending;
        self.steps
    }

    /// Notes what has no counterpart, once for an item.
    fn note(&mut self, text: String) {
        let index = self.current;
        if self.noted[index] {
            return;
        }
        let note = PlanNote { place: format!("item {}", index + 1), text, item: Some(index) };
        self.pending.push(note.to_string());
        self.steps.notes.push(note);
    }

    fn add_step(&mut self, action: StepAction) {
        let comments = std::mem::take(&mut self.pending);
        self.steps.steps.push(PlannedStep { action, comments });
    }

    fn add_leg(&mut self, to: &PlanPosition, name: Option<String>) {
        let place = format!("item {}", self.current + 1);
        let (speed_mps, with_camera) = (self.speed_mps, self.with_camera);
        self.at = Some(degrees_of(to));
        self.add_step(StepAction::Leg { to: *to, name, place, speed_mps, with_camera });
    }

    fn add_stay(&mut self, seconds: f64) {
        if seconds >= SHORTEST_STAY_S {
            self.add_step(StepAction::Stay(seconds));
        } else {
            self.note(format!("a stay of {seconds} s is none"));
        }
    }

    /// A take-off or landing: a leg, unless the robot is there.
    fn lead_to(&mut self, position: Option<&PlanPosition>, what: &str) {
        match position.filter(|position| self.at != Some(degrees_of(position))) {
            Some(position) => {
                self.note(format!("{what} is driven as a leg to its position"));
                self.add_leg(position, None);
            }
            None => self.note(format!("{what} has no counterpart")),
        }
    }

    fn return_home(&mut self) {
        match self.steps.home {
            Some(home) if self.at == Some(degrees_of(&home)) => {}
            Some(home) => self.add_leg(&home, None),
            None => {
                self.note(
                    "the return has no counterpart: the plan has no home position".to_owned(),
                );
            }
        }
    }

    fn set_speed(&mut self, speed: f64) {
        if speed <= 0.0 {
            self.note(format!("a speed of {speed} m/s has no counterpart"));
        } else if self.options.pace.is_none() {
            self.note(format!(
                "the speed of {speed} m/s is left out: the option pace names the parameter for it"
            ));
        } else {
            self.speed_mps = Some(speed);
        }
    }

    fn take_pictures(&mut self, interval_s: f64, count: u32) {
        let many = match count {
            0 => format!("pictures every {interval_s} s"),
            1 => "a picture".to_owned(),
            count => format!("{count} pictures every {interval_s} s"),
        };
        if self.options.camera.is_none() {
            self.note(format!("{many}: left out; the option camera names the component for it"));
        } else if count == 1 {
            self.add_step(StepAction::Picture);
        } else {
            self.note(format!(
                "{many}: the camera is active on the legs until pictures are stopped"
            ));
            self.with_camera = true;
        }
    }

    fn stop_pictures(&mut self) {
        if !self.with_camera {
            self.note("the end of pictures has no counterpart: none are taken".to_owned());
        }
        self.with_camera = false;
    }

    /// A command that the plan keeps as it is: a leg if it leads somewhere.
    fn follow_command(&mut self, command: &MavlinkCommand) {
        let number = command.command;
        let parameters = command.parameters.map(|value| match value {
            Some(value) => value.to_string(),
            None => "nan".to_owned(),
        });
        let parameters = parameters.join(" ");
        match command.leads_to() {
            Some(position) => {
                self.note(format!(
                    "the MAVLink command {number} ({parameters}) is driven as a leg to its position"
                ));
                self.add_leg(&position, None);
            }
            None => {
                self.note(format!(
                    "the MAVLink command {number} ({parameters}) has no counterpart"
                ));
            }
        }
    }
}

fn degrees_of(position: &PlanPosition) -> (f64, f64) {
    (position.latitude_deg, position.longitude_deg)
}
