//! The marks of a recording, read by a thread: the window never waits for the disk.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use armor_inspect::WakeCallback;
use armor_marking::Marking;
use armor_picture::theme::ThemeColours;
use armor_recording::{
    MarkReader, ReadError, RecordedMark, RecordedMessage, RecordedReport, Recording,
    RecordingSummary,
};
use armor_sdk::control::ReportKind;
use armor_wire::WireType;
use armor_wire::codec;
use eframe::egui::Color32;
use parking_lot::Mutex;

/// The executive's output that lists what has fired.
const MARKING: &str = "executive.marking";
/// The key of the version that has recorded.
const VERSION_KEY: &str = "armor";
/// Most marks that are shown; more could not be distinguished on a screen.
const MAX_MARKS: usize = 50_000;
/// Pause between two times at which new marks are shown.
const SHOW_EVERY: Duration = Duration::from_millis(200);
/// A mission that began before the recording has earlier firings, which are left out; those nearer than
/// this belong to its beginning.
const BEGIN_WITHIN_S: f64 = 1.0;

/// What a mark stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MarkKind {
    /// A transition has fired.
    Firing,
    /// A component has reported that it is done, or an event.
    Report,
    /// A component has reported that it failed.
    Failure,
    /// The recorder has lost messages.
    Loss,
}

impl MarkKind {
    /// All of them, from the uppermost on.
    pub const ALL: [Self; 4] = [Self::Firing, Self::Report, Self::Failure, Self::Loss];

    /// What the legend calls them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Firing => "Firings",
            Self::Report => "Reports",
            Self::Failure => "Failures",
            Self::Loss => "Losses",
        }
    }

    /// What it stands for, in a sentence.
    pub fn doc(self) -> &'static str {
        match self {
            Self::Firing => "A transition of the mission fired.",
            Self::Report => "A component reported that it is done, or an event.",
            Self::Failure => "A component reported that it failed.",
            Self::Loss => "The recorder lost messages before this moment.",
        }
    }

    /// Its colour. Its shape differs, too.
    pub fn colour(self, colours: &ThemeColours) -> Color32 {
        match self {
            Self::Firing => colours.accent,
            Self::Report => colours.good,
            Self::Failure => colours.error,
            Self::Loss => colours.warning,
        }
    }
}

/// A moment that is marked.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeMark {
    /// When it was, in system time.
    pub at_s: f64,
    /// The moment at which it is shown: the next marking after a firing.
    pub seek_s: f64,
    /// What it stands for.
    pub kind: MarkKind,
    /// What happened: for a firing the name of the transition.
    pub text: String,
}

/// What was found in a recording so far.
#[derive(Clone, Debug, Default)]
pub struct FoundMarks {
    /// The marks in the order of time.
    pub marks: Arc<Vec<TimeMark>>,
    /// Its first and its last moment, in system time; none before it was opened.
    pub span_s: Option<(f64, f64)>,
    /// The system's file that is in it, with the files that this includes; the first is the main one.
    pub files: Arc<Vec<(PathBuf, String)>>,
    /// How much of it was read, from 0 to 1.
    pub progress: f32,
    /// Whether all of it was read.
    pub is_complete: bool,
    /// Why it cannot be read; empty if it can.
    pub trouble: String,
    /// What is unusual about it.
    pub notes: Vec<String>,
}

/// The marks of a recording. Dropping it ends its thread.
pub struct RecordingMarks {
    shared: Arc<SharedMarks>,
}

struct SharedMarks {
    found: Mutex<FoundMarks>,
    is_closing: AtomicBool,
    wake: WakeCallback,
}

impl RecordingMarks {
    /// Begins to read a recording; `wake` is called when there is something new.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(path: &Path, wake: WakeCallback) -> io::Result<Self> {
        let shared = SharedMarks { found: Mutex::default(), is_closing: false.into(), wake };
        let shared = Arc::new(shared);
        let (of_thread, path) = (Arc::clone(&shared), path.to_owned());
        std::thread::Builder::new()
            .name("read-marks".into())
            .spawn(move || of_thread.read(&path))?;
        Ok(Self { shared })
    }

    /// These marks, which stay: for tests.
    pub fn still(found: FoundMarks) -> Self {
        let wake: WakeCallback = Arc::new(|| {});
        let shared = SharedMarks { found: Mutex::new(found), is_closing: true.into(), wake };
        Self { shared: Arc::new(shared) }
    }

    /// What was found so far.
    pub fn found(&self) -> FoundMarks {
        self.shared.found.lock().clone()
    }
}

impl Drop for RecordingMarks {
    fn drop(&mut self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
    }
}

impl SharedMarks {
    fn read(&self, path: &Path) {
        let name = path.display();
        let trouble = match self.read_recording(path) {
            Ok(()) => String::new(),
            Err(ReadError::Io(error)) => format!("{name} cannot be read: {error}"),
            Err(error) => {
                format!("{name} cannot be read as a recording: {error}")
            }
        };
        let mut found = self.found.lock();
        found.trouble = if !trouble.is_empty() {
            trouble
        } else if found.span_s.is_none() {
            format!("{name} has no messages")
        } else {
            String::new()
        };
        (found.is_complete, found.progress) = (true, 1.0);
        drop(found);
        (self.wake)();
    }

    fn read_recording(&self, path: &Path) -> Result<(), ReadError> {
        let mut recording = Recording::open(path)?;
        let summary = recording.summary().clone();
        let mut files = Vec::new();
        for file in &summary.files {
            let bytes = recording.read_file(&file.name)?.unwrap_or_default();
            files.push((file.name.clone().into(), String::from_utf8_lossy(&bytes).into_owned()));
        }
        let begin_s = summary.begin_s();
        {
            let mut found = self.found.lock();
            found.span_s = begin_s.zip(summary.span_s.map(|(_, end_s)| end_s));
            found.files = Arc::new(files);
            found.notes = describe_unusual(&summary);
        }
        (self.wake)();
        let mut collector = MarkCollector::new(begin_s.unwrap_or_default());
        let mut reader = recording.into_marks(&[MARKING])?;
        let mut shown = Instant::now();
        while let Some(mark) = reader.next_mark()? {
            collector.take(mark);
            if self.is_closing.load(Ordering::Relaxed) {
                return Ok(());
            }
            if shown.elapsed() >= SHOW_EVERY {
                shown = Instant::now();
                self.show(&mut collector, &mut reader);
            }
        }
        self.show(&mut collector, &mut reader);
        Ok(())
    }

    fn show(&self, collector: &mut MarkCollector, reader: &mut MarkReader) {
        let marks = collector.sorted();
        let mut found = self.found.lock();
        found.marks = Arc::new(marks);
        found.progress = reader.progress();
        found.notes.append(&mut collector.notes);
        let damaged = reader.damaged_chunks();
        found.notes.retain(|note| !note.ends_with(DAMAGED));
        if damaged > 0 {
            found.notes.push(format!("{damaged} {DAMAGED}"));
        }
        drop(found);
        (self.wake)();
    }
}

const DAMAGED: &str = "damaged parts were left out";

/// What is unusual about a recording.
fn describe_unusual(summary: &RecordingSummary) -> Vec<String> {
    let mut notes = Vec::new();
    if !summary.is_complete {
        notes.push("it is not complete: it ends where its recorder was killed".into());
    }
    let by = summary.about.get(VERSION_KEY).map(String::as_str).unwrap_or_default();
    let own = env!("CARGO_PKG_VERSION");
    if read_version(by) > read_version(own) {
        notes.push(format!(
            "Armor {by} has recorded it, and this is {own}: what only {by} knows is left out"
        ));
    }
    if summary.files.is_empty() {
        notes.push("it has no system file: the components are listed at the left".into());
    }
    notes
}

/// The numbers of a version.
fn read_version(text: &str) -> Vec<u32> {
    text.split(['.', '-', '+']).map_while(|part| part.parse().ok()).collect()
}

/// Collects the marks as they are read.
struct MarkCollector {
    marks: Vec<TimeMark>,
    begin_s: f64,
    /// The firings before the last marking; none before the first.
    fired: Option<u64>,
    notes: Vec<String>,
    is_full: bool,
    has_other_form: bool,
}

impl MarkCollector {
    fn new(begin_s: f64) -> Self {
        let marks = Vec::new();
        let (fired, notes) = (None, Vec::new());
        Self { marks, begin_s, fired, notes, is_full: false, has_other_form: false }
    }

    fn take(&mut self, mark: RecordedMark) {
        match mark {
            RecordedMark::Report(report) => self.push(describe_report(&report)),
            RecordedMark::Loss { data, count, stamp_s } => {
                let messages = if count == 1 { "message" } else { "messages" };
                let text = format!("{data}: {count} {messages} lost");
                self.push(TimeMark { at_s: stamp_s, seek_s: stamp_s, kind: MarkKind::Loss, text });
            }
            RecordedMark::Message(message) => self.take_marking(&message),
            RecordedMark::Unread(reason) if !self.notes.contains(&reason) => {
                self.notes.push(reason);
            }
            RecordedMark::Unread(_) => {}
        }
    }

    fn take_marking(&mut self, message: &RecordedMessage) {
        let marking = message.payload.as_ref().ok();
        let marking =
            marking.filter(|_| message.output_type.schema == Marking::schema().to_string());
        let marking = marking.and_then(|bytes| codec::decode::<Marking>(bytes).ok());
        let Some(marking) = marking else {
            if !std::mem::replace(&mut self.has_other_form, true) {
                self.notes.push(
                    "another version of Armor has played the mission: its firings are not marked"
                        .into(),
                );
            }
            return;
        };
        let seek_s = message.head.stamp_s;
        // A count that fell is another mission.
        let before = self.fired.filter(|before| *before <= marking.fired);
        let new = usize::try_from(marking.fired - before.unwrap_or_default()).unwrap_or(usize::MAX);
        self.fired = Some(marking.fired);
        let listed = new.min(marking.history.len());
        for fired in &marking.history[marking.history.len() - listed..] {
            let at_s = seek_s - (marking.now_at_s - fired.fired_at_s).max(0.0);
            if at_s < self.begin_s - BEGIN_WITHIN_S {
                continue;
            }
            let (kind, text) = (MarkKind::Firing, fired.transition.clone());
            self.push(TimeMark { at_s: at_s.max(self.begin_s), seek_s, kind, text });
        }
    }

    fn push(&mut self, mark: TimeMark) {
        if self.marks.len() < MAX_MARKS {
            self.marks.push(mark);
        } else if !std::mem::replace(&mut self.is_full, true) {
            self.notes.push(format!("only its first {MAX_MARKS} marks are shown"));
        }
    }

    fn sorted(&mut self) -> Vec<TimeMark> {
        self.marks.sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
        self.marks.clone()
    }
}

fn describe_report(report: &RecordedReport) -> TimeMark {
    let component = &report.component;
    let (kind, text) = match report.kind() {
        ReportKind::Done => (MarkKind::Report, format!("{component} is done")),
        ReportKind::Failed { reason } if reason.is_empty() => {
            (MarkKind::Failure, format!("{component} failed"))
        }
        ReportKind::Failed { reason } => {
            (MarkKind::Failure, format!("{component} failed: {reason}"))
        }
        ReportKind::Event { name, value: 0.0 } => {
            (MarkKind::Report, format!("{component}: {name}"))
        }
        ReportKind::Event { name, value } => {
            (MarkKind::Report, format!("{component}: {name} {value}"))
        }
    };
    TimeMark { at_s: report.stamp, seek_s: report.stamp, kind, text }
}

#[cfg(test)]
mod tests {
    use armor_marking::{Fired, MarkingStage};
    use armor_recording::{MessageHead, OutputType};

    use super::*;

    fn message(stamp_s: f64, marking: &Marking) -> RecordedMessage {
        RecordedMessage {
            data: MARKING.into(),
            output_type: OutputType {
                name: "Marking".into(),
                schema: Marking::schema().to_string(),
                latched: true,
            },
            head: MessageHead { stamp_s, ..MessageHead::default() },
            payload: Ok(codec::encode(marking).expect("it is a message")),
        }
    }

    fn marking(now_at_s: f64, fired: &[(&str, f64)], count: u64) -> Marking {
        let history = fired.iter().map(|(name, fired_at_s)| Fired {
            transition: (*name).into(),
            fired_at_s: *fired_at_s,
        });
        Marking {
            stamp: 0.0,
            mission: "bench".into(),
            now_at_s,
            clock: String::new(),
            stage: MarkingStage::Playing,
            why: String::new(),
            places: Vec::new(),
            in_flight: Vec::new(),
            enabled: Vec::new(),
            waiting: Vec::new(),
            variables: Vec::new(),
            guards: Vec::new(),
            dates: Vec::new(),
            components: Vec::new(),
            fired: count,
            history: history.collect(),
            late_reports: 0,
            unheard_reports: 0,
            unwritten_orders: 0,
            pause: None,
            holder: None,
            link_lost_at_s: None,
            confirmations: Vec::new(),
            orders: Vec::new(),
            version: 1,
            version_since_at_s: 0.0,
            change: None,
        }
    }

    #[track_caller]
    fn check(messages: &[RecordedMessage], expected: &[(f64, f64, &str)]) {
        let mut collector = MarkCollector::new(1000.0);
        messages.iter().for_each(|it| collector.take(RecordedMark::Message(it.clone())));
        let marks = collector.sorted();
        let found: Vec<_> = marks.iter().map(|it| (it.at_s, it.seek_s, &*it.text)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn each_firing_is_marked_once_at_its_moment() {
        let first = marking(2.0, &[("start", 0.0)], 1);
        let second = marking(9.0, &[("start", 0.0), ("seen", 8.0), ("home", 9.0)], 3);
        let after_restart = marking(1.0, &[("start", 1.0)], 1);
        check(
            &[message(1002.0, &first), message(1009.5, &second), message(1020.0, &after_restart)],
            &[
                (1000.0, 1002.0, "start"),
                (1008.5, 1009.5, "seen"),
                (1009.5, 1009.5, "home"),
                (1020.0, 1020.0, "start"),
            ],
        );
    }

    #[test]
    fn firings_before_the_recording_are_left_out() {
        let first = marking(60.0, &[("start", 0.0), ("seen", 58.9)], 2);
        check(&[message(1001.0, &first)], &[(1000.0, 1001.0, "seen")]);
    }

    #[test]
    fn a_marking_of_another_form_is_a_note() {
        let mut other = message(1001.0, &marking(1.0, &[("start", 1.0)], 1));
        other.output_type.schema = "Marking{mission:str}".into();
        let mut collector = MarkCollector::new(1000.0);
        collector.take(RecordedMark::Message(other.clone()));
        collector.take(RecordedMark::Message(other));
        assert_eq!((collector.marks.len(), collector.notes.len()), (0, 1));
    }

    #[test]
    fn reports_are_described() {
        for (kind, mark, text) in [
            (ReportKind::Done, MarkKind::Report, "arm is done"),
            (
                ReportKind::Failed { reason: "no path".into() },
                MarkKind::Failure,
                "arm failed: no path",
            ),
            (
                ReportKind::Event { name: "seen".into(), value: 0.5 },
                MarkKind::Report,
                "arm: seen 0.5",
            ),
        ] {
            let described = describe_report(&RecordedReport::new(3.0, "arm", 1, &kind));
            assert_eq!((described.kind, &*described.text, described.at_s), (mark, text, 3.0));
        }
    }

    #[test]
    fn a_newer_version_and_a_crash_are_noted() {
        let mut summary = RecordingSummary { is_complete: true, ..RecordingSummary::default() };
        summary.files.push(armor_recording::RecordedFile::default());
        summary.about.insert(VERSION_KEY.into(), env!("CARGO_PKG_VERSION").into());
        assert_eq!(describe_unusual(&summary), Vec::<String>::new());
        summary.about.insert(VERSION_KEY.into(), "999.0.0".into());
        summary.is_complete = false;
        summary.files.clear();
        assert_eq!(describe_unusual(&summary).len(), 3);
    }

    #[test]
    fn what_cannot_be_read_is_stated_with_its_name() {
        let folder = std::env::temp_dir().join(format!("armor-marks-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("writable");
        let read = |name: &str| {
            let marks =
                RecordingMarks::begin(&folder.join(name), Arc::new(|| {})).expect("a thread");
            let begun = Instant::now();
            while !marks.found().is_complete {
                assert!(begun.elapsed() < Duration::from_secs(60), "it hangs");
                std::thread::yield_now();
            }
            marks.found().trouble
        };
        let missing = read("none.mcap");
        assert!(missing.contains("none.mcap cannot be read: No such file"), "{missing}");
        std::fs::write(folder.join("text.mcap"), "this is no recording").expect("writable");
        let text = read("text.mcap");
        assert!(text.contains("text.mcap cannot be read as a recording"), "{text}");
        std::fs::remove_dir_all(&folder).expect("ours");
    }
}
