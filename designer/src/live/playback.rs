//! A recording that is played, with a time line: its marks, where it has come, and what is clicked
//! to go elsewhere.

pub mod keys;
pub mod list;
pub mod marks;
pub mod time_line;
mod track;

use std::io;
use std::path::{Path, PathBuf};

use armor_inspect::WakeCallback;
use armor_recording::playback::PlayerLook;
use armor_sdk::control::PlaybackOrder;

use marks::{FoundMarks, MarkKind, RecordingMarks};

/// A recording that is played by this window, or by a player that it watches.
pub struct Playback {
    path: PathBuf,
    marks: RecordingMarks,
    /// Whether this window plays it.
    pub is_own: bool,
}

/// Whether a file is opened as a recording.
pub fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

impl Playback {
    /// Begins to read the marks of a recording.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(path: &Path, is_own: bool, wake: WakeCallback) -> io::Result<Self> {
        let marks = RecordingMarks::begin(path, wake)?;
        Ok(Self { path: path.into(), marks, is_own })
    }

    /// A recording with these marks, which stay: for tests.
    pub fn still(path: &Path, is_own: bool, found: FoundMarks) -> Self {
        Self { path: path.into(), marks: RecordingMarks::still(found), is_own }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its name without folder.
    pub fn name(&self) -> String {
        self.path.file_name().unwrap_or(self.path.as_os_str()).to_string_lossy().into_owned()
    }

    /// What was found in it so far.
    pub fn found(&self) -> FoundMarks {
        self.marks.found()
    }
}

/// What the user wants of the player.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaybackWish {
    /// Time passes again, or stands still; at the end it begins again.
    PlayOrPause,
    /// The next message.
    Step,
    /// This moment, in seconds from the beginning of what is played.
    GoTo(f64),
    /// So many seconds from here.
    GoBy(f64),
    /// The end.
    End,
    /// The firing before this moment.
    PreviousFiring,
    /// The firing after it.
    NextFiring,
    /// This many times as fast as recorded; 0 for as fast as possible.
    Speed(f64),
    /// To begin again at the end, or not.
    Loop(bool),
}

impl PlaybackWish {
    /// Returns the orders that fulfil it.
    pub fn orders(self, look: &PlayerLook, found: &FoundMarks) -> Vec<PlaybackOrder> {
        let Some(state) = look.state() else { return Vec::new() };
        let at_s = look.at_s().unwrap_or(state.at);
        let length_s = state.to - state.from;
        let seek = |at_s: f64| PlaybackOrder::Seek { at_s: at_s.clamp(0.0, length_s) };
        let firings = || {
            let firings = found.marks.iter().filter(|mark| mark.kind == MarkKind::Firing);
            firings.map(|mark| mark.seek_s - state.from)
        };
        match self {
            Self::PlayOrPause if state.over && !state.paused => vec![seek(0.0)],
            Self::PlayOrPause if state.is_at_end() && state.paused => {
                vec![seek(0.0), PlaybackOrder::Resume]
            }
            Self::PlayOrPause if state.paused => vec![PlaybackOrder::Resume],
            Self::PlayOrPause => vec![PlaybackOrder::Pause],
            Self::Step => vec![PlaybackOrder::Step { time_s: 0.0 }],
            Self::GoTo(to_s) => vec![seek(to_s)],
            Self::GoBy(by_s) => vec![seek(at_s + by_s)],
            Self::End => vec![seek(length_s)],
            Self::PreviousFiring => {
                let mut before = firings().filter(|firing_s| *firing_s < at_s - SAME_MOMENT_S);
                vec![seek(before.next_back().unwrap_or_default())]
            }
            Self::NextFiring => {
                let mut after = firings().filter(|firing_s| *firing_s > at_s + SAME_MOMENT_S);
                after.next().map(seek).into_iter().collect()
            }
            Self::Speed(factor) => vec![PlaybackOrder::Speed { factor }],
            Self::Loop(on) => vec![PlaybackOrder::Loop { on }],
        }
    }
}

/// Firings nearer than this are where the player is. After a jump that plays, some time has passed.
const SAME_MOMENT_S: f64 = 0.25;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use armor_recording::playback::{PlaybackState, PlayerRemote};

    use super::marks::TimeMark;
    use super::*;

    fn orders(wish: PlaybackWish, state: PlaybackState) -> Vec<PlaybackOrder> {
        let mark = |at_s, kind| TimeMark { at_s, seek_s: at_s, kind, text: String::new() };
        let marks = vec![
            mark(102.0, MarkKind::Firing),
            mark(104.0, MarkKind::Report),
            mark(106.0, MarkKind::Firing),
        ];
        let found = FoundMarks { marks: Arc::new(marks), ..FoundMarks::default() };
        wish.orders(&PlayerRemote::still(state).look(), &found)
    }

    #[test]
    fn a_wish_becomes_orders() {
        use PlaybackOrder as O;
        use PlaybackWish as W;
        let paused = |at| PlaybackState {
            from: 100.0,
            to: 110.0,
            at,
            speed: 1.0,
            paused: true,
            ..PlaybackState::default()
        };
        let seek = |at_s| O::Seek { at_s };
        for (wish, state, expected) in [
            (W::PlayOrPause, paused(4.0), vec![O::Resume]),
            (W::PlayOrPause, PlaybackState { paused: false, ..paused(4.0) }, vec![O::Pause]),
            (
                W::PlayOrPause,
                PlaybackState { over: true, ..paused(10.0) },
                vec![seek(0.0), O::Resume],
            ),
            (W::PlayOrPause, paused(10.0), vec![seek(0.0), O::Resume]),
            (
                W::PlayOrPause,
                PlaybackState { over: true, paused: false, ..paused(10.0) },
                vec![seek(0.0)],
            ),
            (W::GoBy(-5.0), paused(4.0), vec![seek(0.0)]),
            (W::GoTo(99.0), paused(4.0), vec![seek(10.0)]),
            (W::End, paused(4.0), vec![seek(10.0)]),
            (W::NextFiring, paused(2.0), vec![seek(6.0)]),
            (W::NextFiring, paused(6.0), vec![]),
            (W::PreviousFiring, paused(6.0), vec![seek(2.0)]),
            (W::PreviousFiring, paused(1.0), vec![seek(0.0)]),
        ] {
            assert_eq!(orders(wish, state.clone()), expected, "{wish:?} at {}", state.at);
        }
    }

    #[test]
    fn a_recording_is_known_by_its_ending() {
        assert!(is_recording(Path::new("a/drive.MCAP")) && !is_recording(Path::new("a.xml")));
    }
}
