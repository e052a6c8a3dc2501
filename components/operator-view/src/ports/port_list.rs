//! All ports of the screen, put together from the map area and the panels.

use super::input::ScreenPort;
use super::panels::PANELS;
use super::scene_inputs;

const OUTPUTS: [(&str, &str); 3] = [
    ("goal", "goal that the operator chose; repeated until the robot reaches it"),
    ("velocity", "driving by hand: while a key or the stick is held, then once zero"),
    ("stop", "true: the robot must stand, whatever else is ordered; until false"),
];

/// Name and documentation of every port: inputs first, in the order in which they are declared.
pub(super) const PORTS: [(&str, &str); count_inputs() + OUTPUTS.len()] = collect_ports();

/// Returns all inputs: those of the map area, then those of the panels.
pub(super) fn all_inputs() -> impl Iterator<Item = &'static ScreenPort> {
    scene_inputs::INPUTS.iter().chain(PANELS.iter().flat_map(|kind| kind.inputs))
}

// The manifest wants a constant; iterators cannot run at compile time, loops over indices can.
const fn count_inputs() -> usize {
    let mut count = scene_inputs::INPUTS.len();
    let mut panel = 0;
    while panel < PANELS.len() {
        count += PANELS[panel].inputs.len();
        panel += 1;
    }
    count
}

const fn collect_ports() -> [(&'static str, &'static str); count_inputs() + OUTPUTS.len()] {
    let mut ports = [("", ""); count_inputs() + OUTPUTS.len()];
    let mut next = 0;
    while next < scene_inputs::INPUTS.len() {
        ports[next] = (scene_inputs::INPUTS[next].id, scene_inputs::INPUTS[next].doc);
        next += 1;
    }
    let mut panel = 0;
    while panel < PANELS.len() {
        let inputs = PANELS[panel].inputs;
        let mut input = 0;
        while input < inputs.len() {
            ports[next] = (inputs[input].id, inputs[input].doc);
            next += 1;
            input += 1;
        }
        panel += 1;
    }
    let mut output = 0;
    while output < OUTPUTS.len() {
        ports[next] = OUTPUTS[output];
        next += 1;
        output += 1;
    }
    ports
}
