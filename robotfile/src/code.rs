//! The catalogue of findings: one line per code. A code never changes its meaning; its letter is its
//! severity; its page in `docs/errors` explains it and has an example and the fixed example.
//!
//! A new finding is a line here, its check, and its page.

use crate::finding::Severity;

/// The part of Armor that reports the findings of a [`CodeSection`], and whose tests check their pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingOrigin {
    /// This crate, from the file and the manifests.
    File,
    /// The launcher, from the component directories.
    ComponentDirectories,
    /// The crate `armor-ground`, from the grid of the map.
    Ground,
    /// The executive, from the proof of the mission.
    Proof,
}

/// Codes that belong together: a table in the index of `docs/errors`.
#[derive(Clone, Copy, Debug)]
pub struct CodeSection {
    /// The heading.
    pub title: &'static str,
    /// The part of Armor that reports them.
    pub origin: FindingOrigin,
    /// The codes, in the order of the index.
    pub codes: &'static [Code],
}

macro_rules! codes {
    ($($section:literal from $origin:ident {
        $($variant:ident = $text:literal, $title:literal;)*
    })*) => {
        /// The stable identifier of a kind of finding.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code { $($(#[doc = concat!($text, ": ", $title, ".")] $variant,)*)* }

        impl Code {
            /// All codes, in the order of the catalogue.
            pub const ALL: &'static [Code] = &[$($(Code::$variant,)*)*];

            /// All codes in their sections, in the order of the index.
            pub const SECTIONS: &'static [CodeSection] = &[$(CodeSection {
                title: $section,
                origin: FindingOrigin::$origin,
                codes: &[$(Code::$variant,)*],
            },)*];

            /// Returns the code as text, such as `E0103`.
            pub fn as_str(self) -> &'static str {
                match self { $($(Code::$variant => $text,)*)* }
            }

            /// Returns the page of `docs/errors`, in Markdown: the meaning, an example, the remedy.
            pub fn page(self) -> &'static str {
                match self {
                    $($(Code::$variant => {
                        include_str!(concat!("../../docs/errors/", $text, ".md"))
                    })*)*
                }
            }

            /// Returns the code that `text` spells, in upper or lower case.
            pub fn named(text: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|code| code.as_str().eq_ignore_ascii_case(text))
            }

            /// Returns the part of Armor that reports findings of this code.
            pub fn origin(self) -> FindingOrigin {
                match self { $($(Code::$variant)|* => FindingOrigin::$origin,)* }
            }

            /// Returns the meaning in a few words.
            pub fn title(self) -> &'static str {
                match self { $($(Code::$variant => $title,)*)* }
            }
        }
    };
}

codes! {
    "The bytes and the XML" from File {
        TooLong = "E0001", "the file is too long";
        NotUtf8 = "E0002", "the file is not UTF-8";
        Unreadable = "E0003", "the file cannot be read";
        Malformed = "E0004", "not well-formed XML";
        Doctype = "E0005", "a DOCTYPE is not allowed";
        TooDeep = "E0006", "elements are nested too deeply";
        TooManyAttributes = "E0007", "too many attributes";
        TooMany = "E0008", "too many elements of a kind";
        UnknownEntity = "E0009", "an unknown entity";
        BadCharacter = "E0010", "a character that XML does not allow";
        DuplicateAttribute = "E0011", "an attribute is written twice";
        EndTag = "E0012", "start and end tags do not match";
        Namespace = "E0013", "an undeclared or misplaced namespace";
    }
    "The vocabulary" from File {
        StrayText = "E0014", "text where none belongs";
        UnknownElement = "E0015", "an unknown element";
        UnknownAttribute = "E0016", "an unknown attribute";
        MissingAttribute = "E0017", "an attribute is missing";
        BadName = "E0018", "a malformed name";
        BadValue = "E0019", "a malformed value";
        WrongRoot = "E0020", "not an Armor file of version 1";
        DuplicateElement = "E0021", "an element is written twice";
        NoSystem = "E0022", "there is no system";
        IncludeMissing = "E0023", "the named file is missing";
        IncludeCycle = "E0024", "files name each other in a circle";
        TwoSystems = "E0025", "two systems for one mission";
        Clash = "E0026", "attributes that exclude each other";
        NoEffect = "W0027", "an attribute without effect";
        Draft = "E0028", "the file is a draft";
    }
    "The system" from File {
        DuplicateComponent = "E0101", "two components have the same name";
        DuplicateParameter = "E0102", "a parameter is assigned twice";
        UnknownComponent = "E0103", "an unknown component";
        InputFedTwice = "E0104", "an input is fed twice";
        UnknownKind = "E0105", "an unknown kind of component";
        UnknownPort = "E0106", "an unknown port";
        WrongDirection = "E0107", "a link in the wrong direction";
        TypeMismatch = "E0108", "a link between different types";
        InputUnfed = "E0109", "a required input is not fed";
        UnknownParameter = "E0110", "an unknown parameter";
        ParameterUnassigned = "E0111", "a parameter has no value";
        ParameterType = "E0112", "a value of the wrong type";
        ParameterRange = "E0113", "a value out of range";
        BadOverride = "E0114", "a malformed override";
        ReservedName = "E0115", "a reserved name";
        SimilarNames = "W0116", "two names that differ only in upper and lower case";
        ComponentIdle = "W0117", "an unused component";
        FileMissing = "W0118", "a file that a parameter names is missing";
        NeverCalled = "W0120", "a component that is never called";
        KeepAllCircle = "W0121", "links in a circle that may block each other";
        ShortQueue = "N0122", "a queue that may be too short";
        UnusedOutput = "N0123", "outputs that no link uses";
        NoComponents = "W0131", "a system without components";
        RateTooHigh = "W0132", "a rate that is too high";
        WatchdogTooShort = "W0133", "a watchdog that is too short";
        BadBlock = "N0134", "a block of the layout that shows nothing";
        WorkUnused = "W0135", "an active component whose outputs nothing uses";
        DuplicateHost = "E0136", "two hosts have the same name";
        UnknownHost = "E0137", "an unknown host";
        UnusedHost = "W0138", "a host on which nothing runs";
        LinkToItself = "W0139", "a link from a component to itself";
        CrossedLink = "W0140", "a link from another output than the one with the input's name";
        SpeedUnfollowed = "W0141", "time that runs faster in one component than in all others";
        RateTooLow = "W0142", "a rate that is too low for what takes the data";
        ValueIdle = "W0143", "a value with which a component does nothing";
        DuplicateFrame = "E0144", "a frame is placed twice";
        FrameCircle = "E0145", "frames in a circle";
        FrameMissing = "E0146", "a frame that a component needs is not placed on the robot";
        UnknownParent = "W0147", "a frame in one that nothing provides";
        MovingFrame = "E0148", "a frame that moves has a fixed place";
        DatagramsKeep = "E0149", "more than datagrams can keep";
        WritersDiffer = "E0150", "links of different types at an input that takes any type";
        OwnFile = "W0151", "a parameter that names a file of the robot itself";
    }
    "The component directories" from ComponentDirectories {
        BrokenExecutable = "W0119", "an executable that is not a component";
        KindTwice = "E0124", "a kind that is provided twice";
        NoDirectory = "E0125", "a component directory cannot be read";
        DescribeHangs = "W0126", "an executable takes too long to describe itself";
        ManifestVersion = "W0127", "a manifest of another version";
        NotAProgram = "W0128", "a file marked executable is not a program";
        UnusableEntry = "W0129", "an entry of a component directory cannot be used";
        KindTwiceUnused = "W0130", "an unused kind is provided twice";
    }
    "The mission" from File {
        DuplicatePlace = "E0201", "two places have the same name";
        DuplicateTransition = "E0202", "two transitions have the same name";
        UnknownPlace = "E0203", "an unknown place";
        NoInitialPlace = "E0204", "no initial place";
        NoArcs = "E0205", "a transition or an arc without places";
        NotControllable = "E0206", "the mission may not control this component";
        ExclusiveTogether = "E0207", "exclusive components are active together";
        DuplicateInList = "E0208", "a name is listed twice";
        ForeignParameter = "E0209", "a place sets a parameter of a component it does not activate";
        DuplicateVariable = "E0210", "two variables have the same name";
        DuplicateArc = "E0211", "two arcs of the same kind between a place and a transition";
        UnreachablePlace = "W0212", "a place that cannot be reached";
        NoSafePlace = "W0213", "no safe place";
        ReportNeverSent = "W0214", "a report that cannot be sent there";
        ExclusiveAlone = "W0215", "an exclusive set of one";
        TooManyTokens = "E0216", "more than one token in a place with components";
        NeverFires = "W0217", "a transition that can never fire";
        Tie = "W0218", "only the order in the file decides";
        DatesCrossed = "E0219", "dates that leave no time";
        ShorterThanPeriod = "W0220", "a time shorter than the mission's period";
        ReportMisspelt = "W0221", "a report that is probably misspelt";
        EndlessLoop = "W0222", "transitions that fire forever in no time";
        DatePassed = "W0223", "a date that has passed";
        UnknownEvent = "E0225", "an unknown event";
        EventsUndeclared = "N0226", "an event of a kind whose manifest lists none";
        NoGoal = "W0260", "no goal";
        NoInput = "W0261", "a transition that takes tokens from no place";
        NoOutput = "W0271", "a transition that puts tokens into no place";
        ImmediateExit = "W0272", "a transition without a condition next to others that wait";
        EndsTooSoon = "W0273", "a transition that ends the mission and begins work";
        DoneAtAnyTime = "W0274", "the end of a component that is always active";
        GoalByFailure = "W0275", "a goal that is reached only through a failure";
        GoalExchanged = "W0276", "a goal that seems exchanged with the safe place";
        DoneUnused = "W0277", "a place that waits for a failure and not for the end";
        StaysThere = "N0278", "a token that no transition takes";
        ValueTooLate = "W0279", "a value with which a component is done too late, or never";
        EmergencyAsks = "W0280", "an emergency that waits for a person";
        ChangesNothing = "W0281", "a transition that changes nothing";
        InhibitedJoin = "W0282", "an inhibitor that keeps two tokens apart";
        EndUnawaited = "W0284", "the end of a task that nothing waits for";
        FailsToItself = "W0263", "an on-failure that is its own place, or the goal";
        TimeTooShort = "W0264", "a time that is too short";
        ExclusiveTwice = "W0265", "an exclusive set is written twice";
        FrozenProducer = "W0266", "a link whose producer is frozen while its consumer is active";
        Starved = "W0270", "a component that waits for data of a frozen component";
        LoopInterrupted = "W0269", "a loop of links that a frozen component interrupts";
    }
    "The map and its routes" from File {
        DrawnTwice = "E0301", "two drawn things have the same name";
        NoOrigin = "E0302", "a latitude and longitude on a map without an origin";
        UnknownMark = "E0303", "a point that is not drawn";
        LegIntrudes = "E0304", "a leg through a zone that no robot may enter";
        LegLeaves = "E0305", "a leg that leaves the zone to stay in";
        ExitIntrudes = "E0306", "an exit through a zone or across a line";
        NoRally = "E0307", "an exit that leads nowhere";
        MeetingAlone = "E0308", "a meeting to which the other route does not come";
        RouteEmpty = "E0309", "a route without legs";
        StartUnknown = "W0310", "a route from an unknown start";
        LineCrossed = "E0311", "a leg across a boundary or a limit";
        DrawnIncomplete = "E0312", "a stay, an exit or a zone that lacks its condition";
        TimesConflict = "E0313", "times of routes that exclude each other";
        MeetingsInCircle = "E0314", "meetings that wait for each other";
        TimeMayLack = "W0315", "a limit that the slowest drive misses";
        BatteryEmpty = "E0316", "a battery that does not last to the rally point";
        BatteryOpen = "W0317", "a route of which it is not known whether the battery lasts";
    }
    "Routes over the known grid" from Ground {
        PathBlocked = "E0318", "a drive to which the known grid has no path";
        RallyFarther = "W0319", "a rally point that is not the nearest over the grid";
        GridUnreadable = "E0320", "a grid of the map that cannot be read";
    }
    "Guards and variables" from File {
        GuardSyntax = "E0230", "a guard that cannot be read";
        UnknownVariable = "E0231", "an unknown variable";
        UnknownField = "E0232", "an unknown field of data";
        GuardType = "E0233", "values of different types in a guard";
        GuardUnit = "E0234", "numbers in a guard that do not fit together";
        FieldNotSingle = "E0235", "a field of data is not a single value";
        GuardConstant = "W0236", "a guard that never changes";
        UnusedVariable = "W0237", "a variable that is not used";
        CountSyntax = "E0238", "a value that a variable cannot be set to";
        NotSettable = "E0239", "a variable that cannot be set";
        NothingSets = "W0224", "a variable that nothing sets";
        FrozenData = "W0267", "a guard over data of a frozen component";
        ConditionImplied = "W0283", "a condition that another one implies";
        InexactEqual = "W0268", "a measured value compared with == and a fraction";
    }
    "Checks" from File {
        CheckSyntax = "E0250", "a check that cannot be read";
        UnknownTransition = "E0251", "an unknown transition";
    }
    "What is proven of the mission" from Proof {
        FillsWithoutEnd = "W0240", "a place without a bound";
        GoalNeverReached = "E0241", "the goal can never be reached";
        OverAtStart = "W0262", "a mission that is over at its start";
        Standstill = "W0242", "a mission that can come to a standstill";
        GoalLost = "W0243", "a goal that can become unreachable";
        TwoTokens = "W0244", "a second token in a place with components";
        MarkedTogether = "W0245", "exclusive components requested together";
        NotProven = "W0246", "a mission too large to be proven";
        ProvenByRoutes = "N0285", "a mission whose routes are proven one by one";
        Takes = "N0247", "how long the mission takes";
        ValuesContradict = "W0248", "two values for one parameter";
        ValuesOpen = "W0249", "variables that are not followed in the proof";
        CheckFails = "E0252", "a check that fails";
        CheckUndecided = "W0253", "a check that could not be decided";
        ValueOutside = "E0254", "a value outside a variable's domain";
        NeverEqual = "W0255", "a condition that no value of a variable meets";
        SetUnchanged = "W0256", "a variable that is set and never changes";
        CheckStatesNothing = "W0257", "a check about what never comes";
    }
    "Limits of this version" from File {
        More = "N0999", "more findings were left out";
    }
}

impl Code {
    /// Returns the severity of findings of this code.
    pub fn severity(self) -> Severity {
        match self.as_str().as_bytes()[0] {
            b'E' => Severity::Error,
            b'W' => Severity::Warning,
            _ => Severity::Note,
        }
    }

    /// Returns whether the finding reports that something is missing. If parts of the file could
    /// not be read, the missing thing may be in them, so such a finding is suppressed.
    pub(crate) fn is_of_something_missing(self) -> bool {
        self.severity() != Severity::Error
            || matches!(
                self,
                Code::MissingAttribute
                    | Code::NoSystem
                    | Code::UnknownComponent
                    | Code::InputUnfed
                    | Code::FrameMissing
                    | Code::ParameterUnassigned
                    | Code::UnknownPlace
                    | Code::NoInitialPlace
                    | Code::NoArcs
                    | Code::ExclusiveTogether
                    | Code::ForeignParameter
                    | Code::UnknownVariable
                    | Code::UnknownTransition
                    | Code::UnknownMark
                    | Code::NoRally
                    | Code::MeetingAlone
                    | Code::RouteEmpty
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
