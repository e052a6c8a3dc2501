//! The nodes of the drawing.

use armor_proof::time_in_words as time;
use armor_robotfile::mission::{Autonomy, Class, Place, Submission, Transition};
use eframe::egui::{Pos2, Rect, Vec2, vec2};

use super::scene::Scene;
use crate::canvas::{
    Badge, DiagramNode, Direction, NodeLine, NodeLook, NodePort, NodeShape, Outline, PortSide,
};
use crate::item::Item;
use crate::mission::derived::{is_derived, source_of};
use crate::mission::marks::takes_words;
use crate::mission::play::Standing;
use crate::mission::words::{component_lines, conditions};

/// Least width and height of a place.
const PLACE: Vec2 = vec2(96.0, 44.0);
/// A bar.
pub(super) const BAR: Vec2 = vec2(12.0, 46.0);
/// Distance of a bar's handles from it, so that the bar itself can be clicked.
const HANDLE_DISTANCE: f32 = 13.0;
/// How wide a character is at most about, in the title's size.
pub(super) const TITLE_WIDTH: f32 = 7.8;
/// The same in the size of other lines.
pub(super) const LINE_WIDTH: f32 = 6.8;
/// The height of a line.
pub(super) const LINE: f32 = 16.0;
/// Characters of a line of components.
const COMPONENTS_WIDTH: usize = 26;
/// Conditions that are shown at a bar; more of them are in the panel.
const MAX_CONDITIONS: usize = 4;
/// Characters of a condition that are shown.
const MAX_CONDITION: usize = 34;

impl Scene<'_> {
    pub(super) fn nodes(&self) -> Vec<DiagramNode<Item>> {
        let places = self.mission.places.iter().map(|place| self.place(place));
        let transitions = self.mission.transitions.iter().map(|t| self.transition(t));
        let inner = self.mission.submissions.iter().enumerate();
        let inner = inner.map(|(number, submission)| self.submission(number, submission));
        places.chain(inner).chain(transitions).collect()
    }

    fn place(&self, place: &Place) -> DiagramNode<Item> {
        let name = &place.name.value;
        let item = Item::place(name);
        let is = |role: &Option<armor_robotfile::Spanned<String>>| {
            role.as_ref().is_some_and(|role| role.value == *name)
        };
        let (is_goal, is_safe) = (is(&self.mission.goal), is(&self.mission.safe));
        let is_safety = place.class == Class::Safety;
        let roles = [
            (place.initial > 0, "initial"),
            (is_goal, "goal"),
            (is_safe, "safe place"),
            (is_safety, "safety class"),
        ];
        let roles: Vec<_> = roles.iter().filter(|(is, _)| *is).map(|(_, word)| *word).collect();
        let subtitle = roles.join(", ");
        let mut lines = component_lines(place, COMPONENTS_WIDTH);
        if let Some(takes) = self.marks.takes().filter(|_| is_goal) {
            lines.push(takes_words(takes));
        }
        let rows = 1 + lines.len() + usize::from(!subtitle.is_empty());
        let longest = lines.iter().chain([&subtitle]).map(|line| line.chars().count()).max();
        let inner = (name.chars().count() as f32 * TITLE_WIDTH)
            .max(longest.unwrap_or(0) as f32 * LINE_WIDTH);
        let height = PLACE.y.max(rows as f32 * LINE + 18.0);
        let size = vec2(PLACE.x.max(inner + height * 0.75), height);
        let tokens = self.tokens(place);
        let never_reached = self.marks.badge_of_goal().filter(|_| is_goal);
        let doc = self.place_doc(place, &subtitle) + &self.marks.messages(&item);
        DiagramNode {
            title: name.clone(),
            subtitle,
            lines: lines.into_iter().map(|text| NodeLine { text, is_weak: true }).collect(),
            rect: Rect::from_min_size(Pos2::ZERO, size),
            shape: NodeShape::Place { tokens, is_goal, is_safety: is_safety || is_safe },
            ports: vec![whole(size), handle(size, &item)],
            badge: never_reached.or_else(|| self.marks.badge(&item)),
            mark: self.marks.mark(&item),
            look: self.place_look(place, tokens),
            label: item.to_string(),
            doc,
            item,
        }
    }

    /// The tokens now, or at the start.
    fn tokens(&self, place: &Place) -> u32 {
        let Some(play) = self.play else { return place.initial };
        let places = &play.stage().mission.places;
        let number = places.iter().position(|known| known.name.value == place.name.value);
        let Some(number) = number else { return 0 };
        let on_the_way = self.in_flight.iter().filter(|(place, _)| place.index() == number);
        let on_the_way: u32 = on_the_way.map(|(_, tokens)| *tokens).sum();
        play.marking()[number].saturating_sub(on_the_way)
    }

    fn place_look(&self, place: &Place, tokens: u32) -> NodeLook {
        let is_marked = tokens > 0 && self.play.is_some();
        let breaches = self
            .play
            .filter(|_| is_marked)
            .map_or(Vec::new(), |play| play.stage().breaches(play.marking()));
        let is_breached =
            breaches.iter().any(|(one, other)| place.activates(one) || place.activates(other));
        let tint = match (is_breached, is_marked) {
            (true, _) => Some(self.colours.error),
            (false, true) => Some(self.colours.good),
            _ => None,
        };
        let outline = if is_marked { Outline::Strong } else { Outline::Plain };
        let is_derived = is_derived(self.mission, &place.name.value);
        NodeLook { tint, outline, is_dim: false, is_derived }
    }

    fn place_doc(&self, place: &Place, roles: &str) -> String {
        let mut doc = format!("place {}", place.name.value);
        if !roles.is_empty() {
            doc += &format!(": {roles}");
        }
        if !place.components.is_empty() {
            let names: Vec<_> = place.components.iter().map(|name| name.value.as_str()).collect();
            doc += &format!("\nactivates {}", names.join(", "));
        }
        for given in &place.parameters {
            let (component, parameter) = (&given.component.value, &given.parameter);
            doc += &format!(
                "\n{component}.{} is {} while it is marked",
                parameter.name.value, parameter.value.value
            );
        }
        doc + &self.source_doc(&place.name.value)
    }

    /// The line of the tooltip about the route that a place or transition is derived from.
    fn source_doc(&self, name: &str) -> String {
        let source = source_of(self.mission, name);
        source.map_or_else(String::new, |source| {
            format!("\nderived from {source}: edit it in the view Map, or that line in the file")
        })
    }

    fn transition(&self, transition: &Transition) -> DiagramNode<Item> {
        let name = &transition.name.value;
        let item = Item::transition(name);
        let all = conditions(transition);
        let shown = all.iter().take(MAX_CONDITIONS).map(|text| NodeLine {
            text: crate::text::short(text, MAX_CONDITION).into_owned(),
            is_weak: true,
        });
        let mut lines: Vec<_> = self.standing_line(name).into_iter().chain(shown).collect();
        if all.len() > MAX_CONDITIONS {
            lines.push(NodeLine {
                text: format!("and {} more", all.len() - MAX_CONDITIONS),
                is_weak: true,
            });
        }
        let badge = self.marks.badge(&item);
        let into = NodePort {
            at: vec2(-HANDLE_DISTANCE, BAR.y / 2.0),
            side: PortSide::Left,
            direction: Direction::In,
            is_wired: false,
            label: format!("into {item}"),
            doc: "Drag to a place: this transition takes from it.".into(),
            ..whole(BAR)
        };
        let ports = vec![whole(BAR), handle(BAR + vec2(HANDLE_DISTANCE, 0.0), &item), into];
        let doc = format!("{item}\n{}", all.join("\n"))
            + &self.source_doc(name)
            + &self.marks.messages(&item);
        DiagramNode {
            title: name.clone(),
            subtitle: String::new(),
            lines,
            rect: Rect::from_min_size(Pos2::ZERO, BAR),
            shape: NodeShape::Bar,
            ports,
            badge,
            mark: self.marks.mark(&item),
            look: self.transition_look(transition),
            label: item.to_string(),
            doc,
            item,
        }
    }

    fn transition_look(&self, transition: &Transition) -> NodeLook {
        let standing = self.standing(&transition.name.value);
        let tint = match standing {
            Some(Standing::Ready) => Some(self.colours.good),
            Some(Standing::Waits(_)) => Some(self.colours.accent),
            Some(Standing::Expects) => Some(self.colours.warning),
            _ => None,
        };
        let is_dim = matches!(standing, Some(Standing::Disabled))
            || (standing.is_none() && transition.autonomy != Autonomy::Auto);
        let is_derived = is_derived(self.mission, &transition.name.value);
        NodeLook { tint, outline: Outline::Plain, is_dim, is_derived }
    }

    fn standing(&self, name: &str) -> Option<Standing> {
        let play = self.play?;
        Some(play.standing(play.stage().transition(name)?))
    }

    /// How it stands while it is played, in words.
    fn standing_line(&self, name: &str) -> Option<NodeLine> {
        let play = self.play?;
        let text = match self.standing(name)? {
            Standing::Ready => "fires now".to_owned(),
            Standing::Waits(at) => format!("fires in {}", time(at.saturating_sub(play.time()))),
            Standing::Expects => "click: triggers what it waits for".into(),
            Standing::Disabled => return None,
        };
        Some(NodeLine { text, is_weak: false })
    }

    fn submission(&self, number: usize, submission: &Submission) -> DiagramNode<Item> {
        let item = Item::Submission(number);
        let file = &submission.file.value;
        let stem = std::path::Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
        let size = vec2((file.chars().count() as f32 * LINE_WIDTH + 40.0).max(140.0), 58.0);
        let inner: u32 = self.play.map_or(0, |play| {
            let places = play.stage().mission.places.iter().zip(play.marking());
            let own = places.filter(|(place, _)| {
                place.name.value.split_once('.').is_some_and(|(mission, _)| mission == stem)
            });
            own.map(|(_, tokens)| *tokens).sum()
        });
        let badge = (inner > 0).then(|| Badge {
            text: inner.to_string(),
            doc: "Tokens in places of the sub-mission.".into(),
            tint: Some(self.colours.good),
        });
        let tint = (inner > 0).then_some(self.colours.good);
        DiagramNode {
            title: stem.into_owned(),
            subtitle: file.clone(),
            lines: Vec::new(),
            rect: Rect::from_min_size(Pos2::ZERO, size),
            shape: NodeShape::Block,
            ports: vec![whole(size), handle(size, &item)],
            badge,
            mark: self.marks.mark(&item),
            look: NodeLook { tint, ..NodeLook::default() },
            label: format!("{item}: {file}"),
            doc: format!("sub-mission {file}") + &self.marks.messages(&item),
            item,
        }
    }
}

pub(super) fn whole(size: Vec2) -> NodePort {
    NodePort {
        name: String::new(),
        at: size / 2.0,
        side: PortSide::Around,
        direction: Direction::Both,
        colour: 0,
        is_wired: true,
        is_required: false,
        is_missing: false,
        label: String::new(),
        doc: String::new(),
    }
}

/// Where an arc is drawn from.
fn handle(size: Vec2, item: &Item) -> NodePort {
    NodePort {
        at: vec2(size.x, size.y / 2.0),
        side: PortSide::Right,
        direction: Direction::Out,
        is_wired: false,
        label: format!("arc from {item}"),
        doc: "Drag to where the arc leads.".into(),
        ..whole(size)
    }
}
