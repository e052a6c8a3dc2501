//! The operator's screen. `console` is all that is known and ordered (`scene` what is seen, `links`
//! how each input is doing, `orders` what is said to the robot), without window or sockets; `screen`
//! shows it with egui, in a `window` or as a `picture`; `ports` is all there is of messages.

mod console;
mod links;
mod map;
mod orders;
mod photo;
mod picture;
mod ports;
mod readings;
mod scene;
mod screen;
mod track;
mod window;

pub use ports::{OperatorView, run};
