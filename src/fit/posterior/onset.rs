//! Since when the law holds.
/// x
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {}
