//! Schema texts that are read, refused and compared, and payloads turned into JSON.

use serde_json::json;

use super::json::to_json_within;
use super::*;

const GOOD: &[&str] = &[
    "u8",
    "[?[f64;36]]",
    "Empty{}",
    "Pose2D{x:f64(m),y:f64(m),theta:f64(rad)}",
    "geometry_msgs/Twist{linear:V{x:f64(m/s2)}}",
    "Level<Low,High{margin:f64(%)},_3>",
    "S{u8:u8,string:string}",
];

#[test]
fn what_is_read_is_written_the_same() {
    for text in GOOD {
        let schema = parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(schema.to_string(), *text);
    }
}

#[test]
fn what_is_not_canonical_is_refused_at_its_place() {
    let cases = [
        ("", 0, "name"),
        ("float", 5, "unknown type"),
        ("u8 ", 2, "after the end"),
        ("[u8", 3, "ends with ]"),
        ("[u8;0]", 4, "count"),
        ("[u8;007]", 4, "count"),
        ("[u8;65537]", 4, "count"),
        ("[u8;99999999999999999999]", 4, "count"),
        ("[Empty{}]", 8, "no bytes"),
        ("[Empty{};3]", 8, "no bytes"),
        ("[Hollow{a:Empty{},b:Empty{}}]", 28, "no bytes"),
        ("u8{x:u8}", 2, "after the end"),
        ("S{a:u8,a:u8}", 7, "twice"),
        ("S{a:u8,}", 7, "name"),
        ("S{2:u8}", 2, "name"),
        ("S{a:u8()}", 7, "unit"),
        ("E<>", 2, "name"),
        ("E<A{}>", 5, "no braces"),
        ("E<A,A>", 4, "twice"),
        ("É{}", 0, "name"),
        ("[[[u8;65536];65536];65536]", 26, "no payload"),
    ];
    for (text, at, problem) in cases {
        let error = parse(text).expect_err(text);
        assert_eq!(error.at, at, "{text}: {error}");
        assert!(error.problem.contains(problem), "{text}: {error}");
    }
}

#[test]
fn depth_and_length_have_limits() {
    let nested = |depth: usize| format!("{}u8{}", "[".repeat(depth), "]".repeat(depth));
    assert!(parse(&nested(MAX_DEPTH)).is_ok());
    assert!(parse(&nested(MAX_DEPTH + 1)).is_err_and(|e| e.problem.contains("deep")));
    assert!(parse(&"?".repeat(MAX_TEXT_LEN)).is_err_and(|e| e.problem.contains("deep")));
    assert!(parse(&"u".repeat(MAX_TEXT_LEN + 1)).is_err_and(|e| e.problem.contains("long")));
    assert!(parse(&format!("{}{{}}", "n".repeat(MAX_LABEL_LEN))).is_ok());
    assert!(parse(&format!("{}{{}}", "n".repeat(MAX_LABEL_LEN + 1))).is_err());
    assert!(parse(&format!("S{{a:u8({})}}", "m".repeat(MAX_UNIT_LEN + 1))).is_err());
}

#[test]
fn the_hash_is_that_of_fnv_1a() {
    // The published test vectors of FNV-1a, 64 bits.
    for (text, hash) in [("", 0xcbf2_9ce4_8422_2325), ("foobar", 0x8594_4171_f739_67e8)] {
        assert_eq!(hash_text(text), hash);
    }
    assert_eq!(Schema::U8.hash(), hash_text("u8"));
}

fn check_json(schema: &str, payload: &[u8], expected: Result<serde_json::Value, &str>) {
    let schema = parse(schema).expect("a schema");
    let found = to_json(&schema, payload).map_err(|error| error.to_string());
    assert_eq!(found, expected.map_err(str::to_owned), "{schema}");
}

#[test]
fn payloads_become_json() {
    check_json("?u16", &[1, 2, 1], Ok(json!(258)));
    check_json("?u16", &[0], Ok(json!(null)));
    check_json("f32", &0.1_f32.to_le_bytes(), Ok(json!(0.1)));
    check_json("f64", &f64::NAN.to_le_bytes(), Ok(json!("NaN")));
    check_json("f32", &f32::NEG_INFINITY.to_le_bytes(), Ok(json!("-Infinity")));
    check_json("u64", &u64::MAX.to_le_bytes(), Ok(json!(u64::MAX)));
    check_json("[u8]", &[2, 0, 0, 0, 0, 0, 0, 0, 255, 0], Ok(json!("/wA=")));
    check_json("[u8;2]", &[255, 0], Ok(json!([255, 0])));
    check_json("string", &[1, 0, 0, 0, 0, 0, 0, 0, b'a'], Ok(json!("a")));
    check_json("E<A,B{x:i8}>", &[0, 0, 0, 0], Ok(json!("A")));
    check_json("E<A,B{x:i8}>", &[1, 0, 0, 0, 255], Ok(json!({"B": {"x": -1}})));
    check_json("Empty{}", &[], Ok(json!({})));
}

#[test]
fn payloads_that_do_not_fit_are_refused_with_their_place() {
    let huge = u64::MAX.to_le_bytes();
    check_json("[f64]", &huge, Err("value: a count exceeds the payload at byte 8"));
    check_json("string", &huge, Err("value: a count exceeds the payload at byte 8"));
    check_json("S{a:S{b:bool}}", &[2], Err("a.b: a flag is neither 0 nor 1 at byte 1"));
    check_json("S{a:u8,b:u16}", &[1, 2], Err("b: the payload ends too early at byte 1"));
    check_json("u8", &[1, 2], Err("value: bytes are left over at byte 1"));
    check_json("E<A>", &[1, 0, 0, 0], Err("value: an unknown variant at byte 4"));
    check_json("string", &[1, 0, 0, 0, 0, 0, 0, 0, 255], Err("value: text is not UTF-8 at byte 9"));
}

#[test]
fn json_that_would_fill_the_memory_is_refused() {
    // Sixteen structs around every byte, and three thousand names that no byte pays for.
    let deep = format!("[{}bool{}]", "S{x:".repeat(15), "}".repeat(15));
    let wide: Vec<_> = (0..1500).map(|n| format!("n{n}:E{{}}")).collect();
    let wide = format!("[W{{{},last:bool}}]", wide.join(","));
    let mut payload = (1_u64 << 14).to_le_bytes().to_vec();
    payload.resize(8 + (1 << 14), 0);
    for text in [deep, wide] {
        let schema = parse(&text).expect("a schema");
        let error = to_json_within(&schema, &payload, 4 << 20).expect_err("too large");
        assert_eq!(error.problem, "the value is too large for JSON");
    }
}

fn check_difference(ours: &str, theirs: &str, expected: &[&str]) {
    let found = difference(("a", ours), ("b", theirs));
    assert_eq!(found.lines().collect::<Vec<_>>(), expected, "{ours} and {theirs}");
}

#[test]
fn differences_are_named_field_by_field() {
    check_difference("u8", "u8", &[]);
    check_difference("u8", "i8", &["the type: a has u8, b has i8"]);
    check_difference("S{x:f64(m)}", "S{x:f64(mm)}", &["x: a has m, b has mm"]);
    check_difference("S{x:f64(m)}", "S{x:f64}", &["x: a has m, b has no unit"]);
    check_difference(
        "S{p:P{x:u8},q:u8}",
        "S{p:P{x:u16},r:u8}",
        &["p.x: a has u8, b has u16", "q: only a has it", "r: only b has it"],
    );
    check_difference("S{x:u8,y:u8}", "S{y:u8,x:u8}", &["(order of fields) #0: a has x, b has y"]);
    check_difference("[?[u8;3]]", "[?[i8;3]]", &["[]?[]: a has u8, b has i8"]);
    check_difference("[u8;3]", "[u8;4]", &["the type: a has [u8;3], b has [u8;4]"]);
    check_difference("E<A,B>", "E<A,C,B>", &["(variants) #1: a has B, b has C"]);
    check_difference("E<A>", "E<A,B>", &["(variants) #1: a has none, b has B"]);
    check_difference("E<A{x:u8}>", "E<A{x:i8}>", &["A.x: a has u8, b has i8"]);
    check_difference(
        "u8",
        "\u{1b}",
        &["the schema of b cannot be read: schema text, byte 0: a name \
        is expected: a letter or _, then letters, digits, _ - /; 128 at most"],
    );
}

#[test]
fn a_long_list_of_differences_is_cut() {
    let fields =
        |kind: &str| (0..2000).map(|n| format!("f{n}:{kind}")).collect::<Vec<_>>().join(",");
    let (ours, theirs) = (format!("S{{{}}}", fields("u8")), format!("S{{{}}}", fields("i8")));
    assert!(difference(("a", &ours), ("b", &theirs)).len() < 4096);
    let other = format!("T{{{}}}", fields("u8"));
    assert!(difference(("a", &ours), ("b", &other)).len() < 4096);
}

#[test]
fn the_most_bytes_of_a_value_are_known_unless_its_length_is_free() {
    let most = |text: &str| parse(text).expect(text).max_len();
    assert_eq!(most("Pose{x:f64,y:f32}"), Some(12));
    assert_eq!(most("Pose{at:?[f64;3]}"), Some(25));
    assert_eq!(most("Mode<idle,moving{speed:f32}>"), Some(8));
    assert_eq!(most("Scan{ranges:[f32]}"), None);
    assert_eq!(most("Mode<idle,named{name:string}>"), None);
}

#[test]
fn the_unit_of_a_struct_is_that_of_the_numbers_in_it() {
    let twist = "Twist{linear:Vector3{x:f64,ok:bool,at:f64(s)}(m/s),free:Vector3{x:f64}}";
    let schema = parse(twist).expect("a schema");
    let unit = |names: &[&str]| FieldPath::find(&schema, names).expect("a field").unit;
    assert_eq!(unit(&["linear", "x"]), Some("m/s"));
    assert_eq!(unit(&["linear", "at"]), Some("s"));
    assert_eq!((unit(&["linear", "ok"]), unit(&["free", "x"])), (None, None));
}
