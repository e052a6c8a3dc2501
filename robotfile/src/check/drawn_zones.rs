//! Parameters of the format `zones`, which the zones of the mission's map fill: so a zone is drawn once,
//! and whatever obeys zones receives it.

use armor_geo::{MapArea, MapPoint};
use armor_wire::text_format::TextFormat;
use armor_wire::zone_text::{InText, WrittenDuty, WrittenShape, WrittenZone};

use crate::manifests::Manifests;
use crate::model::{Configuration, Parameter};
use crate::site_map::{DrawnZone, ZoneKind};
use crate::source::Spanned;

/// Gives the zones of the mission's map to every component whose kind has a parameter for them, as if
/// the file assigned it where the first zone is. A value that the file, or `--set`, assigns has
/// priority. The zones of sub-missions are not among them: they are valid only in their own missions.
pub(super) fn fill_zones(configuration: &mut Configuration, manifests: &Manifests) {
    let map = configuration.mission.as_ref().and_then(|mission| mission.map.as_ref());
    let zones = map.map(|map| map.zones.as_slice()).unwrap_or_default();
    let Some(first) = zones.first() else { return };
    let written: Vec<_> =
        zones.iter().filter_map(write_zone).map(|zone| zone.to_string()).collect();
    let (at, folder) = (first.name.at.clone(), first.name.at.source.folder());
    let value = Spanned::new(written.join("; "), at.clone());
    for component in &mut configuration.system.components {
        let Some(kind) = manifests.get(&component.kind.value) else { continue };
        let takes = kind.parameters.iter().filter(|it| it.format == Some(TextFormat::Zones));
        for parameter in takes {
            if component.parameter(&parameter.name).is_some() {
                continue;
            }
            let name = Spanned::new(parameter.name.clone(), at.clone());
            let (value, folder) = (value.clone(), folder.clone());
            component.parameters.push(Parameter { name, value, folder });
        }
    }
}

/// None of a speed zone without a speed, which is a finding.
fn write_zone(zone: &DrawnZone) -> Option<WrittenZone> {
    let duty = match zone.kind {
        ZoneKind::NoGo => WrittenDuty::NoGo,
        ZoneKind::StayIn => WrittenDuty::StayIn,
        ZoneKind::Speed => WrittenDuty::Speed(zone.speed_mps.as_ref()?.value),
        ZoneKind::Observe => WrittenDuty::Observe,
    };
    let point = |point: MapPoint| InText::nowhere([point.x_m(), point.y_m()]);
    let shape = match &zone.area.value {
        MapArea::Polygon(polygon) => {
            WrittenShape::Polygon(polygon.corners().iter().map(|corner| point(*corner)).collect())
        }
        MapArea::Circle(circle) => {
            let radius_m = InText::nowhere(circle.radius().metres());
            WrittenShape::Circle { centre: point(circle.centre()), radius_m }
        }
    };
    let margin_m = InText::nowhere(zone.margin.metres());
    Some(WrittenZone { name: InText::nowhere(zone.name.value.clone()), duty, margin_m, shape })
}
