//! What a viewer may order: velocities, STOP and goals, published as the outputs of this component.

use std::collections::VecDeque;
use std::time::Instant;

use armor_inspect::DriveLimits;
use armor_sdk::prelude::*;
use armor_wire::acting::KeyRole;
use parking_lot::Mutex;
use tokio::sync::Notify;

use super::published_message::PublishedMessage;
use crate::drive_desk::DriveDesk;
use crate::goal_keeper::GoalKeeper;

/// Events that no tick has reported yet; more are the same few again.
const MAX_EVENTS: usize = 16;

/// What the component reports to the mission.
#[derive(Clone, Copy, Debug, Events, PartialEq)]
pub(super) enum ViewerEvent {
    /// STOP was ordered
    Stopped,
    /// STOP was released
    Released,
    /// a person has begun to drive by hand
    Driving,
    /// a goal was set
    Goal,
    /// the robot is at the goal
    Arrived,
}

/// What can be changed while the component runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CommanderSettings {
    pub(super) limits: DriveLimits,
    pub(super) role: KeyRole,
    pub(super) tolerance_m: f64,
}

/// Publishes on the threads of the server, because a person must not wait for the next tick.
pub(super) struct Commander {
    armor: Armor,
    state: Mutex<CommanderState>,
    /// Notified when the robot begins to move.
    pub(super) drive_began: Notify,
}

struct CommanderState {
    desk: DriveDesk,
    goals: GoalKeeper<PoseStamped>,
    role: KeyRole,
    events: VecDeque<ViewerEvent>,
}

impl Commander {
    /// Returns a commander that publishes through `armor`.
    pub(super) fn new(armor: Armor, settings: CommanderSettings) -> Self {
        let state = CommanderState {
            desk: DriveDesk::new(settings.limits),
            goals: GoalKeeper::new(settings.tolerance_m),
            role: settings.role,
            events: VecDeque::new(),
        };
        Self { armor, state: Mutex::new(state), drive_began: Notify::new() }
    }

    /// Applies new settings.
    pub(super) fn set(&self, settings: CommanderSettings) {
        let mut state = self.state.lock();
        state.desk.limits = settings.limits;
        state.goals.tolerance_m = settings.tolerance_m;
        state.role = settings.role;
    }

    /// Returns system time, in seconds.
    pub(super) fn timestamp(&self) -> f64 {
        self.armor.timestamp()
    }

    /// Returns the role of the clients.
    pub(super) fn role(&self) -> KeyRole {
        self.state.lock().role
    }

    /// Checks whether the clients may do what needs a role.
    ///
    /// # Errors
    /// In words, if they may not.
    pub(super) fn check_role(&self, needed: Option<KeyRole>, what: &str) -> Result<(), String> {
        let role = self.role();
        match needed {
            Some(needed) if role >= needed => Ok(()),
            Some(needed) => Err(format!(
                "{what} needs the role {needed}, and viewers have the role {role} here (parameter \
                 `role`)"
            )),
            None => Err(format!("{what} is not for viewers")),
        }
    }

    /// Carries out a message that a client has published.
    ///
    /// # Errors
    /// In words, if it is refused or reaches no component.
    pub(super) fn take_message(
        &self,
        client: u64,
        message: PublishedMessage,
    ) -> Result<(), String> {
        match message {
            PublishedMessage::Velocity { forward_mps, turn_radps } => {
                self.check_role(Some(KeyRole::Operator), "driving by hand")?;
                self.drive(client, (forward_mps, turn_radps))
            }
            // Any role may bring the robot to rest.
            PublishedMessage::Stop(true) => self.stop(),
            PublishedMessage::Stop(false) => {
                self.check_role(Some(KeyRole::Operator), "releasing STOP")?;
                self.release(client)
            }
            PublishedMessage::Goal(goal) => {
                self.check_role(Some(KeyRole::Operator), "setting a goal")?;
                self.set_goal(client, goal)
            }
        }
    }

    fn drive(&self, client: u64, velocity: (f64, f64)) -> Result<(), String> {
        // Published under the lock: a zero that another thread publishes must not be overtaken.
        let mut state = self.state.lock();
        let taken = state.desk.take_velocity(client, velocity, Instant::now());
        let (velocity, has_begun) = taken.map_err(|refusal| refusal.to_string())?;
        let Some(velocity) = velocity else { return Ok(()) };
        if has_begun {
            state.note_event(ViewerEvent::Driving);
            // A person who drives wants the robot nowhere else.
            state.goals.clear();
            self.drive_began.notify_one();
        }
        self.publish_velocity(velocity)
    }

    fn publish_velocity(&self, (forward_mps, turn_radps): (f64, f64)) -> Result<(), String> {
        self.publish("velocity", &Twist::planar(forward_mps, turn_radps), "driver.manual")
    }

    fn publish_halt(&self, halt: Option<(f64, f64)>) {
        if let Some(halt) = halt
            && let Err(error) = self.publish_velocity(halt)
        {
            // The driver stops by its own timeout.
            tracing::warn!("a velocity of zero was not published: {error}");
        }
    }

    fn publish<T: Message>(&self, output: &str, message: &T, input: &str) -> Result<(), String> {
        let sent = self.armor.send_data(output, message).map_err(|error| error.to_string())?;
        if sent.to == 0 {
            return Err(format!(
                "no component takes it: link the output `{output}` of this component, such as to \
                 `{input}`"
            ));
        }
        Ok(())
    }

    fn stop(&self) -> Result<(), String> {
        let mut state = self.state.lock();
        let halt = state.desk.stop();
        state.goals.clear();
        state.note_event(ViewerEvent::Stopped);
        let published = self.publish("stop", &Flag { data: true }, "driver.stop");
        self.publish_halt(halt);
        published.map_err(|error| format!("STOP is not delivered: {error}"))
    }

    fn release(&self, client: u64) -> Result<(), String> {
        let mut state = self.state.lock();
        let was_stopped = state.desk.is_stopped();
        state.desk.release(client, Instant::now()).map_err(|refusal| refusal.to_string())?;
        if was_stopped {
            state.note_event(ViewerEvent::Released);
        }
        self.publish("stop", &Flag { data: false }, "driver.stop")
    }

    fn set_goal(&self, client: u64, mut goal: PoseStamped) -> Result<(), String> {
        goal.stamp = self.timestamp();
        let mut state = self.state.lock();
        self.publish("goal", &goal, "planner.operator")?;
        let place = (goal.pose.position.x, goal.pose.position.y);
        state.goals.set(client, goal, place);
        state.note_event(ViewerEvent::Goal);
        Ok(())
    }

    /// Sends the goal again, since a planner forgets one that is old.
    pub(super) fn repeat_goal(&self) {
        let state = self.state.lock();
        let Some(goal) = state.goals.goal() else { return };
        let goal = PoseStamped { stamp: self.timestamp(), ..goal.clone() };
        // A link that is down comes back, and then the next one arrives.
        let _ = self.armor.send_data("goal", &goal);
    }

    /// Takes where the robot is.
    pub(super) fn take_pose(&self, pose: &Pose) {
        let mut state = self.state.lock();
        if state.goals.has_arrived((pose.position.x, pose.position.y)) {
            state.note_event(ViewerEvent::Arrived);
        }
    }

    /// A client has left: what it has ordered ends, except STOP.
    pub(super) fn leave(&self, client: u64) {
        let mut state = self.state.lock();
        let halt = state.desk.leave(client);
        self.publish_halt(halt);
        state.goals.leave(client);
    }

    /// Publishes zero if the robot moves and no message has arrived in time. Returns until when it
    /// may move.
    pub(super) fn halt_if_silent(&self) -> Option<Instant> {
        let mut state = self.state.lock();
        let halt = state.desk.take_expired(Instant::now());
        self.publish_halt(halt);
        state.desk.moves_until()
    }

    /// Returns whether a client is the one that drives.
    pub(super) fn is_driver(&self, client: u64) -> bool {
        self.state.lock().desk.is_driver(client, Instant::now())
    }

    /// Takes the next event that was not reported yet.
    pub(super) fn take_event(&self) -> Option<ViewerEvent> {
        self.state.lock().events.pop_front()
    }
}

impl CommanderState {
    fn note_event(&mut self, event: ViewerEvent) {
        if self.events.len() < MAX_EVENTS && self.events.back() != Some(&event) {
            self.events.push_back(event);
        }
    }
}
