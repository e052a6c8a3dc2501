//! What helps to find one's way: commands by name, the page of shortcuts, the page one starts with.

pub mod markdown;
pub mod pages;
pub mod shortcuts;
pub mod welcome;
