//! A configuration taken apart into what a person would name: each thing with its attributes, as
//! values to compare and as text to show.

use super::Subject;
use crate::date::Date;
use crate::mission::{Arc, ArcKind, Autonomy, Class, Mission, Place, Transition, Variable};
use crate::model::{Component, Configuration, Link, LinkMode, Parameter, Restart, Transport};
use crate::source::Spanned;

/// One thing of a configuration.
pub(super) struct Item {
    pub(super) subject: Subject,
    /// Unique within its subject.
    pub(super) name: String,
    /// The component that it comes and goes with.
    pub(super) owner: Option<String>,
    pub(super) aspects: Vec<Aspect>,
}

/// One attribute of a thing that is not at its default.
pub(super) struct Aspect {
    pub(super) name: String,
    /// What is compared.
    pub(super) value: String,
    /// What is shown: as written, where it was.
    pub(super) shown: String,
}

impl Item {
    fn new(subject: Subject, name: impl Into<String>, aspects: Vec<Option<Aspect>>) -> Self {
        let aspects = aspects.into_iter().flatten().collect();
        Self { subject, name: name.into(), owner: None, aspects }
    }

    /// `kind mapper, rate 10Hz`.
    pub(super) fn in_words(&self) -> String {
        let words = self.aspects.iter().map(|Aspect { name, shown, .. }| match name.as_str() {
            "" => shown.clone(),
            name => format!("{name} {shown}"),
        });
        words.collect::<Vec<_>>().join(", ")
    }
}

/// Everything in it, each sort in the order of the file.
pub(super) fn of(configuration: &Configuration) -> Vec<Item> {
    let system = &configuration.system;
    let clock = system.clock.as_ref().map(|clock| clock.source.data());
    let itself = vec![text("name", &system.name), clock.and_then(|source| plain("clock", source))];
    let mut items = vec![Item::new(Subject::System, "", itself)];
    for component in &system.components {
        items.push(of_component(component));
        items.extend(component.parameters.iter().map(|given| of_parameter(component, given)));
    }
    items.extend(system.links.iter().map(of_link));
    items.extend(configuration.mission.iter().flat_map(of_mission));
    items
}

fn of_component(component: &Component) -> Item {
    let restart = match component.restart {
        Restart::OnFailure => "",
        Restart::Always => "always",
        Restart::Never => "never",
    };
    let (rate, watchdog) = (component.rate_hz.as_ref(), component.watchdog.as_ref());
    let aspects = vec![
        plain("kind", &*component.kind.value),
        rate.map(|rate| aspect("rate", rate.value.to_string(), rate.at.text())),
        plain("restart", restart),
        watchdog.map(|watchdog| {
            aspect("watchdog", format!("{:?}", watchdog.value), watchdog.at.text())
        }),
        plain("controllable", if component.controllable { "" } else { "false" }),
    ];
    Item::new(Subject::Component, &*component.name.value, aspects)
}

fn of_parameter(component: &Component, given: &Parameter) -> Item {
    let name = format!("{}.{}", component.name.value, given.name.value);
    // An empty text is a value too.
    let value = aspect("", given.value.value.clone(), &quoted_if_needed(&given.value.value));
    let mut item = Item::new(Subject::Parameter, name, vec![Some(value)]);
    item.owner = Some(component.name.value.clone());
    item
}

fn quoted_if_needed(text: &str) -> String {
    let is_bare = !text.is_empty() && !text.contains(char::is_whitespace);
    if is_bare { text.to_owned() } else { format!("\"{text}\"") }
}

fn of_link(link: &Link) -> Item {
    let transport = match link.transport {
        Transport::Auto => "",
        Transport::Tcp => "tcp",
        Transport::Shm => "shm",
        Transport::Udp => "udp",
    };
    let changed_from =
        |value: String, default: &str| if value == default { String::new() } else { value };
    let aspects = vec![
        plain("mode", if link.mode == LinkMode::Pull { "pull" } else { "" }),
        plain("keep", changed_from(link.keep.to_string(), "latest")),
        plain("wake", changed_from(link.wake.to_string(), "sleep")),
        plain("transport", transport),
        plain("history", changed_from(link.history.to_string(), "0")),
    ];
    let name = format!("{} -> {}", link.from.data(), link.to.data());
    Item::new(Subject::Link, name, aspects)
}

fn of_mission(mission: &Mission) -> Vec<Item> {
    let resume = mission.resume.as_ref();
    let period = mission.period.as_ref();
    let checks: Vec<_> = mission.checks.iter().map(|check| check.value.as_str()).collect();
    let itself = vec![
        text("name", &mission.name),
        text("system", &mission.system),
        text("goal", &mission.goal),
        text("safe", &mission.safe),
        resume.map(|resume| aspect("resume", format!("{:?}", resume.value), resume.at.text())),
        period.map(|period| aspect("period", format!("{:?}", period.value), period.at.text())),
        plain("checks", checks.join("; ")),
    ];
    let mut items = vec![Item::new(Subject::Mission, "", itself)];
    items.extend(mission.variables.iter().map(of_variable));
    items.extend(mission.places.iter().map(of_place));
    for exclusive in &mission.exclusives {
        let mut names: Vec<_> = exclusive.components.iter().map(|name| name.as_str()).collect();
        names.sort_unstable();
        items.push(Item::new(Subject::Exclusive, names.join(" "), Vec::new()));
    }
    items.extend(mission.transitions.iter().map(of_transition));
    for submission in &mission.submissions {
        let ports = vec![text("in", &submission.enter), text("out", &submission.leave)];
        items.push(Item::new(Subject::Submission, &*submission.file.value, ports));
    }
    items
}

fn of_variable(variable: &Variable) -> Item {
    let number = |name, bound: &Option<Spanned<f64>>| {
        bound.as_ref().map(|bound| aspect(name, bound.value.to_string(), bound.at.text()))
    };
    let aspects = vec![
        text("source", &variable.source),
        number("min", &variable.minimum),
        number("max", &variable.maximum),
        variable.initial.as_ref().map(|it| aspect("initial", it.value.to_string(), it.at.text())),
    ];
    Item::new(Subject::Variable, &*variable.name.value, aspects)
}

fn of_place(place: &Place) -> Item {
    let components: Vec<_> = place.components.iter().map(|name| name.as_str()).collect();
    let mut sorted = components.clone();
    sorted.sort_unstable();
    let initial = if place.initial == 0 { String::new() } else { place.initial.to_string() };
    let mut aspects = vec![
        plain("initial", initial),
        some(aspect("components", sorted.join(" "), &components.join(" "))),
        class(place.class),
        text("on-failure", &place.on_failure),
    ];
    for given in &place.parameters {
        let name = format!("{}.{}", given.component.value, given.parameter.name.value);
        let value = given.parameter.value.value.clone();
        let shown = quoted_if_needed(&value);
        aspects.push(Some(Aspect { name, value, shown }));
    }
    Item::new(Subject::Place, &*place.name.value, aspects)
}

fn of_transition(transition: &Transition) -> Item {
    let arcs = |kind: ArcKind| {
        let mut places: Vec<_> =
            transition.arcs.iter().filter(|arc| arc.kind == kind).map(weighted).collect();
        places.sort_unstable();
        places.join(" ")
    };
    let sets = transition.sets.iter();
    let sets = sets.map(|set| format!("{} = {}", set.variable.value, set.value.value));
    let sets: Vec<_> = sets.collect();
    let on = transition.on.as_ref();
    let on = on.map(|on| format!("{}.{}", on.component.value, on.event.value));
    let interval = transition.interval.as_ref();
    let priority =
        if transition.priority == 0 { String::new() } else { transition.priority.to_string() };
    let lost = transition.lost_link.as_ref();
    let missed = transition.missed.as_ref();
    let aspects = vec![
        plain("from", arcs(ArcKind::Take)),
        plain("to", arcs(ArcKind::Put)),
        plain("read", arcs(ArcKind::Read)),
        plain("inhibitor", arcs(ArcKind::Inhibitor)),
        plain("reset", arcs(ArcKind::Reset)),
        plain("sets", sets.join(", ")),
        plain("on", on.unwrap_or_default()),
        interval.map(|time| aspect("time", format!("{:?}", time.value), time.at.text())),
        text("when", &transition.when),
        plain("priority", priority),
        class(transition.class),
        plain("autonomy", autonomy(transition.autonomy)),
        lost.map(|lost| aspect("lost-link", format!("{:?}", lost.value), lost.at.text())),
        date("not-before", &transition.not_before),
        date("not-after", &transition.not_after),
        missed.map(|missed| aspect("missed", format!("{:?}", missed.value), missed.at.text())),
        text("on-stop-fail", &transition.on_stop_fail),
        text("on-start-fail", &transition.on_start_fail),
        text("overrun", &transition.overrun),
    ];
    Item::new(Subject::Transition, &*transition.name.value, aspects)
}

fn weighted(arc: &Arc) -> String {
    match arc.weight {
        1 => arc.place.value.clone(),
        weight => format!("{}*{weight}", arc.place.value),
    }
}

fn autonomy(autonomy: Autonomy) -> String {
    match autonomy {
        Autonomy::Auto => String::new(),
        Autonomy::Operator => "operator".into(),
        Autonomy::Confirm { within, fire_unanswered } => {
            let within = within.map_or(String::new(), |within| format!(" within {within:?}"));
            let default = if fire_unanswered { "fires" } else { "waits" };
            format!("confirm{within}, else it {default}")
        }
    }
}

fn class(class: Class) -> Option<Aspect> {
    plain("class", if class == Class::Safety { "safety" } else { "" })
}

fn date(name: &str, date: &Option<Spanned<Date>>) -> Option<Aspect> {
    date.as_ref().map(|date| aspect(name, date.value.to_string(), date.at.text()))
}

fn text(name: &str, text: &Option<Spanned<String>>) -> Option<Aspect> {
    text.as_ref().and_then(|text| plain(name, &*text.value))
}

/// An attribute whose text is its value; none if it is empty.
fn plain(name: &str, value: impl Into<String>) -> Option<Aspect> {
    let value = value.into();
    (!value.is_empty()).then(|| aspect(name, value.clone(), &value))
}

fn some(aspect: Aspect) -> Option<Aspect> {
    (!aspect.value.is_empty()).then_some(aspect)
}

fn aspect(name: &str, value: String, shown: &str) -> Aspect {
    Aspect { name: name.into(), value, shown: shown.into() }
}
