//! The tags of a GeoTIFF that place it: tie points, scale and matrix, and the keys of its
//! reference (OGC 19-008r4).

use crate::error::OpenFault;
use crate::pixel_placement::PixelPlacement;
use crate::reference::{MapReference, PlanePoint};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEODETIC: u16 = 2048;
const PROJECTED: u16 = 3072;
/// The value of a key whose reference is written out in further keys.
const USER_DEFINED: u16 = 32_767;

/// The tags as they are in the file; empty if they are missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GeoTags {
    pub(crate) pixel_scale: Vec<f64>,
    pub(crate) tie_points: Vec<f64>,
    pub(crate) transformation: Vec<f64>,
    pub(crate) keys: Vec<u16>,
}

impl GeoTags {
    /// A key whose value is in the directory itself.
    fn key(&self, wanted: u16) -> Option<u16> {
        let mut entries = self.keys.get(4..)?.chunks_exact(4);
        let entry = entries.find(|entry| entry[0] == wanted && entry[1] == 0)?;
        Some(entry[3])
    }

    /// The reference of the coordinates.
    pub(crate) fn reference(&self) -> Result<MapReference, OpenFault> {
        let refused = |what: String| Err(OpenFault::Reference(what));
        let number = match self.key(MODEL_TYPE) {
            Some(1) => self.key(PROJECTED),
            Some(2) => self.key(GEODETIC),
            Some(3) => return refused("geocentric".to_owned()),
            // Some programs leave the type out.
            _ => self.key(PROJECTED).or(self.key(GEODETIC)),
        };
        match number {
            None => refused("not stated (the keys of a GeoTIFF are missing)".to_owned()),
            Some(USER_DEFINED) => refused("defined in the file itself".to_owned()),
            Some(number) => MapReference::from_epsg(number.into())
                .ok_or_else(|| OpenFault::Reference(format!("EPSG {number}"))),
        }
    }

    /// Where the pixels lie; none without tags for it.
    pub(crate) fn placement(&self) -> Result<Option<PixelPlacement>, OpenFault> {
        let at = PlanePoint::new;
        let (origin, column, row) = if let [a, b, _, d, e, f, _, h, ..] = self.transformation[..] {
            if self.transformation.len() < 16 {
                return Err(OpenFault::Damaged("its matrix has not 16 numbers".to_owned()));
            }
            (at(d, h), at(a, e), at(b, f))
        } else {
            let [scale_x, scale_y, ..] = self.pixel_scale[..] else { return Ok(None) };
            let [i, j, _, x, y, _, ..] = self.tie_points[..] else { return Ok(None) };
            // A positive scale in y points up, against the rows.
            (at(x - i * scale_x, y + j * scale_y), at(scale_x, 0.0), at(0.0, -scale_y))
        };
        // Coordinates may be those of the centres of the pixels.
        let half = if self.key(RASTER_TYPE) == Some(2) { 0.5 } else { 0.0 };
        let origin = at(origin.x - half * (column.x + row.x), origin.y - half * (column.y + row.y));
        PixelPlacement::new(origin, column, row).map(Some).ok_or(OpenFault::Placement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(entries: &[(u16, u16)]) -> Vec<u16> {
        let mut keys = vec![1, 1, 0, entries.len() as u16];
        entries.iter().for_each(|&(key, value)| keys.extend([key, 0, 1, value]));
        keys
    }

    #[test]
    fn a_tie_point_and_a_scale_place_the_corner() {
        let mut tags = GeoTags {
            pixel_scale: vec![0.5, 0.25, 0.0],
            tie_points: vec![10.0, 20.0, 0.0, 1_000.0, 2_000.0, 0.0],
            ..GeoTags::default()
        };
        let placement = tags.placement().unwrap().unwrap();
        assert_eq!(placement.plane_from_pixel(0.0, 0.0), PlanePoint::new(995.0, 2_005.0));
        assert_eq!(placement.plane_from_pixel(10.0, 20.0), PlanePoint::new(1_000.0, 2_000.0));
        tags.keys = keys(&[(RASTER_TYPE, 2)]);
        let placement = tags.placement().unwrap().unwrap();
        assert_eq!(placement.plane_from_pixel(10.5, 20.5), PlanePoint::new(1_000.0, 2_000.0));
    }

    #[test]
    fn a_matrix_turns_the_pixels() {
        let mut matrix = vec![0.0; 16];
        (matrix[0], matrix[1], matrix[3]) = (0.3, 0.4, 7.0);
        (matrix[4], matrix[5], matrix[7]) = (0.4, -0.3, 9.0);
        let tags = GeoTags { transformation: matrix, ..GeoTags::default() };
        let placement = tags.placement().unwrap().unwrap();
        assert_eq!(placement.plane_from_pixel(10.0, 0.0), PlanePoint::new(10.0, 13.0));
        assert_eq!(placement.plane_from_pixel(0.0, 10.0), PlanePoint::new(11.0, 6.0));
    }

    #[test]
    fn other_references_are_refused_by_their_number() {
        let reference = |entries: &[(u16, u16)]| {
            GeoTags { keys: keys(entries), ..GeoTags::default() }.reference()
        };
        assert_eq!(reference(&[(1024, 1), (3072, 32_733)]).unwrap().epsg(), Some(32_733));
        assert_eq!(reference(&[(1024, 2), (2048, 4326)]).unwrap().epsg(), Some(4326));
        assert_eq!(reference(&[(3072, 3857)]).unwrap().epsg(), Some(3857));
        let refused = |entries: &[(u16, u16)]| reference(entries).unwrap_err().to_string();
        assert!(refused(&[(1024, 1), (2048, 4326), (3072, 2154)]).contains("EPSG 2154;"));
        assert!(refused(&[(1024, 2), (2048, 4258)]).contains("EPSG 4258;"));
        assert!(refused(&[(1024, 1), (3072, 32_767)]).contains("defined in the file"));
        assert!(refused(&[]).contains("not stated"));
    }
}
