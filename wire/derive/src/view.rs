//! The struct that a message is read as without copying its arrays and texts.

use super::{Tokens, read_attributes};
use quote::{format_ident, quote};
use syn::{DeriveInput, Error, Fields, Result};

/// Why a type has no view.
pub(crate) const NEEDS_NAMED_FIELDS: &str = "a view is derived for a struct with named fields; remove `view`: the type is then copied where \
     a message that contains it is viewed";

/// How a type is viewed.
pub(crate) struct ViewTokens {
    /// The definition of the view's type, if it has one of its own.
    pub definition: Tokens,
    /// `View` and `view_value` of `WireType`.
    pub members: Tokens,
}

/// The view of a type that is its own view.
pub(crate) fn copy_value(wire: &Tokens) -> ViewTokens {
    let members = quote! {
        type View<'view> = Self;
        fn view_value<'view, D: #wire::bincode::de::BorrowDecoder<'view>>(
            decoder: &mut D,
        ) -> ::core::result::Result<Self, #wire::bincode::error::DecodeError> {
            <Self as #wire::WireType>::read_value(decoder)
        }
    };
    ViewTokens { definition: Tokens::new(), members }
}

/// The view of a struct: a struct of the views of its fields.
pub(crate) fn expand_view(
    input: &DeriveInput,
    fields: &Fields,
    wire: &Tokens,
) -> Result<ViewTokens> {
    let (ident, vis) = (&input.ident, &input.vis);
    let Fields::Named(fields) = fields else {
        return Err(Error::new_spanned(ident, NEEDS_NAMED_FIELDS));
    };
    let view = format_ident!("{ident}View");
    let (mut definitions, mut reads) = (vec![], vec![]);
    for field in &fields.named {
        let (name, vis, ty) = (&field.ident, &field.vis, &field.ty);
        let docs = field.attrs.iter().filter(|attribute| attribute.path().is_ident("doc"));
        let (ty, read) = match read_attributes(&field.attrs)?.text {
            true => (quote!(#ty), quote!(#wire::message::read_text(decoder)?)),
            false => (
                quote!(<#ty as #wire::WireType>::View<'view>),
                quote!(<#ty as #wire::WireType>::view_value(decoder)?),
            ),
        };
        definitions.push(quote!(#(#docs)* #vis #name: #ty));
        reads.push(quote!(#name: #read));
    }
    let doc = format!("A [`{ident}`] read where it arrived: its arrays and texts are borrowed.");
    let definition = quote! {
        #[doc = #doc]
        #[derive(Debug)]
        #vis struct #view<'view> { #(#definitions),* }
    };
    let members = quote! {
        type View<'view> = #view<'view>;
        fn view_value<'view, D: #wire::bincode::de::BorrowDecoder<'view>>(
            decoder: &mut D,
        ) -> ::core::result::Result<Self::View<'view>, #wire::bincode::error::DecodeError> {
            ::core::result::Result::Ok(#view { #(#reads),* })
        }
    };
    Ok(ViewTokens { definition, members })
}
