//! The time line beneath the live view of a recording: buttons, the track, the legend of its marks.

use armor_picture::icons::Icon;
use armor_picture::theme::{self, ThemeColours};
use armor_recording::playback::{PlayerLook, PlayerRemote};
use eframe::egui::{self, Atom, Button, ComboBox, RichText, vec2};

use super::marks::{FoundMarks, MarkKind};
use super::track::{Track, draw_sign, format_clock};
use super::{Playback, PlaybackWish, keys};
use crate::live::session::{Session, Standing};
use crate::live::words::printable;

/// The speeds that are offered; 0 is as fast as possible.
const SPEEDS: [f64; 9] = [0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 50.0, 0.0];

/// What of it is remembered from frame to frame.
#[derive(Debug, Default)]
pub struct TimeLine {
    /// The kinds of marks that are hidden.
    pub hidden: Vec<MarkKind>,
    /// The moment that was chosen last, shown until the player is there.
    sought_s: Option<f64>,
    /// Whether it has got the focus: it gets it when a recording is opened, and when a mark is chosen,
    /// so that its keys act.
    pub has_been_focused: bool,
}

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeLineRequest {
    /// An order to the player.
    Wish(PlaybackWish),
    /// To play it once more, after the player has ended.
    PlayAgain,
}

impl TimeLine {
    /// Shows it, if a recording is played. Returns what was asked for.
    pub fn show(&mut self, ui: &mut egui::Ui, session: &Session) -> Vec<TimeLineRequest> {
        let player = session.player();
        let look = player.map(PlayerRemote::look).unwrap_or_default();
        let found = session.playback().map(Playback::found).unwrap_or_default();
        if session.playback().is_none() && player.is_none() {
            *self = Self { hidden: std::mem::take(&mut self.hidden), ..Self::default() };
            return Vec::new();
        }
        let mut asked = Vec::new();
        let has_ended = session.ended().is_some()
            || session.watched().is_some_and(|watched| watched.silence().is_some());
        let may = look.state().is_some() && !has_ended;
        if !look.is_busy {
            self.sought_s = None;
        }
        ui.horizontal_wrapped(|ui| {
            asked.extend(self.buttons(ui, &look, may));
            if has_ended {
                let is_own = session.playback().is_some_and(|it| it.is_own);
                let again = theme::main_button(ThemeColours::of(ui.visuals()), "Play again");
                if is_own && ui.add(again).clicked() {
                    asked.push(TimeLineRequest::PlayAgain);
                }
            }
            ui.separator();
            show_standing(ui, session, &look, &found, has_ended);
        });
        ui.horizontal_wrapped(|ui| {
            self.show_legend(ui, &found);
            show_notes(ui, session, &look, &found);
        });
        let span_s = look.state().map(|state| (state.from, state.to)).or(found.span_s);
        let (from_s, to_s) = span_s.unwrap_or_default();
        let track = Track {
            length_s: to_s - from_s,
            at_s: self.sought_s.or(look.at_s()).unwrap_or_default(),
            from_s,
            marks: &found.marks,
            hidden: &self.hidden,
        };
        let shown = ui.add_enabled_ui(may, |ui| track.show(ui)).inner;
        let (response, chosen) = shown;
        if may && !std::mem::replace(&mut self.has_been_focused, true) {
            response.request_focus();
        }
        asked.extend(chosen.map(|at_s| TimeLineRequest::Wish(PlaybackWish::GoTo(at_s))));
        if may {
            asked.extend(keys::read(ui.ctx(), response.id).into_iter().map(TimeLineRequest::Wish));
        }
        for request in &asked {
            if let TimeLineRequest::Wish(PlaybackWish::GoTo(at_s)) = request {
                self.sought_s = Some(*at_s);
            }
        }
        asked
    }

    fn buttons(&self, ui: &mut egui::Ui, look: &PlayerLook, may: bool) -> Vec<TimeLineRequest> {
        let mut asked = Vec::new();
        let state = look.state();
        let stands = state.is_none_or(|state| state.paused || state.over);
        let button = |ui: &mut egui::Ui, name: &str, icon: Option<Icon>, doc: &str| {
            let shown = match icon {
                Some(icon) => Button::new((icon.to_atom(), name)).gap(theme::NEAR),
                None => Button::new(name),
            };
            let shown = ui.add_enabled(may, shown).on_hover_text(doc);
            shown.accessible_name(format!("time line: {name}")).clicked()
        };
        if button(ui, "Begin", None, "Goes to the beginning (Home)") {
            asked.push(PlaybackWish::GoTo(0.0));
        }
        let (name, icon, doc) = if stands {
            ("Play", Icon::Run, "Lets time pass (F9, or space on the time line)")
        } else {
            ("Pause", Icon::Pause, "Lets time stand still (F9, or space on the time line)")
        };
        if button(ui, name, Some(icon), doc) {
            asked.push(PlaybackWish::PlayOrPause);
        }
        if button(ui, "Step", None, "Plays the next message, and pauses (F10)") {
            asked.push(PlaybackWish::Step);
        }
        if button(ui, "End", None, "Goes to the end (End)") {
            asked.push(PlaybackWish::End);
        }
        let at_s = self.sought_s.or(look.at_s()).unwrap_or_default();
        let length_s = state.map_or(0.0, |state| state.to - state.from);
        let text = format!("{} / {}", format_clock(at_s), format_clock(length_s));
        ui.label(RichText::new(text).monospace().strong());
        ui.add_enabled_ui(may, |ui| {
            let speed = state.map_or(1.0, |state| state.speed);
            let combo = ComboBox::from_id_salt("speed of the recording").width(64.0);
            let combo = combo.selected_text(format_speed(speed)).show_ui(ui, |ui| {
                for offered in SPEEDS {
                    if ui.selectable_label(offered == speed, format_speed(offered)).clicked() {
                        asked.push(PlaybackWish::Speed(offered));
                    }
                }
            });
            combo
                .response
                .on_hover_text("How many times as fast as recorded")
                .accessible_name("speed");
            let mut loops = state.is_some_and(|state| state.loops);
            let loop_box = ui.checkbox(&mut loops, "Loop");
            if loop_box.on_hover_text("Begins again at the end").changed() {
                asked.push(PlaybackWish::Loop(loops));
            }
        });
        asked.into_iter().map(TimeLineRequest::Wish).collect()
    }

    /// The kinds of marks with their numbers; a click hides or shows one.
    fn show_legend(&mut self, ui: &mut egui::Ui, found: &FoundMarks) {
        let colours = ThemeColours::of(ui.visuals());
        for kind in MarkKind::ALL {
            let count = found.marks.iter().filter(|mark| mark.kind == kind).count();
            let mut is_shown = !self.hidden.contains(&kind);
            let sign = Atom::paint(vec2(12.0, 12.0), move |ui, place| {
                draw_sign(ui.painter(), place.rect.center(), kind, kind.colour(colours));
            });
            let name = format!("{} {count}", kind.name());
            let toggle = ui.add(Button::selectable(is_shown, (sign, name.clone())));
            let doc = format!("{} A click hides or shows them.", kind.doc());
            let toggle = toggle.on_hover_text(doc);
            if toggle.accessible_name(format!("marks: {name}")).clicked() {
                is_shown = !is_shown;
                match is_shown {
                    true => self.hidden.retain(|hidden| *hidden != kind),
                    false => self.hidden.push(kind),
                }
            }
        }
    }
}

fn format_speed(factor: f64) -> String {
    if factor == 0.0 { "max".into() } else { format!("{factor} ×") }
}

/// What the player does, and what is wrong.
fn show_standing(
    ui: &mut egui::Ui,
    session: &Session,
    look: &PlayerLook,
    found: &FoundMarks,
    has_ended: bool,
) {
    let colours = ThemeColours::of(ui.visuals());
    if !found.trouble.is_empty() {
        ui.colored_label(colours.error, printable(ui, &found.trouble));
    } else if has_ended {
        let how = session.ended().map_or("it has ended or is unreachable", |(how, _)| how);
        let text = format!("The playback has ended: {how}");
        ui.colored_label(colours.warning, printable(ui, &text));
    } else {
        let (text, colour) = describe_player(session, look, colours);
        ui.colored_label(colour, printable(ui, &text));
    }
    if !look.refusal.is_empty() && !has_ended {
        ui.colored_label(colours.error, printable(ui, &look.refusal));
    }
}

/// How far its marks are read, and what is unusual about it.
fn show_notes(ui: &mut egui::Ui, session: &Session, look: &PlayerLook, found: &FoundMarks) {
    let colours = ThemeColours::of(ui.visuals());
    if !found.is_complete && session.playback().is_some() {
        ui.weak(format!("reading marks, {:.0} %", found.progress * 100.0));
    }
    if session.playback().is_none() && look.state().is_some() {
        ui.weak("no marks: the recording is on the player's host");
    }
    if !found.notes.is_empty() {
        let notes = found.notes.join("; ");
        let note = ui.colored_label(colours.warning, printable(ui, &format!("Note: {notes}")));
        note.on_hover_text(printable(ui, &notes));
    }
}

fn describe_player(
    session: &Session,
    look: &PlayerLook,
    colours: &ThemeColours,
) -> (String, egui::Color32) {
    let Some(state) = look.state() else {
        let text = match session.standing() {
            Standing::Stopping => "stopping",
            _ if !look.problem.is_empty() => return (look.problem.clone(), colours.warning),
            _ => "opening",
        };
        return (text.into(), colours.accent);
    };
    match () {
        () if !look.problem.is_empty() => {
            (format!("the player is out of reach: {}", look.problem), colours.warning)
        }
        () if state.is_at_end() => ("at the end".into(), colours.weak),
        () if state.paused => ("paused".into(), colours.weak),
        () if !state.waits_for.is_empty() => {
            (format!("time waits: {}", state.waits_for), colours.warning)
        }
        () => ("playing".into(), colours.good),
    }
}
