//! A configuration divided into the things that a user would name: each with its attributes, as
//! values to compare and as text to show.

use std::collections::BTreeMap;

use armor_wire::keep::Keep;
use armor_wire::remote_process::CutOff;
use armor_wire::text_format::FixedFrame;

use super::Subject;
use crate::date::Date;
use crate::mission::{Arc, ArcKind, Autonomy, Class, Mission, Place, Transition, Variable};
use crate::model::{
    Component, Configuration, Host, Link, LinkMode, Parameter, PlacedFrame, Restart,
};
use crate::resources::ResourceLimits;
use crate::source::Spanned;

/// One thing of a configuration.
pub(super) struct ComparedItem {
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
    /// The value that is compared.
    pub(super) value: String,
    /// The text that is shown: as written in the file, if it was.
    pub(super) shown: String,
}

impl ComparedItem {
    pub(super) fn new(
        subject: Subject,
        name: impl Into<String>,
        aspects: Vec<Option<Aspect>>,
    ) -> Self {
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

/// Returns everything in the configuration, each kind in the order of the file.
pub(super) fn of(configuration: &Configuration) -> Vec<ComparedItem> {
    let system = &configuration.system;
    let clock = system.clock.as_ref().map(|clock| clock.source.data());
    let itself = vec![
        text_aspect("name", &system.name),
        text_aspect("group", &system.group),
        clock.and_then(|source| plain_aspect("clock", source)),
    ];
    let mut items = vec![ComparedItem::new(Subject::System, "", itself)];
    items.extend(system.hosts.iter().map(of_host));
    items.extend(system.frames.iter().map(of_frame));
    for component in &system.components {
        items.push(of_component(component));
        items.extend(component.parameters.iter().map(|given| of_parameter(component, given)));
    }
    items.extend(system.links.iter().map(of_link));
    items.extend(configuration.mission.iter().flat_map(of_mission));
    items
}

fn of_host(host: &Host) -> ComparedItem {
    let cut_off =
        CutOff::ALL.iter().find(|(_, it)| *it == host.cut_off && *it != CutOff::default());
    let aspects = vec![
        plain_aspect("at", host.addresses.value.join(" ")),
        cut_off.and_then(|(name, _)| plain_aspect("cut-off", *name)),
        host.patience.and_then(|it| plain_aspect("patience", format!("{}s", it.as_secs_f64()))),
    ];
    ComparedItem::new(Subject::Host, &*host.name.value, aspects)
}

fn of_frame(frame: &PlacedFrame) -> ComparedItem {
    let FixedFrame { translation_m, rotation_rad, .. } = &frame.fixed;
    let numbers = translation_m.iter().map(|number| (number, "m"));
    let numbers = numbers.chain(rotation_rad.iter().map(|number| (number, "rad")));
    let aspects = ["x", "y", "z", "roll", "pitch", "yaw"].into_iter().zip(numbers);
    let aspects = aspects.map(|(name, (number, unit))| {
        plain_aspect(name, if *number == 0.0 { String::new() } else { format!("{number}{unit}") })
    });
    let parent = plain_aspect("in", &*frame.parent.value);
    ComparedItem::new(
        Subject::Frame,
        &*frame.name.value,
        [parent].into_iter().chain(aspects).collect(),
    )
}

fn of_component(component: &Component) -> ComparedItem {
    let restart = match component.restart {
        Restart::OnFailure => "",
        Restart::Always => "always",
        Restart::Never => "never",
    };
    let (rate, watchdog) = (component.rate_hz.as_ref(), component.watchdog.as_ref());
    let ResourceLimits { nice, realtime, cpus, cpu, memory } = &component.resources;
    let aspects = vec![
        plain_aspect("kind", &*component.kind.value),
        text_aspect("host", &component.host),
        rate.map(|rate| new_aspect("rate", rate.value.to_string(), rate.at.text())),
        plain_aspect("restart", restart),
        watchdog.map(|watchdog| {
            new_aspect("watchdog", format!("{:?}", watchdog.value), watchdog.at.text())
        }),
        plain_aspect("controllable", if component.controllable { "" } else { "false" }),
        component
            .variables
            .as_ref()
            .map(|variables| new_aspect("env", variables.value.join(" "), variables.at.text())),
        nice.as_ref().map(|nice| new_aspect("nice", nice.value.to_string(), nice.at.text())),
        realtime
            .as_ref()
            .map(|priority| new_aspect("realtime", priority.value.to_string(), priority.at.text())),
        cpus.as_ref().map(|cpus| new_aspect("cpus", format!("{:?}", cpus.value), cpus.at.text())),
        cpu.as_ref().map(|cpu| new_aspect("cpu", cpu.value.permille.to_string(), cpu.at.text())),
        memory
            .as_ref()
            .map(|memory| new_aspect("memory", memory.value.to_string(), memory.at.text())),
    ];
    ComparedItem::new(Subject::Component, &*component.name.value, aspects)
}

fn of_parameter(component: &Component, given: &Parameter) -> ComparedItem {
    let name = format!("{}.{}", component.name.value, given.name.value);
    // An empty text is a value too.
    let value = new_aspect("", given.value.value.clone(), &quoted_if_needed(&given.value.value));
    let mut item = ComparedItem::new(Subject::Parameter, name, vec![Some(value)]);
    item.owner = Some(component.name.value.clone());
    item
}

fn quoted_if_needed(text: &str) -> String {
    let is_bare = !text.is_empty() && !text.contains(char::is_whitespace);
    if is_bare { text.to_owned() } else { format!("\"{text}\"") }
}

/// What a link keeps, if it is not the usual one.
fn keep_of(keep: Keep) -> String {
    match keep {
        // What pulls is another aspect.
        Keep::Latest | Keep::Pull => String::new(),
        Keep::All { .. } => "all".into(),
        keep @ Keep::Last { .. } => keep.to_string(),
    }
}

/// The patience of a link, if it is not the usual one.
fn patience_of(keep: Keep) -> String {
    match keep {
        Keep::All { patience_ms } if keep != Keep::ALL => {
            format!("{}s", f64::from(patience_ms) / 1e3)
        }
        _ => String::new(),
    }
}

fn of_link(link: &Link) -> ComparedItem {
    let changed_from =
        |value: String, default: &str| if value == default { String::new() } else { value };
    let aspects = vec![
        plain_aspect("mode", if link.mode == LinkMode::Pull { "pull" } else { "" }),
        plain_aspect("keep", keep_of(link.keep)),
        plain_aspect("patience", patience_of(link.keep)),
        plain_aspect("wake", changed_from(link.wake.to_string(), "sleep")),
        plain_aspect("transport", changed_from(link.transport.name().into(), "auto")),
        plain_aspect("history", changed_from(link.history.to_string(), "1")),
    ];
    let name = format!("{} -> {}", link.from.data(), link.to.data());
    ComparedItem::new(Subject::Link, name, aspects)
}

fn of_mission(mission: &Mission) -> Vec<ComparedItem> {
    let resume = mission.resume.as_ref();
    let period = mission.period.as_ref();
    let checks: Vec<_> = mission.checks.iter().map(|check| check.value.as_str()).collect();
    let itself = vec![
        text_aspect("name", &mission.name),
        text_aspect("system", &mission.system),
        text_aspect("goal", &mission.goal),
        text_aspect("safe", &mission.safe),
        resume.map(|resume| new_aspect("resume", format!("{:?}", resume.value), resume.at.text())),
        period.map(|period| new_aspect("period", format!("{:?}", period.value), period.at.text())),
        plain_aspect("checks", checks.join("; ")),
    ];
    let mut items = vec![ComparedItem::new(Subject::Mission, "", itself)];
    items.extend(super::drawn::of_drawing(mission));
    items.extend(mission.variables.iter().map(of_variable));
    items.extend(mission.places.iter().map(of_place));
    for exclusive in &mission.exclusives {
        let mut names: Vec<_> = exclusive.components.iter().map(|name| name.as_str()).collect();
        names.sort_unstable();
        items.push(ComparedItem::new(Subject::Exclusive, names.join(" "), Vec::new()));
    }
    items.extend(mission.transitions.iter().map(of_transition));
    items.extend(of_submissions(mission));
    items
}

/// A file may be included several times: the second time has `(2)` in its name.
fn of_submissions(mission: &Mission) -> Vec<ComparedItem> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let items = mission.submissions.iter().map(|submission| {
        let file = submission.file.value.as_str();
        let count = counts.entry(file).or_default();
        *count += 1;
        let name = if *count == 1 { file.to_owned() } else { format!("{file} ({count})") };
        let ports =
            vec![text_aspect("in", &submission.enter), text_aspect("out", &submission.leave)];
        ComparedItem::new(Subject::Submission, name, ports)
    });
    items.collect()
}

fn of_variable(variable: &Variable) -> ComparedItem {
    let number = |name, bound: &Option<Spanned<f64>>| {
        bound.as_ref().map(|bound| new_aspect(name, bound.value.to_string(), bound.at.text()))
    };
    let aspects = vec![
        text_aspect("source", &variable.source),
        number("min", &variable.minimum),
        number("max", &variable.maximum),
        variable
            .initial
            .as_ref()
            .map(|it| new_aspect("initial", it.value.to_string(), it.at.text())),
    ];
    ComparedItem::new(Subject::Variable, &*variable.name.value, aspects)
}

fn of_place(place: &Place) -> ComparedItem {
    let components: Vec<_> = place.components.iter().map(|name| name.as_str()).collect();
    let mut sorted = components.clone();
    sorted.sort_unstable();
    let initial = if place.initial == 0 { String::new() } else { place.initial.to_string() };
    let mut aspects = vec![
        plain_aspect("initial", initial),
        some_aspect(new_aspect("components", sorted.join(" "), &components.join(" "))),
        class_aspect(place.class),
        text_aspect("on-failure", &place.on_failure),
    ];
    for given in &place.parameters {
        let name = format!("{}.{}", given.component.value, given.parameter.name.value);
        let value = given.parameter.value.value.clone();
        let shown = quoted_if_needed(&value);
        aspects.push(Some(Aspect { name, value, shown }));
    }
    ComparedItem::new(Subject::Place, &*place.name.value, aspects)
}

fn of_transition(transition: &Transition) -> ComparedItem {
    let arcs = |kind: ArcKind| {
        let mut places: Vec<_> =
            transition.arcs.iter().filter(|arc| arc.kind == kind).map(format_arc).collect();
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
        plain_aspect("from", arcs(ArcKind::Take)),
        plain_aspect("to", arcs(ArcKind::Put)),
        plain_aspect("read", arcs(ArcKind::Read)),
        plain_aspect("inhibitor", arcs(ArcKind::Inhibitor)),
        plain_aspect("reset", arcs(ArcKind::Reset)),
        plain_aspect("sets", sets.join(", ")),
        plain_aspect("on", on.unwrap_or_default()),
        interval.map(|time| new_aspect("time", format!("{:?}", time.value), time.at.text())),
        text_aspect("when", &transition.when),
        plain_aspect("priority", priority),
        class_aspect(transition.class),
        plain_aspect("autonomy", format_autonomy(transition.autonomy)),
        lost.map(|lost| new_aspect("lost-link", format!("{:?}", lost.value), lost.at.text())),
        date_aspect("not-before", &transition.not_before),
        date_aspect("not-after", &transition.not_after),
        missed.map(|missed| new_aspect("missed", format!("{:?}", missed.value), missed.at.text())),
        text_aspect("on-stop-fail", &transition.on_stop_fail),
        text_aspect("on-start-fail", &transition.on_start_fail),
        text_aspect("overrun", &transition.overrun),
    ];
    ComparedItem::new(Subject::Transition, &*transition.name.value, aspects)
}

fn format_arc(arc: &Arc) -> String {
    match arc.weight {
        1 => arc.place.value.clone(),
        weight => format!("{}*{weight}", arc.place.value),
    }
}

fn format_autonomy(autonomy: Autonomy) -> String {
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

fn class_aspect(class: Class) -> Option<Aspect> {
    plain_aspect("class", if class == Class::Safety { "safety" } else { "" })
}

fn date_aspect(name: &str, date: &Option<Spanned<Date>>) -> Option<Aspect> {
    date.as_ref().map(|date| new_aspect(name, date.value.to_string(), date.at.text()))
}

pub(super) fn text_aspect(name: &str, text: &Option<Spanned<String>>) -> Option<Aspect> {
    text.as_ref().and_then(|text| plain_aspect(name, &*text.value))
}

/// An attribute whose text is its value; none if it is empty.
pub(super) fn plain_aspect(name: &str, value: impl Into<String>) -> Option<Aspect> {
    let value = value.into();
    (!value.is_empty()).then(|| new_aspect(name, value.clone(), &value))
}

fn some_aspect(aspect: Aspect) -> Option<Aspect> {
    (!aspect.value.is_empty()).then_some(aspect)
}

pub(super) fn new_aspect(name: &str, value: String, shown: &str) -> Aspect {
    Aspect { name: name.into(), value, shown: shown.into() }
}
