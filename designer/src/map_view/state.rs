//! What the view of the map keeps from frame to frame.

use std::collections::BTreeSet;
use std::sync::Arc;

use armor_geo::MapPoint;
use eframe::egui::{Pos2, Rect};

use crate::canvas::Diagram;
use crate::item::Item;
use crate::map_view::camera::{Camera, MapBounds, map_point};
use crate::map_view::corner::Corner;
use crate::map_view::hit::{MapHit, Sight};
use crate::map_view::layers::Layers;
use crate::map_view::live::LiveMap;
use crate::map_view::model::mission_of;
use crate::map_view::other_drawings::OtherDrawings;
use crate::map_view::pictures::Pictures;
use crate::map_view::rehearsal::MapRehearsal;
use crate::map_view::scene::MapScene;
use crate::map_view::shaping_form::ShapingForm;
use crate::map_view::symbol_picture::SymbolPictures;
use crate::map_view::times::TimesStrip;
use crate::map_view::tools::Tool;
use crate::mission::form::Form;
use crate::mission::marks::Marks;
use crate::name::ItemName;
use crate::workspace::Workspace;

/// The view of the map.
pub struct MapView {
    pub(super) camera: Camera,
    /// What is to be brought into the window once its size is known.
    pub(super) fit: Option<MapFit>,
    /// Whether everything stays fitted into the window: until the user moves the view.
    pub(super) stays_fitted: bool,
    pub(super) window: Rect,
    pub(super) tool: Tool,
    pub(super) gesture: MapGesture,
    /// The points of the zone, line or path that is being drawn.
    pub(super) draft: Vec<MapPoint>,
    pub(super) selection: BTreeSet<Item>,
    /// The corner that was clicked last, of the item that is selected alone.
    pub(super) corner: Option<Corner>,
    /// What is selected in the next scene: what an edit has just added is not in the present one.
    pub(super) select_next: Vec<Item>,
    pub(super) scene: MapScene,
    drawn: Option<DrawnFrom>,
    symbols: SymbolPictures,
    pub(super) marks: Marks,
    pub(super) form: Form,
    /// What is typed to change the selection by numbers.
    pub(super) shaping: ShapingForm,
    pub(super) layers: Layers,
    pub(super) pictures: Pictures,
    /// What the open menu is about, and where on the map it is.
    pub(super) menu: (Option<Item>, MapPoint),
    /// Where the pointer is, or was last.
    pub(super) pointer: Option<Pos2>,
    /// Where the last click selected something.
    pub(super) clicked: Option<Pos2>,
    /// The route that new legs are added to; none is the last one.
    pub(super) route: Option<ItemName>,
    /// Whether the next leg begins a further route.
    pub(super) is_new_route: bool,
    /// The point where a new route begins.
    pub(super) new_start: Option<MapPoint>,
    /// The step of the first route that a new meeting is behind.
    pub(super) meets_after: Option<Item>,
    pub(super) times: TimesStrip,
    pub(super) rehearsal: MapRehearsal,
    pub(super) others: OtherDrawings,
    pub(super) live: LiveMap,
    /// The symbols of tracks.
    pub(super) live_symbols: SymbolPictures,
    /// Whether lines stay lines when it is painted: for a file of them.
    pub(super) keeps_lines: bool,
    /// When a wheel was turned last, in seconds.
    pub(super) wheel_turned: f64,
    /// Of other views; a map is no diagram.
    pub(super) no_diagram: Diagram<Item>,
}

/// What is brought into the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MapFit {
    Everything,
    Area(MapBounds),
}

/// What the pointer is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum MapGesture {
    #[default]
    Idle,
    Pan,
    /// What is selected is moved by metres to the right and up.
    Move {
        grabbed: MapPoint,
        by_m: [f64; 2],
    },
    /// A corner is moved to a position.
    Corner {
        corner: Corner,
        to: MapPoint,
    },
    /// A new corner is drawn out of a side.
    NewCorner {
        corner: Corner,
        to: MapPoint,
    },
    /// A point between is drawn out of a leg.
    NewLeg {
        step: Item,
        to: MapPoint,
    },
    /// A frame around what is to be selected.
    Frame {
        from: Pos2,
        to: Pos2,
    },
}

/// What a scene was made of.
#[derive(Clone, Debug, PartialEq)]
struct DrawnFrom {
    revision: u64,
    checked: (u64, bool),
    gesture: MapGesture,
}

impl MapView {
    /// A view that shows the whole map at first.
    pub fn new() -> Self {
        Self {
            camera: Camera::default(),
            fit: Some(MapFit::Everything),
            stays_fitted: true,
            window: Rect::ZERO,
            tool: Tool::default(),
            gesture: MapGesture::Idle,
            draft: Vec::new(),
            selection: BTreeSet::new(),
            corner: None,
            select_next: Vec::new(),
            scene: MapScene::default(),
            drawn: None,
            symbols: SymbolPictures::default(),
            marks: Marks::default(),
            form: Form::default(),
            shaping: ShapingForm::default(),
            layers: Layers::default(),
            pictures: Pictures::default(),
            menu: (None, map_point([0.0, 0.0])),
            pointer: None,
            clicked: None,
            route: None,
            is_new_route: false,
            new_start: None,
            meets_after: None,
            times: TimesStrip::default(),
            rehearsal: MapRehearsal::default(),
            others: OtherDrawings::default(),
            live: LiveMap::default(),
            live_symbols: SymbolPictures::default(),
            keeps_lines: false,
            wheel_turned: f64::NEG_INFINITY,
            no_diagram: Diagram::default(),
        }
    }

    /// Draws the map again if the file, what was found in it, or what is dragged has changed.
    pub(super) fn update(&mut self, workspace: &Workspace) {
        let checked = workspace.project.checked();
        let now = DrawnFrom {
            revision: workspace.project.revision(),
            checked: (checked.revision, checked.is_complete),
            gesture: self.gesture,
        };
        if self.drawn.as_ref() == Some(&now) {
            return;
        }
        let known = self.drawn.as_ref();
        let is_same_file = known.is_some_and(|drawn| drawn.revision == now.revision);
        let is_known = known
            .is_some_and(|drawn| (drawn.revision, drawn.checked) == (now.revision, now.checked));
        if !is_known {
            self.marks = marks_of(workspace);
        }
        if !is_same_file {
            self.gesture = MapGesture::Idle;
            self.pictures.follow();
        }
        let mut symbols = std::mem::take(&mut self.symbols);
        self.scene = match mission_of(workspace) {
            Some(mission) => {
                let displaced = self.displacement();
                let mut scene = MapScene::of(mission, &self.marks, &mut symbols, &displaced);
                scene.add_malformed_zones(&workspace.project, mission, &self.marks, &displaced);
                scene
            }
            None => MapScene::default(),
        };
        self.symbols = symbols;
        if !is_same_file {
            self.keep_selection(workspace);
        }
        self.drawn = Some(DrawnFrom { gesture: self.gesture, ..now });
    }

    /// Keeps what is selected and still there, or selects what was added.
    fn keep_selection(&mut self, workspace: &Workspace) {
        let added: BTreeSet<_> = std::mem::take(&mut self.select_next)
            .into_iter()
            .filter(|item| self.holds(*item, workspace))
            .collect();
        if added.is_empty() {
            let kept = self.selection.iter().copied();
            self.selection = kept.filter(|item| self.holds(*item, workspace)).collect();
        } else {
            self.selection = added;
        }
        self.corner = self.corner.filter(|corner| self.only() == Some(corner.item));
    }

    /// Whether the map or its routes have an item; a route is no shape of its own.
    fn holds(&self, item: Item, workspace: &Workspace) -> bool {
        let routes = mission_of(workspace).map_or(&[][..], |mission| &mission.routes);
        match item {
            Item::Route(name) => routes.iter().any(|route| route.name.value == name.as_str()),
            Item::Step { route, step } => routes.iter().any(|it| {
                it.name.value == route.as_str()
                    && it.steps.iter().any(|other| other.name().value == step.as_str())
            }),
            item => self.scene.find(item).is_some(),
        }
    }

    /// Where positions are shown while something is dragged.
    fn displacement(&self) -> impl Fn(Corner, MapPoint) -> MapPoint + use<'_> {
        move |corner, at| match self.gesture {
            MapGesture::Move { by_m, .. } if self.selection.contains(&corner.item) => {
                map_point([at.x_m() + by_m[0], at.y_m() + by_m[1]])
            }
            MapGesture::Corner { corner: dragged, to } if dragged == corner => to,
            _ => at,
        }
    }

    /// What is selected, if it is one thing.
    pub(super) fn only(&self) -> Option<Item> {
        let mut items = self.selection.iter();
        items.next().copied().filter(|_| items.next().is_none())
    }

    /// The scene in the window.
    pub(super) fn sight(&self) -> Sight<'_> {
        Sight {
            scene: &self.scene,
            camera: &self.camera,
            window: self.window,
            layers: &self.layers,
        }
    }

    /// What is at a point of the window.
    pub(super) fn hit(&self, at: Pos2) -> Option<MapHit> {
        self.sight().hit(at, self.only())
    }

    /// The position under a point of the window, on the steps of this size.
    pub(super) fn position_at(&self, at: Pos2, workspace: &Workspace) -> MapPoint {
        let here = self.camera.to_map(self.window, at);
        self.camera.snapped(here, workspace.settings.snap)
    }

    /// Selects exactly these items.
    pub(super) fn select(&mut self, items: impl IntoIterator<Item = Item>) {
        self.selection = items.into_iter().collect();
        self.corner = None;
    }

    /// The position of something new: at the pointer if it is over the map, otherwise in the middle.
    pub(super) fn spot(&self, workspace: &Workspace) -> MapPoint {
        let at = self.pointer.filter(|at| self.window.contains(*at));
        self.position_at(at.unwrap_or(self.window.center()), workspace)
    }

    /// Ends what is being drawn or dragged. Returns whether there was something.
    pub(super) fn cancel(&mut self) -> bool {
        let was_busy = self.gesture != MapGesture::Idle
            || !self.draft.is_empty()
            || self.new_start.is_some()
            || self.meets_after.is_some()
            || self.tool != Tool::Select;
        self.gesture = MapGesture::Idle;
        if self.draft.is_empty() && self.new_start.is_none() && self.meets_after.is_none() {
            self.tool = Tool::Select;
        }
        self.draft.clear();
        self.new_start = None;
        self.meets_after = None;
        self.is_new_route = false;
        was_busy
    }
}

impl Default for MapView {
    fn default() -> Self {
        Self::new()
    }
}

/// What was found of the current files; of older ones the places would be wrong.
fn marks_of(workspace: &Workspace) -> Marks {
    let checked = workspace.project.checked();
    if checked.revision != workspace.project.revision() {
        return Marks::default();
    }
    Marks::of(Arc::clone(&checked.findings), &|at| workspace.project.item_at(at))
}
