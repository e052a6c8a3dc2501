//! The projects of components in C and C++: what CMake builds with the package Armor.

use super::type_name::type_name_in;

/// A language in which a component is built by CMake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CmakeLanguage {
    C,
    Cpp,
}

const README: &str = include_str!("cmake_readme.md");
const IGNORED: &str = "/build\n";
const C_FILES: [(&str, &str); 7] = [
    ("CMakeLists.txt", include_str!("c_project/CMakeLists.txt")),
    ("src/component.h", include_str!("c_project/component.h")),
    ("src/component.c", include_str!("c_project/component.c")),
    ("src/main.c", include_str!("c_project/main.c")),
    ("tests/component_test.c", include_str!("c_project/component_test.c")),
    ("README.md", README),
    (".gitignore", IGNORED),
];
const CPP_COMPONENT: &str = include_str!("cpp_project/component.hpp");
const CPP_FILES: [(&str, &str); 6] = [
    ("CMakeLists.txt", include_str!("cpp_project/CMakeLists.txt")),
    ("src/component.hpp", CPP_COMPONENT),
    ("src/main.cpp", include_str!("cpp_project/main.cpp")),
    ("tests/component_test.cpp", include_str!("cpp_project/component_test.cpp")),
    ("README.md", README),
    (".gitignore", IGNORED),
];

impl CmakeLanguage {
    fn files(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::C => &C_FILES,
            Self::Cpp => &CPP_FILES,
        }
    }

    /// The files of a project of this name.
    pub fn fill_files(self, name: &str) -> impl Iterator<Item = (&'static str, String)> {
        let type_name = type_name_in(CPP_COMPONENT, name);
        self.files().iter().map(move |(file, text)| {
            (*file, text.replace("{{name}}", name).replace("{{Type}}", &type_name))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_a_project_is_filled_in() {
        for language in [CmakeLanguage::C, CmakeLanguage::Cpp] {
            let files: Vec<_> = language.fill_files("laser-scanner").collect();
            assert!(files.iter().any(|(file, _)| *file == "CMakeLists.txt"));
            for (file, text) in files {
                let is_left = ["{{name}}", "{{Type}}"].iter().any(|blank| text.contains(blank));
                assert!(!is_left, "{language:?}, {file}: {text}");
            }
        }
        let mut files = CmakeLanguage::Cpp.fill_files("component");
        let header = files.find(|(file, _)| *file == "src/component.hpp").expect("it exists").1;
        assert!(header.contains("class ComponentComponent :"), "{header}");
    }
}
