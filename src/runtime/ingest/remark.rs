//! What a person should know of a file that is read.

/// Something that a person should know of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// The column, or what else it is about; one remark about each is enough.
    pub about: String,
    /// What there is to know.
    pub text: String,
    /// Whether readings are missing by it.
    pub is_loss: bool,
}
