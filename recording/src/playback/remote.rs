//! A player that runs in another process, seen and controlled from this one: for programs with a
//! window.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

use armor_sdk::control::{Answer, Command, ControlConnection, ControlEvent, PlaybackOrder, Role};
use armor_sdk::directory::Directory;
use armor_sdk::tap::Tap;
use armor_wire::codec;
use armor_wire::keep::Keep;
use armor_wire::message::WireType;
use parking_lot::Mutex;

use super::player::PLAYBACK;
use super::state::PlaybackState;

/// How long one attempt waits for the player.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Time between two looks whether this was dropped.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// A jump in a large recording takes some time.
const ANSWER_WITHIN: Duration = Duration::from_secs(30);
/// Between two states the time is estimated, no longer than this: the player states it five times per
/// second.
const ESTIMATED_FOR: Duration = Duration::from_millis(300);

/// Called, from any thread, when there is something new.
type WakeCallback = Arc<dyn Fn() + Send + Sync>;

/// What is known of a player.
#[derive(Clone, Debug, Default)]
pub struct PlayerLook {
    /// Its last state, and when it arrived.
    state: Option<(PlaybackState, Instant)>,
    /// Why no state arrives; empty if one does.
    pub problem: String,
    /// Why the last order was not carried out; empty if it was.
    pub refusal: String,
    /// Whether orders wait for their answers.
    pub is_busy: bool,
}

impl PlayerLook {
    /// Its last state.
    pub fn state(&self) -> Option<&PlaybackState> {
        self.state.as_ref().map(|(state, _)| state)
    }

    /// Whether its time passes.
    pub fn is_moving(&self) -> bool {
        let moves =
            |state: &PlaybackState| !state.paused && !state.over && state.waits_for.is_empty();
        self.problem.is_empty() && self.state().is_some_and(moves)
    }

    /// How much has been played since the beginning, in seconds, estimated between two states.
    pub fn at_s(&self) -> Option<f64> {
        let (state, arrived) = self.state.as_ref()?;
        let since_s = arrived.elapsed().min(ESTIMATED_FOR).as_secs_f64();
        let passed_s = if self.is_moving() { since_s * state.speed } else { 0.0 };
        Some((state.at + passed_s).min(state.to - state.from))
    }
}

/// See the module. Dropping it ends its threads.
pub struct PlayerRemote {
    shared: Arc<SharedPlayer>,
    orders: Sender<PlaybackOrder>,
    /// For tests: orders that nothing takes.
    untaken: Option<Receiver<PlaybackOrder>>,
}

struct SharedPlayer {
    look: Mutex<PlayerLook>,
    is_closing: AtomicBool,
    wake: WakeCallback,
}

impl PlayerRemote {
    /// Begins to follow the player of a system. `from` is the program, and `wake` is called when there
    /// is something new.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(directory: &Directory, from: &str, wake: WakeCallback) -> io::Result<Self> {
        let (orders, given) = mpsc::channel();
        let remote = Self { shared: Arc::new(SharedPlayer::new(wake)), orders, untaken: None };
        let (shared, of_states) = (Arc::clone(&remote.shared), directory.clone());
        spawn("look-playback", move || shared.follow_states(&of_states))?;
        let (shared, directory) = (Arc::clone(&remote.shared), directory.clone());
        let from = format!("{from}, process {}", std::process::id());
        spawn("order-playback", move || shared.send_orders(&directory, &from, &given))?;
        Ok(remote)
    }

    /// A player that always has this state: for tests of displays.
    pub fn still(state: PlaybackState) -> Self {
        let shared = SharedPlayer::new(Arc::new(|| {}));
        shared.look.lock().state = Some((state, Instant::now()));
        let (orders, given) = mpsc::channel();
        Self { shared: Arc::new(shared), orders, untaken: Some(given) }
    }

    /// The orders that were given since the last call to a player of [`Self::still`].
    pub fn take_given(&self) -> Vec<PlaybackOrder> {
        self.untaken.iter().flat_map(Receiver::try_iter).collect()
    }

    /// Changes the state of a player of [`Self::still`].
    pub fn set_state(&self, state: PlaybackState) {
        self.shared.look.lock().state = Some((state, Instant::now()));
    }

    /// What is known of it.
    pub fn look(&self) -> PlayerLook {
        self.shared.look.lock().clone()
    }

    /// Gives it an order. Of jumps that wait for one that is carried out, only the last is sent.
    pub fn order(&self, order: PlaybackOrder) {
        self.shared.look.lock().is_busy = true;
        if self.orders.send(order).is_err() {
            self.shared.look.lock().is_busy = false;
        }
    }
}

impl Drop for PlayerRemote {
    fn drop(&mut self) {
        self.shared.is_closing.store(true, Ordering::Relaxed);
    }
}

impl SharedPlayer {
    fn new(wake: WakeCallback) -> Self {
        Self { look: Mutex::default(), is_closing: AtomicBool::new(false), wake }
    }

    fn is_closing(&self) -> bool {
        self.is_closing.load(Ordering::Relaxed)
    }

    fn change(&self, change: impl FnOnce(&mut PlayerLook)) {
        change(&mut self.look.lock());
        (self.wake)();
    }

    fn follow_states(&self, directory: &Directory) {
        let data = format!("{PLAYBACK}.state");
        while !self.is_closing() {
            let problem = match Tap::open(directory, &data, Keep::Latest, PROVIDER_WITHIN) {
                Ok(tap) if tap.schema().hash() == PlaybackState::schema().hash() => {
                    self.read_states(tap)
                }
                Ok(_) => "the player has another version than this program".to_owned(),
                Err(error) => error.to_string(),
            };
            if self.look.lock().problem != problem {
                self.change(|look| look.problem = problem);
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    /// Reads until the link ends, and returns why.
    fn read_states(&self, mut tap: Tap) -> String {
        while !self.is_closing() {
            match tap.next(LOOK_EVERY) {
                Ok(Some(data)) => {
                    let Ok(state) = codec::decode::<PlaybackState>(&data.payload) else { continue };
                    let before = self.look.lock().state.as_ref().map(|(state, _)| state.clone());
                    let is_new = before.as_ref() != Some(&state);
                    let mut look = self.look.lock();
                    look.state = Some((state, Instant::now()));
                    look.problem.clear();
                    drop(look);
                    // A pause is stated again and again.
                    if is_new {
                        (self.wake)();
                    }
                }
                Ok(None) => {}
                Err(error) => return error.to_string(),
            }
        }
        String::new()
    }

    fn send_orders(&self, directory: &Directory, from: &str, given: &Receiver<PlaybackOrder>) {
        let mut connection = None;
        let mut next = None;
        let mut request = 0;
        while !self.is_closing() {
            let order = match next.take() {
                Some(order) => order,
                None => match given.recv_timeout(LOOK_EVERY) {
                    Ok(order) => order,
                    Err(RecvTimeoutError::Timeout) => continue,
                    Err(RecvTimeoutError::Disconnected) => return,
                },
            };
            let order = skip_jumps(order, given, &mut next);
            request += 1;
            let answer = send_order(&mut connection, directory, from, request, order);
            if answer.is_err() {
                connection = None;
            }
            let is_busy = next.is_some();
            let refusal = match answer {
                Ok((true, _)) => String::new(),
                Ok((false, text)) | Err(text) => text,
            };
            self.change(|look| (look.refusal, look.is_busy) = (refusal, is_busy));
        }
    }
}

/// Returns the order to send: of jumps in a row the last. What was taken and is none is `next`.
fn skip_jumps(
    mut order: PlaybackOrder,
    given: &Receiver<PlaybackOrder>,
    next: &mut Option<PlaybackOrder>,
) -> PlaybackOrder {
    while matches!(order, PlaybackOrder::Seek { .. }) {
        match given.try_recv() {
            Ok(later @ PlaybackOrder::Seek { .. }) => order = later,
            Ok(other) => {
                *next = Some(other);
                break;
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
        }
    }
    order
}

type PlayerConnection = (ControlConnection, Receiver<Result<(u64, bool, String), String>>);

/// Sends an order and waits for its answer: whether it is carried out, and what follows.
fn send_order(
    connection: &mut Option<PlayerConnection>,
    directory: &Directory,
    from: &str,
    request: u64,
    order: PlaybackOrder,
) -> Result<(bool, String), String> {
    if connection.is_none() {
        let entry = directory.find_process(PLAYBACK, PROVIDER_WITHIN);
        let entry = entry.map_err(|error| error.to_string())?;
        let (sender, answers) = mpsc::channel();
        let sink = move |event| {
            let answer = match event {
                ControlEvent::Answer(Answer::Ordered { request, accepted, text }) => {
                    Ok((request, accepted, text))
                }
                ControlEvent::Closed(reason) => Err(reason),
                ControlEvent::Answer(_) => return,
            };
            // The thread that reads it may have ended.
            let _ = sender.send(answer);
        };
        let opened = ControlConnection::connect(&entry, Role::Operator, from, sink);
        *connection = Some((opened.map_err(|error| error.to_string())?, answers));
    }
    let Some((writer, answers)) = connection else { return Err(String::new()) };
    let command = Command::Playback { request, order };
    writer.send(&command).map_err(|error| error.to_string())?;
    let end = Instant::now() + ANSWER_WITHIN;
    loop {
        match answers.recv_timeout(end.saturating_duration_since(Instant::now())) {
            Ok(Ok((answered, accepted, text))) if answered == request => {
                return Ok((accepted, text));
            }
            Ok(Ok(_)) => {}
            Ok(Err(reason)) => return Err(format!("the player is gone: {reason}")),
            Err(_) => {
                return Err(format!(
                    "the player has not answered within {} s",
                    ANSWER_WITHIN.as_secs()
                ));
            }
        }
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.into()).spawn(work).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_jumps_in_a_row_only_the_last_is_sent() {
        let (sender, given) = mpsc::channel();
        let seek = |at_s| PlaybackOrder::Seek { at_s };
        for order in [seek(2.0), seek(3.0), PlaybackOrder::Pause, seek(4.0)] {
            sender.send(order).unwrap();
        }
        let mut next = None;
        assert_eq!(skip_jumps(seek(1.0), &given, &mut next), seek(3.0));
        assert_eq!(next.take(), Some(PlaybackOrder::Pause));
        assert_eq!(skip_jumps(PlaybackOrder::Pause, &given, &mut next), PlaybackOrder::Pause);
        assert_eq!((next, given.recv()), (None, Ok(seek(4.0))));
    }

    #[test]
    fn the_time_stands_in_pauses_and_does_not_pass_the_end() {
        let state =
            PlaybackState { from: 10.0, to: 12.0, at: 1.5, speed: 100.0, ..Default::default() };
        let look = |state: PlaybackState| PlayerLook {
            state: Some((state, Instant::now().checked_sub(ESTIMATED_FOR).unwrap())),
            ..PlayerLook::default()
        };
        assert_eq!(look(state.clone()).at_s(), Some(2.0));
        assert_eq!(look(PlaybackState { paused: true, ..state }).at_s(), Some(1.5));
        assert_eq!(PlayerLook::default().at_s(), None);
    }
}
