//! The sub-missions of a mission, and theirs: each file read once, a circle of files found.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::code::Code;
use crate::finding::Finding;
use crate::load::FileReader;
use crate::mission::{Mission, Submission};
use crate::source::{Location, Source, Spanned, plain_path};

/// The limit for the files of one mission, so that the work is bounded.
pub const MAX_FILES: usize = 64;

/// A file that is being read, and where it was named.
struct OpenMission {
    path: PathBuf,
    named: Option<Location>,
    /// The sub-missions that it includes, the next one last.
    wanted: Vec<Submission>,
}

impl FileReader<'_> {
    /// Reads the missions that `mission`, of the file at `path`, includes. Their sources are added
    /// to `sources`.
    pub(super) fn submissions(
        &mut self,
        path: &Path,
        mission: &Mission,
        of_system: Option<&Path>,
        sources: &mut Vec<Arc<Source>>,
    ) -> BTreeMap<PathBuf, Mission> {
        let mut included = BTreeMap::new();
        let mut seen = vec![plain_path(path)];
        let mut open = vec![open_file(path, None, mission)];
        while let Some(top) = open.last_mut() {
            let Some(next) = top.wanted.pop() else {
                open.pop();
                continue;
            };
            if let Some(at) = open.iter().position(|file| file.path == next.path) {
                self.refuse_circle(&open[at..], &next.file);
            } else if !seen.contains(&next.path) {
                if seen.len() >= MAX_FILES {
                    let message = format!("the mission has more than {MAX_FILES} files");
                    let finding = Finding::new(Code::TooMany, &next.file.at, message);
                    self.findings.push(finding.remedy("this is the format's limit"));
                    break;
                }
                seen.push(next.path.clone());
                let Some((source, mission)) = self.read_submission(&next, of_system) else {
                    continue;
                };
                sources.push(source);
                open.push(open_file(&next.path, Some(&next.file.at), &mission));
                included.insert(next.path, mission);
            }
        }
        included
    }

    fn read_submission(
        &mut self,
        next: &Submission,
        of_system: Option<&Path>,
    ) -> Option<(Arc<Source>, Mission)> {
        let bytes = self.bytes_of(&next.path, &next.file)?;
        let (source, contents) = self.named_contents(&next.path, &bytes, &next.file.at)?;
        let Some(mission) = contents.mission else {
            if !self.is_partial {
                let message = format!("{} contains no mission", next.path.display());
                let finding = Finding::new(Code::IncludeMissing, &next.file.at, message);
                self.findings.push(finding.remedy("name the file that contains <mission>"));
            }
            return None;
        };
        if contents.system.is_some() {
            let message = format!("{} has a system of its own", next.path.display());
            let finding = Finding::new(Code::TwoSystems, &next.file.at, message);
            let remedy = "a sub-mission uses the system of the mission that includes it: \
                          keep its mission in a file without <system>";
            self.findings.push(finding.remedy(remedy));
        }
        if let Some(other) = mission.system.as_ref().filter(|_| !self.is_copy) {
            self.same_system(&next.file, other, of_system);
        }
        Some((source, mission))
    }

    /// A sub-mission may name the system that it was made for: it must be this one.
    fn same_system(
        &mut self,
        file: &Spanned<String>,
        other: &Spanned<String>,
        of_system: Option<&Path>,
    ) {
        let path = plain_path(&other.at.source.folder().join(&other.value));
        let Some(ours) = of_system.filter(|ours| plain_path(ours) != path) else { return };
        let message =
            format!("this sub-mission is for the system in {}, not for {}", path.display(), {
                ours.display()
            });
        let finding = Finding::new(Code::TwoSystems, &other.at, message);
        let remedy = "a mission and its sub-missions use one system";
        self.findings.push(finding.remedy(remedy).related(&file.at, "included here"));
    }

    fn refuse_circle(&mut self, circle: &[OpenMission], back: &Spanned<String>) {
        let names: Vec<_> = circle.iter().map(|file| file.path.display().to_string()).collect();
        let message = match names.as_slice() {
            [only] => format!("{only} includes itself as a sub-mission"),
            names => format!("{} include each other as sub-missions", names.join(" and ")),
        };
        let mut finding = Finding::new(Code::IncludeCycle, &back.at, message)
            .remedy("remove one of them: a mission cannot contain itself");
        for named in circle.iter().skip(1).filter_map(|file| file.named.as_ref()) {
            finding = finding.related(named, "included here");
        }
        self.findings.push(finding);
    }
}

fn open_file(path: &Path, named: Option<&Location>, mission: &Mission) -> OpenMission {
    let wanted = mission.submissions.iter().rev().cloned().collect();
    OpenMission { path: plain_path(path), named: named.cloned(), wanted }
}
