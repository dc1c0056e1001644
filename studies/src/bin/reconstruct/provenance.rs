//! What a reconstruction says of itself in its file.

use std::collections::BTreeMap;

/// What differs from one reconstruction to the other.
#[derive(Debug)]
pub(crate) struct Provenance<'a> {
    /// Slope, years and benchmarks.
    pub(crate) title: &'a str,
    /// What the paper states and the reconstruction keeps.
    pub(crate) stated: &'a str,
    /// What it makes up.
    pub(crate) invented: &'a str,
    /// Of its noise.
    pub(crate) seed: u64,
}

impl Provenance<'_> {
    /// The entries of the recording's provenance.
    pub(crate) fn entries(&self) -> BTreeMap<String, String> {
        let seed = self.seed.to_string();
        let entries = [
            ("title", self.title),
            ("kind", "reconstruction"),
            (
                "statement",
                "These values are not measured. They were computed from the statements of the \
                 source; no table of the measured record was available.",
            ),
            (
                "sources",
                "A. Helmstetter, D. Sornette, J.-R. Grasso, J. V. Andersen, S. Gluzman, \
                 V. Pisarenko, \"Slider-block friction model for landslides: application to \
                 Vaiont and La Clapière landslides\", J. Geophys. Res., 2004",
            ),
            (
                "attribution",
                "computed by this project's generator from statements in the source",
            ),
            ("licence", "MIT OR Apache-2.0"),
            ("stated_by_the_source", self.stated),
            ("invented", self.invented),
            ("seed", &seed),
            (
                "made_by",
                "cargo run --release -p studies --bin reconstruct -- recordings",
            ),
        ];
        entries
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .into()
    }
}
