//! What others track, from all outputs with messages `Tracks`: symbols that age and go.

use std::collections::BTreeMap;

use armor_geo::MapPoint;
use armor_inspect::ValueLook;
use armor_sdk::messages::{TrackedObject, Tracks};
use armor_wire::WireType;
use armor_wire::codec;

use crate::map_view::live::robots::is_of_file;

/// A track is drawn whole as long as it is at most this old, in seconds.
const FRESH_S: f64 = 5.0;
/// It is no longer drawn when it is this old.
pub const GONE_S: f64 = 60.0;
/// Most tracks that are kept.
const MAX_TRACKS: usize = 2_000;

/// The tracks of a system.
#[derive(Default)]
pub struct TrackPicture {
    /// By the output, and the name that its sender gives it.
    tracks: BTreeMap<(String, String), ShownTrack>,
    /// The message of each output that was taken last.
    taken: BTreeMap<String, (u64, u64)>,
    /// Why those of an output are not drawn.
    pub why_not: BTreeMap<String, String>,
}

/// One track.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownTrack {
    /// Its symbol identification code.
    pub sidc: String,
    /// Where it was seen.
    pub at: MapPoint,
    /// Its velocity along the axes, in metres per second.
    pub velocity_mps: [f64; 2],
    /// When it was there, in seconds of the window.
    was_there_s: f64,
}

impl ShownTrack {
    /// How old it is, in seconds.
    pub fn age_s(&self, now_s: f64) -> f64 {
        (now_s - self.was_there_s).max(0.0)
    }

    /// Its speed, in metres per second.
    pub fn speed_mps(&self) -> f64 {
        self.velocity_mps[0].hypot(self.velocity_mps[1])
    }

    /// How visible it is, from 1 while it is fresh down to 0.
    pub fn visibility(&self, now_s: f64) -> f32 {
        let left = (GONE_S - self.age_s(now_s)) / (GONE_S - FRESH_S);
        left.clamp(0.0, 1.0) as f32
    }
}

impl TrackPicture {
    /// Takes the newest message of an output; `now_s` is the time of the window.
    pub fn take(&mut self, output: &str, look: &ValueLook, now_s: f64) {
        let (Some(schema), Some(data)) = (&look.schema, &look.data) else { return };
        let key = (data.header.instance, data.header.sequence);
        if self.taken.insert(output.to_owned(), key) == Some(key) {
            return;
        }
        if schema.hash() != Tracks::schema().hash() {
            return;
        }
        match codec::decode::<Tracks>(&data.payload) {
            Err(error) => {
                self.why_not.insert(output.to_owned(), error.to_string());
            }
            Ok(message) if !is_of_file(&message.frame) => {
                let why = format!("in `{}`, whose origin is not that of the file", message.frame);
                self.why_not.insert(output.to_owned(), why);
                self.tracks.retain(|(of, _), _| of != output);
            }
            Ok(message) => {
                self.why_not.remove(output);
                for track in &message.tracks {
                    self.add(output, track, message.stamp, now_s);
                }
            }
        }
    }

    fn add(&mut self, output: &str, track: &TrackedObject, sent_s: f64, now_s: f64) {
        let key = (output.to_owned(), track.id.clone());
        let is_full = self.tracks.len() >= MAX_TRACKS && !self.tracks.contains_key(&key);
        let Ok(at) = MapPoint::new(track.position.x, track.position.y) else { return };
        if is_full {
            return;
        }
        // By the sender's clock, whichever that is: how old it was when it was sent.
        let age_s = Some(sent_s - track.stamp).filter(|age_s| age_s.is_finite()).unwrap_or(0.0);
        let velocity_mps = [track.velocity.x, track.velocity.y];
        let is_finite = velocity_mps.iter().all(|mps| mps.is_finite());
        let shown = ShownTrack {
            sidc: track.sidc.clone(),
            at,
            velocity_mps: if is_finite { velocity_mps } else { [0.0; 2] },
            was_there_s: now_s - age_s.max(0.0),
        };
        self.tracks.insert(key, shown);
    }

    /// Forgets the tracks that are too old.
    pub fn forget_old(&mut self, now_s: f64) {
        self.tracks.retain(|_, track| track.age_s(now_s) < GONE_S);
    }

    /// The tracks, with the names that their senders give them.
    pub fn tracks(&self) -> impl Iterator<Item = (&str, &ShownTrack)> {
        self.tracks.iter().map(|((_, id), track)| (id.as_str(), track))
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::messages::{Point, Vector3};

    use super::*;

    fn track(id: &str, x: f64, stamp: f64) -> TrackedObject {
        TrackedObject {
            id: id.into(),
            sidc: "10031000121211000000".into(),
            position: Point { x, y: 0.0, z: 0.0 },
            velocity: Vector3 { x: 3.0, y: 4.0, z: 0.0 },
            stamp,
        }
    }

    #[test]
    fn a_track_fades_and_goes_and_news_of_it_bring_it_back() {
        let mut picture = TrackPicture::default();
        // Sent 2 s after it was seen.
        picture.add("radar.tracks", &track("a", 1.0, 98.0), 100.0, 10.0);
        let (id, shown) = picture.tracks().next().expect("it is there");
        assert_eq!((id, shown.age_s(10.0), shown.speed_mps()), ("a", 2.0, 5.0));
        assert_eq!(shown.visibility(12.0), 1.0);
        assert!((0.2..0.8).contains(&shown.visibility(40.0)));
        picture.add("radar.tracks", &track("a", 2.0, 140.0), 140.0, 50.0);
        picture.add("radar.tracks", &track("b", 9.0, 90.0), 140.0, 50.0);
        picture.add("camera.tracks", &track("a", 5.0, 140.0), 140.0, 50.0);
        assert_eq!(picture.tracks().count(), 3, "each sender has names of its own");
        picture.forget_old(65.0);
        assert_eq!(picture.tracks().count(), 2, "the one that was old when it was sent has gone");
        picture.forget_old(50.0 + GONE_S);
        assert_eq!(picture.tracks().count(), 0);
    }

    #[test]
    fn positions_that_are_none_and_too_many_tracks_are_left_out() {
        let mut picture = TrackPicture::default();
        picture.add("radar.tracks", &track("nan", f64::NAN, 0.0), 0.0, 0.0);
        assert_eq!(picture.tracks().count(), 0);
        for number in 0..MAX_TRACKS + 5 {
            picture.add("radar.tracks", &track(&number.to_string(), 1.0, 0.0), 0.0, 0.0);
        }
        assert_eq!(picture.tracks().count(), MAX_TRACKS);
    }
}
