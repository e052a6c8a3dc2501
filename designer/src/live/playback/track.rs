//! The track of a time line: its marks, a scale, and the moment that is reached. A click or a drag on
//! it goes to another moment.

use eframe::egui::{
    self, Color32, CornerRadius, EventFilter, FontId, Painter, Pos2, Rect, Response, Sense, Shape,
    Stroke, WidgetInfo, pos2, vec2,
};

use super::marks::{MarkKind, TimeMark};
use armor_picture::theme::{self, ThemeColours};

/// Height of a row of marks.
const LANE: f32 = 13.0;
/// Height of the bar that is filled up to where the player is.
const BAR: f32 = 6.0;
/// Height of the scale.
const SCALE: f32 = 16.0;
/// Space at both ends, so that marks there are whole.
const MARGIN: f32 = 10.0;
/// A mark is met by a pointer as near as this.
const REACH: f32 = 6.0;
/// Least space between two numbers of the scale.
const SCALE_STEP: f32 = 90.0;
/// Marks that a tooltip lists.
const MAX_LISTED: usize = 6;

/// What a track shows. Times are in seconds from the beginning of what is played.
pub struct Track<'a> {
    /// How long it is.
    pub length_s: f64,
    /// The moment that is reached.
    pub at_s: f64,
    /// The system time of its beginning, from which the marks are counted.
    pub from_s: f64,
    /// The marks in the order of time.
    pub marks: &'a [TimeMark],
    /// The kinds that are hidden.
    pub hidden: &'a [MarkKind],
}

/// Draws the sign of a kind of marks around a point.
pub fn draw_sign(painter: &Painter, at: Pos2, kind: MarkKind, colour: Color32) {
    let side = 4.5;
    match kind {
        MarkKind::Firing => {
            let corners = [vec2(0.0, -side), vec2(side, 0.0), vec2(0.0, side), vec2(-side, 0.0)];
            let corners = corners.map(|corner| at + corner).to_vec();
            painter.add(Shape::convex_polygon(corners, colour, Stroke::NONE));
        }
        MarkKind::Report => {
            painter.circle_filled(at, side - 1.0, colour);
        }
        MarkKind::Failure => {
            let stroke = Stroke::new(2.0, colour);
            let (one, other) = (vec2(side - 1.0, side - 1.0), vec2(side - 1.0, 1.0 - side));
            painter.line_segment([at - one, at + one], stroke);
            painter.line_segment([at - other, at + other], stroke);
        }
        MarkKind::Loss => {
            let corners = [vec2(0.0, -side), vec2(side, side - 1.0), vec2(-side, side - 1.0)];
            let corners = corners.map(|corner| at + corner).to_vec();
            painter.add(Shape::convex_polygon(corners, colour, Stroke::NONE));
        }
    }
}

/// The row of a kind: firings above, reports and failures below them, losses at the bottom.
fn lane(kind: MarkKind) -> f32 {
    match kind {
        MarkKind::Firing => 0.0,
        MarkKind::Report | MarkKind::Failure => 1.0,
        MarkKind::Loss => 2.0,
    }
}

impl Track<'_> {
    /// Shows it over the whole width. Returns it, and the moment that was chosen.
    pub fn show(&self, ui: &mut egui::Ui) -> (Response, Option<f64>) {
        let size = vec2(ui.available_width(), 3.0 * LANE + BAR + SCALE + 4.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let place = rect.shrink2(vec2(MARGIN, 2.0));
        let is_usable = ui.is_enabled() && self.length_s > 0.0;
        response.widget_info(|| WidgetInfo::slider(is_usable, self.at_s, "time line"));
        if response.clicked() || response.drag_started() {
            response.request_focus();
        }
        if response.has_focus() {
            let filter = EventFilter {
                horizontal_arrows: true,
                vertical_arrows: true,
                ..EventFilter::default()
            };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        }
        let mut chosen = None;
        if let Some(at) = response.interact_pointer_pos().filter(|_| is_usable) {
            let is_moved = response.drag_started() || response.drag_delta().x != 0.0;
            if response.clicked() {
                let met = self.find_met(place, at);
                chosen =
                    Some(met.first().map_or_else(
                        || self.time_at(place, at.x),
                        |mark| mark.seek_s - self.from_s,
                    ));
            } else if response.dragged() && is_moved {
                chosen = Some(self.time_at(place, at.x));
            }
        }
        self.paint(ui, rect, place, response.has_focus());
        if let Some(at) = response.hover_pos().filter(|_| is_usable) {
            let x = at.x.clamp(place.left(), place.right());
            let stroke = Stroke::new(1.0, ThemeColours::of(ui.visuals()).weak);
            ui.painter().vline(x, place.y_range(), stroke);
            let text = self.describe(place, at);
            response.clone().on_hover_text_at_pointer(text);
        }
        (response, chosen)
    }

    fn x_of(&self, place: Rect, time_s: f64) -> f32 {
        let share =
            if self.length_s > 0.0 { (time_s / self.length_s).clamp(0.0, 1.0) } else { 0.0 };
        place.left() + place.width() * share as f32
    }

    fn time_at(&self, place: Rect, x: f32) -> f64 {
        let share = f64::from((x - place.left()) / place.width()).clamp(0.0, 1.0);
        share * self.length_s
    }

    fn shown(&self) -> impl Iterator<Item = &TimeMark> {
        self.marks.iter().filter(|mark| {
            let at_s = mark.at_s - self.from_s;
            !self.hidden.contains(&mark.kind) && at_s >= 0.0 && at_s <= self.length_s
        })
    }

    /// The marks at a point, those of its row first, the nearest of them first.
    fn find_met(&self, place: Rect, at: Pos2) -> Vec<&TimeMark> {
        let distance = |mark: &TimeMark| (self.x_of(place, mark.at_s - self.from_s) - at.x).abs();
        let row = ((at.y - place.top()) / LANE).floor();
        let mut met: Vec<_> = self.shown().filter(|mark| distance(mark) <= REACH).collect();
        let is_other = |mark: &TimeMark| lane(mark.kind) != row;
        met.sort_by(|one, other| {
            is_other(one).cmp(&is_other(other)).then(distance(one).total_cmp(&distance(other)))
        });
        met
    }

    fn describe(&self, place: Rect, at: Pos2) -> String {
        let met = self.find_met(place, at);
        let mut lines = vec![format_clock(self.time_at(place, at.x))];
        for mark in met.iter().take(MAX_LISTED) {
            let time = format_clock(mark.at_s - self.from_s);
            let kind = match mark.kind {
                MarkKind::Firing => "fired: ",
                _ => "",
            };
            lines.push(format!("{time}  {kind}{}", mark.text));
        }
        if met.len() > MAX_LISTED {
            lines.push(format!("and {} more", met.len() - MAX_LISTED));
        }
        lines.join("\n")
    }

    fn paint(&self, ui: &egui::Ui, rect: Rect, place: Rect, has_focus: bool) {
        let colours = ThemeColours::of(ui.visuals());
        let painter = ui.painter().with_clip_rect(rect.expand(2.0));
        painter.rect_filled(rect, CornerRadius::same(theme::CORNER), colours.background);
        let frame = if has_focus {
            Stroke::new(2.0, colours.accent)
        } else {
            Stroke::new(1.0, colours.outline)
        };
        painter.rect_stroke(
            rect,
            CornerRadius::same(theme::CORNER),
            frame,
            egui::StrokeKind::Inside,
        );
        let bar_top = place.top() + 3.0 * LANE;
        let bar =
            Rect::from_min_max(pos2(place.left(), bar_top), pos2(place.right(), bar_top + BAR));
        painter.rect_filled(bar, 2.0, colours.button);
        let x = self.x_of(place, self.at_s);
        painter.rect_filled(bar.with_max_x(x), 2.0, colours.accent);
        self.paint_scale(&painter, place, bar.bottom(), colours);
        // Marks that would cover each other are painted once.
        let mut painted = [f32::NEG_INFINITY; MarkKind::ALL.len()];
        for mark in self.shown() {
            let x = self.x_of(place, mark.at_s - self.from_s);
            let last = &mut painted[mark.kind as usize];
            if x - *last < 1.0 {
                continue;
            }
            *last = x;
            let y = place.top() + (lane(mark.kind) + 0.5) * LANE;
            draw_sign(&painter, pos2(x, y), mark.kind, mark.kind.colour(colours));
        }
        painter.vline(x, place.top()..=bar.bottom(), Stroke::new(2.0, colours.text));
        painter.circle(
            pos2(x, bar.center().y),
            6.0,
            colours.accent,
            Stroke::new(1.5, colours.background),
        );
    }

    fn paint_scale(&self, painter: &Painter, place: Rect, top: f32, colours: &ThemeColours) {
        let font = FontId::proportional(theme::LEAST_TEXT);
        let step_s = find_step(self.length_s, f64::from(place.width() / SCALE_STEP));
        let mut number = 0.0;
        while step_s > 0.0 && number * step_s <= self.length_s {
            let time_s = number * step_s;
            let x = self.x_of(place, time_s);
            painter.vline(x, top..=top + 4.0, Stroke::new(1.0, colours.outline));
            let align = match () {
                () if number == 0.0 => egui::Align2::LEFT_TOP,
                () if x > place.right() - 20.0 => egui::Align2::RIGHT_TOP,
                () => egui::Align2::CENTER_TOP,
            };
            let text = format_scale(time_s, step_s);
            painter.text(pos2(x, top + 3.0), align, text, font.clone(), colours.weak);
            number += 1.0;
        }
    }
}

/// The step of a scale that has about so many steps.
fn find_step(length_s: f64, steps: f64) -> f64 {
    const STEPS_S: [f64; 20] = [
        0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0,
        600.0, 1800.0, 3600.0, 7200.0, 21_600.0,
    ];
    let least_s = length_s / steps.max(1.0);
    STEPS_S.into_iter().find(|step_s| *step_s >= least_s).unwrap_or(86_400.0)
}

fn format_scale(time_s: f64, step_s: f64) -> String {
    let text = format_clock(time_s);
    if step_s < 1.0 { text } else { text.trim_end_matches(".0").into() }
}

/// A moment as a clock shows it: `1:02.3`, `1:00:02.3`.
pub fn format_clock(time_s: f64) -> String {
    let tenths = (time_s.max(0.0) * 10.0).round();
    let (minutes, tenths) = ((tenths / 600.0).floor(), tenths % 600.0);
    let (hours, minutes) = ((minutes / 60.0).floor(), minutes % 60.0);
    let seconds = tenths / 10.0;
    if hours > 0.0 {
        format!("{hours}:{minutes:02}:{seconds:04.1}")
    } else {
        format!("{minutes}:{seconds:04.1}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_shows_hours_only_where_there_are_some() {
        for (time_s, text) in [
            (0.0, "0:00.0"),
            (9.96, "0:10.0"),
            (59.96, "1:00.0"),
            (3723.45, "1:02:03.5"),
            (-1.0, "0:00.0"),
        ] {
            assert_eq!(format_clock(time_s), text);
        }
    }

    #[test]
    fn the_scale_has_no_more_steps_than_there_is_room_for() {
        for (length_s, steps, step_s) in
            [(116.0, 10.0, 20.0), (0.5, 10.0, 0.05), (7200.0, 8.0, 1800.0), (1e7, 8.0, 86_400.0)]
        {
            assert_eq!(find_step(length_s, steps), step_s, "{length_s}");
        }
    }

    #[test]
    fn the_nearest_mark_of_the_row_is_met_first() {
        let mark = |at_s, kind| TimeMark { at_s, seek_s: at_s, kind, text: String::new() };
        let marks = [
            mark(100.0 + 50.0, MarkKind::Loss),
            mark(100.0 + 50.2, MarkKind::Firing),
            mark(100.0 + 50.1, MarkKind::Firing),
            mark(100.0 + 90.0, MarkKind::Firing),
        ];
        let hidden = [MarkKind::Loss];
        let place = Rect::from_min_size(Pos2::ZERO, vec2(1000.0, 60.0));
        let track =
            |hidden| Track { length_s: 100.0, at_s: 0.0, from_s: 100.0, marks: &marks, hidden };
        let met = |hidden, y| -> Vec<f64> {
            let track: Track<'_> = track(hidden);
            track.find_met(place, pos2(501.0, y)).iter().map(|mark| mark.at_s - 100.0).collect()
        };
        let rounded = |found: Vec<f64>| -> Vec<i32> {
            found.iter().map(|it| (it * 10.0).round() as i32).collect()
        };
        assert_eq!(rounded(met(&[], 2.0 * LANE + 1.0)), [500, 501, 502]);
        assert_eq!(rounded(met(&hidden, 1.0)), [501, 502]);
        assert_eq!(rounded(met(&[], 1.0)), [501, 502, 500]);
    }
}
