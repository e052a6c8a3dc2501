//! Enums that travel as text: the schema is `Text`, the bytes are those of the word.

/// Defines an enum whose variants travel as one word each.
macro_rules! words {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal,)+ }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($(#[$doc])* $variant,)+ }

        impl $name {
            /// Returns the word that travels.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl ::std::fmt::Display for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.write_str(self.as_str())
            }
        }

        impl ::armor_wire::bincode::Encode for $name {
            fn encode<E: ::armor_wire::bincode::enc::Encoder>(
                &self,
                encoder: &mut E,
            ) -> Result<(), ::armor_wire::bincode::error::EncodeError> {
                self.as_str().encode(encoder)
            }
        }

        impl ::armor_wire::WireType for $name {
            const MIN_LEN: usize = <String as ::armor_wire::WireType>::MIN_LEN;

            fn schema() -> ::armor_wire::schema::Schema {
                <String as ::armor_wire::WireType>::schema()
            }

            fn read_value<D: ::armor_wire::bincode::de::Decoder>(
                decoder: &mut D,
            ) -> Result<Self, ::armor_wire::bincode::error::DecodeError> {
                let word = <String as ::armor_wire::WireType>::read_value(decoder)?;
                match word.as_str() {
                    $($word => Ok(Self::$variant),)+
                    _ => Err(::armor_wire::bincode::error::DecodeError::Other(concat!(
                        "not a word of ",
                        stringify!($name)
                    ))),
                }
            }

            type View<'a> = Self;

            fn view_value<'a, D: ::armor_wire::bincode::de::BorrowDecoder<'a>>(
                decoder: &mut D,
            ) -> Result<Self, ::armor_wire::bincode::error::DecodeError> {
                Self::read_value(decoder)
            }
        }
    };
}

pub(crate) use words;

#[cfg(test)]
mod tests {
    use crate::ChangeState;
    use armor_wire::WireType;
    use armor_wire::codec::{decode, encode};
    use armor_wire::schema::Schema;

    #[test]
    fn an_enum_of_words_has_the_schema_and_the_bytes_of_a_text() {
        assert_eq!(ChangeState::schema(), Schema::Text);
        let word = encode(&ChangeState::Waiting).unwrap();
        assert_eq!(word, encode(&"waiting".to_owned()).unwrap());
        assert_eq!(decode::<ChangeState>(&word).unwrap(), ChangeState::Waiting);
    }

    #[test]
    fn an_unknown_word_is_refused() {
        assert!(decode::<ChangeState>(&encode(&"gone".to_owned()).unwrap()).is_err());
    }
}
