//! A system that is watched, while it runs, and its last known state afterwards.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use armor_inspect::log::{LogLine, Tail};
use armor_inspect::systems::{self, RunRecord};
use armor_inspect::{
    MissionLook, MissionWatch, OrderSender, ParameterClient, SystemPicture, SystemWatch,
    WakeCallback, WatchedValues,
};

use armor_recording::playback::{PLAYBACK, PlayerRemote};

use super::version::RunningVersions;
use super::words::is_over;

/// The name by which the window observes a system.
pub const TOOL: &str = "designer";
/// The name of the process that plays missions.
const EXECUTIVE: &str = "executive";

/// A system that is watched.
pub struct Watched {
    /// Where its registry listens.
    pub registry: String,
    /// Its record, if it is a system of this user on this host.
    pub record: Option<RunRecord>,
    /// The processes and their states.
    pub watch: SystemWatch,
    /// The state of its mission.
    pub mission: MissionWatch,
    /// The values on the outputs that are shown.
    pub values: WatchedValues,
    /// Where orders are given.
    pub orders: OrderSender,
    /// Where parameters are requested and set.
    pub parameters: ParameterClient,
    /// The player, if it plays a recording.
    pub player: Option<PlayerRemote>,
    /// The texts that it runs; none if they are not on this host.
    pub versions: Option<RunningVersions>,
    /// Whether the versions are those in the recording that this window plays.
    pub is_recording_drawn: bool,
    /// Another run may listen at its address now: its registry was found again.
    pub may_be_another: bool,
    /// The last seen number of times that its registry was found.
    found_count: u32,
    /// The starts of each process, and whether it had ended, as last seen.
    seen: BTreeMap<String, (u32, bool)>,
    /// Since when nothing has been received from it, in system time; its clocks stand at this time.
    silent_since_s: Option<f64>,
    /// It was this window's run, and has ended for good.
    is_over: bool,
    /// Observation has ended.
    is_at_rest: bool,
    _tail: Option<Tail>,
    wake: WakeCallback,
}

impl Watched {
    /// Begins to watch the system whose registry listens at `registry`; `wake` is called when there
    /// is something new.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn at(
        registry: &str,
        record: Option<RunRecord>,
        tail: Option<Tail>,
        wake: &WakeCallback,
    ) -> io::Result<Self> {
        if let Ok(registry) = registry.parse() {
            systems::adopt_place(registry);
        }
        let watch = SystemWatch::begin(registry, TOOL, Arc::clone(wake))?;
        let mission = MissionWatch::begin(watch.directory(), Arc::clone(wake))?;
        if let Some(record) = &record {
            watch.follow_hosts(record)?;
        }
        let record = record.map(RunRecord::resolved);
        let versions = record.as_ref().map(|record| {
            // Not the record's own path, which may be relative to the folder of the launcher.
            RunningVersions::begin(&record.out, Arc::clone(wake))
        });
        let versions = versions.transpose()?;
        Ok(Self { record, versions, _tail: tail, ..Self::by(watch, mission, registry, wake)? })
    }

    /// The system that others watch already.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn by(
        watch: SystemWatch,
        mission: MissionWatch,
        registry: &str,
        wake: &WakeCallback,
    ) -> io::Result<Self> {
        let directory = watch.directory();
        Ok(Self {
            registry: registry.into(),
            record: None,
            mission,
            values: WatchedValues::new(directory.clone(), Arc::clone(wake)),
            orders: OrderSender::open(directory, "armor-designer", Arc::clone(wake))?,
            parameters: ParameterClient::open(directory, TOOL, Arc::clone(wake))?,
            watch,
            player: None,
            versions: None,
            is_recording_drawn: false,
            may_be_another: false,
            found_count: 0,
            seen: BTreeMap::new(),
            silent_since_s: None,
            is_over: false,
            is_at_rest: false,
            _tail: None,
            wake: Arc::clone(wake),
        })
    }

    /// Mission time now, or when something was received last, in seconds.
    pub fn mission_s(&self, look: &MissionLook) -> f64 {
        look.now_at_s(self.time_s())
    }

    /// System time now, or when something was received last, in seconds.
    fn time_s(&self) -> f64 {
        let played = || {
            let look = self.player.as_ref()?.look();
            Some(look.state()?.from + look.at_s()?)
        };
        self.silent_since_s.or_else(played).unwrap_or_else(|| self.watch.timestamp())
    }

    /// Returns whether all of it is a recording: its mission takes no orders.
    pub fn is_recorded(&self) -> bool {
        self.plays(EXECUTIVE)
    }

    /// Whether a component is played from a recording.
    fn plays(&self, component: &str) -> bool {
        let look = self.player.as_ref().map(PlayerRemote::look);
        let state = look.as_ref().and_then(|look| look.state());
        state.is_some_and(|state| state.components.iter().any(|played| played == component))
    }

    /// Returns why its mission cannot receive orders; none if it can.
    pub fn refuses_orders(&self) -> Option<&'static str> {
        let played = self.is_recorded().then_some("This is a recording: orders have no effect.");
        self.silence().or(played)
    }

    /// Returns why a parameter of a component cannot be set; none if it can.
    pub fn refuses_values(&self, component: &str) -> Option<&'static str> {
        let text = "It is played from a recording: its parameters have no effect.";
        self.silence().or(self.plays(component).then_some(text))
    }

    /// Returns why it cannot receive requests; none if it can.
    pub fn silence(&self) -> Option<&'static str> {
        match (self.silent_since_s, self.is_over) {
            (None, _) => None,
            (Some(_), true) => Some("It has ended."),
            (Some(_), false) => Some("It has ended or is unreachable."),
        }
    }

    /// Takes notice of its end: to be called in each frame. `is_over`: it was this window's run,
    /// and nothing comes back.
    pub fn poll(&mut self, is_over: bool) {
        if self.is_at_rest {
            return;
        }
        let picture = self.watch.picture();
        if self.player.is_none() && picture.processes.contains_key(PLAYBACK) {
            // Without a thread it is tried again with the next frame.
            self.player = self.follow_player().ok();
        }
        self.may_be_another |= self.found_count > 0 && picture.found_count > self.found_count;
        self.found_count = picture.found_count;
        let has_ended = picture.has_ended();
        let is_silent = is_over || has_ended;
        self.is_over = is_over;
        if is_silent != self.silent_since_s.is_some() {
            self.silent_since_s = is_silent.then(|| self.watch.timestamp());
            self.values.keep(is_silent);
        }
        // Not earlier: its last messages may still arrive.
        if is_over && has_ended {
            self.is_at_rest = true;
            self.watch.rest();
            self.mission.rest();
            self.values.rest();
        }
    }

    fn follow_player(&self) -> io::Result<PlayerRemote> {
        PlayerRemote::begin(self.watch.directory(), "armor-designer", Arc::clone(&self.wake))
    }

    /// Ends the observation, since its launcher has ended: nothing of it comes back, and another
    /// system may take its address.
    pub fn end(&mut self) {
        if self.is_at_rest {
            return;
        }
        (self.is_at_rest, self.is_over) = (true, true);
        if self.silent_since_s.is_none() {
            self.silent_since_s = Some(self.watch.timestamp());
            self.values.keep(true);
        }
        self.watch.rest_as_ended();
        self.mission.rest();
        self.values.rest();
    }

    /// Whether its registry cannot be reached any longer.
    pub fn has_lost_registry(&self) -> bool {
        let picture = self.watch.picture();
        picture.was_found && !picture.is_found
    }

    /// Returns a line for each component that ended or was started again since the last call.
    pub fn take_losses(&mut self) -> Vec<LogLine> {
        let picture = self.watch.picture();
        let marking = self.mission.look().marking;
        let is_over = marking.is_some_and(|marking| is_over(marking.stage));
        losses(&mut self.seen, &picture, is_over)
    }
}

/// Compares the processes with those `seen` before. `is_over`: the mission has ended or is being
/// ended, and its processes with it.
fn losses(
    seen: &mut BTreeMap<String, (u32, bool)>,
    picture: &SystemPicture,
    is_over: bool,
) -> Vec<LogLine> {
    let mut lines = Vec::new();
    for (name, process) in &picture.processes {
        let now = (process.starts, process.condition.is_gone());
        let before = seen.insert(name.clone(), now);
        // At the end of the system all processes end, which is no loss.
        if before == Some(now) || picture.has_ended() || picture.is_second_name(name) {
            continue;
        }
        let mut report = |text: String| {
            lines.push(LogLine::own_line(name, "WARN", format!("{text} (seen by the {TOOL})")));
        };
        match (before, now) {
            (Some((starts, _)), (now, _)) if now > starts => {
                report(format!("it was started again, start {now}"));
            }
            (Some((_, false)), (_, true)) if !is_over => report("its process has ended".into()),
            _ => {}
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_inspect::SystemEvent;
    use armor_sdk::directory::DirectoryChange;
    use armor_wire::registry::ComponentEntry;

    use super::*;

    #[test]
    fn a_component_that_dies_and_comes_back_is_two_lines() {
        let mut picture = SystemPicture::default();
        let mut seen = BTreeMap::new();
        let entry = |instance| ComponentEntry {
            name: "arm".into(),
            kind: "arm".into(),
            instance,
            pid: 7,
            host: "here".into(),
            endpoint: "127.0.0.1:1".into(),
        };
        let mut lines_after = |change| {
            picture.handle_event(SystemEvent::Registry(change), Duration::ZERO);
            losses(&mut seen, &picture, false).into_iter().map(|line| line.text).collect::<Vec<_>>()
        };
        let nothing: [&str; 0] = [];
        assert_eq!(lines_after(DirectoryChange::Appeared(entry(1))), nothing);
        let ended = "its process has ended (seen by the designer)";
        assert_eq!(lines_after(DirectoryChange::Gone(entry(1))), [ended]);
        let again = "it was started again, start 2 (seen by the designer)";
        assert_eq!(lines_after(DirectoryChange::Appeared(entry(2))), [again]);
        let again = "it was started again, start 3 (seen by the designer)";
        assert_eq!(lines_after(DirectoryChange::Appeared(entry(3))), [again], "its end was missed");
        assert_eq!(lines_after(DirectoryChange::RegistryLost), nothing);
    }

    #[test]
    fn the_ends_of_processes_after_that_of_the_mission_are_no_losses() {
        let mut picture = SystemPicture::default();
        let mut seen = BTreeMap::new();
        let entry = ComponentEntry {
            name: EXECUTIVE.into(),
            kind: EXECUTIVE.into(),
            instance: 1,
            pid: 7,
            host: "here".into(),
            endpoint: "127.0.0.1:1".into(),
        };
        for change in [DirectoryChange::Appeared(entry.clone()), DirectoryChange::Gone(entry)] {
            picture.handle_event(SystemEvent::Registry(change), Duration::ZERO);
            assert_eq!(losses(&mut seen, &picture, true), []);
        }
        assert_eq!(seen[EXECUTIVE], (1, true));
    }

    #[test]
    fn clocks_stand_where_the_run_ended() {
        let mission = MissionWatch::still(MissionLook::default());
        let wake: WakeCallback = Arc::new(|| {});
        let watch = SystemWatch::still(SystemPicture::default());
        let mut watched = Watched::by(watch, mission, "nowhere", &wake).expect("threads start");
        watched.poll(false);
        assert_eq!(watched.silence(), None);
        watched.poll(true);
        assert_eq!(watched.silence(), Some("It has ended."));
        let stood_s = watched.time_s();
        while watched.watch.timestamp() <= stood_s {}
        watched.poll(true);
        assert_eq!(watched.time_s(), stood_s);
        watched.poll(false);
        assert!(watched.time_s() > stood_s, "it has come back");
        watched.end();
        assert!(watched.watch.picture().has_ended(), "whatever takes its address");
        watched.poll(false);
        assert_eq!(watched.silence(), Some("It has ended."), "its launcher has ended");
    }
}
