//! Zones whose shape in the file is malformed, such as one that crosses itself: they are drawn, so
//! that a corner can be dragged.

use armor_geo::MapPoint;
use armor_robotfile::Item as Named;
use armor_robotfile::mission::Mission;
use armor_robotfile::site_map::ZoneKind;
use armor_robotfile::tree::Element;

use crate::item::Item;
use crate::map_view::corner::Corner;
use crate::map_view::position_text::ShapeText;
use crate::map_view::scene::{Displaced, MapScene, Outline, SceneItem, SceneShape};
use crate::mission::marks::Marks;
use crate::project::Project;

impl MapScene {
    /// Adds the zones that the mission does not have because their shape is no polygon.
    pub fn add_malformed_zones(
        &mut self,
        project: &Project,
        mission: &Mission,
        marks: &Marks,
        displaced: Displaced<'_>,
    ) {
        let Some(map) = &mission.map else { return };
        let Some(document) = project.document_with(Named::Map) else { return };
        let element = document.find(Named::Map).and_then(|path| document.tree().element(&path));
        let zones = element.into_iter().flat_map(Element::elements);
        let zones = zones.filter(|element| element.name == "zone");
        let mut found = Vec::new();
        for zone in zones {
            let value = |name| zone.attribute(name).map(|given| given.value.as_str());
            let (Some(name), Some(shape)) = (value("name"), value("shape")) else { continue };
            if map.zones.iter().any(|known| known.name.value == name) {
                continue;
            }
            let item = Item::zone(name);
            let shape = ShapeText::new(shape);
            let corner = |number| {
                let at: MapPoint = shape.corner_point(number, map.placement.as_ref())?;
                Some(displaced(Corner { item, number }, at))
            };
            let corners: Option<Vec<_>> = (0..shape.count()).map(corner).collect();
            let Some(corners) = corners.filter(|it| it.len() > 1 && !shape.is_circle()) else {
                continue;
            };
            let word = value("kind").unwrap_or_default();
            let kind = ZoneKind::NAMED.iter().find(|(known, _)| *known == word);
            let kind = kind.map_or(ZoneKind::Observe, |(_, kind)| *kind);
            found.push(SceneItem {
                item,
                shape: SceneShape::Zone { kind, outline: Outline::Polygon(corners) },
                text: format!("{name} ({word})"),
                label: format!("zone {name}"),
                doc: marks.messages(&item).trim_start().to_owned(),
                mark: marks.mark(&item),
            });
        }
        // Beneath the points, as all zones.
        self.items.splice(0..0, found);
    }
}
