//! The connections of keys that are open: counted by name and process, and ended when their key is
//! no longer accepted.

use std::collections::HashMap;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::oneshot;

use super::limits::GateLimits;
use crate::certificate::CertificateFacts;
use crate::identity::KeyPurpose;

/// The open connections.
#[derive(Clone)]
pub(crate) struct Sessions {
    open: Arc<Mutex<OpenSessions>>,
    limits: GateLimits,
}

#[derive(Default)]
struct OpenSessions {
    last: u64,
    sessions: HashMap<u64, OpenSession>,
}

struct OpenSession {
    facts: CertificateFacts,
    /// The process to which it leads.
    process: String,
    end: Option<oneshot::Sender<String>>,
}

/// One connection's place, which is returned when this is dropped.
pub(crate) struct SessionPlace {
    sessions: Sessions,
    id: u64,
    end: oneshot::Receiver<String>,
}

impl Sessions {
    pub(crate) fn new(limits: GateLimits) -> Self {
        Self { open: Arc::default(), limits }
    }

    /// Gives a connection to `process` a place; otherwise returns why there is none.
    pub(crate) fn admit(
        &self,
        facts: &CertificateFacts,
        process: &str,
    ) -> Result<SessionPlace, String> {
        let name = &facts.holder.name;
        let mut open = self.open.lock();
        // A host has a connection for each link of its components.
        let is_host = facts.holder.purpose == KeyPurpose::Host;
        let of_name = || open.sessions.values().filter(|it| it.facts.holder.name == *name);
        let to_process = of_name().filter(|it| it.process == process).count();
        if open.sessions.len() >= self.limits.sessions {
            return Err(format!("all {} connections of the gate are taken", self.limits.sessions));
        }
        if !is_host && of_name().count() >= self.limits.sessions_per_name {
            return Err(format!(
                "{name} has {} connections already",
                self.limits.sessions_per_name
            ));
        }
        if !is_host && to_process >= self.limits.sessions_per_process {
            return Err(format!("{name} has {to_process} connections to {process} already"));
        }
        open.last += 1;
        let id = open.last;
        let (sender, end) = oneshot::channel();
        let (facts, process) = (facts.clone(), process.to_owned());
        open.sessions.insert(id, OpenSession { facts, process, end: Some(sender) });
        drop(open);
        Ok(SessionPlace { sessions: self.clone(), id, end })
    }

    /// Ends the connections for which `judge` returns a reason. Returns how many.
    pub(crate) fn end_sessions(
        &self,
        judge: impl Fn(&CertificateFacts) -> Option<String>,
    ) -> usize {
        let mut open = self.open.lock();
        let mut ended = 0;
        for session in open.sessions.values_mut() {
            if let Some(why) = judge(&session.facts)
                && let Some(end) = session.end.take()
            {
                let _ = end.send(why);
                ended += 1;
            }
        }
        ended
    }
}

impl SessionPlace {
    /// Waits until the gate ends the connection; returns why.
    pub(crate) async fn ended(&mut self) -> String {
        (&mut self.end).await.unwrap_or_else(|_| "the gate ends".into())
    }
}

impl Drop for SessionPlace {
    fn drop(&mut self) {
        self.sessions.open.lock().sessions.remove(&self.id);
    }
}

#[cfg(test)]
mod tests {
    use armor_wire::acting::KeyRole;

    use super::*;
    use crate::certificate::Serial;
    use crate::identity::KeyHolder;

    fn key(name: &str) -> CertificateFacts {
        let purpose = KeyPurpose::Person(KeyRole::Observer);
        let holder = KeyHolder { name: name.into(), purpose };
        let serial = Serial::random();
        CertificateFacts { holder, serial, not_before_s: 0, not_after_s: 9, sites: Vec::new() }
    }

    #[test]
    fn connections_are_counted_by_name_and_by_process() {
        let limits = GateLimits {
            sessions: 4,
            sessions_per_name: 3,
            sessions_per_process: 2,
            ..GateLimits::default()
        };
        let sessions = Sessions::new(limits);
        let (alice, renewed, bob) = (key("alice"), key("alice"), key("bob"));
        let _first = sessions.admit(&alice, "driver").unwrap();
        let second = sessions.admit(&renewed, "driver").unwrap();
        let refused = |facts, process| sessions.admit(facts, process).err().unwrap();
        assert_eq!(refused(&alice, "driver"), "alice has 2 connections to driver already");
        let _third = sessions.admit(&alice, "mapper").unwrap();
        assert_eq!(refused(&renewed, "camera"), "alice has 3 connections already");
        let _fourth = sessions.admit(&bob, "driver").unwrap();
        assert_eq!(refused(&bob, "mapper"), "all 4 connections of the gate are taken");
        drop(second);
        assert!(sessions.admit(&alice, "driver").is_ok(), "places come back");
    }

    #[test]
    fn only_the_connections_of_a_refused_key_end() {
        let sessions = Sessions::new(GateLimits::default());
        let (old, new) = (key("alice"), key("alice"));
        let mut places = [&old, &new, &old].map(|facts| sessions.admit(facts, "driver").unwrap());
        let judge =
            |facts: &CertificateFacts| (facts.serial == old.serial).then(|| "revoked".to_owned());
        assert_eq!(sessions.end_sessions(judge), 2);
        assert_eq!(sessions.end_sessions(judge), 0, "once");
        let ends = places.each_mut().map(|place| place.end.try_recv().ok());
        let revoked = || Some("revoked".to_owned());
        assert_eq!(ends, [revoked(), None, revoked()]);
    }
}
