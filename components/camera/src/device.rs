//! A camera at this machine, by Video4Linux: a thread takes its pictures as they come and keeps the
//! newest. What is JPEG already passes; YUYV is converted on demand.

mod mjpeg;
mod yuyv;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use linuxvideo::format::{PixFormat, PixelFormat};
use linuxvideo::stream::ReadStream;
use linuxvideo::{BufType, Device as Video};
use parking_lot::Mutex;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::finish::Finish;
use crate::picture::PictureError;
use crate::scale::SizeLimits;

/// The default size, which every camera has.
const USUAL: (u32, u32) = (640, 480);
/// How long the thread waits for a picture before it looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(100);
/// A camera that gives nothing for this long has failed; the first picture of some takes two
/// seconds.
const SILENCE: Duration = Duration::from_secs(5);

/// Why a device gives no pictures.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DeviceError {
    /// It cannot be opened, or is no camera.
    #[error("cannot use {} as a camera: {source}", path.display())]
    Open {
        /// The device.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It has no format that is read here.
    #[error("{} gives {offered}, and neither MJPG, JPEG nor YUYV", path.display())]
    Format {
        /// The device.
        path: PathBuf,
        /// What it has.
        offered: String,
    },
    /// It was there and is not any more.
    #[error("{} is lost: {source}; was it unplugged?", path.display())]
    Lost {
        /// The device.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

/// How a device's pictures lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FrameForm {
    Jpeg,
    Yuyv { width: usize, height: usize, step: usize },
}

/// What the thread and the component share.
#[derive(Default)]
struct DeviceShared {
    newest: Mutex<Newest>,
    is_over: AtomicBool,
}

#[derive(Default)]
struct Newest {
    /// When it was there, and its bytes.
    frame: Option<(f64, Vec<u8>)>,
    lost: Option<io::Error>,
}

/// An open device. Its thread ends with it.
pub(crate) struct Device {
    path: PathBuf,
    form: FrameForm,
    shared: Arc<DeviceShared>,
    thread: Option<JoinHandle<()>>,
    has_warned: bool,
}

impl Device {
    /// Opens a device for pictures of about the largest size within `limits`; `clock` gives the
    /// stamps.
    pub(crate) fn open(
        path: &Path,
        limits: SizeLimits,
        clock: impl Fn() -> f64 + Send + 'static,
    ) -> Result<Self, DeviceError> {
        let unusable = |source| DeviceError::Open { path: path.to_owned(), source };
        let video = Video::open(path).map_err(unusable)?;
        let offered: Result<Vec<_>, _> = video.formats(BufType::VIDEO_CAPTURE).collect();
        let offered: Vec<_> =
            offered.map_err(unusable)?.iter().map(|format| format.pixel_format()).collect();
        let wanted = choose_format(&offered).ok_or_else(|| {
            let names: Vec<_> = offered.iter().map(|format| format_name(*format)).collect();
            DeviceError::Format { path: path.to_owned(), offered: names.join(", ") }
        })?;
        let (width, height) = choose_size(limits);
        // The driver takes the nearest size that it has.
        let given = PixFormat::new(width, height, wanted);
        let capture = video.video_capture(given).map_err(unusable)?;
        let given = capture.format();
        let form = frame_form(given).ok_or_else(|| DeviceError::Format {
            path: path.to_owned(),
            offered: format_name(given.pixel_format()),
        })?;
        tracing::info!(
            device = %path.display(), width = given.width(), height = given.height(),
            format = format_name(given.pixel_format()), "the camera is open"
        );
        let stream = capture.into_stream().map_err(unusable)?;
        let shared = Arc::new(DeviceShared::default());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("device".into())
            .spawn(move || theirs.follow_stream(stream, &clock))
            .map_err(unusable)?;
        Ok(Self { path: path.to_owned(), form, shared, thread: Some(thread), has_warned: false })
    }

    /// Fails if the device is lost.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        match self.shared.newest.lock().lost.take() {
            Some(source) => Err(DeviceError::Lost { path: self.path.clone(), source }),
            None => Ok(()),
        }
    }

    /// The newest picture that was not taken yet, with its stamp in seconds. A damaged one, as
    /// cameras give now and then, is left out.
    pub(crate) fn take(&mut self, finish: &Finish) -> Result<Option<(f64, Vec<u8>)>, DeviceError> {
        self.check()?;
        let Some((stamp_s, bytes)) = self.shared.newest.lock().frame.take() else {
            return Ok(None);
        };
        match finish_frame(self.form, bytes, finish) {
            Ok(jpeg) => Ok(Some((stamp_s, jpeg))),
            Err(reason) => {
                if !std::mem::replace(&mut self.has_warned, true) {
                    let path = self.path.display();
                    tracing::warn!("{path} gives damaged pictures, which are skipped: {reason}");
                }
                Ok(None)
            }
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It cannot have panicked with anything that matters now.
            let _ = thread.join();
        }
    }
}

impl DeviceShared {
    /// Takes pictures until they are not wanted any more, or there are none.
    fn follow_stream(&self, mut stream: ReadStream, clock: &dyn Fn() -> f64) {
        let mut heard = Instant::now();
        let mut spare = Vec::new();
        while !self.is_over.load(Ordering::Relaxed) {
            match read_frame(&mut stream, &mut spare) {
                Ok(true) => {
                    heard = Instant::now();
                    let old =
                        self.newest.lock().frame.replace((clock(), std::mem::take(&mut spare)));
                    spare = old.map(|(_, bytes)| bytes).unwrap_or_default();
                }
                Ok(false) if heard.elapsed() < SILENCE => {}
                Ok(false) => {
                    let silent = format!("no picture for {} s", SILENCE.as_secs());
                    self.newest.lock().lost = Some(io::Error::new(io::ErrorKind::TimedOut, silent));
                    return;
                }
                Err(error) => {
                    self.newest.lock().lost = Some(error);
                    return;
                }
            }
        }
    }
}

/// Copies the next picture to `into`; false if none came for a while or it was marked as damaged.
fn read_frame(stream: &mut ReadStream, into: &mut Vec<u8>) -> io::Result<bool> {
    let look = Timespec { tv_sec: 0, tv_nsec: i64::from(LOOK.subsec_nanos()) };
    if poll(&mut [PollFd::new(stream, PollFlags::IN)], Some(&look))? == 0 {
        return Ok(false);
    }
    stream.dequeue(|frame| {
        into.clear();
        into.extend_from_slice(&frame);
        Ok(!frame.is_error() && !frame.is_empty())
    })
}

/// The best format: what is compressed already takes no work and the least of the bus.
fn choose_format(offered: &[PixelFormat]) -> Option<PixelFormat> {
    let known = [PixelFormat::MJPG, PixelFormat::JPEG, PixelFormat::YUYV];
    known.into_iter().find(|format| offered.contains(format))
}

/// The size to ask for.
fn choose_size(limits: SizeLimits) -> (u32, u32) {
    match (u32::from(limits.width), u32::from(limits.height)) {
        (0, 0) => USUAL,
        (width, 0) => (width, width * USUAL.1 / USUAL.0),
        (0, height) => (height * USUAL.0 / USUAL.1, height),
        both => both,
    }
}

fn frame_form(format: &PixFormat) -> Option<FrameForm> {
    if format.pixel_format() == PixelFormat::YUYV {
        let (width, height) = (format.width() as usize, format.height() as usize);
        return Some(FrameForm::Yuyv { width, height, step: format.bytes_per_line() as usize });
    }
    let is_jpeg = [PixelFormat::MJPG, PixelFormat::JPEG].contains(&format.pixel_format());
    is_jpeg.then_some(FrameForm::Jpeg)
}

fn format_name(format: PixelFormat) -> String {
    String::from_utf8_lossy(&format.as_fourcc()).into_owned()
}

fn finish_frame(form: FrameForm, bytes: Vec<u8>, finish: &Finish) -> Result<Vec<u8>, PictureError> {
    match form {
        FrameForm::Jpeg => finish.file(mjpeg::add_missing_tables(bytes)?),
        FrameForm::Yuyv { width, height, step } => {
            finish.picture(yuyv::convert_picture(width, height, step, &bytes)?)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finish::tests::AS_IT_IS;

    #[test]
    fn what_is_compressed_goes_first() {
        use PixelFormat as P;
        assert_eq!(choose_format(&[P::YUYV, P::MJPG]).map(format_name).as_deref(), Some("MJPG"));
        assert_eq!(choose_format(&[P::BGR3, P::YUYV]).map(format_name).as_deref(), Some("YUYV"));
        assert!(choose_format(&[P::BGR3]).is_none());
    }

    #[test]
    fn the_size_keeps_within_the_limits() {
        assert_eq!(choose_size(SizeLimits::default()), (640, 480));
        assert_eq!(choose_size(SizeLimits { width: 1280, height: 0 }), (1280, 960));
        assert_eq!(choose_size(SizeLimits { width: 0, height: 240 }), (320, 240));
        assert_eq!(choose_size(SizeLimits { width: 300, height: 300 }), (300, 300));
    }

    #[test]
    fn what_is_no_camera_is_refused_by_name() {
        for path in ["/dev/null", "/dev/no-such-video"] {
            let refused = Device::open(Path::new(path), SizeLimits::default(), || 0.0).err();
            let error = refused.expect("no camera").to_string();
            assert!(error.contains(path) && error.contains("as a camera"), "{error}");
        }
    }

    #[test]
    fn pictures_of_both_forms_become_jpegs() {
        let form = FrameForm::Yuyv { width: 4, height: 2, step: 8 };
        let jpeg = finish_frame(form, vec![128; 16], &AS_IT_IS).expect("a picture");
        assert_eq!(crate::jpeg::size(&jpeg).expect("a JPEG"), (4, 2));
        assert_eq!(
            finish_frame(FrameForm::Jpeg, jpeg.clone(), &AS_IT_IS).expect("a picture"),
            jpeg
        );
        assert!(finish_frame(form, vec![128; 15], &AS_IT_IS).is_err());
        assert!(finish_frame(FrameForm::Jpeg, vec![0; 64], &AS_IT_IS).is_err());
    }
}
