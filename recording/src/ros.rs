//! Messages as ROS 2 has them: their definition (`.msg` text) and their bytes (CDR), so that the
//! viewers that people have open a recording. Pure.
//!
//! Every message has such a form, and it loses nothing: [`RosMessage::decode`] gives back the bytes
//! that [`RosMessage::encode`] took. Standard messages become those of ROS with the same meaning
//! (`standard.rs` is the table), all others a type of the package `armor_msgs` with the same fields.
//! The rules are in docs/recordings.md.

mod bytes;
mod decode;
mod definition;
mod encode;
mod read_definition;
mod ros1;
mod shape;
mod standard;
#[cfg(test)]
mod tests;
mod time;

use armor_wire::schema::Schema;

pub use bytes::LayoutError;
pub use encode::RosBytes;
pub use read_definition::{DefinitionError, read_definition};
pub use ros1::Ros1Type;
use shape::{Shape, ShapeBuilder};

/// Returns the type of Armor that a standard message of ROS 2 means, by its name.
pub fn find_standard_type(ros_name: &str) -> Option<&'static Schema> {
    standard::find_by_ros_name(ros_name)
}

/// A type of messages in both forms.
#[derive(Debug)]
pub struct RosMessage {
    shape: Shape,
    name: String,
    definition: String,
}

impl RosMessage {
    /// Finds the form of the messages of `schema`.
    pub fn new(schema: &Schema) -> Self {
        let mut builder = ShapeBuilder::default();
        let shape = builder.build_message(schema);
        let (name, definition) = definition::write_definition(&shape);
        Self { shape, name, definition }
    }

    /// Its name in ROS, such as `sensor_msgs/msg/LaserScan`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its fields, and those of the types in it, as ROS 2 writes them in `.msg` files.
    pub fn definition(&self) -> &str {
        &self.definition
    }

    /// Converts an encoded message of Armor.
    ///
    /// # Errors
    /// If the bytes are not exactly one value of the schema.
    pub fn encode(&self, payload: &[u8]) -> Result<RosBytes, LayoutError> {
        let mut out = RosBytes::default();
        self.encode_into(payload, &mut out)?;
        Ok(out)
    }

    /// As [`Self::encode`], into the memory of an earlier message.
    ///
    /// # Errors
    /// As [`Self::encode`]; `out` is empty then.
    pub fn encode_into(&self, payload: &[u8], out: &mut RosBytes) -> Result<(), LayoutError> {
        encode::encode_message(&self.shape, payload, out)
    }

    /// Converts an encoded message of Armor to ROS 1.
    ///
    /// # Errors
    /// As [`Self::encode`].
    pub fn encode_ros1(&self, payload: &[u8]) -> Result<Vec<u8>, LayoutError> {
        encode::encode_ros1_message(&self.shape, payload)
    }

    /// Converts back. `stamps_s` as [`Self::encode`] has returned them; without them, each stamp is
    /// the time in nanoseconds that is nearest to the original.
    ///
    /// # Errors
    /// If the bytes are no value of the type.
    pub fn decode(&self, bytes: &[u8], stamps_s: &[f64]) -> Result<Vec<u8>, LayoutError> {
        decode::decode_message(&self.shape, bytes, stamps_s)
    }

    /// Converts a message of ROS 1.
    ///
    /// # Errors
    /// If the bytes are no value of the type.
    pub fn decode_ros1(&self, bytes: &[u8]) -> Result<Vec<u8>, LayoutError> {
        decode::decode_ros1_message(&self.shape, bytes)
    }
}
