//! What the strip shows, computed on a thread of its own: again for each change of the file.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use armor_robotfile::timing::{
    CHANCE_DRAWS, MissionChances, MissionPreview, RobotMotion, SpeedChoice, StraightLengths,
};
use armor_robotfile::{Configuration, Date};
use eframe::egui;

/// The seed of the draws: the chances of a file are always the same.
const SEED: u64 = 1;

/// The revision of the files, and the begin of the mission.
type ForecastKey = (u64, Option<Date>);

/// The times of a mission, and the lines of their diagram.
pub struct Forecast {
    /// Where the robots are at each time.
    pub preview: MissionPreview,
    /// How probable it is that limits are kept; none while it is computed.
    pub chances: Option<MissionChances>,
    /// For each robot: between the earliest and the latest times.
    pub bands: Vec<TimeBand>,
    /// For each choice of speeds and each robot: seconds, and metres along its route.
    pub lines: [Vec<Vec<[f64; 2]>>; 3],
}

/// How far along its route a robot is at least and at most.
#[derive(Default)]
pub struct TimeBand {
    pub times_s: Vec<f64>,
    pub least_m: Vec<f64>,
    pub most_m: Vec<f64>,
}

enum ForecastPart {
    Times(Option<Box<Forecast>>),
    Chances(MissionChances),
}

/// The thread that computes, and what it has found.
#[derive(Default)]
pub struct Forecaster {
    wanted: Option<ForecastKey>,
    work: Option<ForecastWork>,
    forecast: Option<Box<Forecast>>,
}

struct ForecastWork {
    is_cancelled: Arc<AtomicBool>,
    found: Receiver<ForecastPart>,
}

impl Drop for ForecastWork {
    fn drop(&mut self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }
}

impl Forecaster {
    /// What was computed last.
    pub fn forecast(&self) -> Option<&Forecast> {
        self.forecast.as_deref()
    }

    /// Whether something of the present file is still computed.
    pub fn is_computing(&self) -> bool {
        self.work.is_some()
    }

    /// Ends the work, and forgets what was computed.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// Takes what was computed, and begins again if the file or the begin has changed.
    pub fn follow(
        &mut self,
        ctx: &egui::Context,
        configuration: Option<&Configuration>,
        key: ForecastKey,
    ) {
        if self.wanted != Some(key) {
            self.wanted = Some(key);
            // A file that cannot be read keeps the times of before, as it keeps the map.
            self.work = configuration.and_then(|it| ForecastWork::begin(ctx, it, key.1));
        }
        let Some(work) = &self.work else { return };
        loop {
            match work.found.try_recv() {
                Ok(ForecastPart::Times(forecast)) => self.forecast = forecast,
                Ok(ForecastPart::Chances(chances)) => {
                    if let Some(forecast) = &mut self.forecast {
                        forecast.chances = Some(chances);
                    }
                }
                Err(std::sync::mpsc::TryRecvError::Empty) => break,
                Err(std::sync::mpsc::TryRecvError::Disconnected) => {
                    self.work = None;
                    break;
                }
            }
        }
    }
}

impl ForecastWork {
    fn begin(
        ctx: &egui::Context,
        configuration: &Configuration,
        begin: Option<Date>,
    ) -> Option<Self> {
        let mission = configuration.mission.clone()?;
        let system = configuration.system.clone();
        let is_cancelled = Arc::new(AtomicBool::new(false));
        let (outbox, found) = channel();
        let (ctx, is_over) = (ctx.clone(), Arc::clone(&is_cancelled));
        let compute = move || {
            let preview = MissionPreview::of_mission(&mission, &system, &StraightLengths, begin);
            send_parts(preview, &outbox, &is_over, &ctx);
            drop(outbox);
            // The window learns that there is no more.
            ctx.request_repaint();
        };
        match std::thread::Builder::new().name("times".into()).spawn(compute) {
            Ok(_) => Some(Self { is_cancelled, found }),
            Err(error) => {
                tracing::error!(%error, "There are no times: no thread could be started");
                None
            }
        }
    }
}

fn send_parts(
    preview: Option<MissionPreview>,
    outbox: &Sender<ForecastPart>,
    is_over: &AtomicBool,
    ctx: &egui::Context,
) {
    let drawn = preview.clone();
    let forecast = preview.map(|preview| Box::new(Forecast::of_preview(preview)));
    // Sending fails only if the strip was closed or the file has changed.
    let _ = outbox.send(ForecastPart::Times(forecast));
    ctx.request_repaint();
    let is_cancelled = || is_over.load(Ordering::Relaxed);
    let chances = drawn.and_then(|it| it.draw_chances(SEED, CHANCE_DRAWS, &is_cancelled));
    if let Some(chances) = chances {
        let _ = outbox.send(ForecastPart::Chances(chances));
    }
}

impl Forecast {
    fn of_preview(preview: MissionPreview) -> Self {
        let motions = |speeds| &preview.schedule(speeds).motions;
        let both = motions(SpeedChoice::Fastest).iter().zip(motions(SpeedChoice::Slowest));
        let bands = both.map(|(early, late)| TimeBand::between(early, late)).collect();
        let lines =
            SpeedChoice::NAMED.map(|(_, speeds)| motions(speeds).iter().map(list_points).collect());
        Self { preview, chances: None, bands, lines }
    }
}

fn list_points(motion: &RobotMotion) -> Vec<[f64; 2]> {
    let first = motion.pieces.first().map(|piece| [piece.start_s, piece.from_m]);
    let ends = motion.pieces.iter().map(|piece| [piece.end_s, piece.to_m]);
    first.into_iter().chain(ends).collect()
}

impl TimeBand {
    fn between(early: &RobotMotion, late: &RobotMotion) -> Self {
        let ends = early.pieces.iter().chain(&late.pieces);
        let mut times_s: Vec<_> = ends.flat_map(|piece| [piece.start_s, piece.end_s]).collect();
        times_s.sort_by(f64::total_cmp);
        times_s.dedup();
        // Where it is after what is known: at least as far as then.
        let distance = |motion: &RobotMotion, time_s: f64| {
            let last_m = motion.pieces.last().map_or(0.0, |piece| piece.to_m);
            motion.distance_at(time_s).unwrap_or(last_m)
        };
        let least_m = times_s.iter().map(|time_s| distance(late, *time_s)).collect();
        let most_m = times_s.iter().map(|time_s| distance(early, *time_s)).collect();
        Self { times_s, least_m, most_m }
    }
}
