//! A bulk array that is read where it arrived: borrowed from the receive buffer or from a slot of
//! shared memory.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

use crate::array::ArrayElement;

/// The numbers of an [`Array`](crate::Array) in received bytes, not copied.
///
/// The bytes may begin at any address, so numbers of several bytes are read one by one
/// ([`iter`](Self::iter), [`get`](Self::get)) or as a slice if they are aligned
/// ([`as_slice`](Self::as_slice)). An array of bytes always is a slice: `ArrayView<u8>` and
/// `ArrayView<i8>` dereference to it.
pub struct ArrayView<'a, T> {
    bytes: &'a [u8],
    element: PhantomData<&'a [T]>,
}

impl<'a, T: ArrayElement> ArrayView<'a, T> {
    /// The numbers that `bytes` hold, a whole number of them.
    pub(crate) fn of(bytes: &'a [u8]) -> Self {
        debug_assert!(bytes.len().is_multiple_of(size_of::<T>()));
        Self { bytes, element: PhantomData }
    }

    /// How many numbers there are.
    pub fn len(&self) -> usize {
        self.bytes.len() / size_of::<T>()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The number at `index`, counted from 0; `None` beyond the end.
    pub fn get(&self, index: usize) -> Option<T> {
        let start = index.checked_mul(size_of::<T>())?;
        let bytes = self.bytes.get(start..)?.get(..size_of::<T>())?;
        Some(bytemuck::pod_read_unaligned(bytes))
    }

    /// All numbers in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = T> + DoubleEndedIterator + 'a {
        self.bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned)
    }

    /// The numbers as a slice, if they are aligned in memory.
    pub fn as_slice(&self) -> Option<&'a [T]> {
        bytemuck::try_cast_slice(self.bytes).ok()
    }

    /// The numbers as a slice: borrowed if they are aligned in memory, otherwise copied.
    pub fn to_slice(&self) -> Cow<'a, [T]> {
        match self.as_slice() {
            Some(slice) => Cow::Borrowed(slice),
            None => Cow::Owned(bytemuck::pod_collect_to_vec(self.bytes)),
        }
    }

    /// The bytes of the numbers, little-endian.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}

impl<T> Clone for ArrayView<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for ArrayView<'_, T> {}

impl<T: ArrayElement + fmt::Debug> fmt::Debug for ArrayView<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl<T: ArrayElement + PartialEq> PartialEq for ArrayView<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Deref for ArrayView<'_, u8> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes
    }
}

impl Deref for ArrayView<'_, i8> {
    type Target = [i8];

    fn deref(&self) -> &[i8] {
        bytemuck::cast_slice(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_any_address() {
        let numbers = [1.5_f32, -2.0, f32::MAX];
        let mut bytes = [0_u8; 16];
        for start in 0..4 {
            let place = &mut bytes[start..start + 12];
            place.copy_from_slice(bytemuck::cast_slice(&numbers));
            let view = ArrayView::<f32>::of(&bytes[start..start + 12]);
            assert_eq!(view.iter().collect::<Vec<_>>(), numbers);
            assert_eq!((view.len(), view.is_empty()), (3, false));
            assert_eq!(
                (view.get(2), view.get(3), view.get(usize::MAX)),
                (Some(f32::MAX), None, None)
            );
            assert_eq!(view.to_slice(), &numbers[..]);
            assert_eq!(view.as_slice().is_some(), matches!(view.to_slice(), Cow::Borrowed(_)));
            assert_eq!(view, ArrayView::of(bytemuck::cast_slice(&numbers)));
        }
        let aligned = (0..4)
            .filter(|start| ArrayView::<f32>::of(&bytes[*start..start + 12]).as_slice().is_some());
        assert_eq!(aligned.count(), 1, "one of four addresses is a multiple of four");
    }

    #[test]
    fn an_array_of_bytes_is_a_slice() {
        let bytes = [1, 2, 255];
        assert_eq!(&*ArrayView::<u8>::of(&bytes), &[1, 2, 255]);
        assert_eq!(&*ArrayView::<i8>::of(&bytes), &[1, 2, -1]);
        assert_eq!(format!("{:?}", ArrayView::<i8>::of(&bytes)), "[1, 2, -1]");
    }
}
