//! The keys of `armor play` in a terminal, and the line that shows them.

use std::io::{self, Stdin, stdin};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use armor_inspect::ObservedSystem;
use armor_recording::playback::{PLAYBACK, PlaybackState};
use armor_sdk::control::{Command, PlaybackOrder};
use armor_sdk::tap::Tap;
use armor_wire::codec;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Signal, getpgrp, getpid, kill_process};
use rustix::termios::{
    LocalModes, OptionalActions, Termios, isatty, tcgetattr, tcgetpgrp, tcsetattr,
};

use super::orders::format_state;
use crate::component_orders::answer::send_command;
use crate::run::status::StatusLine;

/// Time between two looks at the keys and the state.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// How long the player may take to register before it is sought again.
const FOUND_WITHIN: Duration = Duration::from_millis(500);
/// A link is read only while it is waited for.
const STATE_WITHIN: Duration = Duration::from_millis(1);
const SHORT_JUMP_S: f64 = 5.0;
const LONG_JUMP_S: f64 = 60.0;
/// What `+` and `-` lead through; 0 is as fast as possible.
const SPEEDS: [f64; 13] =
    [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 0.0];
const HELP: &str = "space pause · . step · ←→ 5 s · ↑↓ 1 min · +- speed · q end";

/// A key that means something.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PlaybackKey {
    Pause,
    Step,
    Jump(f64),
    Faster,
    Slower,
    End,
}

/// Reads the keys on a thread of its own, until it is dropped.
pub struct PlaybackKeys {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PlaybackKeys {
    /// Begins, if stdin is a terminal and the line is redrawn on one. It shows the state instead of
    /// that of the run.
    pub fn start(registry: SocketAddr, line: &StatusLine) -> Option<Self> {
        if !isatty(stdin()) || !line.is_live() {
            return None;
        }
        let is_over = Arc::new(AtomicBool::new(false));
        let (over, line) = (Arc::clone(&is_over), line.clone());
        let run = move || {
            let mut keys = KeyReader {
                terminal: stdin(),
                before: None,
                observed: ObservedSystem::at(&registry.to_string(), "keys"),
                tap: None,
                state: None,
                line,
            };
            while !over.load(Ordering::Relaxed) {
                keys.look();
            }
        };
        let thread = thread::Builder::new().name("keys".into()).spawn(run).ok()?;
        Some(Self { is_over, thread: Some(thread) })
    }
}

impl Drop for PlaybackKeys {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of it has been printed.
            let _ = thread.join();
        }
    }
}

struct KeyReader {
    terminal: Stdin,
    /// The modes of the terminal before, which it gets back.
    before: Option<Termios>,
    observed: ObservedSystem,
    tap: Option<Tap>,
    state: Option<PlaybackState>,
    line: StatusLine,
}

impl KeyReader {
    fn look(&mut self) {
        for key in self.read_keys().unwrap_or_default() {
            if key == PlaybackKey::End {
                // As Ctrl-C does.
                let _ = kill_process(getpid(), Signal::INT);
            } else if let Some(order) = self.state.as_ref().and_then(|state| order_of(key, state)) {
                self.give(order);
            }
        }
        self.follow_state();
        if let Some(state) = &self.state {
            self.line.show_text(format!("{}   {HELP}", format_state(state)));
        }
    }

    /// Waits for keys. In the background, where reading would stop the process, there are none.
    fn read_keys(&mut self) -> io::Result<Vec<PlaybackKey>> {
        if tcgetpgrp(&self.terminal)? != getpgrp() {
            thread::sleep(LOOK_EVERY);
            return Ok(Vec::new());
        }
        // A shell sets the modes again when the process continues after Ctrl-Z.
        let mut modes = tcgetattr(&self.terminal)?;
        if modes.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO) {
            self.before.get_or_insert_with(|| modes.clone());
            modes.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
            tcsetattr(&self.terminal, OptionalActions::Now, &modes)?;
        }
        let mut awaited = [PollFd::new(&self.terminal, PollFlags::IN)];
        let limit = Timespec { tv_sec: 0, tv_nsec: LOOK_EVERY.subsec_nanos().into() };
        if poll(&mut awaited, Some(&limit))? == 0 {
            return Ok(Vec::new());
        }
        let mut bytes = [0; 256];
        let count = rustix::io::read(&self.terminal, &mut bytes)?;
        if count == 0 {
            // The terminal was closed.
            thread::sleep(LOOK_EVERY);
        }
        Ok(parse_keys(&bytes[..count]))
    }

    fn follow_state(&mut self) {
        if self.tap.is_none() {
            self.tap = self.observed.tap_within(&format!("{PLAYBACK}.state"), FOUND_WITHIN).ok();
        }
        while let Some(tap) = &mut self.tap {
            match tap.next(STATE_WITHIN) {
                Ok(Some(message)) => self.state = codec::decode(&message.payload).ok(),
                Ok(None) => return,
                Err(_) => self.tap = None,
            }
        }
    }

    fn give(&mut self, order: PlaybackOrder) {
        // Several keys together are carried out one after the other, on what the one before has done.
        if let Some(state) = &mut self.state {
            apply(&order, state);
        }
        let Ok(entry) = self.observed.directory().find_process(PLAYBACK, FOUND_WITHIN) else {
            return;
        };
        let request = crate::component_orders::answer::REQUEST;
        // A refusal shows in the state, which stays as it is.
        let _ = send_command(&entry, "armor play", &Command::Playback { request, order });
    }
}

impl Drop for KeyReader {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            // A terminal that was closed needs no modes.
            let _ = tcsetattr(&self.terminal, OptionalActions::Now, before);
        }
        self.line.finish();
    }
}

/// The keys in what a terminal sends; others mean nothing.
fn parse_keys(bytes: &[u8]) -> Vec<PlaybackKey> {
    let mut keys = Vec::new();
    let mut rest = bytes;
    while let [first, after @ ..] = rest {
        rest = after;
        let key = match first {
            b' ' => PlaybackKey::Pause,
            b'.' => PlaybackKey::Step,
            b'+' | b'=' => PlaybackKey::Faster,
            b'-' => PlaybackKey::Slower,
            b'q' => PlaybackKey::End,
            // An arrow, in either mode of the terminal.
            0x1b => {
                let [b'[' | b'O', arrow, after @ ..] = rest else { continue };
                rest = after;
                match arrow {
                    b'A' => PlaybackKey::Jump(LONG_JUMP_S),
                    b'B' => PlaybackKey::Jump(-LONG_JUMP_S),
                    b'C' => PlaybackKey::Jump(SHORT_JUMP_S),
                    b'D' => PlaybackKey::Jump(-SHORT_JUMP_S),
                    _ => continue,
                }
            }
            _ => continue,
        };
        keys.push(key);
    }
    keys
}

/// What a key orders in a state.
fn order_of(key: PlaybackKey, state: &PlaybackState) -> Option<PlaybackOrder> {
    let order = match key {
        PlaybackKey::Pause if state.paused => PlaybackOrder::Resume,
        PlaybackKey::Pause => PlaybackOrder::Pause,
        PlaybackKey::Step => PlaybackOrder::Step { time_s: 0.0 },
        PlaybackKey::Jump(by_s) => {
            let length_s = (state.to - state.from).max(0.0);
            PlaybackOrder::Seek { at_s: (state.at + by_s).clamp(0.0, length_s) }
        }
        PlaybackKey::Faster => {
            let speed = rank(state.speed);
            let faster = SPEEDS.into_iter().find(|it| rank(*it) > speed)?;
            PlaybackOrder::Speed { factor: faster }
        }
        PlaybackKey::Slower => {
            let speed = rank(state.speed);
            let slower = SPEEDS.into_iter().rev().find(|it| rank(*it) < speed)?;
            PlaybackOrder::Speed { factor: slower }
        }
        PlaybackKey::End => return None,
    };
    Some(order)
}

/// The speed as a number of which as fast as possible is the largest.
fn rank(factor: f64) -> f64 {
    if factor == 0.0 { f64::INFINITY } else { factor }
}

/// The state that an order leads to, until the player has published it.
fn apply(order: &PlaybackOrder, state: &mut PlaybackState) {
    match order {
        PlaybackOrder::Pause | PlaybackOrder::Step { .. } => state.paused = true,
        PlaybackOrder::Resume => state.paused = false,
        PlaybackOrder::Speed { factor } => state.speed = *factor,
        PlaybackOrder::Seek { at_s } => {
            state.at = *at_s;
            state.paused |= *at_s >= state.to - state.from;
        }
        PlaybackOrder::Loop { on } => state.loops = *on,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_arrows_are_read_and_all_else_is_passed_over() {
        let keys = parse_keys(b" .x+\x1b[C\x1b[D\x1bOA\x1b[B-\x1b[Zq\x1b");
        let expected = [
            PlaybackKey::Pause,
            PlaybackKey::Step,
            PlaybackKey::Faster,
            PlaybackKey::Jump(5.0),
            PlaybackKey::Jump(-5.0),
            PlaybackKey::Jump(60.0),
            PlaybackKey::Jump(-60.0),
            PlaybackKey::Slower,
            PlaybackKey::End,
        ];
        assert_eq!(keys, expected);
    }

    #[test]
    fn a_key_orders_what_follows_from_the_state() {
        let state =
            PlaybackState { from: 100.0, to: 160.0, at: 3.0, speed: 1.0, ..Default::default() };
        let check = |key, state: &PlaybackState, expected| {
            assert_eq!(order_of(key, state), expected, "{key:?} at {state:?}");
        };
        check(PlaybackKey::Pause, &state, Some(PlaybackOrder::Pause));
        let paused = PlaybackState { paused: true, ..state.clone() };
        check(PlaybackKey::Pause, &paused, Some(PlaybackOrder::Resume));
        check(PlaybackKey::Jump(-5.0), &state, Some(PlaybackOrder::Seek { at_s: 0.0 }));
        check(PlaybackKey::Jump(60.0), &state, Some(PlaybackOrder::Seek { at_s: 60.0 }));
        check(PlaybackKey::Faster, &state, Some(PlaybackOrder::Speed { factor: 2.0 }));
        check(PlaybackKey::Slower, &state, Some(PlaybackOrder::Speed { factor: 0.5 }));
        let fast = PlaybackState { speed: 500.0, ..state.clone() };
        check(PlaybackKey::Faster, &fast, Some(PlaybackOrder::Speed { factor: 0.0 }));
        let fastest = PlaybackState { speed: 0.0, ..state };
        check(PlaybackKey::Faster, &fastest, None);
        check(PlaybackKey::Slower, &fastest, Some(PlaybackOrder::Speed { factor: 500.0 }));
    }

    #[test]
    fn a_second_key_builds_on_the_first() {
        let mut state = PlaybackState { to: 60.0, at: 3.0, speed: 1.0, ..Default::default() };
        for key in [PlaybackKey::Faster, PlaybackKey::Faster, PlaybackKey::Pause] {
            let order = order_of(key, &state).expect("an order");
            apply(&order, &mut state);
        }
        assert_eq!((state.speed, state.paused), (5.0, true));
        let order = order_of(PlaybackKey::Jump(60.0), &state).expect("an order");
        assert_eq!(order, PlaybackOrder::Seek { at_s: 60.0 }, "the end, and no further");
        let mut running = PlaybackState { paused: false, ..state };
        apply(&order, &mut running);
        assert!(running.paused, "a jump to the end pauses there");
        assert_eq!(order_of(PlaybackKey::Pause, &running), Some(PlaybackOrder::Resume));
    }
}
