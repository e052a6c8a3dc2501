//! Which component publishes and subscribes to what, and what changed since a client was informed.
//! Pure.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

/// Names by topic: its publishers, or its subscribers.
type NamesByTopic = BTreeMap<String, BTreeSet<String>>;

/// The connections of a system at one time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ConnectionGraph {
    published: NamesByTopic,
    subscribed: NamesByTopic,
    services: NamesByTopic,
}

impl ConnectionGraph {
    /// Adds a publisher.
    pub(crate) fn add_publisher(&mut self, topic: &str, component: &str) {
        self.published.entry(topic.to_owned()).or_default().insert(component.to_owned());
    }

    /// Adds a subscriber.
    pub(crate) fn add_subscriber(&mut self, topic: &str, name: &str) {
        self.subscribed.entry(topic.to_owned()).or_default().insert(name.to_owned());
    }

    /// Adds a service.
    pub(crate) fn add_service(&mut self, service: &str, component: &str) {
        self.services.entry(service.to_owned()).or_default().insert(component.to_owned());
    }

    /// Composes what changed since `before`; `None` if nothing did.
    pub(crate) fn compose_update(&self, before: &Self) -> Option<String> {
        if self == before {
            return None;
        }
        let topics = |graph: &Self| -> BTreeSet<String> {
            graph.published.keys().chain(graph.subscribed.keys()).cloned().collect()
        };
        let removed: Vec<_> = topics(before).difference(&topics(self)).cloned().collect();
        let removed_services: Vec<_> =
            before.services.keys().filter(|name| !self.services.contains_key(*name)).collect();
        let update = json!({
            "op": "connectionGraphUpdate",
            "publishedTopics": list_changes(&self.published, &before.published, "publisherIds"),
            "subscribedTopics": list_changes(&self.subscribed, &before.subscribed, "subscriberIds"),
            "advertisedServices": list_changes(&self.services, &before.services, "providerIds"),
            "removedTopics": removed,
            "removedServices": removed_services,
        });
        Some(update.to_string())
    }
}

/// The topics whose names have changed. One that has lost its last name, but still exists, has none.
fn list_changes(now: &NamesByTopic, before: &NamesByTopic, ids: &str) -> Vec<Value> {
    let none = BTreeSet::new();
    let all: BTreeSet<_> = now.keys().chain(before.keys()).collect();
    let names = |map: &NamesByTopic, topic: &String| map.get(topic).unwrap_or(&none).clone();
    all.into_iter()
        .filter(|topic| names(now, topic) != names(before, topic))
        .map(|topic| json!({"name": topic, ids: names(now, topic)}))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_has_what_is_new_changed_and_gone() {
        let mut before = ConnectionGraph::default();
        before.add_publisher("laser.scan", "laser");
        before.add_subscriber("laser.scan", "mapper");
        before.add_publisher("gps.fix", "gps");
        before.add_service("mission/pause", "view");
        assert_eq!(before.compose_update(&before), None);
        let mut now = ConnectionGraph::default();
        now.add_publisher("laser.scan", "laser");
        now.add_subscriber("laser.scan", "mapper");
        now.add_subscriber("laser.scan", "driver");
        let update = now.compose_update(&before).expect("a change");
        let update: Value = serde_json::from_str(&update).expect("JSON");
        let expected = json!({
            "op": "connectionGraphUpdate",
            "publishedTopics": [{"name": "gps.fix", "publisherIds": []}],
            "subscribedTopics": [{"name": "laser.scan", "subscriberIds": ["driver", "mapper"]}],
            "advertisedServices": [{"name": "mission/pause", "providerIds": []}],
            "removedTopics": ["gps.fix"],
            "removedServices": ["mission/pause"],
        });
        assert_eq!(update, expected);
    }
}
