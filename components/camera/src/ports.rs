//! The camera as a component: where its pictures come from, and when one is worth its making.

use std::path::PathBuf;

use armor_sdk::prelude::*;

#[cfg(feature = "v4l2")]
use crate::device::Device;
use crate::film::Film;
use crate::finish::Finish;
use crate::picture::Picture;
use crate::scale::Limits;

/// While nobody is linked one picture a second is made, in seconds: what tells if somebody is.
const UNWATCHED_S: f64 = 1.0;

/// Gives pictures as JPEG files.
pub struct Camera {
    armor: Armor,
    files: Option<PathBuf>,
    device: Option<PathBuf>,
    is_endless: bool,
    finish: Finish,
    /// The frame to say instead of that of `raw`.
    frame: Option<String>,
    source: Option<Source>,
    /// Somebody looks at the pictures.
    is_watched: bool,
    published_s: f64,
}

/// Where pictures come from.
enum Source {
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
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("files")
            .default("")
            .doc("pictures from this folder, by name, or from this file: JPEG or PNG"),
        Parameter::flag("loop").default("true").doc("begin again after the last file; else done"),
        Parameter::path("device")
            .default("")
            .doc("pictures from this device, as /dev/video0; needs a build with the feature v4l2"),
        Parameter::integer("width")
            .default("0")
            .range(0.0, 65535.0)
            .doc("most columns; larger pictures are scaled down, 0: as they are"),
        Parameter::integer("height")
            .default("0")
            .range(0.0, 65535.0)
            .doc("most rows; larger pictures are scaled down, 0: as they are"),
        Parameter::integer("quality")
            .default("80")
            .range(1.0, 100.0)
            .doc("of JPEG, for what is not JPEG yet"),
        Parameter::text("frame")
            .default("")
            .doc("frame of the pictures; if not given, that of raw, or camera"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("image", "pictures as JPEG files; one a second if nobody is linked"),
        ("raw", "pictures to compress: rgb8, bgr8 or mono8"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<CompressedImage>("image")?;
        armor.subscribe::<Optional<Image>>("raw")?;
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            armor,
            files: None,
            device: None,
            is_endless: true,
            finish: Finish { limits: Limits::default(), quality: 80 },
            frame: None,
            source: None,
            is_watched: false,
            published_s: f64::NEG_INFINITY,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let path = || -> Result<_, Fault> {
            Ok(if value.text()?.is_empty() { None } else { Some(value.path()?) })
        };
        match name {
            "files" => self.files = path()?,
            "device" => self.device = path()?,
            "loop" => self.is_endless = value.flag()?,
            "width" => self.finish.limits.width = u16::try_from(value.integer()?)?,
            "height" => self.finish.limits.height = u16::try_from(value.integer()?)?,
            "quality" => self.finish.quality = u8::try_from(value.integer()?)?,
            "frame" => self.frame = Some(value.text()?.to_owned()).filter(|text| !text.is_empty()),
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let is_due = self.is_due();
        if let Some(Source::Link(newest)) = &mut self.source {
            *newest = if is_due { Some(data.decode()?) } else { None };
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        if call == Call::Stopping {
            self.rest();
            return Ok(Outcome::CarryOn);
        }
        if self.source.is_none() {
            self.source = Some(self.open()?);
        }
        if let Some(image) = self.next()? {
            self.published_s = self.armor.timestamp();
            self.is_watched = self.armor.send_data("image", &image)?.to > 0;
        }
        match &self.source {
            Some(Source::Files(film)) if film.is_over() => Ok(Outcome::Done),
            _ => Ok(Outcome::CarryOn),
        }
    }
}

impl Camera {
    /// Whether a picture is worth its making: somebody looks, or it is time to see if somebody does.
    fn is_due(&self) -> bool {
        let since_s = self.armor.timestamp() - self.published_s;
        self.is_watched || since_s.abs() >= UNWATCHED_S
    }

    fn open(&self) -> Result<Source, Fault> {
        let link = self.armor.subscribed_data("raw");
        match (&self.files, &self.device, link) {
            (Some(files), None, None) => Ok(Source::Files(Film::open(files, self.is_endless)?)),
            (None, None, Some(_)) => Ok(Source::Link(None)),
            #[cfg(feature = "v4l2")]
            (None, Some(device), None) => {
                let armor = self.armor.clone();
                let clock = move || armor.timestamp();
                Ok(Source::Device(Device::open(device, self.finish.limits, clock)?))
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

    /// Gives back what others may use, and forgets what would be old.
    fn rest(&mut self) {
        match &mut self.source {
            Some(Source::Files(film)) if !film.is_over() => {}
            _ => self.source = None,
        }
    }

    /// The next picture, if there is one and it is due.
    fn next(&mut self) -> Result<Option<CompressedImage>, Fault> {
        let (now_s, is_due) = (self.armor.timestamp(), self.is_due());
        let finish = self.finish;
        let made = match &mut self.source {
            None => None,
            Some(Source::Files(film)) if !is_due => {
                film.skip();
                None
            }
            Some(Source::Files(film)) => film.take(&finish)?.map(|jpeg| (now_s, None, jpeg)),
            Some(Source::Link(newest)) => match newest.take() {
                Some(raw) => {
                    let jpeg = compress(&raw, finish)?;
                    Some((raw.stamp, Some(raw.frame), jpeg))
                }
                None => None,
            },
            #[cfg(feature = "v4l2")]
            Some(Source::Device(device)) if !is_due => {
                device.check()?;
                None
            }
            #[cfg(feature = "v4l2")]
            Some(Source::Device(device)) => {
                device.take(&finish)?.map(|(stamp_s, jpeg)| (stamp_s, None, jpeg))
            }
        };
        Ok(made.map(|(stamp, frame, jpeg)| CompressedImage {
            stamp,
            frame: self.frame.clone().or(frame).unwrap_or_else(|| "camera".into()),
            format: "jpeg".into(),
            data: jpeg.into(),
        }))
    }
}

/// The JPEG file of a picture of a link.
fn compress(raw: &Image, finish: Finish) -> Result<Vec<u8>, Fault> {
    let (width, height) = (raw.width as usize, raw.height as usize);
    let picture = Picture::of_rows(&raw.encoding, width, height, raw.step as usize, &raw.data);
    Ok(finish.picture(picture.map_err(|error| format!("raw: {error}"))?)?)
}
