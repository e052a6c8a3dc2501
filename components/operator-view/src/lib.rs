//! The operator's screen. `console` is its whole state as plain data (`scene` the map, `links` the
//! statistics of inputs, `orders` the commands to the robot, `readings` the data of panels);
//! `screen` shows it with egui, in a `window` or as a `picture`; `ports` holds messages, parameters
//! and panels.

mod alerts;
mod connection;
mod console;
mod goal_check;
mod links;
mod map;
mod mission;
mod orders;
mod photo;
mod picture;
mod ports;
mod readings;
mod scene;
mod screen;
mod stop_delivery;
mod track;
mod window;

pub use ports::{OperatorView, run};
