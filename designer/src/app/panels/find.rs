//! Finding something by its words, in whichever view has it.

use eframe::egui::{self, Align2, Id, Modal, Vec2};

use crate::app::Designer;
use crate::app::lists::FindList;
use crate::item::Item;
use crate::panels::pick::{Entry, Picked};

impl Designer {
    pub(in crate::app) fn show_find(&mut self, ctx: &egui::Context) {
        let Some(mut find) = self.find.take() else { return };
        let entries = find.entries.take().unwrap_or_else(|| self.findable());
        let area = Modal::default_area(Id::unique("find"))
            .anchor(Align2::CENTER_TOP, Vec2::new(0.0, 70.0));
        let modal = Modal::new(Id::unique("find")).area(area).show(ctx, |ui| {
            ui.set_width(440.0);
            find.picker.show(ui, "Find by name, port, parameter or value", &entries)
        });
        match modal.inner {
            Picked::Open if !modal.backdrop_response.clicked() => {
                self.find = Some(FindList { entries: Some(entries), ..find });
            }
            Picked::One(item) => self.workspace.shown = Some(item),
            _ => {}
        }
    }

    fn findable(&self) -> Vec<Entry<Item>> {
        let all = self.panes.iter().flat_map(|(_, pane)| pane.findable_items(&self.workspace));
        let mut entries: Vec<Entry<Item>> = Vec::new();
        for (item, about) in all {
            // Several views have it: the first shows it.
            if !entries.iter().any(|known| known.value == item) {
                entries.push(Entry { name: item.to_string(), about, value: item });
            }
        }
        entries
    }
}
