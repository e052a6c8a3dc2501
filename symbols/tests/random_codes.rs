//! Codes drawn at random: each is an error that names its position, or a symbol that is drawn.

use armor_symbols::{CodeError, Symbol};

const CODES: usize = 100_000;

fn draw(code: &str) -> bool {
    match Symbol::parse(code) {
        Ok(symbol) => {
            let svg = symbol.to_svg();
            assert!(
                svg.starts_with("<svg") && !svg.contains("NaN") && !svg.contains("inf"),
                "{code}"
            );
            let again = Symbol::parse(&symbol.code.to_string()).expect(code);
            assert_eq!(again.shapes(), symbol.shapes(), "{code}");
            true
        }
        Err(CodeError::Length { found }) => {
            assert_eq!(found, code.chars().count());
            false
        }
        Err(CodeError::Character { position, .. } | CodeError::Value { position, .. }) => {
            assert!((1..=code.chars().count()).contains(&position), "{code}");
            false
        }
    }
}

#[test]
fn random_codes_of_digits_are_drawn_or_refused() {
    let mut random = fastrand::Rng::with_seed(19);
    let mut drawn = 0;
    for _ in 0..CODES / 2 {
        let mut code: Vec<u8> = (0..20).map(|_| b'0' + random.u8(..10)).collect();
        // Most codes should get past the first fields.
        if random.u8(..4) > 0 {
            let set = [b"10", b"15", b"20", b"25", b"30", b"35", b"40", b"01", b"05", b"00"];
            code[2] = b'0' + random.u8(..3);
            code[3] = b'0' + random.u8(..7);
            code[4..6].copy_from_slice(set[random.usize(..set.len())]);
            code[6] = b'0' + random.u8(..6);
            code[7] = b'0' + random.u8(..8);
            let amplifier = [b"00", b"11", b"18", b"22", b"26", b"31", b"34", b"42", b"52", b"62"];
            code[8..10].copy_from_slice(amplifier[random.usize(..amplifier.len())]);
        }
        drawn += usize::from(draw(std::str::from_utf8(&code).expect("digits")));
    }
    assert!(drawn > CODES / 4, "only {drawn} were drawn");
}

#[test]
fn random_letters_and_text_are_drawn_or_refused() {
    let mut random = fastrand::Rng::with_seed(20);
    let letters: Vec<char> = "SGOEFHNUAPGXCDEIMQRTUVWB-*5é\u{0}".chars().collect();
    let mut drawn = 0;
    for _ in 0..CODES / 2 {
        let length = if random.u8(..10) == 0 { random.usize(..40) } else { 15 };
        let mut code: Vec<char> =
            (0..length).map(|_| letters[random.usize(..letters.len())]).collect();
        if length == 15 && random.bool() {
            for (at, of) in [(0, "SG"), (1, "FHNU"), (2, "GAS"), (3, "AP"), (10, "-"), (11, "-AFI")]
            {
                let choices: Vec<char> = of.chars().collect();
                code[at] = choices[random.usize(..choices.len())];
            }
            for letter in &mut code[4..] {
                *letter = if letter.is_ascii_uppercase() { *letter } else { '-' };
            }
            code[10] = '-';
            code[11] = 'F';
        }
        drawn += usize::from(draw(&code.into_iter().collect::<String>()));
    }
    assert!(drawn > 1000, "only {drawn} were drawn");
}
