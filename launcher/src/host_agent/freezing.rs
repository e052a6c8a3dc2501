//! Freezing a component while its host is cut off (`cut-off="safe"`). The agent orders it on a control
//! connection of its own, in the place of the executive, which cannot reach it; when the launcher is
//! connected again, the executive orders what the mission needs.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use armor_sdk::control::{Answer, Command, ControlConnection, ControlEvent, Role, RunState};
use armor_wire::run_key::NameKey;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep, sleep_until, timeout_at};

use crate::run::supervisor::LogLevel;

/// How long a component has to confirm an order to freeze, as the executive gives it.
const STOPS_WITHIN: Duration = Duration::from_secs(1);
/// How many times it is ordered to freeze before it is killed.
const STOP_TRIES: u32 = 2;
/// How long it has to confirm that it is active again, also on another connection.
const STARTS_WITHIN: Duration = Duration::from_secs(10);
/// Rest before the order is sent on another connection, since the one that it was sent on has ended.
const CONNECTS_AGAIN: Duration = Duration::from_millis(100);
/// Events of the control connection that wait.
const MAX_EVENTS: usize = 64;
/// The agent's name on the control connection.
const FROM: &str = "agent";

/// The process of a component, as far as freezing it needs.
pub(super) trait FreezableProcess: Send + Sync + 'static {
    /// Where it listens; not known before another host has connected to it.
    fn port(&self) -> Option<u16>;
    /// Its key, if the launcher has given it one.
    fn key(&self) -> Option<NameKey>;
    /// Whether it runs.
    fn is_alive(&self) -> bool;
    /// Whether an executive activates and freezes it.
    fn is_commanded(&self) -> bool;
    /// Writes a line into the log.
    fn report(&self, level: LogLevel, text: String);
    /// Kills it, as what is started again when the launcher is connected.
    fn kill_for_cut(&self);
    /// Waits until a launcher is connected to it.
    fn wait_for_launcher(&self) -> impl Future<Output = ()> + Send;
}

/// What follows from what the component reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FreezeStep {
    /// It gets no calls, or soon reports what it does.
    Wait,
    /// It must be ordered to freeze: it runs.
    Freeze,
    /// It has stopped.
    Stopped,
    /// Its code lets none freeze it.
    Exempt,
}

/// One component that is being frozen.
#[derive(Debug, Default)]
struct Freezing {
    /// The activation that was ended.
    ended: Option<u64>,
    tries: u32,
    is_stopped: bool,
}

impl Freezing {
    fn take_state(&mut self, state: RunState, activation: u64, controllable: bool) -> FreezeStep {
        if !controllable {
            return FreezeStep::Exempt;
        }
        match state {
            RunState::Active => {
                *self = Self { ended: Some(activation), tries: 1, is_stopped: false };
                FreezeStep::Freeze
            }
            RunState::Frozen if self.is_under_way() => {
                self.is_stopped = true;
                FreezeStep::Stopped
            }
            // One that is done or has failed gets no calls; it keeps its report.
            RunState::Starting | RunState::Frozen | RunState::Done | RunState::Failed => {
                FreezeStep::Wait
            }
        }
    }

    /// Whether an order to freeze is not confirmed yet.
    fn is_under_way(&self) -> bool {
        self.ended.is_some() && !self.is_stopped
    }

    /// Orders it once more, if it may still obey.
    fn try_again(&mut self) -> bool {
        self.tries += 1;
        self.tries <= STOP_TRIES
    }

    fn order(&self) -> Command {
        Command::Freeze { activation: self.ended.unwrap_or_default() }
    }
}

/// Freezes the component until a launcher is connected to it again. One that does not stop is killed,
/// and started again after the cut.
pub(super) async fn freeze_while_cut_off(process: Arc<impl FreezableProcess>, launcher: String) {
    if let Err(why) = keep_frozen(&*process, &launcher).await
        && process.is_alive()
    {
        process.report(LogLevel::Warn, format!("cannot be frozen ({why}); it is killed"));
        process.kill_for_cut();
    }
}

async fn keep_frozen(process: &impl FreezableProcess, launcher: &str) -> Result<(), String> {
    let port = process.port().ok_or("it has not registered yet")?;
    let (connection, mut events) = connect(port, process.key()).await?;
    let mut freezing = Freezing::default();
    let mut deadline = Instant::now();
    let mut is_replaced = false;
    loop {
        tokio::select! {
            event = events.recv() => match event {
                Some(ControlEvent::Answer(Answer::State { state, activation, controllable })) => {
                    match freezing.take_state(state, activation, controllable) {
                        FreezeStep::Wait => {}
                        FreezeStep::Freeze => {
                            deadline = Instant::now() + STOPS_WITHIN;
                            send(&connection, &freezing.order())?;
                        }
                        FreezeStep::Stopped => {
                            let text = format!("frozen until {launcher} is connected again");
                            process.report(LogLevel::Info, text);
                        }
                        FreezeStep::Exempt => {
                            let text = "continues: its code lets none freeze it";
                            process.report(LogLevel::Warn, text.into());
                            return Ok(());
                        }
                    }
                }
                Some(ControlEvent::Answer(_)) => {}
                // An executive that reaches it again has taken the agent's place, or it has ended.
                _ if !freezing.is_under_way() => {
                    is_replaced = true;
                    process.wait_for_launcher().await;
                    break;
                }
                Some(ControlEvent::Closed(why)) => return Err(why),
                None => return Err("its control connection has ended".into()),
            },
            () = sleep_until(deadline), if freezing.is_under_way() => {
                if !freezing.try_again() {
                    return Err(format!("it did not stop within {:?}", STOPS_WITHIN * STOP_TRIES));
                }
                deadline = Instant::now() + STOPS_WITHIN;
                send(&connection, &freezing.order())?;
            }
            () = process.wait_for_launcher() => break,
        }
    }
    let Some(activation) = freezing.ended else { return Ok(()) };
    if process.is_commanded() {
        // The executive connects, finds it frozen, and orders what the marking needs.
        return Ok(());
    }
    if !process.is_alive() {
        return Ok(());
    }
    // No executive commands it: it runs again as it did.
    let open = (!is_replaced).then_some((connection, events));
    if let Err(why) = activate_again(process, port, activation, open).await {
        process.report(LogLevel::Warn, format!("cannot be activated again ({why}); it is killed"));
        process.kill_for_cut();
    }
    Ok(())
}

/// Orders the component to be active, on the connection that is open or on another one.
async fn activate_again(
    process: &impl FreezableProcess,
    port: u16,
    activation: u64,
    open: Option<(ControlConnection, mpsc::Receiver<ControlEvent>)>,
) -> Result<(), String> {
    let until = Instant::now() + STARTS_WITHIN;
    let mut open = open;
    while Instant::now() < until {
        let (connection, mut events) = match open.take() {
            Some(open) => open,
            None => connect(port, process.key()).await?,
        };
        // A connection that has ended meanwhile has not brought the order: it is sent on another one.
        if send(&connection, &Command::Activate { activation, parameters: Vec::new() }).is_ok() {
            while let Ok(Some(event)) = timeout_at(until, events.recv()).await {
                match event {
                    ControlEvent::Answer(Answer::State { state: RunState::Active, .. }) => {
                        process.report(LogLevel::Info, "active again".into());
                        return Ok(());
                    }
                    ControlEvent::Closed(_) => break,
                    ControlEvent::Answer(_) => {}
                }
            }
        }
        sleep(CONNECTS_AGAIN).await;
    }
    let within = STARTS_WITHIN.as_secs();
    let text = format!("has not confirmed within {within} s that it is active again");
    process.report(LogLevel::Warn, text);
    Ok(())
}

/// Connects to the component that listens on a port of this host.
async fn connect(
    port: u16,
    key: Option<NameKey>,
) -> Result<(ControlConnection, mpsc::Receiver<ControlEvent>), String> {
    let (sender, events) = mpsc::channel(MAX_EVENTS);
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port)).to_string();
    let connecting = tokio::task::spawn_blocking(move || {
        // Waits where nothing is read: the component is not slowed down by a second of that.
        let sink = move |event| drop(sender.blocking_send(event));
        ControlConnection::connect_to(&address, key, Role::Executive, FROM, sink)
    });
    let connection = connecting.await.map_err(|error| error.to_string())?;
    Ok((connection.map_err(|error| error.to_string())?, events))
}

fn send(connection: &ControlConnection, command: &Command) -> Result<(), String> {
    connection.send(command).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_runs_is_ordered_to_freeze_until_it_confirms() {
        let mut freezing = Freezing::default();
        assert_eq!(freezing.take_state(RunState::Starting, 0, true), FreezeStep::Wait);
        assert!(!freezing.is_under_way());
        assert_eq!(freezing.take_state(RunState::Active, 7, true), FreezeStep::Freeze);
        assert_eq!(freezing.order(), Command::Freeze { activation: 7 });
        // It was in its last call.
        assert_eq!(freezing.take_state(RunState::Done, 7, true), FreezeStep::Wait);
        assert!(freezing.is_under_way() && freezing.try_again() && !freezing.try_again());
        assert_eq!(freezing.take_state(RunState::Frozen, 7, true), FreezeStep::Stopped);
        assert!(!freezing.is_under_way());
        assert_eq!(freezing.take_state(RunState::Frozen, 7, true), FreezeStep::Wait);
        // Such as one that becomes active by itself when it has its parameters.
        assert_eq!(freezing.take_state(RunState::Active, 8, true), FreezeStep::Freeze);
        assert!(freezing.is_under_way() && freezing.try_again());
    }

    #[test]
    fn what_is_at_rest_keeps_its_report_and_what_none_may_freeze_continues() {
        for state in [RunState::Frozen, RunState::Done, RunState::Failed] {
            let mut freezing = Freezing::default();
            assert_eq!(freezing.take_state(state, 3, true), FreezeStep::Wait);
            assert_eq!(freezing.ended, None);
        }
        let step = Freezing::default().take_state(RunState::Active, 3, false);
        assert_eq!(step, FreezeStep::Exempt);
    }
}
