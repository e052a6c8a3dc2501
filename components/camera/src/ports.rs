//! The camera as a component: the source of its pictures, and when one is worth making.

use std::path::PathBuf;

use armor_sdk::prelude::*;

#[cfg(feature = "v4l2")]
use crate::device::Device;
use crate::film::Film;
use crate::finish::Finish;
use crate::picture::Picture;
use crate::scale::SizeLimits;

/// Period of pictures without a subscriber, in seconds: publishing is how subscribers are noticed.
const UNWATCHED_S: f64 = 1.0;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct CameraParameters {
    /// pictures from this folder, by name, or from this file: JPEG or PNG
    #[parameter(default = "")]
    files: Option<PathBuf>,
    /// begin again after the last file; else done
    #[parameter(default = true)]
    r#loop: bool,
    /// pictures from this device, as /dev/video0; needs a build with the feature v4l2
    #[parameter(default = "")]
    device: Option<PathBuf>,
    /// most columns; larger pictures are scaled down, 0: as they are
    #[parameter(default = 0, range = 0.0..=65535.0)]
    width: u16,
    /// most rows; larger pictures are scaled down, 0: as they are
    #[parameter(default = 0, range = 0.0..=65535.0)]
    height: u16,
    /// of JPEG, for what is not JPEG yet
    #[parameter(default = 80, range = 1.0..=100.0)]
    quality: u8,
    /// frame of the pictures; if not given, that of raw, or camera
    #[parameter(default = "")]
    frame: Option<String>,
}

impl CameraParameters {
    fn finish(&self) -> Finish {
        let limits = SizeLimits { width: self.width, height: self.height };
        Finish { limits, quality: self.quality }
    }
}

/// Publishes pictures as JPEG files.
pub struct Camera {
    armor: Armor,
    parameters: CameraParameters,
    source: Option<PictureSource>,
    /// Whether anything subscribes to the pictures.
    is_watched: bool,
    published_s: f64,
}

/// Where pictures come from.
enum PictureSource {
    Files(Film),
    /// The newest picture of the link.
    Link(Option<Image>),
    #[cfg(feature = "v4l2")]
    Device(Device),
}

impl Component for Camera {
    const KIND: &'static str = "camera";
    const SUMMARY: &'static str =
        "Gives pictures as JPEG: from files, from a link of raw ones, or from a device.";
    const NEEDS_ONE_OF: &'static [&'static [&'static str]] = &[&["raw", "files", "device"]];
    const PARAMETERS: &'static [Parameter] = CameraParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("image", "pictures as JPEG files; one a second without a subscriber"),
        ("raw", "pictures to compress: rgb8, bgr8 or mono8"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<CompressedImage>("image")?;
        armor.subscribe::<Optional<Image>>("raw")?;
        let parameters = CameraParameters::request(&armor)?;
        Ok(Self {
            armor,
            parameters,
            source: None,
            is_watched: false,
            published_s: f64::NEG_INFINITY,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        Ok(self.parameters.set(name, value)?)
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let is_due = self.is_due();
        if let Some(PictureSource::Link(newest)) = &mut self.source {
            *newest = if is_due { Some(data.decode()?) } else { None };
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Stopping {
            self.release_source();
            return Ok(Outcome::CarryOn);
        }
        if self.source.is_none() {
            self.source = Some(self.open_source()?);
        }
        if let Some(image) = self.make_picture()? {
            self.published_s = self.armor.timestamp();
            self.is_watched = self.armor.send_data("image", &image)?.to > 0;
        }
        match &self.source {
            Some(PictureSource::Files(film)) if film.is_over() => Ok(Outcome::Done),
            _ => Ok(Outcome::CarryOn),
        }
    }
}

impl Camera {
    /// Whether a picture is worth making: there is a subscriber, or it is time to look for one.
    fn is_due(&self) -> bool {
        let since_s = self.armor.timestamp() - self.published_s;
        self.is_watched || since_s.abs() >= UNWATCHED_S
    }

    fn open_source(&self) -> Result<PictureSource, Fault> {
        let link = self.armor.subscribed_data("raw");
        match (&self.parameters.files, &self.parameters.device, link) {
            (Some(files), None, None) => {
                Ok(PictureSource::Files(Film::open(files, self.parameters.r#loop)?))
            }
            (None, None, Some(_)) => Ok(PictureSource::Link(None)),
            #[cfg(feature = "v4l2")]
            (None, Some(device), None) => {
                let armor = self.armor.clone();
                let clock = move || armor.timestamp();
                Ok(PictureSource::Device(Device::open(
                    device,
                    self.parameters.finish().limits,
                    clock,
                )?))
            }
            #[cfg(not(feature = "v4l2"))]
            (None, Some(device), None) => Err(format!(
                "{}: this program was built without cameras; build it with --features v4l2",
                device.display()
            )
            .into()),
            _ => {
                Err("pictures come from one place: give it the parameter `files`, or `device`, or \
                      a link to `raw`"
                    .into())
            }
        }
    }

    /// Releases the device, and forgets a picture that would be old.
    fn release_source(&mut self) {
        match &mut self.source {
            Some(PictureSource::Files(film)) if !film.is_over() => {}
            _ => self.source = None,
        }
    }

    /// The next picture, if there is one and it is due.
    fn make_picture(&mut self) -> Result<Option<CompressedImage>, Fault> {
        let (now_s, is_due) = (self.armor.timestamp(), self.is_due());
        let finish = self.parameters.finish();
        let made = match &mut self.source {
            None => None,
            Some(PictureSource::Files(film)) if !is_due => {
                film.skip_file();
                None
            }
            Some(PictureSource::Files(film)) => film.take(&finish)?.map(|jpeg| (now_s, None, jpeg)),
            Some(PictureSource::Link(newest)) => match newest.take() {
                Some(raw) => {
                    let jpeg = compress_raw(&raw, finish)?;
                    Some((raw.stamp, Some(raw.frame), jpeg))
                }
                None => None,
            },
            #[cfg(feature = "v4l2")]
            Some(PictureSource::Device(device)) if !is_due => {
                device.check()?;
                None
            }
            #[cfg(feature = "v4l2")]
            Some(PictureSource::Device(device)) => {
                device.take(&finish)?.map(|(stamp_s, jpeg)| (stamp_s, None, jpeg))
            }
        };
        Ok(made.map(|(stamp, frame, jpeg)| CompressedImage {
            stamp,
            frame: self.parameters.frame.clone().or(frame).unwrap_or_else(|| "camera".into()),
            format: "jpeg".into(),
            data: jpeg.into(),
        }))
    }
}

/// The JPEG file of a picture of a link.
fn compress_raw(raw: &Image, finish: Finish) -> Result<Vec<u8>, Fault> {
    let (width, height) = (raw.width as usize, raw.height as usize);
    let picture = Picture::of_rows(&raw.encoding, width, height, raw.step as usize, &raw.data);
    Ok(finish.picture(picture.map_err(|error| format!("raw: {error}"))?)?)
}
