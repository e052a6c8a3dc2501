//! Driving by keys: W A S D or arrows drive while they are held, Space stops, Esc closes what is open, or deletes the
//! goal.

use std::time::Duration;

use eframe::egui::{Event, InputState, Key, Ui};

use super::open_parts;
use crate::orders::OperatorOrder;

/// Longest time between frames while a key or the stick is held. Without frames nothing is sent,
/// and the robot stops.
pub(super) const PERIOD: Duration = Duration::from_millis(40);

/// Each key with its shares ahead and to the left.
const DRIVING: [(Key, f64, f64); 8] = [
    (Key::W, 1.0, 0.0),
    (Key::ArrowUp, 1.0, 0.0),
    (Key::S, -1.0, 0.0),
    (Key::ArrowDown, -1.0, 0.0),
    (Key::A, 0.0, 1.0),
    (Key::ArrowLeft, 0.0, 1.0),
    (Key::D, 0.0, -1.0),
    (Key::ArrowRight, 0.0, -1.0),
];

/// Returns the orders of single keys. Space is removed from the input before any button can receive
/// it, so that it never clicks Release, whatever has the focus.
pub(super) fn read_keys(ui: &Ui) -> Vec<OperatorOrder> {
    let mut orders = Vec::new();
    let mut escapes = false;
    let drives = ui.input_mut(|input| {
        if take_key(input, Key::Space) {
            orders.push(OperatorOrder::Stop);
        }
        escapes = take_key(input, Key::Escape);
        DRIVING.iter().any(|(key, ..)| input.key_down(*key))
    });
    // It closes what is open; only then it is meant for the goal.
    if escapes && !open_parts::close_last(ui.ctx()) {
        orders.push(OperatorOrder::Cancel);
    }
    if drives || !orders.is_empty() {
        // Arrows would move the focus through the buttons, and Enter then click one.
        ui.memory_mut(|memory| {
            if let Some(focused) = memory.focused() {
                memory.surrender_focus(focused);
            }
        });
    }
    orders
}

fn take_key(input: &mut InputState, wanted: Key) -> bool {
    let is_it =
        |event: &Event| matches!(event, Event::Key { key, pressed: true, .. } if *key == wanted);
    let is_pressed = input.events.iter().any(is_it);
    input.events.retain(|event| !is_it(event));
    is_pressed
}

/// Returns the direction of the held keys, as shares of the limits: ahead, to the left. None
/// without the keyboard's focus, because a key release would not be reported.
pub(super) fn read_held_direction(ui: &Ui) -> Option<(f64, f64)> {
    ui.input(|input| {
        if !input.focused || input.modifiers.command || input.modifiers.alt {
            return None;
        }
        let held: Vec<_> = DRIVING.iter().filter(|(key, ..)| input.key_down(*key)).collect();
        let sum = |of: fn(&(Key, f64, f64)) -> f64| {
            held.iter().map(|key| of(key)).sum::<f64>().clamp(-1.0, 1.0)
        };
        (!held.is_empty()).then(|| (sum(|key| key.1), sum(|key| key.2)))
    })
}
