use armor_sdk::{Array, Message};
use armor_sdk::messages::Pose2D;

#[derive(Clone, Debug, Default, PartialEq, Message)]
pub enum State {
    #[default]
    Idle,
    Busy,
}

#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct Part {
    pub id: i32,
    #[message(unit = "kg")]
    pub mass: Option<f32>,
}

#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct Reading {
    #[message(unit = "s")]
    pub stamp: f64,
    pub name: String,
    pub level: u16,
    pub ok: bool,
    #[message(unit = "m")]
    pub ranges: Array<f32>,
    pub raw: Array<u8>,
    pub names: Vec<String>,
    #[message(unit = "m")]
    pub corner: [f64; 4],
    #[message(unit = "m")]
    pub depth: Option<f64>,
    pub state: State,
    pub at: Pose2D,
    pub parts: Vec<Part>,
}
