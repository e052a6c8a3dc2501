//! The frames of ports: each is of a port that exists, and named by a parameter.

use super::{Faults, ManifestFault};
use crate::manifest::Manifest;
use crate::text_format::TextFormat;

impl Manifest {
    /// Of a port with a frame: the port, and a parameter that names the frame.
    pub(super) fn check_frames(&self, found: &mut Vec<ManifestFault>) {
        let is_port = |id: &str| self.inputs.iter().chain(&self.outputs).any(|it| it.id == id);
        for frame in &self.frames {
            let mut faults =
                Faults { subject: format!("the port {}", frame.port), found: &mut *found };
            if !is_port(&frame.port) {
                faults.add("frames", "it has a frame, and there is no such port", "name a port");
            }
            let named = self.parameters.iter().find(|it| it.name == frame.parameter);
            if named.is_none_or(|it| it.format != Some(TextFormat::Frame)) {
                let problem =
                    format!("`{}` does not name its frame: it is no such text", frame.parameter);
                faults.add("frames", problem, "name a parameter of the format frame");
            }
        }
    }
}
