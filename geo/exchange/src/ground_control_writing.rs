//! Writing the plans of QGroundControl.

use serde_json::{Value, json};

use crate::error::PlanWriteError;
use crate::mavlink::command_of;
use crate::plan::{
    Fence, FenceShape, Omissions, PlanItem, PlanNote, PlanPosition, PlannedRoute, RoutePlan,
};

const FORMAT: &str = "plan of QGroundControl";

pub(crate) fn write(plan: &RoutePlan) -> Result<(String, Vec<PlanNote>), PlanWriteError> {
    let found = plan.routes.len();
    if found > 1 {
        return Err(PlanWriteError::SeveralRoutes { format: FORMAT, found });
    }
    let mut omissions = Omissions::default();
    let empty = PlannedRoute::default();
    let route = plan.routes.first().unwrap_or(&empty);
    omissions.add("name of the route", usize::from(route.name.is_some()));
    let is_named = |item: &&PlanItem| matches!(item, PlanItem::Go { name: Some(_), .. });
    omissions.add("name of a waypoint", route.items.iter().filter(is_named).count());
    omissions.add("point", plan.points.len());
    let named = plan.fences.iter().filter(|fence| fence.name.is_some()).count();
    omissions.add("name of a fence", named);
    let named = plan.rally_points.iter().filter(|point| point.name.is_some()).count();
    omissions.add("name of a rally point", named);
    let rally: Vec<Value> =
        plan.rally_points.iter().map(|point| with_altitude(point.position)).collect();
    let mut fence = json!({
        "version": 2,
        "circles": plan.fences.iter().filter_map(circle_of).collect::<Vec<_>>(),
        "polygons": plan.fences.iter().filter_map(polygon_of).collect::<Vec<_>>(),
    });
    if let Some(position) = plan.breach_return {
        fence["breachReturn"] = with_altitude(position);
    }
    let mut mission = json!({
        "version": 2,
        "firmwareType": 12,
        "vehicleType": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "items": route.items.iter().enumerate().map(item_of).collect::<Vec<_>>(),
    });
    if let Some(home) = plan.home {
        mission["plannedHomePosition"] = with_altitude(home);
    }
    let file = json!({
        "fileType": "Plan",
        "version": 1,
        "groundStation": "Armor",
        "mission": mission,
        "geoFence": fence,
        "rallyPoints": { "version": 2, "points": rally },
    });
    Ok((format!("{file:#}\n"), omissions.into_notes(FORMAT)))
}

fn item_of((index, item): (usize, &PlanItem)) -> Value {
    let command = command_of(item, |index| index as i64 + 1);
    json!({
        "type": "SimpleItem",
        "command": command.command,
        "frame": command.frame,
        "params": command.parameters,
        "autoContinue": true,
        "doJumpId": index + 1,
    })
}

/// Latitude, longitude and altitude, which is 0 if there is none.
fn with_altitude(position: PlanPosition) -> Value {
    let altitude = position.altitude.map_or(0.0, |altitude| altitude.m);
    json!([position.latitude_deg, position.longitude_deg, altitude])
}

fn circle_of(fence: &Fence) -> Option<Value> {
    let FenceShape::Circle { centre, radius_m } = &fence.shape else { return None };
    let centre = [centre.latitude_deg, centre.longitude_deg];
    let circle = json!({ "center": centre, "radius": radius_m });
    Some(json!({ "version": 1, "inclusion": fence.stay_in, "circle": circle }))
}

fn polygon_of(fence: &Fence) -> Option<Value> {
    let FenceShape::Polygon(corners) = &fence.shape else { return None };
    let corners: Vec<_> =
        corners.iter().map(|corner| [corner.latitude_deg, corner.longitude_deg]).collect();
    Some(json!({ "version": 1, "inclusion": fence.stay_in, "polygon": corners }))
}
