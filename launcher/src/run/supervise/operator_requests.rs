//! What an operator asks of the launcher: restarting and stopping components, and the history of one.

use armor_inspect::run_control::{RunReply, RunRequest};
use armor_robotfile::advise_similar;

use super::Launcher;
use crate::run::plan::LAUNCHER;
use crate::run::requests::{ReceivedRequest, refusal};
use crate::run::supervisor::{
    ChildId, ChildOrder, ChildRole, Duty, LogLevel, StopRequest, Supervisor, SupervisorEvent,
};

impl Launcher {
    /// Answers a request, and returns what it orders.
    pub(super) fn convert_request(
        &self,
        received: ReceivedRequest,
        supervisor: &Supervisor,
    ) -> Option<SupervisorEvent> {
        let ReceivedRequest { request, reply } = received;
        let (event, text) = match self.judge_request(&request) {
            Ok((event, text)) => (event, text),
            Err(text) => {
                let _ = reply.send(refusal(text));
                return None;
            }
        };
        if event.is_some() {
            self.log.report(LAUNCHER, LogLevel::Info, format!("an operator: {text}"));
        }
        let is_list = request == RunRequest::List;
        let absent = if is_list { supervisor.list_absent() } else { Vec::new() };
        let hosts = if is_list { self.plan.hosts.list() } else { Vec::new() };
        let has_executive = is_list.then(|| supervisor.has_executive());
        let history = match &request {
            RunRequest::History { component } => {
                self.find_process(component).map(|id| supervisor.describe_history(id))
            }
            _ => None,
        };
        let answer = RunReply { accepted: true, text, absent, hosts, has_executive, history };
        // A client that has left does not take back what it has asked for.
        let _ = reply.send(answer);
        event
    }

    /// Returns what a request orders, if anything, and the reply; or why it is refused.
    fn judge_request(
        &self,
        request: &RunRequest,
    ) -> Result<(Option<SupervisorEvent>, String), String> {
        let find = |name: &str| self.find_component(name);
        match request {
            RunRequest::Restart { component } => {
                let id = find(component)?;
                let event = SupervisorEvent::Order(id, ChildOrder::Restart);
                Ok((Some(event), format!("{component} is restarted")))
            }
            RunRequest::Stop { component } => {
                let id = find(component)?;
                if self.plan.duties.iter().any(|duty| duty.role == ChildRole::Executive) {
                    return Err(format!(
                        "a mission runs in this system, and its components run as long as it \
                         does: `armor mission pause` freezes them, `armor restart {component}` \
                         starts one again, `armor stop --all` ends the system"
                    ));
                }
                let event = SupervisorEvent::Order(id, ChildOrder::Stop);
                Ok((
                    Some(event),
                    format!("{component} is being stopped; `armor restart {component}` starts it"),
                ))
            }
            RunRequest::StopAll => {
                let event = SupervisorEvent::Stop(StopRequest::Ordered);
                Ok((Some(event), "the system stops".into()))
            }
            RunRequest::History { component } if self.find_process(component).is_none() => {
                find(component).map(|_| (None, String::new()))
            }
            RunRequest::History { .. } | RunRequest::List => Ok((None, String::new())),
        }
    }

    /// Finds a component or a daemon.
    fn find_process(&self, name: &str) -> Option<ChildId> {
        self.plan.duties.iter().position(|duty| duty.name == name)
    }

    fn find_component(&self, name: &str) -> Result<ChildId, String> {
        let is_it = |duty: &Duty| duty.role == ChildRole::Component && duty.name == name;
        self.plan.duties.iter().position(is_it).ok_or_else(|| {
            let components = self.plan.duties.iter().filter(|it| it.role == ChildRole::Component);
            let names: Vec<&str> = components.map(|duty| duty.name.as_str()).collect();
            let advice = advise_similar(name, names.iter().copied());
            if self.find_process(name).is_some() {
                return format!(
                    "{name} is a process of Armor and no component: the launcher starts it again \
                     itself when it ends (the components: {})",
                    names.join(", ")
                );
            }
            format!(
                "this run has started no component called {name}{advice} (its components: {})",
                names.join(", ")
            )
        })
    }
}
