use std::cell::RefCell;
use std::rc::Rc;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::disk::scratch::Scratch;

/// A choice in a folder with two robots and a folder.
struct Shown {
    harness: Harness<'static>,
    chosen: Rc<RefCell<Chosen>>,
    folder: Scratch,
}

fn shown(name: &str, is_new: bool) -> Shown {
    let folder = Scratch::new();
    for file in ["rover.xml", "robot.xml", "notes.txt"] {
        std::fs::write(folder.path().join(file), "<armor/>").expect("written");
    }
    std::fs::create_dir(folder.path().join("worlds")).expect("made");
    let chosen = Rc::new(RefCell::new(Chosen::Open));
    let mut choice = PathChoice::new(folder.path(), name, "xml", is_new);
    let shared = Rc::clone(&chosen);
    let mut harness = Harness::builder().with_size([800.0, 700.0]).build_ui(move |ui| {
        if *shared.borrow() == Chosen::Open {
            *shared.borrow_mut() = choice.show(ui, "Take");
        }
    });
    harness.run();
    Shown { harness, chosen, folder }
}

impl Shown {
    fn types(&mut self, text: &str) -> &mut Self {
        self.harness.event(egui::Event::Text(text.to_owned()));
        self.harness.run();
        self
    }

    fn presses(&mut self, key: Key) -> &mut Self {
        self.harness.key_press(key);
        self.harness.run();
        self
    }

    fn clicks(&mut self, label: &str) -> &mut Self {
        self.harness.get_by_label(label).click();
        self.harness.run();
        self
    }

    #[track_caller]
    fn chose(&self, name: &str) {
        assert_eq!(*self.chosen.borrow(), Chosen::File(self.folder.path().join(name)));
    }
}

#[test]
fn a_name_is_begun_gone_on_with_and_taken() {
    let mut choice = shown("", false);
    choice.types("rov").presses(Key::Tab).presses(Key::Enter).chose("rover.xml");
}

#[test]
fn the_arrows_go_through_the_list() {
    let mut choice = shown("", false);
    choice.presses(Key::ArrowDown).presses(Key::ArrowDown).presses(Key::Enter).chose("robot.xml");
}

#[test]
fn a_row_is_clicked_and_taken() {
    shown("", false).clicks("rover.xml").clicks("Take").chose("rover.xml");
}

#[test]
fn only_what_can_be_chosen_is_listed() {
    assert!(shown("", false).harness.query_by_label("notes.txt").is_none());
}

#[test]
fn a_missing_file_is_reported() {
    let mut choice = shown("", false);
    choice.types("none.xml").presses(Key::Enter);
    assert_eq!(*choice.chosen.borrow(), Chosen::Open);
    choice.harness.get_by_label_contains("no file /");
    choice.presses(Key::Escape);
    assert_eq!(*choice.chosen.borrow(), Chosen::Left);
}

#[test]
fn a_new_file_gets_the_ending_and_needs_its_folder() {
    shown("new", true).presses(Key::Enter).chose("new.xml");
    let mut choice = shown("no-such-folder/a.xml", true);
    choice.presses(Key::Enter).harness.get_by_label_contains("no folder /");
}

#[test]
fn a_folder_is_gone_into() {
    let mut choice = shown("", false);
    choice.types("wor").presses(Key::Tab).presses(Key::Enter);
    choice.harness.get_by_label("worlds");
    choice.harness.get_by_label("no files here");
}
