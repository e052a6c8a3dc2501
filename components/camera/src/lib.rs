//! A camera: pictures from files, from a link or from a device, compressed as JPEG.
//!
//! Pure: `picture` is what a picture is, `scale` makes it smaller, `jpeg` writes and reads it,
//! `finish` is all that is done to one. `film` reads files one after the other, `device` a camera
//! at this machine (feature `v4l2`). `ports` alone knows the SDK.

#[cfg(feature = "v4l2")]
mod device;
mod film;
mod finish;
mod jpeg;
mod picture;
mod ports;
mod scale;

pub use finish::{Finish, read};
pub use picture::{Picture, PictureError, PixelLayout};
pub use ports::Camera;
pub use scale::SizeLimits;
