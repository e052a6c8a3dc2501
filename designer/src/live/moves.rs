//! Tokens moved by hand while the mission is paused: the user sets the number of each place, and
//! orders all moves together.

use std::collections::BTreeMap;

use armor_marking::Marking;
use armor_sdk::control::{Order, TokenMove};
use eframe::egui::{self, CollapsingHeader, DragValue, Grid};

use super::orders::Giving;

/// The panel that moves tokens.
#[derive(Debug, Default)]
pub struct Panel {
    /// The number of tokens that the user wants in a place, where it was changed.
    wanted: BTreeMap<String, u32>,
}

/// A place: the tokens that it has and those that it is to have.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    place: String,
    now: u32,
    wanted: u32,
}

impl Panel {
    /// Shows it, while there is a pause; `places` are those of the mission.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        giving: &Giving<'_>,
        marking: &Marking,
        places: &[String],
    ) {
        if marking.pause.is_none() {
            self.wanted.clear();
            return;
        }
        let header = CollapsingHeader::new("Move tokens").id_salt("move tokens");
        header.show(ui, |ui| {
            let mut rows = self.rows(marking, places);
            Grid::new("tokens to move").num_columns(3).show(ui, |ui| {
                for row in &mut rows {
                    choose(ui, row);
                    ui.end_row();
                }
            });
            let changed = rows.iter().filter(|row| row.now != row.wanted);
            self.wanted = changed.map(|row| (row.place.clone(), row.wanted)).collect();
            ui.horizontal(|ui| {
                let doc = "The components they activate start when the mission resumes. Before \
                           that, the move is proven safe.";
                let why_not = unmovable(&rows);
                if giving.button_unless(ui, "Move", doc, why_not.as_deref()).clicked() {
                    giving.give(Order::Move { moves: moves(&rows) });
                }
                if !self.wanted.is_empty() && ui.button("Cancel").clicked() {
                    self.wanted.clear();
                }
            });
        });
    }

    /// The places of the mission, and those of the running one that the open file does not have.
    fn rows(&self, marking: &Marking, places: &[String]) -> Vec<Row> {
        let others = marking.places.iter().map(|marked| &marked.place);
        let others = others.filter(|name| !places.contains(name));
        let row = |name: &String| {
            let marked = marking.places.iter().find(|marked| marked.place == *name);
            let now = marked.map_or(0, |marked| marked.tokens);
            let wanted = self.wanted.get(name).copied().unwrap_or(now);
            Row { place: name.clone(), now, wanted }
        };
        places.iter().chain(others).map(row).collect()
    }
}

fn choose(ui: &mut egui::Ui, row: &mut Row) {
    let name = &row.place;
    if row.now == 0 && row.wanted == 0 {
        ui.weak(name)
    } else {
        ui.label(name)
    };
    ui.horizontal(|ui| {
        let less = ui.add_enabled(row.wanted > 0, egui::Button::new("-").small());
        if less.accessible_name(format!("a token less in {name}")).clicked() {
            row.wanted -= 1;
        }
        let tokens = ui.add(DragValue::new(&mut row.wanted).speed(0.05));
        tokens.accessible_name(format!("tokens in {name}"));
        let more = ui.small_button("+").accessible_name(format!("a token more in {name}"));
        if more.clicked() {
            row.wanted = row.wanted.saturating_add(1);
        }
    });
    if row.now != row.wanted {
        ui.weak(format!("now {}", row.now));
    }
}

/// Why these tokens cannot be moved; nothing if they can.
fn unmovable(rows: &[Row]) -> Option<String> {
    let sum = |of: fn(&Row) -> u32| rows.iter().map(of).map(u64::from).sum::<u64>();
    let (now, wanted) = (sum(|row| row.now), sum(|row| row.wanted));
    if now != wanted {
        let tokens = |count: u64| if count == 1 { "token" } else { "tokens" };
        return Some(format!(
            "There are {now} {}, but {wanted} are placed: tokens are moved, not created.",
            tokens(now)
        ));
    }
    rows.iter()
        .all(|row| row.now == row.wanted)
        .then(|| "First set how many tokens each place gets.".into())
}

/// Returns the moves that give every place the wanted number, if the total stays the same.
fn moves(rows: &[Row]) -> Vec<TokenMove> {
    let mut to: Vec<_> = rows
        .iter()
        .filter(|row| row.wanted > row.now)
        .map(|row| (&row.place, row.wanted - row.now))
        .collect();
    let mut moves = Vec::new();
    for row in rows.iter().filter(|row| row.now > row.wanted) {
        let mut left = row.now - row.wanted;
        while left > 0
            && let Some((place, missing)) = to.last_mut()
        {
            let tokens = left.min(*missing);
            moves.push(TokenMove { from: row.place.clone(), to: (*place).clone(), tokens });
            (left, *missing) = (left - tokens, *missing - tokens);
            if *missing == 0 {
                to.pop();
            }
        }
    }
    moves
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(rows: &[(&str, u32, u32)]) -> Vec<Row> {
        let row = |(place, now, wanted): &(&str, u32, u32)| Row {
            place: (*place).into(),
            now: *now,
            wanted: *wanted,
        };
        rows.iter().map(row).collect()
    }

    #[test]
    fn what_places_are_to_hold_becomes_moves() {
        let check = |given: &[(&str, u32, u32)], expected: &[(&str, &str, u32)]| {
            let moves = moves(&rows(given));
            let moves: Vec<_> =
                moves.iter().map(|it| (it.from.as_str(), it.to.as_str(), it.tokens)).collect();
            assert_eq!(moves, expected);
        };
        check(&[("a", 1, 0), ("b", 0, 1), ("c", 2, 2)], &[("a", "b", 1)]);
        check(&[("a", 3, 0), ("b", 0, 1), ("c", 0, 2)], &[("a", "c", 2), ("a", "b", 1)]);
        check(&[("a", 0, 3), ("b", 1, 0), ("c", 2, 0)], &[("b", "a", 1), ("c", "a", 2)]);
        check(&[("a", 1, 1)], &[]);
    }

    #[test]
    fn tokens_are_moved_and_not_made() {
        let check = |given: &[(&str, u32, u32)], can: bool| {
            assert_eq!(unmovable(&rows(given)).is_none(), can, "{given:?}");
        };
        check(&[("a", 1, 0), ("b", 0, 1)], true);
        check(&[("a", 1, 0), ("b", 0, 0)], false);
        check(&[("a", 1, 1), ("b", 0, 1)], false);
        check(&[("a", 1, 1), ("b", 0, 0)], false);
    }
}
