//! The drawing of the system with what runs in it: blocks by state, links by what they carry.

use std::collections::BTreeMap;

use armor_inspect::words::{describe_call, format_duration};
use armor_inspect::{ObservedLink, ObservedProcess, SystemPicture};
use eframe::egui::Color32;

use super::presence::{self, Presences};
use super::tone::{self, Tone};
use crate::canvas::{Badge, Diagram, Mark, Wire};
use crate::item::Item;
use armor_picture::theme::ThemeColours;

/// The host of each component that the file places on another one.
pub type FilePlaces = BTreeMap<String, String>;

/// Updates the drawing with the observed state; `base` is the drawing without it, of the same
/// blocks. A system of several hosts has `places`, or a launcher that reports on them. In a system that
/// `is_recorded` nothing is linked: its links are drawn as the file has them.
pub fn show(
    diagram: &mut Diagram<Item>,
    base: &Diagram<Item>,
    picture: &SystemPicture,
    places: &FilePlaces,
    presences: &Presences,
    is_recorded: bool,
    colours: &ThemeColours,
) {
    let has_hosts = !places.is_empty() || !picture.hosts.is_empty();
    for (node, plain) in diagram.nodes.iter_mut().zip(&base.nodes) {
        let Item::Component(name) = &plain.item else { continue };
        let process = picture.processes.get(name.as_str());
        let seen_on = process.map(|process| &process.entry.host);
        let host = seen_on.or(places.get(name.as_str())).filter(|_| has_hosts);
        let cut = host.and_then(|host| picture.find_cut(host));
        let (tone, word) = match cut {
            Some(_) => Tone::cut_off(colours),
            None => Tone::seen(process, picture, colours),
        };
        let word = host.map_or_else(|| word.to_owned(), |host| format!("{word} on {host}"));
        (node.look.tint, node.look.outline) = (tone.tint, tone.outline);
        (node.look.is_dim, node.mark) = (tone.is_dim, tone.mark);
        node.subtitle = if plain.subtitle.is_empty() {
            word.clone()
        } else {
            format!("{word}, {}", plain.subtitle)
        };
        node.label = format!("{}: {word}", plain.label);
        node.badge = process.and_then(|process| restarts(process, colours));
        if let Some(badge) = &node.badge {
            node.label = format!("{}, {}", node.label, badge.text);
        } else if process.is_some_and(|it| it.condition.is_gone()) && !picture.has_ended() {
            let doc = "its process has ended".into();
            node.badge = Some(Badge { text: "lost".into(), doc, tint: Some(colours.error) });
        }
        node.doc = match process {
            Some(_) if picture.has_ended() => "The system has ended.".into(),
            Some(process) => of_process(process, picture),
            None => "No process of this name has been seen.".into(),
        };
        if let Some(cut) = cut {
            node.doc = format!("{} is {}\n{}", cut.host, cut.describe_link(), node.doc);
        }
        if let Some(presence) = presences.get(&plain.label) {
            presence::mark_node(node, plain, presence, process.is_some(), colours);
        }
    }
    if picture.has_ended() {
        diagram.wires.clone_from(&base.wires);
    }
    for (wire, plain) in diagram.wires.iter_mut().zip(&base.wires) {
        let Item::Link { from, to } = &plain.item else { continue };
        if is_recorded {
            wire.clone_from(plain);
            wire.label = format!("{}: recorded", plain.label);
        } else if !picture.has_ended() {
            let edge = picture.links.iter().find(|edge| *from == edge.from && *to == edge.to);
            carry(wire, plain, edge, colours);
        }
        if let Some(presence) = presences.get(&plain.label) {
            presence::mark_wire(wire, plain, presence, colours);
        }
    }
}

/// The mark of a component that died and came back, or that is gone.
fn restarts(process: &ObservedProcess, colours: &ThemeColours) -> Option<Badge> {
    let count = process.starts.saturating_sub(1);
    let text = match count {
        0 => return None,
        1 => "1 restart".to_owned(),
        count => format!("{count} restarts"),
    };
    let doc = format!("started {} times while it was watched", process.starts);
    Some(Badge { text, doc, tint: Some(colours.warning) })
}

/// A link by what it carries.
fn carry(
    wire: &mut Wire<Item>,
    plain: &Wire<Item>,
    edge: Option<&ObservedLink>,
    colours: &ThemeColours,
) {
    let words = edge.map_or_else(|| "unknown".to_owned(), in_words);
    let is_down = edge.is_none_or(|edge| !edge.connected);
    let carries = edge.and_then(|edge| edge.rate_hz).is_some_and(|rate_hz| rate_hz > 0.0);
    wire.is_dashed = is_down;
    wire.is_strong = carries && !is_down;
    wire.tint = tint(edge, plain.tint, colours);
    wire.mark = match edge {
        Some(edge) if !edge.connected => Mark::Error,
        Some(edge) if has_lost(edge) => Mark::Warning,
        _ => Mark::None,
    };
    wire.doc = edge.map_or_else(|| "No report from either end yet.".into(), of_edge);
    wire.label = format!("{}: {words}", plain.label);
    wire.text = if edge.is_some() { words } else { String::new() };
}

fn tint(
    edge: Option<&ObservedLink>,
    plain: Option<Color32>,
    colours: &ThemeColours,
) -> Option<Color32> {
    match edge {
        None => Some(colours.weak),
        Some(edge) if !edge.connected => Some(colours.error),
        Some(edge) if edge.paused => Some(colours.weak),
        Some(edge) if has_lost(edge) => Some(colours.warning),
        Some(_) => plain,
    }
}

/// Returns whether data was lost. Data that `keep="latest"` leaves out does not count.
pub fn has_lost(edge: &ObservedLink) -> bool {
    edge.lost > 0 || (edge.dropped > 0 && edge.keep != "latest")
}

/// A link in a few words, for the drawing.
pub fn in_words(edge: &ObservedLink) -> String {
    if !edge.connected {
        return "down".into();
    }
    if edge.paused {
        return "paused".into();
    }
    let mut words = edge.rate_hz.map_or_else(|| "up".to_owned(), rate);
    if edge.lost > 0 {
        words += &format!(", {} lost", edge.lost);
    }
    if edge.dropped > 0 && edge.keep != "latest" {
        words += &format!(", {} dropped", edge.dropped);
    }
    words
}

/// A rate as people read it.
pub fn rate(rate_hz: f64) -> String {
    match rate_hz {
        none if none <= 0.0 => "quiet".into(),
        slow if slow < 9.95 => format!("{slow:.1} Hz"),
        fast => format!("{fast:.0} Hz"),
    }
}

fn of_process(process: &ObservedProcess, picture: &SystemPicture) -> String {
    let for_s = picture.now.saturating_sub(process.since).as_secs_f64();
    let mut lines = vec![format!("{} for {}", process.condition.word(), format_duration(for_s))];
    lines.push(tone::doc(process.condition).into());
    if !process.problem.is_empty() {
        lines.push(process.problem.clone());
    }
    lines.extend(process.call.as_ref().map(describe_call));
    if let Some(status) = &process.status {
        lines.push(format!("{} calls of exec, process {}", status.exec_calls, process.entry.pid));
        if !status.last_error.is_empty() {
            lines.push(status.last_error.clone());
        }
    }
    if process.starts > 1 {
        lines.push(format!("started {} times while it was watched", process.starts));
    }
    lines.join("\n")
}

fn of_edge(edge: &ObservedLink) -> String {
    let mut lines = vec![in_words(edge)];
    if !edge.problem.is_empty() {
        lines.push(edge.problem.clone());
    }
    lines.push(format!("{} sent, {} received", edge.sent, edge.received));
    lines.push(format!(
        "{} dropped because a process was slow (keep {}), {} lost in transit",
        edge.dropped, edge.keep, edge.lost
    ));
    if edge.queued + edge.waiting > 0 {
        lines.push(format!(
            "{} waiting at the provider, {} at the consumer",
            edge.queued, edge.waiting
        ));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(change: impl FnOnce(&mut ObservedLink)) -> ObservedLink {
        let mut edge = ObservedLink {
            from: "laser.scan".into(),
            to: "slam.scan".into(),
            type_name: "LaserScan".into(),
            keep: "10".into(),
            transport: "unix".into(),
            connected: true,
            paused: false,
            sent: 100,
            skipped: 0,
            history_dropped: 0,
            dropped: 0,
            lost: 0,
            queued: 0,
            waiting: 0,
            received: 100,
            rate_hz: Some(19.6),
            problem: String::new(),
        };
        change(&mut edge);
        edge
    }

    #[test]
    fn a_link_says_what_it_carries_and_what_it_lost() {
        let check = |edge: ObservedLink, expected: &str| assert_eq!(in_words(&edge), expected);
        check(edge(|_| {}), "20 Hz");
        check(edge(|edge| edge.rate_hz = None), "up");
        check(edge(|edge| edge.rate_hz = Some(0.0)), "quiet");
        check(edge(|edge| edge.rate_hz = Some(0.5)), "0.5 Hz");
        check(edge(|edge| (edge.lost, edge.dropped) = (2, 7)), "20 Hz, 2 lost, 7 dropped");
        check(edge(|edge| edge.paused = true), "paused");
        check(edge(|edge| edge.connected = false), "down");
    }

    #[test]
    fn what_latest_leaves_out_is_no_loss() {
        let latest = edge(|edge| (edge.keep, edge.dropped) = ("latest".into(), 9));
        assert_eq!((has_lost(&latest), in_words(&latest).as_str()), (false, "20 Hz"));
        assert!(has_lost(&edge(|edge| edge.dropped = 1)));
        assert!(has_lost(&edge(|edge| (edge.keep, edge.lost) = ("latest".into(), 1))));
    }
}
