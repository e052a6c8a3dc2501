//! The catalogue of findings. A code never changes its meaning; its letter is its severity; it has
//! a page in `docs/errors`.

use crate::finding::Severity;

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident = $text:literal, $title:literal;)*) => {
        /// What kind of finding it is.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code { $($(#[$doc])* $variant,)* }

        impl Code {
            /// Every code there is, in the order of the catalogue.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// The stable code, such as `E0103`.
            pub fn as_str(self) -> &'static str {
                match self { $(Code::$variant => $text,)* }
            }

            /// Its page of `docs/errors`: what it means, an example, what to do; Markdown.
            pub fn page(self) -> &'static str {
                match self {
                    $(Code::$variant => {
                        include_str!(concat!("../../docs/errors/", $text, ".md"))
                    })*
                }
            }

            /// The code written so, in capitals or not.
            pub fn named(text: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|code| code.as_str().eq_ignore_ascii_case(text))
            }

            /// What the code means, in a few words.
            pub fn title(self) -> &'static str {
                match self { $(Code::$variant => $title,)* }
            }
        }
    };
}

codes! {
    // The bytes and the XML.
    /// Longer than the stated limit.
    TooLong = "E0001", "the file is too long";
    /// Not UTF-8.
    NotUtf8 = "E0002", "the file is not UTF-8";
    /// The file could not be read at all.
    Unreadable = "E0003", "the file cannot be read";
    /// Not well-formed XML.
    Malformed = "E0004", "not well-formed XML";
    /// A document type declaration.
    Doctype = "E0005", "a DOCTYPE is not allowed";
    /// Elements nested deeper than the stated limit.
    TooDeep = "E0006", "elements are nested too deeply";
    /// More attributes than the stated limit.
    TooManyAttributes = "E0007", "too many attributes";
    /// More elements of a sort than the stated limit.
    TooMany = "E0008", "too many elements of a sort";
    /// An entity other than the five of XML.
    UnknownEntity = "E0009", "an unknown entity";
    /// A character that XML does not allow, or a reference to one.
    BadCharacter = "E0010", "a character that XML does not allow";
    /// The same attribute twice in one tag.
    DuplicateAttribute = "E0011", "an attribute is written twice";
    /// An end tag that closes nothing, or an element that is never closed.
    EndTag = "E0012", "start and end tags do not match";
    /// A prefix that no `xmlns:` declares, or a namespace on what is ours.
    Namespace = "E0013", "an undeclared or misplaced namespace";

    // The vocabulary.
    /// Text where only elements belong.
    StrayText = "E0014", "text where none belongs";
    /// An element that is not known there.
    UnknownElement = "E0015", "an unknown element";
    /// An attribute that is not known there.
    UnknownAttribute = "E0016", "an unknown attribute";
    /// An attribute that must be there is not.
    MissingAttribute = "E0017", "an attribute is missing";
    /// A name that is not `[A-Za-z][A-Za-z0-9_-]*`.
    BadName = "E0018", "a malformed name";
    /// A value that is not of the attribute's type.
    BadValue = "E0019", "a malformed value";
    /// The root element is not `<armor version="1">`.
    WrongRoot = "E0020", "not an Armor file of version 1";
    /// An element that may be there once is there twice.
    DuplicateElement = "E0021", "an element is written twice";
    /// No system, or no mission and no system.
    NoSystem = "E0022", "there is no system";
    /// The file that is named cannot be read or holds no system.
    IncludeMissing = "E0023", "the named file is missing";
    /// Files that name each other in a circle.
    IncludeCycle = "E0024", "files name each other in a circle";
    /// The system is both in the file and in another one.
    TwoSystems = "E0025", "two systems for one mission";
    /// Two attributes that exclude each other.
    Clash = "E0026", "attributes that exclude each other";
    /// An attribute that changes nothing beside the others of its element.
    NoEffect = "W0027", "an attribute without effect";

    // The system.
    /// Two components of one name.
    DuplicateComponent = "E0101", "two components have the same name";
    /// A parameter is assigned twice.
    DuplicateParameter = "E0102", "a parameter is assigned twice";
    /// A component that the system does not have.
    UnknownComponent = "E0103", "an unknown component";
    /// Two links into one input.
    InputFedTwice = "E0104", "an input is fed twice";
    /// A kind that no component directory has.
    UnknownKind = "E0105", "an unknown kind of component";
    /// A port that the kind does not have.
    UnknownPort = "E0106", "an unknown port";
    /// A link that starts at an input or ends at an output.
    WrongDirection = "E0107", "a link in the wrong direction";
    /// A link between ports of different types.
    TypeMismatch = "E0108", "a link between different types";
    /// A required input that nothing feeds.
    InputUnfed = "E0109", "a required input is not fed";
    /// A parameter that the kind does not have.
    UnknownParameter = "E0110", "an unknown parameter";
    /// A parameter without default that has no value.
    ParameterUnassigned = "E0111", "a parameter has no value";
    /// A value that is not of the parameter's type or unit.
    ParameterType = "E0112", "a value of the wrong type";
    /// A value outside the parameter's range or choices.
    ParameterRange = "E0113", "a value out of range";
    /// A `--set` that is not `component.parameter=value`.
    BadOverride = "E0114", "a malformed override";
    /// A component called as one of Armor's own programs.
    ReservedName = "E0115", "a name that Armor needs itself";
    /// Two components whose names differ in nothing but capitals.
    SimilarNames = "W0116", "two names that differ only in capitals";
    /// A component without links, in no place, that nothing speaks of.
    ComponentIdle = "W0117", "a component that takes part in nothing";
    /// A parameter names a file that is not there.
    FileMissing = "W0118", "a file that a parameter names is missing";
    /// An executable of a component directory that cannot be used.
    BrokenExecutable = "W0119", "an executable that is no component";
    /// A component that is only called after data, none of which is ever sent to it.
    NeverCalled = "W0120", "a component that is never called";
    /// Links that drop nothing, in a circle: everybody may wait for everybody.
    KeepAllCircle = "W0121", "links in a circle that may wait for each other";
    /// A queue that may not hold what comes while its reader works.
    ShortQueue = "N0122", "a queue shorter than what may come at once";
    /// Outputs that no link takes.
    UnusedOutput = "N0123", "outputs that nothing takes";

    // The component directories.
    /// A component of a kind that is there more than once.
    KindTwice = "E0124", "a kind that is there twice";
    /// A component directory that was asked for is not there or cannot be read.
    NoDirectory = "E0125", "a component directory cannot be read";
    /// An executable that does not end when it is asked to describe itself.
    DescribeHangs = "W0126", "an executable takes too long to describe itself";
    /// A manifest of a version that is not known.
    ManifestVersion = "W0127", "a manifest of another version";
    /// A file marked executable that this machine cannot execute.
    NotAProgram = "W0128", "a file marked executable is no program";
    /// Something in a component directory that is neither a program nor a plain file.
    UnusableEntry = "W0129", "something in a component directory cannot be used";
    /// A kind that is there more than once and that the file does not use.
    KindTwiceUnused = "W0130", "an unused kind is there twice";

    // The mission.
    /// Two places of one name.
    DuplicatePlace = "E0201", "two places have the same name";
    /// Two transitions of one name.
    DuplicateTransition = "E0202", "two transitions have the same name";
    /// A place that the mission does not have.
    UnknownPlace = "E0203", "an unknown place";
    /// No place is marked at the start.
    NoInitialPlace = "E0204", "no initial place";
    /// A transition or an arc that joins no place.
    NoArcs = "E0205", "a transition or an arc without places";
    /// A place or an exclusive set names a component that may not be frozen.
    NotControllable = "E0206", "the mission may not control this component";
    /// Exclusive components are active together.
    ExclusiveTogether = "E0207", "exclusive components are active together";
    /// A name is twice in a list.
    DuplicateInList = "E0208", "a name is twice in a list";
    /// A place sets a parameter of a component that it does not activate.
    ForeignParameter = "E0209", "a place sets a parameter of a component it does not activate";
    /// Two variables of one name.
    DuplicateVariable = "E0210", "two variables have the same name";
    /// Two arcs of one sort between one place and one transition.
    DuplicateArc = "E0211", "two arcs of one sort join the same place and transition";
    /// A place that no transition leads to.
    UnreachablePlace = "W0212", "a place that cannot be reached";
    /// No place to go to when something fails.
    NoSafePlace = "W0213", "no safe place";
    /// A transition waits for a report that its component cannot send there.
    ReportNeverSent = "W0214", "a report that cannot be sent there";
    /// An exclusive set of fewer than two components excludes nothing.
    ExclusiveAlone = "W0215", "an exclusive set of one";
    /// More than one token in a place that activates components.
    TooManyTokens = "E0216", "more than one token in a place with components";
    /// A transition whose conditions exclude each other, or that another one always precedes.
    NeverFires = "W0217", "a transition that can never fire";
    /// Two transitions between which only the order in the file decides.
    Tie = "W0218", "only the order in the file decides";
    /// A transition that may fire only before it may fire.
    DatesCrossed = "E0219", "dates that leave no time";
    /// A time that a mission with a period cannot keep.
    ShorterThanPeriod = "W0220", "a time shorter than the mission's period";
    /// A report called almost as one that the executive sends itself.
    ReportMisspelt = "W0221", "a report that is probably misspelt";
    /// Transitions that pass a token round without any time.
    EndlessLoop = "W0222", "transitions in a circle that takes no time";
    /// The last date of a transition has passed before the mission begins.
    DatePassed = "W0223", "a date that has passed";

    // Guards and variables.
    /// The text of a guard is not one.
    GuardSyntax = "E0230", "a guard that cannot be read";
    /// A guard names a variable that the mission does not have.
    UnknownVariable = "E0231", "an unknown variable";
    /// A guard or a source names a field that the data does not have.
    UnknownField = "E0232", "an unknown field of data";
    /// Truths, numbers and texts are mixed.
    GuardType = "E0233", "values of different types in a guard";
    /// Numbers of different units are compared or added.
    GuardUnit = "E0234", "numbers in a guard that do not fit together";
    /// Data of several fields, or of none, where one value is wanted.
    FieldNotSaid = "E0235", "a field of data is not a single value";
    /// A guard, or a comparison in it, that comes out the same whatever happens.
    GuardConstant = "W0236", "a guard that never changes";
    /// A variable that no guard speaks of.
    UnusedVariable = "W0237", "a variable that no guard speaks of";

    /// What a transition sets a variable to is no whole number that it can be.
    CountSyntax = "E0238", "a value that a variable cannot be set to";
    /// A transition sets a variable that follows data, or one variable twice; or a variable neither
    /// follows data nor has a domain.
    NotSettable = "E0239", "a variable that cannot be set";
    /// A variable that guards speak of and no transition sets.
    NothingSets = "W0224", "a variable that nothing sets";

    // What the executive proves of a mission.
    /// A place that can get more and more tokens.
    FillsWithoutEnd = "W0240", "a place that fills without end";
    /// No way leads to the goal, whatever is reported and when.
    GoalNeverReached = "E0241", "the goal can never be reached";
    /// A marking that nothing leads out of, and that is not the end.
    Standstill = "W0242", "a mission that can come to a standstill";
    /// Markings that lead in circles, away from goal and safe place.
    GoalLost = "W0243", "a goal that can get out of reach";
    /// More than one token in a place that activates components, after some firings.
    TwoTokens = "W0244", "a second token in a place with components";
    /// Places of exclusive components that can be marked together.
    MarkedTogether = "W0245", "exclusive components wanted together";
    /// Too many states.
    NotProven = "W0246", "a mission too large to be proven";
    /// How soon the goal can come, and how late.
    Takes = "N0247", "how long the mission takes";

    /// Places that give a component different values and can be marked together.
    ValuesContradict = "W0248", "two values for one parameter";
    /// Variables with too many values to be followed.
    ValuesOpen = "W0249", "variables that are not followed in the proof";

    // What the file itself claims of the mission.
    /// The text of a `<check>` is not one.
    CheckSyntax = "E0250", "a check that cannot be read";
    /// A check names a transition that the mission does not have.
    UnknownTransition = "E0251", "an unknown transition";
    /// What a check says is not so.
    CheckFails = "E0252", "a check that does not hold";
    /// Whether a check holds could not be found out.
    CheckUndecided = "W0253", "a check that could not be decided";

    /// A transition can set a variable to what is outside of its domain.
    ValueOutside = "E0254", "a value outside of a variable's domain";

    // What is understood but not played.
    /// Something that the format has and this version does not play.
    NotPlayed = "E0301", "not played by this version";
    /// There were more findings than are kept.
    More = "N0999", "more findings were left out";
}

impl Code {
    /// How grave a finding of this code is.
    pub fn severity(self) -> Severity {
        match self.as_str().as_bytes()[0] {
            b'E' => Severity::Error,
            b'W' => Severity::Warning,
            _ => Severity::Note,
        }
    }

    /// Whether such a finding says that something is not there. Of a file that could not be read
    /// whole it is worth nothing.
    pub(crate) fn is_of_something_missing(self) -> bool {
        self.severity() != Severity::Error
            || matches!(
                self,
                Code::MissingAttribute
                    | Code::NoSystem
                    | Code::UnknownComponent
                    | Code::InputUnfed
                    | Code::ParameterUnassigned
                    | Code::UnknownPlace
                    | Code::NoInitialPlace
                    | Code::NoArcs
                    | Code::ExclusiveTogether
                    | Code::ForeignParameter
                    | Code::UnknownVariable
                    | Code::UnknownTransition
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn codes_are_a_letter_and_four_digits_each_given_once() {
        let texts: BTreeSet<_> = Code::ALL.iter().map(|code| code.as_str()).collect();
        assert_eq!(texts.len(), Code::ALL.len());
        for text in texts {
            let (letter, number) = text.split_at(1);
            assert!(["E", "W", "N"].contains(&letter), "{text}");
            assert!(number.len() == 4 && number.bytes().all(|b| b.is_ascii_digit()), "{text}");
        }
    }
}
