//! The planes that coordinates of pictures are in, and their conversion to a map's own frame.

use armor_geo::{
    GeoError, GeoPosition, MapPlacement, MapPoint, MercatorPosition, ShapeError, UtmZone,
};

/// A degree of latitude near the equator, for the scale of a plane in degrees.
const METRES_PER_DEGREE: f64 = 111_320.0;
/// Below it a degree of longitude has practically no width.
const MIN_COS_LATITUDE: f64 = 0.01;

/// The plane in which a source states its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapReference {
    /// Metres in the frame of the map, x right and y up.
    Local,
    /// Degrees on WGS 84 (EPSG 4326): x is the longitude, y the latitude.
    Wgs84,
    /// Metres in a UTM zone on WGS 84 (EPSG 326xx and 327xx): x is the easting, y the northing.
    Utm(UtmZone),
    /// Metres of Web Mercator (EPSG 3857).
    WebMercator,
}

/// A point in the plane of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PlanePoint {
    /// To the right or east; a longitude in degrees.
    pub x: f64,
    /// Up or north; a latitude in degrees.
    pub y: f64,
}

/// A rectangle along the axes of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneBounds {
    /// The smallest x and y.
    pub min: PlanePoint,
    /// The largest x and y.
    pub max: PlanePoint,
}

/// What a view shows of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneView {
    /// The rectangle that contains all that is shown.
    pub bounds: PlaneBounds,
    /// Pixels of the screen for one unit of the plane.
    pub pixels_per_unit: f64,
}

/// Why a point of a plane has no place on a map.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlacingError {
    /// The picture is in the world, and the map is not.
    #[error(
        "the picture is placed in the world, and the map has no origin; give the map its \
             origin=\"LATITUDE LONGITUDE HEIGHT\""
    )]
    NoOrigin,
    /// The position does not exist, or is too far away.
    #[error(transparent)]
    Position(#[from] GeoError),
    /// The point is beyond all maps.
    #[error(transparent)]
    Point(#[from] ShapeError),
}

impl PlanePoint {
    /// The point with these coordinates.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }
}

impl PlaneBounds {
    /// The rectangle between two corners, in any order.
    pub fn new(x0: f64, y0: f64, x1: f64, y1: f64) -> Self {
        Self {
            min: PlanePoint::new(x0.min(x1), y0.min(y1)),
            max: PlanePoint::new(x0.max(x1), y0.max(y1)),
        }
    }

    /// The smallest rectangle that contains all `points`; nothing without points.
    pub fn containing(points: impl IntoIterator<Item = PlanePoint>) -> Option<Self> {
        points.into_iter().map(|at| Self { min: at, max: at }).reduce(|all, one| all.union(one))
    }

    /// The smallest rectangle that contains both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: PlanePoint::new(self.min.x.min(other.min.x), self.min.y.min(other.min.y)),
            max: PlanePoint::new(self.max.x.max(other.max.x), self.max.y.max(other.max.y)),
        }
    }

    /// What both have in common; nothing if they do not touch.
    pub fn intersection(self, other: Self) -> Option<Self> {
        let min = PlanePoint::new(self.min.x.max(other.min.x), self.min.y.max(other.min.y));
        let max = PlanePoint::new(self.max.x.min(other.max.x), self.max.y.min(other.max.y));
        (min.x <= max.x && min.y <= max.y).then_some(Self { min, max })
    }

    /// The corners: top left, top right, bottom right, bottom left, with y up.
    pub fn corners(self) -> [PlanePoint; 4] {
        let Self { min, max } = self;
        [PlanePoint::new(min.x, max.y), max, PlanePoint::new(max.x, min.y), min]
    }

    /// The extent along x.
    pub fn width(self) -> f64 {
        self.max.x - self.min.x
    }

    /// The extent along y.
    pub fn height(self) -> f64 {
        self.max.y - self.min.y
    }
}

impl MapReference {
    /// The reference of an EPSG number, if it is supported: 4326, 3857, 32601 to 32660 and 32701
    /// to 32760.
    pub fn from_epsg(number: u32) -> Option<Self> {
        match number {
            4326 => Some(Self::Wgs84),
            3857 => Some(Self::WebMercator),
            32601..=32660 | 32701..=32760 => {
                UtmZone::new((number % 100) as u8, number < 32700).ok().map(Self::Utm)
            }
            _ => None,
        }
    }

    /// The EPSG number; none for metres in the map's frame.
    pub fn epsg(self) -> Option<u32> {
        match self {
            Self::Local => None,
            Self::Wgs84 => Some(4326),
            Self::WebMercator => Some(3857),
            Self::Utm(zone) => {
                let base = if zone.is_north() { 32600 } else { 32700 };
                Some(base + u32::from(zone.number()))
            }
        }
    }

    /// The position at a point of the plane, at height 0; nothing for metres in the map's frame.
    ///
    /// # Errors
    /// A point that is not on the Earth, or not in the zone.
    pub fn geo_from_plane(self, point: PlanePoint) -> Result<Option<GeoPosition>, GeoError> {
        match self {
            Self::Local => Ok(None),
            Self::Wgs84 => GeoPosition::new(point.y, point.x, 0.0).map(Some),
            Self::Utm(zone) => zone.geo_from_utm(point.x, point.y, 0.0).map(Some),
            Self::WebMercator => {
                GeoPosition::try_from(MercatorPosition { x_m: point.x, y_m: point.y }).map(Some)
            }
        }
    }

    /// The point of the map at a point of the plane. `placement` is not needed for
    /// [`MapReference::Local`].
    ///
    /// # Errors
    /// A map without an origin; a point too far from it.
    pub fn map_from_plane(
        self,
        point: PlanePoint,
        placement: Option<&MapPlacement>,
    ) -> Result<MapPoint, PlacingError> {
        match self.geo_from_plane(point)? {
            None => Ok(MapPoint::new(point.x, point.y)?),
            Some(position) => {
                Ok(placement.ok_or(PlacingError::NoOrigin)?.map_from_geo(position)?)
            }
        }
    }

    /// The point of the plane at a point of the map.
    ///
    /// # Errors
    /// A map without an origin; a point that the reference does not cover.
    pub fn plane_from_map(
        self,
        point: MapPoint,
        placement: Option<&MapPlacement>,
    ) -> Result<PlanePoint, PlacingError> {
        if self == Self::Local {
            return Ok(PlanePoint::new(point.x_m(), point.y_m()));
        }
        let position = placement.ok_or(PlacingError::NoOrigin)?.geo_from_map(point)?;
        Ok(match self {
            Self::Utm(zone) => {
                let utm = zone.utm_from_geo(position)?;
                PlanePoint::new(utm.easting_m, utm.northing_m)
            }
            Self::WebMercator => {
                let plane = MercatorPosition::try_from(position)?;
                PlanePoint::new(plane.x_m, plane.y_m)
            }
            _ => PlanePoint::new(position.longitude_deg(), position.latitude_deg()),
        })
    }

    /// What a view of the map shows of the plane: `corners` are those of the view in the map, in
    /// any order, with `pixels_per_m` pixels for a metre of the map.
    ///
    /// # Errors
    /// A map without an origin; a corner that the reference does not cover.
    pub fn view_from_map(
        self,
        corners: [MapPoint; 4],
        pixels_per_m: f64,
        placement: Option<&MapPlacement>,
    ) -> Result<PlaneView, PlacingError> {
        let [a, b, c, d] = corners.map(|corner| self.plane_from_map(corner, placement));
        let (a, b, c, d) = (a?, b?, c?, d?);
        let bounds =
            PlaneBounds::new(a.x, a.y, b.x, b.y).union(PlaneBounds::new(c.x, c.y, d.x, d.y));
        let middle_y = bounds.min.y.midpoint(bounds.max.y);
        let scale = placement.map_or(1.0, MapPlacement::scale);
        let units_per_m = match self {
            Self::Local => 1.0,
            Self::Utm(_) => scale,
            Self::Wgs84 => scale / METRES_PER_DEGREE,
            Self::WebMercator => {
                let latitude_rad = self
                    .geo_from_plane(PlanePoint::new(0.0, middle_y))?
                    .map_or(0.0, |position| position.latitude_deg().to_radians());
                scale / latitude_rad.cos().max(MIN_COS_LATITUDE)
            }
        };
        Ok(PlaneView { bounds, pixels_per_unit: pixels_per_m / units_per_m })
    }
}

impl std::fmt::Display for MapReference {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Local => out.write_str("metres of the map's frame"),
            Self::Wgs84 => out.write_str("WGS 84, degrees (EPSG 4326)"),
            Self::WebMercator => out.write_str("Web Mercator (EPSG 3857)"),
            Self::Utm(zone) => {
                let hemisphere = if zone.is_north() { 'N' } else { 'S' };
                let epsg = self.epsg().unwrap_or_default();
                write!(out, "UTM zone {}{hemisphere} (EPSG {epsg})", zone.number())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn supported_numbers_return_themselves_and_others_are_refused() {
        for number in [4326, 3857, 32601, 32631, 32660, 32701, 32760] {
            assert_eq!(MapReference::from_epsg(number).and_then(MapReference::epsg), Some(number));
        }
        for number in [0, 2154, 4258, 25832, 32600, 32661, 32700, 32761, u32::MAX] {
            assert_eq!(MapReference::from_epsg(number), None);
        }
    }

    #[test]
    fn a_point_of_the_map_is_found_again_through_every_plane() {
        let origin = GeoPosition::new(48.8583, 2.2945, 35.0).unwrap();
        let placement = MapPlacement::new(origin, 0.2, 1.0).unwrap();
        let point = MapPoint::new(120.0, -45.0).unwrap();
        for number in [4326, 3857, 32631] {
            let reference = MapReference::from_epsg(number).unwrap();
            let plane = reference.plane_from_map(point, Some(&placement)).unwrap();
            let again = reference.map_from_plane(plane, Some(&placement)).unwrap();
            let off_m = (again.x_m() - point.x_m()).hypot(again.y_m() - point.y_m());
            assert!(off_m < 0.01, "{reference}: {off_m}");
            let refused = reference.plane_from_map(point, None).unwrap_err();
            assert_eq!(refused, PlacingError::NoOrigin);
        }
        let plane = MapReference::Local.plane_from_map(point, None).unwrap();
        assert_eq!(plane, PlanePoint::new(120.0, -45.0));
    }

    #[test]
    fn a_view_has_fewer_pixels_for_a_stretched_metre() {
        let origin = GeoPosition::new(60.0, 10.0, 0.0).unwrap();
        let placement = MapPlacement::new(origin, 0.0, 1.0).unwrap();
        let at = |x, y| MapPoint::new(x, y).unwrap();
        let corners = [at(-50.0, -50.0), at(50.0, -50.0), at(50.0, 50.0), at(-50.0, 50.0)];
        let view =
            MapReference::WebMercator.view_from_map(corners, 10.0, Some(&placement)).unwrap();
        assert!((view.pixels_per_unit - 5.0).abs() < 0.01, "{view:?}");
        assert!((view.bounds.width() - 200.0).abs() < 1.0, "{view:?}");
    }
}
