//! A run on the screen: how it begins, what dies in it, and how it has ended.

use super::*;
use crate::ports::watch_messages::LinkedInput;

/// Time between two looks at whether the launcher of a run has ended.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// One in this many looks asks the launcher for its component.
const LOOKS_PER_HINT: u32 = 10;
/// So many looks a system whose mission is over may take to end; then its connection counts as lost.
const LOOKS_OF_ENDING: u32 = 30;
/// Time between two looks at the ends of the processes of a run.
const LOOK_FOR_CRASHES_EVERY: Duration = Duration::from_secs(1);

impl Station {
    pub(super) fn begin_run(
        &self,
        system: &str,
        robot: String,
        run: &str,
        links: Vec<LinkedInput>,
    ) {
        let now = self.now();
        let mut console = self.console.lock();
        // Without a number, it is the same as long as it has not been seen to end.
        let is_cut = matches!(&console.connection, SystemConnection::Cut { system: cut, .. } if cut == system);
        let is_same = *self.run.lock() == run && (!run.is_empty() || is_cut);
        if !is_same {
            // What is on the screen is of another run: nothing of it may be taken for this one.
            let before = std::mem::take(&mut *console);
            let is_light = before.is_light;
            let map = before.scene.map.emptied();
            let mut alerts = before.alerts;
            alerts.end_conditions();
            *console = Console { is_light, alerts, ..Console::default() };
            console.scene.map = map;
            run.clone_into(&mut self.run.lock());
            self.ended.lock().clear();
        }
        console.connection = SystemConnection::Live { system: system.into() };
        console.robot_name = robot;
        console.refusal = None;
        let linked = links.into_iter().filter_map(|link| {
            let input = all_inputs().find(|input| input.id == link.input)?;
            Some(InputLink::new(input.id, link.data, input.is_steady))
        });
        console.links = linked.collect();
        console.scene.is_localised = console.is_linked("pose");
        // Before anything else, and under the lock, so that a Release is sent after it.
        if let Some(is_on) = console.stop.begin_again(now.host_s) {
            self.send(&ToComponent::Stop { is_on });
        }
    }

    /// Raises an alert for each process of the run that dies.
    pub(super) fn watch_crashes(&self, number: u64, run: &WatchedRun) {
        let (station, run) = (self.clone(), run.clone());
        let watch = move || {
            while station.is_newest(number) && station.look_for_crashes(&run) {
                std::thread::sleep(LOOK_FOR_CRASHES_EVERY);
            }
        };
        // Without a thread only these alerts are missing.
        let _ = std::thread::Builder::new().name("crashes".into()).spawn(watch);
    }

    /// Raises an alert for each process that has died since the last look. Returns whether the run
    /// can be asked further.
    fn look_for_crashes(&self, run: &WatchedRun) -> bool {
        let Some(record) = run.find_record() else { return false };
        // What was before this window is no news.
        let is_first = self.ended.lock().is_empty();
        for name in run.list_processes() {
            let Some(history) = find_history(&record, &name) else { continue };
            let before = self.ended.lock().insert(name.clone(), history.ended);
            let is_new = !is_first && history.ended > before.unwrap_or(0);
            if is_new && is_crash(&history.last_end) {
                let text = format!("{name} {}", history.last_end);
                eprintln!("alert: {text}");
                self.console.lock().alerts.raise(text, self.now().host_s);
                self.request_frame();
            }
        }
        true
    }

    /// Keeps the last picture, and finds out whether the run has ended, and why.
    pub(super) fn end_connection(&self, number: u64, run: &WatchedRun, why: &str) {
        let change = |change: &dyn Fn(&mut Console, &str)| {
            let mut console = self.console.lock();
            if !self.is_newest(number) {
                return;
            }
            let robot = console.robot_name.clone();
            change(&mut console, &robot);
            drop(console);
            self.request_frame();
        };
        let cut = |text: &str| {
            change(&|console, robot| console.cut_connection(robot, text, self.now()));
        };
        let system = &run.system;
        if run.launcher == 0 {
            let host = "its launcher is not on this host, so whether it runs is not known";
            let text = if why.is_empty() { host.into() } else { format!("{host}: {why}") };
            eprintln!("{CUT}, to {system}: {text}");
            return cut(&text);
        }
        let is_ending = self.console.lock().mission.as_ref().is_some_and(MissionState::is_over);
        let lost = "the component is started again, or the system ends";
        match is_ending {
            true => change(&|console, robot| console.await_end(robot, self.now())),
            false => cut(lost),
        }
        let mut looks = 0_u32;
        while run.is_running() {
            if !self.is_newest(number) {
                return;
            }
            looks += 1;
            if is_ending && looks < LOOKS_OF_ENDING {
                std::thread::sleep(LOOK_EVERY);
                continue;
            }
            if is_ending && looks == LOOKS_OF_ENDING {
                cut(lost);
            }
            if looks.is_multiple_of(LOOKS_PER_HINT)
                && let Some(hint) = run.find_hint()
            {
                cut(&hint);
            }
            std::thread::sleep(LOOK_EVERY);
        }
        let mut end = find_end(system, &run.read_log());
        let mission = self.console.lock().mission.clone();
        if let Some(why) = mission.map(|mission| mission.why).filter(|why| !why.is_empty()) {
            end.why = format!("{}: {why}", end.why);
        }
        eprintln!("{system} has ended: {}", end.why);
        change(&|console, robot| console.end_system(robot, end.clone(), self.now()));
    }
}
