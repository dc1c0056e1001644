//! The methods that are scored, under the names that scorecards print.

use super::Known;
use super::rivals;
use crate::forecast::Passage;

/// One way to say when a slope fails.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// As scorecards print it.
    pub name: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// Days from the newest reading to failure. A point forecast is one time with probability 1, a forecast that
    /// it never comes has no time; `None` where the method has nothing to say.
    pub forecast: fn(&Known) -> Option<Passage>,
}

/// Every method, the program's own first.
pub const METHODS: &[Method] = &[
    Method {
        name: "slider-block",
        source: "this program: the law under an undeclared load",
        forecast: rivals::slider_block,
    },
    Method {
        name: "inverse-velocity-line",
        source: "Fukuzono 1985",
        forecast: rivals::line::raw,
    },
];
